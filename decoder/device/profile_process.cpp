/// Reads the sections "latch" and "sync" of a profile.

#include "decoder/base/text.h"
#include "decoder/device/profile_sections.h"

namespace ecaudit::device {

void Read(const Cursor& cursor, ObjectAddress& out) {
  ObjectReader object(cursor);
  object.Require("index", out.index);
  object.Require("sub", out.subindex);
  object.Finish();
}

static void Read(const Cursor& cursor, LatchField& out) {
  ObjectReader object(cursor);
  object.AllowWith("bits", [&](const Cursor& at) { ReadBits(at, out.first, out.last); });
  object.Require("mask", out.mask);
  object.Allow("value", out.value);
  object.Allow("reserved", out.reserved);
  object.Allow("input", out.input);
  object.Require("meaning", out.meaning);
  FinishRow(object, cursor, out.note, out.source);
  if (!cursor.failed() && (out.value & ~out.mask) != 0) cursor.Fail("\"value\" has bits outside \"mask\"");
}

static void Read(const Cursor& cursor, LatchEdge& out) {
  ObjectReader object(cursor);
  object.Require("name", out.name);
  object.Require("enable", out.enable);
  object.Require("valid", out.valid);
  object.Require("selector", out.selector);
  object.Allow("positions", out.positions);
  object.Allow("touch_probe", out.touch_probe);
  object.Allow("capture_unit", out.capture_unit);
  FinishRow(object, cursor, out.note, out.source);
  if (!cursor.failed() && out.touch_probe > 2) cursor.Fail("\"touch_probe\" is neither 1 nor 2");
}

void Read(const Cursor& cursor, LatchDescription& out) {
  ObjectReader object(cursor);
  object.Allow("control_object", out.control_object);
  object.Allow("status_object", out.status_object);
  object.Allow("selector_mask", out.selector_mask);
  object.Allow("acknowledge_mask", out.acknowledge_mask);
  object.Allow("edges", out.edges);
  object.Allow("other_positions", out.other_positions);
  object.Allow("control", out.control);
  object.Allow("status", out.status);
  FinishRow(object, cursor, out.note, out.source);
  // No object is the usual one: without them nothing could be followed.
  if (!cursor.failed() && out.control_object == 0) cursor.Fail("\"control_object\" is missing");
  if (!cursor.failed() && out.status_object == 0) cursor.Fail("\"status_object\" is missing");
  const auto reserved = [](const std::vector<LatchField>& fields) {
    unsigned mask = 0;
    for (const LatchField& field : fields) mask |= field.reserved ? field.mask : 0U;
    return static_cast<std::uint16_t>(mask);
  };
  out.reserved_control = reserved(out.control);
  out.reserved_status = reserved(out.status);
}

static void Read(const Cursor& cursor, JitterLimit& out) {
  ObjectReader object(cursor);
  object.Allow("cycle_min_ns", out.cycle_min);
  object.Allow("cycle_max_ns", out.cycle_max);
  object.Require("jitter_ns", out.jitter);
  object.Allow("undocumented", out.undocumented);
  FinishRow(object, cursor, out.note, out.source);
}

static void Read(const Cursor& cursor, SyncParameter& out) {
  ObjectReader object(cursor);
  object.Require("parameter", out.parameter);
  object.Allow("object", out.object);
  object.Allow("unit", out.unit);
  object.Allow("meaning", out.meaning);
  object.Allow("default", out.default_value);
  object.Allow("limit", out.limit);
  FinishRow(object, cursor, out.note, out.source);
}

static void Read(const Cursor& cursor, DriveParameter& out) {
  ObjectReader object(cursor);
  object.Require("keyword", out.keyword);
  object.Allow("object", out.object);
  object.Allow("object_inferred", out.object_inferred);
  object.Allow("on_bits", out.on_bits);
  object.Allow("off_bits", out.off_bits);
  FinishRow(object, cursor, out.note, out.source);
}

void Read(const Cursor& cursor, SyncDescription& out) {
  ObjectReader object(cursor);
  object.Allow("cycle_base_ns", out.cycle_base);
  object.Allow("cycle_min_ns", out.cycle_min);
  object.Allow("cycle_by_60c2", out.cycle_by_60c2);
  object.Allow("pll_range_ppm", out.pll_range_ppm);
  object.Allow("pll_step_ns", out.pll_step);
  object.Allow("jitter", out.jitter);
  object.Allow("lost_after_jitter", out.lost_after_jitter);
  object.Allow("lost_after_missing", out.lost_after_missing);
  object.Allow("lost_faults", out.lost_faults);
  object.Allow("lost_warnings", out.lost_warnings);
  object.Allow("source_with_dc", out.source_with_dc);
  object.Allow("source_without_dc", out.source_without_dc);
  object.Allow("cycle_count", out.cycle_count);
  object.Allow("sync_distance", out.sync_distance);
  object.Allow("sync_actual", out.sync_actual);
  object.Allow("sync_window", out.sync_window);
  object.Allow("pll_threshold", out.pll_threshold);
  object.Allow("supervision", out.supervision);
  object.Allow("pll_switch", out.pll_switch);
  object.Allow("parameters", out.parameters);
  FinishRow(object, cursor, out.note, out.source);
}

}  // namespace ecaudit::device
