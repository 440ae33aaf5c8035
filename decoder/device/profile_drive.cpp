/// Reads the section "drive" of a profile.
#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "decoder/base/text.h"
#include "decoder/device/profile_sections.h"

namespace ecaudit::device {
namespace {

/// Control word bits that the tables of commands have columns for.
constexpr std::array<std::pair<std::string_view, std::uint8_t>, 5> kCommandBits = {
    {{"bit7", 7}, {"bit3", 3}, {"bit2", 2}, {"bit1", 1}, {"bit0", 0}}};

/// "reserved", "Reserved", "reserved (0)": how manuals print it, apart from a use that only begins with the same
/// letters.
bool IsReserved(std::string_view text) {
  constexpr std::string_view kReserved = "reserved";
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  if (text.size() < kReserved.size()) return false;
  for (std::size_t i = 0; i < kReserved.size(); ++i) {
    if (lower(text[i]) != kReserved[i]) return false;
  }
  if (text.size() == kReserved.size()) return true;
  const char next = lower(text[kReserved.size()]);
  return (next < 'a' || next > 'z') && next != '_';
}

std::uint16_t ReservedBit(std::string_view text, unsigned bit) {
  return static_cast<std::uint16_t>(IsReserved(text) ? 1U << bit : 0U);
}

}  // namespace

static void Read(const Cursor& cursor, DriveState& out) {
  static constexpr Word<DriveState> kStates[] = {{"Not ready to switch on", DriveState::kNotReadyToSwitchOn},
                                                 {"Switch on disabled", DriveState::kSwitchOnDisabled},
                                                 {"Ready to switch on", DriveState::kReadyToSwitchOn},
                                                 {"Switched on", DriveState::kSwitchedOn},
                                                 {"Operation enabled", DriveState::kOperationEnabled},
                                                 {"Quick stop active", DriveState::kQuickStopActive},
                                                 {"Fault reaction active", DriveState::kFaultReactionActive},
                                                 {"Fault", DriveState::kFault}};
  ReadWord(cursor, kStates, out);
}

static void Read(const Cursor& cursor, StatusPattern& out) {
  ObjectReader object(cursor);
  object.Require("mask", out.mask);
  object.Require("value", out.value);
  object.Allow("note", out.note);
  object.Finish();
  if (!cursor.failed() && (out.value & ~out.mask) != 0) cursor.Fail("\"value\" has bits outside \"mask\"");
}

static void Read(const Cursor& cursor, DriveStateRow& out) {
  ObjectReader object(cursor);
  object.Require("state", out.state);
  object.Require("mask", out.printed.mask);
  object.Require("value", out.printed.value);
  object.Allow("also", out.also);
  object.Allow("enabled", out.enabled);
  object.Allow("edge_bit", out.edge_bit);
  object.Allow("meaning", out.meaning);
  FinishRow(object, cursor, out.note, out.source);
  if (!cursor.failed() && (out.printed.value & ~out.printed.mask) != 0) {
    cursor.Fail("\"value\" has bits outside \"mask\"");
  }
  if (!cursor.failed() && out.edge_bit.value_or(0) > 15) cursor.Fail("\"edge_bit\" is no bit of the control word");
}

static void Read(const Cursor& cursor, DriveTransition& out) {
  ObjectReader object(cursor);
  object.Require("number", out.number);
  object.Allow("from", out.from);
  object.Require("to", out.to);
  object.Allow("automatic", out.automatic);
  object.Allow("optional", out.optional);
  object.Require("basis", out.basis);
  FinishRow(object, cursor, out.note, out.source);
}

/// "bit3": "P" and so on: X irrelevant, 0 and 1 levels, P rising edge, N falling edge.
static void ReadLevel(const Cursor& cursor, std::uint8_t bit, DriveCommand& out) {
  std::string text;
  Read(cursor, text);
  if (cursor.failed()) return;
  const auto flag = static_cast<std::uint16_t>(1U << bit);
  if (text == "X") return;
  out.mask = static_cast<std::uint16_t>(out.mask | flag);
  if (text == "1" || text == "P") out.value = static_cast<std::uint16_t>(out.value | flag);
  if (text == "P") out.rising = static_cast<std::uint16_t>(out.rising | flag);
  if (text == "N") out.falling = static_cast<std::uint16_t>(out.falling | flag);
  if (text != "0" && text != "1" && text != "P" && text != "N") {
    cursor.Fail("\"" + Printable(text) + "\" is none of X, 0, 1, P, N");
  }
}

static void Read(const Cursor& cursor, DriveCommand& out) {
  ObjectReader object(cursor);
  object.Require("name", out.name);
  object.Require("transitions", out.transitions);
  object.Allow("automatic", out.automatic);
  for (const auto& [key, bit] : kCommandBits) {
    object.AllowWith(key, [&, number = bit](const Cursor& at) { ReadLevel(at, number, out); });
  }
  object.Allow("variant", out.variant);
  object.Allow("printed", out.printed);
  FinishRow(object, cursor, out.note, out.source);
}

static void Read(const Cursor& cursor, EdgeAction& out) {
  ObjectReader object(cursor);
  object.AllowWith("edge", [&](const Cursor& at) {
    static constexpr Word<bool> kEdges[] = {{"rising", true}, {"falling", false}};
    ReadWord(at, kEdges, out.rising);
  });
  object.Require("bit", out.bit);
  object.Require("action", out.action);
  object.Allow("condition", out.condition);
  FinishRow(object, cursor, out.note, out.source);
}

static void Read(const Cursor& cursor, WordBit& out) {
  ObjectReader object(cursor);
  object.Require("bit", out.bit);
  object.Require("name", out.name);
  object.Allow("meaning", out.meaning);
  object.Allow("level", out.level);
  object.Allow("sign", out.sign);
  FinishRow(object, cursor, out.note, out.source);
  if (!cursor.failed() && out.bit > 15) cursor.Fail("\"bit\" is none of a word");
  if (!cursor.failed()) out.reserved = ReservedBit(out.name, out.bit);
  if (!cursor.failed() && out.level.value_or(0) > 1) cursor.Fail("\"level\" is neither 0 nor 1");
}

static void Read(const Cursor& cursor, ModeBits& out) {
  ObjectReader object(cursor);
  object.Require("mode", out.mode);
  object.Require("name", out.name);
  object.Allow("bit4", out.bit4);
  object.Allow("bit5", out.bit5);
  object.Allow("bit6", out.bit6);
  FinishRow(object, cursor, out.note, out.source);
  out.reserved =
      static_cast<std::uint16_t>(ReservedBit(out.bit4, 4) | ReservedBit(out.bit5, 5) | ReservedBit(out.bit6, 6));
}

static void Read(const Cursor& cursor, OperationMode& out) {
  ObjectReader object(cursor);
  object.Require("value", out.value);
  object.Require("name", out.name);
  object.Allow("opmode", out.opmode);
  object.Allow("cmdsource", out.cmdsource);
  object.Allow("printed_opmode", out.printed_opmode);
  object.Allow("start_bit", out.start_bit);
  object.Allow("setpoints", out.setpoints);
  FinishRow(object, cursor, out.note, out.source);
}

static void Read(const Cursor& cursor, FaultValue& out) {
  static constexpr Word<FaultValue> kKinds[] = {{"error code", FaultValue::kErrorCode},
                                                {"error history", FaultValue::kErrorHistory},
                                                {"fault number", FaultValue::kFaultNumber},
                                                {"warning number", FaultValue::kWarningNumber}};
  ReadWord(cursor, kKinds, out);
}

void Read(const Cursor& cursor, FaultObject& out) {
  ObjectReader object(cursor);
  object.Require("index", out.index);
  object.Allow("sub", out.subindex);
  out.last_subindex = out.subindex;
  object.Allow("last_sub", out.last_subindex);
  object.Require("kind", out.kind);
  object.Require("bits", out.bits);
  object.Allow("prefix", out.prefix);
  object.Require("basis", out.basis);
  FinishRow(object, cursor, out.note, out.source);
  if (cursor.failed()) return;
  if (out.last_subindex < out.subindex) cursor.Fail("\"last_sub\" is below \"sub\"");
  if (out.bits != 16 && out.bits != 32) cursor.Fail("\"bits\" is " + std::to_string(out.bits) + ", neither 16 nor 32");
}

/// Rows of the profile are added to the inherited ones and replace inherited rows with the same index: the objects of
/// the standard remain valid for a drive that has more.
static void ReadFaultObjects(const Cursor& cursor, std::vector<FaultObject>& inherited) {
  std::vector<FaultObject> rows;
  Read(cursor, rows);
  if (cursor.failed()) return;
  std::erase_if(inherited, [&](const FaultObject& old) {
    return std::ranges::any_of(rows, [&](const FaultObject& row) { return row.index == old.index; });
  });
  inherited.insert(inherited.end(), rows.begin(), rows.end());
}

void Read(const Cursor& cursor, DriveProfile& out) {
  ObjectReader object(cursor);
  object.Allow("states", out.states);
  object.Allow("transitions", out.transitions);
  object.Allow("commands", out.commands);
  object.Allow("edge_actions", out.edge_actions);
  object.Allow("control_bits", out.control_bits);
  object.Allow("status_bits", out.status_bits);
  object.Allow("mode_bits", out.mode_bits);
  object.Allow("modes", out.modes);
  object.Allow("modes_complete", out.modes_complete);
  object.Allow("opmode_parameter", out.opmode_parameter);
  object.Allow("cmdsource_parameter", out.cmdsource_parameter);
  object.AllowWith("fault_objects", [&](const Cursor& at) { ReadFaultObjects(at, out.fault_objects); });
  object.Allow("control_word_in", out.control_word_in);
  object.Allow("status_word_in", out.status_word_in);
  object.Allow("objects", out.objects);
  FinishRow(object, cursor, out.note, out.source);
  SortObjects(out.objects);
}

}  // namespace ecaudit::device
