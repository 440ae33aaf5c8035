/// Reads the sections "eeprom", "fieldbus_parameters", "limits" and "facts" of a profile.
#include "decoder/device/profile_sections.h"

namespace ecaudit::device {

void Read(const Cursor& cursor, EepromFact& out) {
  ObjectReader object(cursor);
  object.Require("kind", out.kind);
  object.Allow("key", out.key);
  object.Allow("category", out.category);
  object.Require("fact", out.fact);
  FinishRow(object, cursor, out.note, out.source);
}

void Read(const Cursor& cursor, FieldbusParameter& out) {
  ObjectReader object(cursor);
  object.Require("parameter", out.parameter);
  object.Allow("bit", out.bit);
  object.Allow("value", out.value);
  object.Require("meaning", out.meaning);
  FinishRow(object, cursor, out.note, out.source);
}

void Read(const Cursor& cursor, Limit& out) {
  ObjectReader object(cursor);
  object.Require("name", out.name);
  object.Require("value", out.value);
  object.Allow("unit", out.unit);
  object.Allow("meaning", out.meaning);
  FinishRow(object, cursor, out.note, out.source);
}

void Read(const Cursor& cursor, Fact& out) {
  ObjectReader object(cursor);
  object.Require("category", out.category);
  object.Require("name", out.name);
  object.Require("value", out.value);
  FinishRow(object, cursor, out.note, out.source);
}

}  // namespace ecaudit::device
