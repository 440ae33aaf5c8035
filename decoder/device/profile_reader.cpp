#include "decoder/device/profile_reader.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "decoder/base/text.h"
#include "decoder/device/json_cursor.h"
#include "decoder/device/profile_registry.h"

namespace ecaudit::esc {

// Beside AlState, where argument-dependent lookup finds it.
static void Read(const device::Cursor& cursor, AlState& out) {
  static constexpr device::Word<AlState> kStates[] = {{"INIT", AlState::INIT},
                                                      {"PREOP", AlState::PREOP},
                                                      {"BOOT", AlState::BOOT},
                                                      {"SAFEOP", AlState::SAFEOP},
                                                      {"OP", AlState::OP}};
  device::ReadWord(cursor, kStates, out);
}

}  // namespace ecaudit::esc

namespace ecaudit::device {
namespace {

constexpr std::string_view kSchema = "ecaudit.profile/1";

/// Every fact says where it stands; an empty text would be a way around that.
void ReadSource(ObjectReader& object, const Cursor& cursor, std::string& source) {
  object.Require("source", source);
  if (!cursor.failed() && source.empty()) cursor.Fail("\"source\" is empty");
}

}  // namespace

static void Read(const Cursor& cursor, Basis& out) {
  static constexpr Word<Basis> kWords[] = {
      {"printed", Basis::kPrinted}, {"standard", Basis::kStandard}, {"inferred", Basis::kInferred}};
  ReadWord(cursor, kWords, out);
}

static void Read(const Cursor& cursor, Access& out) {
  static constexpr Word<Access> kWords[] = {{"unknown", Access::kUnknown},
                                            {"-", Access::kNone},
                                            {"r", Access::kRead},
                                            {"w", Access::kWrite},
                                            {"rw", Access::kReadWrite}};
  ReadWord(cursor, kWords, out);
}

static void Read(const Cursor& cursor, IdentityMatch& out) {
  out = {};
  ObjectReader object(cursor);
  object.Allow("vendor_id", out.vendor_id);
  object.Allow("product_codes", out.product_codes);
  object.Allow("revision_min", out.revision_min);
  object.Allow("revision_max", out.revision_max);
  object.Allow("models", out.models);
  object.Allow("note", out.note);
  ReadSource(object, cursor, out.source);
  object.Finish();
}

static void Read(const Cursor& cursor, AlTransition& out) {
  ObjectReader object(cursor);
  object.Require("from", out.from);
  object.Require("to", out.to);
  object.Require("allowed", out.allowed);
  object.Allow("performed", out.performed);
  object.Require("basis", out.basis);
  object.Allow("action", out.action);
  object.Allow("requirement", out.requirement);
  object.Allow("refusal_codes", out.refusal_codes);
  object.Allow("tolerated_codes", out.tolerated_codes);
  object.Allow("note", out.note);
  ReadSource(object, cursor, out.source);
  object.Finish();
}

/// "INIT>PREOP"
static void Read(const Cursor& cursor, AlStatusCode::Transition& out) {
  std::string text;
  Read(cursor, text);
  if (cursor.failed()) return;
  const std::size_t arrow = text.find('>');
  const std::uint8_t from = esc::StateFromName(text.substr(0, arrow));
  const std::uint8_t to = arrow == std::string::npos ? std::uint8_t{0} : esc::StateFromName(text.substr(arrow + 1));
  if (!esc::IsAlState(from) || !esc::IsAlState(to)) {
    return cursor.Fail("\"" + Printable(text) + "\" is not a transition (expected \"INIT>PREOP\")");
  }
  out = {static_cast<esc::AlState>(from), static_cast<esc::AlState>(to)};
}

static void Read(const Cursor& cursor, AlStatusCode& out) {
  ObjectReader object(cursor);
  object.Require("code", out.code);
  object.Require("name", out.name);
  object.Allow("any_transition", out.any_transition);
  object.Allow("transitions", out.transitions);
  object.Allow("states", out.states);
  object.Allow("exclusive", out.exclusive);
  object.Allow("resulting_state", out.resulting_state);
  object.Allow("result", out.result);
  object.Allow("note", out.note);
  ReadSource(object, cursor, out.source);
  object.Finish();
}

static void Read(const Cursor& cursor, SpontaneousAlChange& out) {
  ObjectReader object(cursor);
  object.Require("from", out.from);
  object.Require("to", out.to);
  object.Require("codes", out.codes);
  object.Require("cause", out.cause);
  object.Require("basis", out.basis);
  object.Allow("note", out.note);
  ReadSource(object, cursor, out.source);
  object.Finish();
}

static void Read(const Cursor& cursor, AlDescription& out) {
  out = {};
  ObjectReader object(cursor);
  object.Require("transitions", out.transitions);
  object.Allow("spontaneous", out.spontaneous);
  object.Require("status_codes", out.status_codes);
  object.Require("status_codes_complete", out.status_codes_complete);
  object.Allow("vendor_codes_from", out.vendor_codes_from);
  object.Allow("note", out.note);
  ReadSource(object, cursor, out.source);
  object.Finish();
  if (cursor.failed()) return;

  const auto pair = [](const AlTransition& t) { return std::make_pair(t.from, t.to); };
  std::sort(out.transitions.begin(), out.transitions.end(),
            [&](const AlTransition& a, const AlTransition& b) { return pair(a) < pair(b); });
  const auto twice = std::adjacent_find(out.transitions.begin(), out.transitions.end(),
                                        [&](const auto& a, const auto& b) { return pair(a) == pair(b); });
  if (twice != out.transitions.end()) {
    return cursor.Fail("transition " + std::string(esc::StateName(twice->from)) + " to " +
                       std::string(esc::StateName(twice->to)) + " is listed twice");
  }
  std::sort(out.status_codes.begin(), out.status_codes.end(),
            [](const AlStatusCode& a, const AlStatusCode& b) { return a.code < b.code; });
  const auto same = std::adjacent_find(out.status_codes.begin(), out.status_codes.end(),
                                       [](const auto& a, const auto& b) { return a.code == b.code; });
  if (same != out.status_codes.end()) cursor.Fail("AL status code " + Hex(same->code) + " is listed twice");
}

namespace {

/// A row that stands for several equal ones: "{n}" in its name is their number.
struct RegisterRow {
  struct Repeat {
    std::uint16_t count = 1;
    std::uint16_t stride = 0;
  };
  RegisterRight first;
  Repeat repeat;
};

}  // namespace

static void Read(const Cursor& cursor, RegisterRow::Repeat& out) {
  ObjectReader object(cursor);
  object.Require("count", out.count);
  object.Require("stride", out.stride);
  object.Finish();
}

static void Read(const Cursor& cursor, RegisterRow& row) {
  RegisterRight& out = row.first;
  ObjectReader object(cursor);
  object.Require("address", out.address);
  object.Require("length", out.length);
  object.Allow("repeat", row.repeat);
  object.Allow("buffer", out.buffer);
  object.Require("name", out.name);
  object.Allow("ecat", out.ecat);
  object.Allow("drive", out.drive);
  object.Allow("printed_ecat", out.printed_ecat);
  object.Allow("printed_length", out.printed_length);
  object.Allow("note", out.note);
  ReadSource(object, cursor, out.source);
  object.Finish();
  if (cursor.failed()) return;
  const std::uint64_t last = out.address + (row.repeat.count - 1ULL) * row.repeat.stride;
  if (out.length == 0 || row.repeat.count == 0 || last + out.length > 0x10000) {
    cursor.Fail("a register is at least one byte long and ends inside 0x0000 to 0xFFFF");
  }
}

namespace {

bool Overlap(const RegisterRight& a, const RegisterRight& b) {
  return a.address < b.address + b.length && b.address < a.address + a.length;
}

std::vector<RegisterRight> Expand(const std::vector<RegisterRow>& rows) {
  std::vector<RegisterRight> out;
  for (const RegisterRow& row : rows) {
    for (std::uint16_t n = 0; n < row.repeat.count; ++n) {
      RegisterRight& made = out.emplace_back(row.first);
      made.address = static_cast<EscAddress>(made.address + n * row.repeat.stride);
      if (const auto at = made.name.find("{n}"); at != std::string::npos) made.name.replace(at, 3, std::to_string(n));
    }
  }
  return out;
}

/// Rows of `own` win over rows of `inherited` that they touch: what the drive's manual says replaces the standard.
void MergeRegisters(const Cursor& cursor, std::vector<RegisterRight> own, std::vector<RegisterRight>& inherited) {
  const auto by_address = [](const RegisterRight& a, const RegisterRight& b) { return a.address < b.address; };
  std::sort(own.begin(), own.end(), by_address);
  const auto clash = std::adjacent_find(own.begin(), own.end(), Overlap);
  if (clash != own.end()) {
    return cursor.Fail("registers " + Hex(clash->address) + " and " + Hex(std::next(clash)->address) + " overlap");
  }
  std::erase_if(inherited, [&](const RegisterRight& old) {
    return std::any_of(own.begin(), own.end(), [&](const RegisterRight& r) { return Overlap(old, r); });
  });
  inherited.insert(inherited.end(), std::make_move_iterator(own.begin()), std::make_move_iterator(own.end()));
  std::sort(inherited.begin(), inherited.end(), by_address);
}

void ReadHead(ObjectReader& object, const Cursor& cursor, ProfileHead& head) {
  std::string schema;
  object.Require("schema", schema);
  if (!cursor.failed() && schema != kSchema) {
    cursor.Fail("\"schema\" is \"" + Printable(schema) + "\", this program reads \"" + std::string(kSchema) + "\"");
  }
  object.Require("id", head.id);
  if (!cursor.failed() && head.id.empty()) cursor.Fail("\"id\" is empty");
  object.Allow("extends", head.extends);
}

}  // namespace

Result<ProfileHead> ReadProfileHead(std::string_view json) {
  Result<nlohmann::json> document = ParseJson(json);
  if (!document) return document.error();
  std::optional<Error> error;
  const Cursor cursor(*document, error);
  ObjectReader object(cursor);
  ProfileHead head;
  ReadHead(object, cursor, head);
  if (error) return *error;
  return head;
}

Result<DeviceDescription> ReadProfile(std::string_view json, const ProfileLookup& lookup) {
  Result<nlohmann::json> document = ParseJson(json);
  if (!document) return document.error();

  std::optional<Error> error;
  const Cursor cursor(*document, error);
  ObjectReader object(cursor);
  ProfileHead head;
  ReadHead(object, cursor, head);
  if (error) return *error;

  DeviceDescription out;
  if (!head.extends.empty()) {
    const DeviceDescription* base = lookup ? lookup(head.extends) : nullptr;
    if (base == nullptr) return Error{"extends: there is no profile \"" + Printable(head.extends) + "\""};
    out = *base;
  }
  // Who the drive is never comes from another profile.
  out.id = head.id;
  out.extends = head.extends;
  out.match = {};
  out.edition.clear();
  out.note.clear();

  object.Require("title", out.title);
  object.Allow("edition", out.edition);
  object.Require("document", out.document);
  object.Allow("note", out.note);
  object.Allow("match", out.match);
  object.Allow("al", out.al);
  std::vector<RegisterRow> registers;
  object.Allow("registers", registers);
  if (!error) MergeRegisters(cursor, Expand(registers), out.registers);
  object.Finish();
  if (error) return *error;
  return out;
}

Result<DeviceDescription> ReadProfile(std::string_view json) {
  return ReadProfile(json, BuiltinProfile);
}

}  // namespace ecaudit::device
