/// Reads the sections "object_bits", "eeprom", "fieldbus_parameters", "limits" and "facts" of a profile.
#include "decoder/device/profile_sections.h"

namespace ecaudit::device {

void Read(const Cursor& cursor, BitSign& out) {
  static constexpr Word<BitSign> kSigns[] = {
      {"fault", BitSign::kFault}, {"warning", BitSign::kWarning}, {"fault or warning", BitSign::kEither}};
  ReadWord(cursor, kSigns, out);
}

void Read(const Cursor& cursor, ObjectBits& out) {
  ObjectReader object(cursor);
  object.Require("index", out.index);
  object.Allow("sub", out.subindex);
  bool has_bits = false;
  object.AllowWith("bits", [&](const Cursor& bits) {
    has_bits = true;
    ReadBits(bits, out.first, out.last);
  });
  object.Allow("value", out.value);
  object.Require("name", out.name);
  object.Allow("meaning", out.meaning);
  object.Allow("reserved", out.reserved);
  object.Allow("sign", out.sign);
  FinishRow(object, cursor, out.note, out.source);
  if (!cursor.failed() && !has_bits) cursor.Fail("\"bits\" is missing");
}

void Read(const Cursor& cursor, EepromFact& out) {
  ObjectReader object(cursor);
  object.Require("kind", out.kind);
  object.Allow("key", out.key);
  object.Allow("category", out.category);
  object.Allow("word", out.word);
  object.Require("fact", out.fact);
  object.Allow("rules", out.rules);
  FinishRow(object, cursor, out.note, out.source);
}

void Read(const Cursor& cursor, FieldbusParameter& out) {
  ObjectReader object(cursor);
  object.Require("parameter", out.parameter);
  object.Allow("bit", out.bit);
  object.Allow("value", out.value);
  object.Require("meaning", out.meaning);
  object.Allow("rules", out.rules);
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
