/// Reads the sections "pdo", "dictionary" and "emergency" of a profile.
#include <algorithm>

#include "decoder/base/sort_by_key.h"
#include "decoder/base/text.h"
#include "decoder/device/profile_sections.h"

namespace ecaudit::device {

void Read(const Cursor& cursor, PdoDirection& out) {
  static constexpr Word<PdoDirection> kWords[] = {{"rx", PdoDirection::kRx}, {"tx", PdoDirection::kTx}};
  ReadWord(cursor, kWords, out);
}

static void Read(const Cursor& cursor, DataType& out) {
  std::string text;
  Read(cursor, text);
  if (cursor.failed()) return;
  out = DataTypeFromName(text);
  if (out == DataType::kUnknown) cursor.Fail("\"" + Printable(text) + "\" is no data type");
}

static void Read(const Cursor& cursor, Mappable& out) {
  static constexpr Word<Mappable> kWords[] = {
      {"no", Mappable::kNo}, {"yes", Mappable::kYes}, {"yes*", Mappable::kConditional}};
  ReadWord(cursor, kWords, out);
}

static void Read(const Cursor& cursor, Confidence& out) {
  static constexpr Word<Confidence> kWords[] = {{"printed", Confidence::kPrinted},
                                                {"resolved", Confidence::kResolved},
                                                {"ambiguous", Confidence::kAmbiguous},
                                                {"inferred", Confidence::kInferred}};
  ReadWord(cursor, kWords, out);
}

/// "U8", or "U8/U16/U32" for a range of subindices.
static void ReadTypes(const Cursor& cursor, std::vector<DataType>& out) {
  std::string text;
  Read(cursor, text);
  if (cursor.failed()) return;
  out.clear();
  std::string_view rest = text;
  while (true) {
    const std::size_t slash = rest.find('/');
    const DataType type = DataTypeFromName(rest.substr(0, slash));
    if (type == DataType::kUnknown) return cursor.Fail("\"" + Printable(text) + "\" is no data type");
    out.push_back(type);
    if (slash == std::string_view::npos) return;
    rest.remove_prefix(slash + 1);
  }
}

/// ro, rw, wo, const
static void ReadObjectAccess(const Cursor& cursor, DictionaryObject& out) {
  std::string text;
  Read(cursor, text);
  if (cursor.failed()) return;
  out.constant = text == "const";
  if (text == "ro" || text == "const") {
    out.access = Access::kRead;
  } else if (text == "rw") {
    out.access = Access::kReadWrite;
  } else if (text == "wo") {
    out.access = Access::kWrite;
  } else {
    cursor.Fail("\"" + Printable(text) + "\" is none of ro, rw, wo, const");
  }
}

void Read(const Cursor& cursor, DictionaryObject& out) {
  ObjectReader object(cursor);
  object.Require("index", out.index);
  object.Allow("head", out.head);
  object.Allow("sub", out.subindex);
  out.last_subindex = out.subindex;
  object.Allow("last_sub", out.last_subindex);
  object.AllowWith("type", [&](const Cursor& at) { ReadTypes(at, out.types); });
  object.AllowWith("access", [&](const Cursor& at) { ReadObjectAccess(at, out); });
  object.Allow("pdo", out.mappable);
  object.Allow("only", out.only);
  object.Allow("scale", out.scale);
  object.Allow("pdo_scale", out.pdo_scale);
  object.Allow("unit", out.unit);
  object.Allow("pdo_unit", out.pdo_unit);
  object.Allow("max_bytes", out.max_bytes);
  object.Allow("name", out.name);
  object.Allow("keyword", out.keyword);
  object.Allow("printed_type", out.printed_type);
  object.Allow("printed_access", out.printed_access);
  FinishRow(object, cursor, out.note, out.source);
  if (!cursor.failed() && out.last_subindex < out.subindex) cursor.Fail("\"last_sub\" is below \"sub\"");
}

void Read(const Cursor& cursor, ObjectDictionary& out) {
  ObjectReader object(cursor);
  object.Allow("complete", out.complete);
  object.Allow("objects", out.objects);
  FinishRow(object, cursor, out.note, out.source);
  SortObjects(out.objects);
  for (std::size_t i = 1; i < out.objects.size(); ++i) {
    const DictionaryObject& before = out.objects[i - 1];
    const DictionaryObject& row = out.objects[i];
    const bool twice_head = before.head && row.head;
    if (before.index == row.index && before.head == row.head && (twice_head || before.last_subindex >= row.subindex)) {
      return cursor.Fail("object " + ObjectName(row.index, row.head ? -1 : row.subindex) + " is listed twice");
    }
  }
}

static void Read(const Cursor& cursor, PdoEntry& out) {
  ObjectReader object(cursor);
  object.Require("index", out.index);
  object.Require("sub", out.subindex);
  object.Require("bits", out.bits);
  object.Allow("type", out.type);
  object.Allow("name", out.name);
  object.Allow("confidence", out.confidence);
  object.Allow("note", out.note);
  object.Finish();
}

static void Read(const Cursor& cursor, PdoContent& out) {
  ObjectReader object(cursor);
  object.Require("index", out.index);
  object.Require("direction", out.direction);
  object.Allow("name", out.name);
  object.Allow("known", out.known);
  object.Allow("entries", out.entries);
  FinishRow(object, cursor, out.note, out.source);
  if (!cursor.failed() && out.known == out.entries.empty()) {
    cursor.Fail("a PDO has \"entries\", or \"known\": false");
  }
}

static void Read(const Cursor& cursor, SelectablePdo& out) {
  ObjectReader object(cursor);
  object.Require("direction", out.direction);
  object.Require("index", out.index);
  object.Allow("example_only", out.example_only);
  FinishRow(object, cursor, out.note, out.source);
}

static void Read(const Cursor& cursor, CyclicObject& out) {
  ObjectReader object(cursor);
  object.Require("direction", out.direction);
  object.Require("index", out.index);
  object.Require("sub", out.subindex);
  object.Allow("type", out.type);
  object.Require("bits", out.bits);
  object.Require("name", out.name);
  FinishRow(object, cursor, out.note, out.source);
}

static void Read(const Cursor& cursor, ByteLimit& out) {
  ObjectReader object(cursor);
  object.Require("bytes", out.bytes);
  object.Allow("condition", out.condition);
  object.Require("basis", out.basis);
  FinishRow(object, cursor, out.note, out.source);
}

static void Read(const Cursor& cursor, Padding& out) {
  ObjectReader object(cursor);
  object.Require("direction", out.direction);
  object.Require("index", out.index);
  object.Require("sub", out.first_subindex);
  out.last_subindex = out.first_subindex;
  object.Allow("last_sub", out.last_subindex);
  object.Allow("bits", out.bits);
  FinishRow(object, cursor, out.note, out.source);
}

static void Read(const Cursor& cursor, MappingRule& out) {
  ObjectReader object(cursor);
  object.Require("rule", out.rule);
  object.Require("value", out.value);
  FinishRow(object, cursor, out.note, out.source);
}

static void Read(const Cursor& cursor, FlexibleMapping& out) {
  ObjectReader object(cursor);
  object.Allow("rx_pdos", out.rx_pdos);
  object.Allow("tx_pdos", out.tx_pdos);
  object.Allow("max_pdos", out.max_pdos);
  object.Allow("max_bytes_per_pdo", out.max_bytes_per_pdo);
  object.Allow("max_entries_per_pdo", out.max_entries_per_pdo);
  object.Allow("clear_unused", out.clear_unused);
  object.Allow("even_length", out.even_length);
  object.Allow("max_rx_bytes", out.max_rx_bytes);
  object.Allow("max_tx_bytes", out.max_tx_bytes);
  object.Allow("paddings", out.paddings);
  object.Finish();
  const auto bytes = [](const ByteLimit& limit) { return limit.bytes; };
  SortByKey(out.max_rx_bytes, bytes);
  SortByKey(out.max_tx_bytes, bytes);
}

void Read(const Cursor& cursor, PdoDescription& out) {
  ObjectReader object(cursor);
  object.Allow("rx_assign", out.rx_assign);
  object.Allow("tx_assign", out.tx_assign);
  object.Allow("selectable", out.selectable);
  object.Allow("selectable_complete", out.selectable_complete);
  object.Allow("fixed", out.fixed);
  object.Allow("cyclic", out.cyclic);
  object.Allow("cyclic_complete", out.cyclic_complete);
  object.AllowWith("flexible", [&](const Cursor& at) { ReadSection(at, out.flexible); });
  object.Allow("rules", out.rules);
  FinishRow(object, cursor, out.note, out.source);
  if (cursor.failed()) return;
  SortByKey(out.selectable, [](const SelectablePdo& pdo) { return pdo.index; });
  SortByKey(out.fixed, [](const PdoContent& pdo) { return pdo.index; });
  const auto twice =
      std::ranges::adjacent_find(out.fixed, [](const auto& a, const auto& b) { return a.index == b.index; });
  if (twice != out.fixed.end()) cursor.Fail("PDO " + Hex(twice->index) + " is listed twice");
}

static void Read(const Cursor& cursor, EmergencyCode& out) {
  static constexpr Word<EmergencyKind> kKinds[] = {
      {"none", EmergencyKind::kNone}, {"fault", EmergencyKind::kFault}, {"warning", EmergencyKind::kWarning}};
  ObjectReader object(cursor);
  object.Require("code", out.code);
  out.last_code = out.code;
  object.Allow("last_code", out.last_code);
  object.Allow("id", out.id);
  object.AllowWith("kind", [&](const Cursor& at) { ReadWord(at, kKinds, out.kind); });
  object.Require("text", out.text);
  FinishRow(object, cursor, out.note, out.source);
  if (!cursor.failed() && out.last_code < out.code) cursor.Fail("\"last_code\" is below \"code\"");
}

void Read(const Cursor& cursor, EmergencyTable& out) {
  ObjectReader object(cursor);
  object.Allow("category", out.category);
  object.Allow("codes", out.codes);
  FinishRow(object, cursor, out.note, out.source);
  // Of those with one beginning, the widest class first.
  SortByKey(out.codes, [](const EmergencyCode& code) {
    return static_cast<std::uint64_t>(code.code) << 16U | (0xFFFFU - code.last_code);
  });
  const auto twice = std::ranges::adjacent_find(
      out.codes, [](const auto& a, const auto& b) { return a.code == b.code && a.last_code == b.last_code; });
  if (twice != out.codes.end()) cursor.Fail("emergency code " + Hex(twice->code) + " is listed twice");
}

}  // namespace ecaudit::device
