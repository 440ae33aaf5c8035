/// Objects of a drive: what can be read and written by SDO, and mapped into PDOs.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "decoder/device/register_right.h"

namespace ecaudit::device {

/// CoE data types, with the codes of SDO information where they are numbers.
enum class DataType : std::uint8_t {
  kUnknown,
  kBoolean,
  kInteger8,
  kInteger16,
  kInteger32,
  kInteger64,
  kUnsigned8,
  kUnsigned16,
  kUnsigned32,
  kUnsigned64,
  kReal32,
  kReal64,
  kVisibleString,
  kOctetString,
  kArray,   ///< head row of an array
  kRecord,  ///< head row of a record
};

/// Bits of a value, 0 for strings, heads and unknown types.
[[nodiscard]] std::uint16_t BitsOf(DataType type);
/// Integers with a sign, and reals.
[[nodiscard]] bool IsSigned(DataType type);
/// "INT32", "UINT16", "VISIBLE_STRING".
[[nodiscard]] std::string_view DataTypeName(DataType type);
/// Reads the spellings of manuals and ESI files: U32, UINT32, UDINT, S32, INT32, DINT, VisStr, STRING(20), BOOL, BIT,
/// ... kUnknown for others, among them names of records.
[[nodiscard]] DataType DataTypeFromName(std::string_view name);
/// Reads a data type code of SDO information or of the EEPROM (0x0007 = UNSIGNED32).
[[nodiscard]] DataType DataTypeFromCode(std::uint16_t code);

enum class PdoDirection : std::uint8_t {
  kRx,  ///< master to drive
  kTx,  ///< drive to master
};

/// May an object be mapped into a PDO?
enum class Mappable : std::uint8_t {
  kUnknown,  ///< not documented
  kNo,
  kYes,
  kConditional,  ///< printed "yes*", the condition is not known
};

/// One row of a dictionary: one subindex, a range of equal ones, or (`head`) the name of an array or record.
struct DictionaryObject {
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  std::uint8_t last_subindex = 0;  ///< equals `subindex` for a single one; 0xFF when the manual prints an open range
  bool head = false;               ///< names the whole object; its subindex means nothing
  /// Possible types. Several only for a range over subindex 0 and others; the first is then that of subindex 0.
  std::vector<DataType> types;
  Access access = Access::kUnknown;
  bool constant = false;  ///< read only and never changing
  Mappable mappable = Mappable::kUnknown;
  std::optional<PdoDirection> only;  ///< mappable in this direction only, if a source states it
  std::string scale;                 ///< "1000:1", "1:1", "var"; empty: plain number
  std::string pdo_scale;             ///< that of the process data, if it is another one; else empty
  std::string pdo_unit;              ///< likewise
  std::uint16_t max_bytes = 0;       ///< longest text; 0: not documented
  std::string unit;
  std::string name;
  std::string keyword;         ///< ASCII parameter(s) after the object
  std::string printed_type;    ///< where `types` reads print otherwise
  std::string printed_access;  ///< where `access` reads print otherwise
  std::string note;
  std::string source;

  [[nodiscard]] bool Covers(std::uint8_t sub) const { return !head && sub >= subindex && sub <= last_subindex; }
  /// The type of one of its subindices; kUnknown when several remain possible.
  [[nodiscard]] DataType TypeOf(std::uint8_t sub) const;
  /// False only when all possible types of that subindex have a fixed size other than `bits`.
  [[nodiscard]] bool AllowsBits(std::uint8_t sub, std::uint32_t bits) const;
};

struct ObjectDictionary {
  /// The source claims to list every object: what is missing does not exist.
  bool complete = false;
  std::vector<DictionaryObject> objects;  ///< sorted by (index, heads first, subindex)
  std::string note;
  std::string source;

  /// The row of a subindex, or null. Heads are not found this way.
  [[nodiscard]] const DictionaryObject* Find(std::uint16_t index, std::uint8_t subindex) const;
  /// The head row, or for simple objects their only row, or null.
  [[nodiscard]] const DictionaryObject* FindIndex(std::uint16_t index) const;
};

/// Find() and FindIndex() over any rows sorted like those of a dictionary.
[[nodiscard]] const DictionaryObject* FindObject(const std::vector<DictionaryObject>& objects, std::uint16_t index,
                                                 std::uint8_t subindex);
[[nodiscard]] const DictionaryObject* FindObjectHead(const std::vector<DictionaryObject>& objects, std::uint16_t index);
/// Sorts rows as the functions above need them.
void SortObjects(std::vector<DictionaryObject>& objects);

}  // namespace ecaudit::device
