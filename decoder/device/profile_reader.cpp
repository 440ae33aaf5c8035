#include "decoder/device/profile_reader.h"

#include "decoder/base/text.h"
#include "decoder/device/profile_registry.h"
#include "decoder/device/profile_sections.h"

namespace ecaudit::esc {

// Beside AlState, where argument-dependent lookup finds it.
void Read(const device::Cursor& cursor, AlState& out) {
  static constexpr device::Word<AlState> kStates[] = {{"INIT", AlState::INIT},
                                                      {"PREOP", AlState::PREOP},
                                                      {"BOOT", AlState::BOOT},
                                                      {"SAFEOP", AlState::SAFEOP},
                                                      {"OP", AlState::OP}};
  device::ReadWord(cursor, kStates, out);
}

}  // namespace ecaudit::esc

namespace ecaudit::device {

void ReadSource(ObjectReader& object, const Cursor& cursor, std::string& source) {
  object.Require("source", source);
  if (!cursor.failed() && source.empty()) cursor.Fail("\"source\" is empty");
}

void FinishRow(ObjectReader& object, const Cursor& cursor, std::string& note, std::string& source) {
  object.Allow("note", note);
  ReadSource(object, cursor, source);
  object.Finish();
}

void Read(const Cursor& cursor, Basis& out) {
  static constexpr Word<Basis> kWords[] = {
      {"printed", Basis::kPrinted}, {"standard", Basis::kStandard}, {"inferred", Basis::kInferred}};
  ReadWord(cursor, kWords, out);
}

void Read(const Cursor& cursor, IdentityMatch& out) {
  out = {};
  ObjectReader object(cursor);
  object.Allow("vendor_id", out.vendor_id);
  object.Allow("product_codes", out.product_codes);
  object.Allow("revision_min", out.revision_min);
  object.Allow("revision_max", out.revision_max);
  object.Allow("models", out.models);
  FinishRow(object, cursor, out.note, out.source);
}

namespace {

constexpr std::string_view kSchema = "ecaudit.profile/1";

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

/// Manuals that the profile cites and docs/sources.md does not know. Their keys are all that is needed, for the check.
void ReadDocuments(const Cursor& cursor) {
  if (!cursor.value().is_array()) return cursor.FailType("an array");
  for (std::size_t i = 0; i < cursor.value().size(); ++i) {
    const Cursor row = cursor.Index(i);
    ObjectReader object(row);
    std::string key;
    std::string title;
    object.Require("key", key);
    object.Require("title", title);
    object.Finish();
  }
}

}  // namespace

Result<ProfileHead> ReadProfileHead(std::string_view json) {
  const Result<JsonDocument> document = ParseJson(json, "match");
  if (!document) return document.error();
  return ReadProfileHead(*document);
}

Result<ProfileHead> ReadProfileHead(const JsonDocument& document) {
  std::optional<Error> error;
  const Cursor cursor(document.root(), error);
  ObjectReader object(cursor);
  ProfileHead head;
  ReadHead(object, cursor, head);
  object.Allow("edition", head.edition);
  object.Allow("match", head.match);
  if (error) return *error;
  return head;
}

Result<DeviceDescription> ReadProfile(std::string_view json, const ProfileLookup& lookup) {
  const Result<JsonDocument> document = ParseJson(json);
  if (!document) return document.error();
  return ReadProfile(*document, lookup);
}

Result<DeviceDescription> ReadProfile(const JsonDocument& document, const ProfileLookup& lookup) {
  std::optional<Error> error;
  const Cursor cursor(document.root(), error);
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
  object.AllowWith("documents", ReadDocuments);
  object.Allow("match", out.match);
  object.Allow("al", out.al);
  object.AllowWith("registers", [&](const Cursor& at) { ReadRegisters(at, out.registers); });
  object.Allow("register_bits", out.register_bits);
  object.Allow("event_bits", out.event_bits);
  object.AllowWith("drive", [&](const Cursor& at) { ReadSection(at, out.drive); });
  object.Allow("pdo", out.pdo);
  object.AllowWith("dictionary", [&](const Cursor& at) { ReadSection(at, out.dictionary); });
  object.Allow("object_bits", out.object_bits);
  object.Allow("reported_objects", out.reported_objects);
  object.AllowWith("emergency", [&](const Cursor& at) { ReadSection(at, out.emergency); });
  object.AllowWith("latch", [&](const Cursor& at) { ReadSection(at, out.latch); });
  object.AllowWith("touch_probe", [&](const Cursor& at) { ReadSection(at, out.touch_probe); });
  object.Allow("sync", out.sync);
  object.Allow("mailbox", out.mailbox);
  object.Allow("eeprom", out.eeprom);
  object.Allow("fieldbus_parameters", out.fieldbus_parameters);
  object.Allow("limits", out.limits);
  object.Allow("facts", out.facts);
  object.Finish();
  if (error) return *error;
  return out;
}

Result<DeviceDescription> ReadProfile(std::string_view json) {
  return ReadProfile(json, BuiltinProfile);
}

}  // namespace ecaudit::device
