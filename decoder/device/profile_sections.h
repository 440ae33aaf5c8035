/// The readers of the sections of a profile; internal to the profile reader.
///
/// All of them read over what is already there: a key that the profile does not have leaves the extended profile's
/// value.
#pragma once

#include <string>
#include <vector>

#include "decoder/device/device_description.h"
#include "decoder/device/json_cursor.h"

namespace ecaudit::esc {

void Read(const device::Cursor& cursor, AlState& out);

}  // namespace ecaudit::esc

namespace ecaudit::device {

/// Reads "source", which must be there and not empty: every fact names its place.
void ReadSource(ObjectReader& object, const Cursor& cursor, std::string& source);
/// What every row ends with: an optional note, its source, and nothing else.
void FinishRow(ObjectReader& object, const Cursor& cursor, std::string& note, std::string& source);

/// Reads a section over an inherited one. null means that the drive does not have it.
template <typename T>
void ReadSection(const Cursor& cursor, std::optional<T>& out) {
  if (cursor.value().is_null()) {
    out.reset();
    return;
  }
  if (!out) out.emplace();
  Read(cursor, *out);
}

/// {"value": 62500, "note": "...", "source": "..."}; the value may be null.
template <typename T>
void Read(const Cursor& cursor, Sourced<T>& out) {
  out = {};
  ObjectReader object(cursor);
  object.Require("value", out.value);
  FinishRow(object, cursor, out.note, out.source);
}

void Read(const Cursor& cursor, Basis& out);
void Read(const Cursor& cursor, Access& out);
void Read(const Cursor& cursor, PdoDirection& out);
/// "3" or "0-3"
void ReadBits(const Cursor& cursor, std::uint8_t& first, std::uint8_t& last);

void Read(const Cursor& cursor, IdentityMatch& out);
void Read(const Cursor& cursor, AlDescription& out);
void Read(const Cursor& cursor, RegisterBits& out);
/// Rows of the profile replace the inherited rows that they touch.
void ReadRegisters(const Cursor& cursor, std::vector<RegisterRight>& inherited);
void Read(const Cursor& cursor, DictionaryObject& out);
void Read(const Cursor& cursor, DriveProfile& out);
void Read(const Cursor& cursor, PdoDescription& out);
void Read(const Cursor& cursor, ObjectDictionary& out);
void Read(const Cursor& cursor, BitSign& out);
void Read(const Cursor& cursor, ObjectBits& out);
void Read(const Cursor& cursor, ObjectAddress& out);
void Read(const Cursor& cursor, FaultObject& out);
void Read(const Cursor& cursor, EmergencyTable& out);
void Read(const Cursor& cursor, LatchDescription& out);
void Read(const Cursor& cursor, SyncDescription& out);
void Read(const Cursor& cursor, MailboxDescription& out);
void Read(const Cursor& cursor, EepromFact& out);
void Read(const Cursor& cursor, FieldbusParameter& out);
void Read(const Cursor& cursor, Limit& out);
void Read(const Cursor& cursor, Fact& out);

}  // namespace ecaudit::device
