#include "decoder/device/object_dictionary.h"

#include <algorithm>
#include <array>
#include <tuple>

#include "decoder/base/sort_by_key.h"

namespace ecaudit::device {
namespace {

struct NamedType {
  std::string_view name;
  DataType type;
};

// Spellings of manuals ("U32", "S32", "VisStr"), of CoE ("UNSIGNED32") and of IEC 61131 as ESI files use them
// ("UDINT").
constexpr auto kNames = std::to_array<NamedType>({
    {"BOOL", DataType::kBoolean},
    {"BOOLEAN", DataType::kBoolean},
    {"BIT", DataType::kBoolean},
    {"INT8", DataType::kInteger8},
    {"S8", DataType::kInteger8},
    {"INTEGER8", DataType::kInteger8},
    {"SINT", DataType::kInteger8},
    {"INT16", DataType::kInteger16},
    {"S16", DataType::kInteger16},
    {"INTEGER16", DataType::kInteger16},
    {"INT", DataType::kInteger16},
    {"INT32", DataType::kInteger32},
    {"S32", DataType::kInteger32},
    {"INTEGER32", DataType::kInteger32},
    {"DINT", DataType::kInteger32},
    {"INT64", DataType::kInteger64},
    {"S64", DataType::kInteger64},
    {"INTEGER64", DataType::kInteger64},
    {"LINT", DataType::kInteger64},
    {"UINT8", DataType::kUnsigned8},
    {"U8", DataType::kUnsigned8},
    {"UNSIGNED8", DataType::kUnsigned8},
    {"USINT", DataType::kUnsigned8},
    {"BYTE", DataType::kUnsigned8},
    {"BITARR8", DataType::kUnsigned8},
    {"UINT16", DataType::kUnsigned16},
    {"U16", DataType::kUnsigned16},
    {"UNSIGNED16", DataType::kUnsigned16},
    {"UINT", DataType::kUnsigned16},
    {"WORD", DataType::kUnsigned16},
    {"BITARR16", DataType::kUnsigned16},
    {"UINT32", DataType::kUnsigned32},
    {"U32", DataType::kUnsigned32},
    {"UNSIGNED32", DataType::kUnsigned32},
    {"UDINT", DataType::kUnsigned32},
    {"DWORD", DataType::kUnsigned32},
    {"BITARR32", DataType::kUnsigned32},
    {"UINT64", DataType::kUnsigned64},
    {"U64", DataType::kUnsigned64},
    {"UNSIGNED64", DataType::kUnsigned64},
    {"ULINT", DataType::kUnsigned64},
    {"REAL", DataType::kReal32},
    {"REAL32", DataType::kReal32},
    {"FLOAT", DataType::kReal32},
    {"REAL64", DataType::kReal64},
    {"LREAL", DataType::kReal64},
    {"VisStr", DataType::kVisibleString},
    {"String", DataType::kVisibleString},
    {"STRING", DataType::kVisibleString},
    {"VISIBLE_STRING", DataType::kVisibleString},
    {"OCTET_STRING", DataType::kOctetString},
    {"ARRAY", DataType::kArray},
    {"RECORD", DataType::kRecord},
});

// ETG.1000.6 table 64: the basic data types of CoE.
constexpr auto kByCode =
    std::to_array<DataType>({DataType::kUnknown, DataType::kBoolean, DataType::kInteger8, DataType::kInteger16,
                             DataType::kInteger32, DataType::kUnsigned8, DataType::kUnsigned16, DataType::kUnsigned32,
                             DataType::kReal32, DataType::kVisibleString, DataType::kOctetString});

std::tuple<std::uint16_t, bool, std::uint8_t> SortKey(const DictionaryObject& object) {
  return {object.index, !object.head, object.subindex};
}

/// How types are printed; their bits, 0 where that depends; by number.
struct Printed {
  std::string_view name;
  std::uint16_t bits = 0;
  bool is_signed = false;
};
constexpr Printed kPrinted[] = {
    {"", 0},
    {"BOOL", 1},
    {"INT8", 8, true},
    {"INT16", 16, true},
    {"INT32", 32, true},
    {"INT64", 64, true},
    {"UINT8", 8},
    {"UINT16", 16},
    {"UINT32", 32},
    {"UINT64", 64},
    {"REAL32", 32, true},
    {"REAL64", 64, true},
    {"VISIBLE_STRING"},
    {"OCTET_STRING"},
    {"ARRAY"},
    {"RECORD"},
};

const Printed& PrintedOf(DataType type) {
  const auto index = static_cast<std::size_t>(type);
  return kPrinted[index < std::size(kPrinted) ? index : 0];
}

}  // namespace

std::uint16_t BitsOf(DataType type) {
  return PrintedOf(type).bits;
}

bool IsSigned(DataType type) {
  return PrintedOf(type).is_signed;
}

std::string_view DataTypeName(DataType type) {
  return PrintedOf(type).name;
}

DataType DataTypeFromName(std::string_view name) {
  if (const auto bracket = name.find('('); bracket != std::string_view::npos) name = name.substr(0, bracket);
  const auto it = std::ranges::find(kNames, name, &NamedType::name);
  return it == kNames.end() ? DataType::kUnknown : it->type;
}

DataType DataTypeFromCode(std::uint16_t code) {
  if (code < kByCode.size()) return kByCode[code];
  switch (code) {
    case 0x0011:
      return DataType::kReal64;
    case 0x0015:
      return DataType::kInteger64;
    case 0x001B:
      return DataType::kUnsigned64;
    case 0x001E:  // BYTE
    case 0x002D:  // BITARR8
      return DataType::kUnsigned8;
    case 0x001F:  // WORD
    case 0x002E:  // BITARR16
      return DataType::kUnsigned16;
    case 0x0020:  // DWORD
    case 0x002F:  // BITARR32
      return DataType::kUnsigned32;
    case 0x0030:  // BIT1
      return DataType::kBoolean;
    default:
      return DataType::kUnknown;
  }
}

DataType DictionaryObject::TypeOf(std::uint8_t sub) const {
  if (types.empty()) return DataType::kUnknown;
  if (types.size() == 1) return types.front();
  // "U8/U32" over subindices 0..8: the number of entries, then the entries.
  if (sub == 0 && subindex == 0) return types.front();
  return types.size() == 2 ? types[1] : DataType::kUnknown;
}

bool DictionaryObject::AllowsBits(std::uint8_t sub, std::uint32_t bits) const {
  const DataType one = TypeOf(sub);
  if (one != DataType::kUnknown) return BitsOf(one) == 0 || BitsOf(one) == bits;
  if (types.empty()) return true;
  return std::ranges::any_of(types, [&](DataType type) { return BitsOf(type) == 0 || BitsOf(type) == bits; });
}

void SortObjects(std::vector<DictionaryObject>& objects) {
  SortByKey(objects, [](const DictionaryObject& object) {
    return static_cast<std::uint64_t>(object.index) << 16U | (object.head ? 0U : 0x100U) | object.subindex;
  });
}

const DictionaryObject* FindObject(const std::vector<DictionaryObject>& objects, std::uint16_t index,
                                   std::uint8_t subindex) {
  const auto key = std::make_tuple(index, true, subindex);
  auto it =
      std::upper_bound(objects.begin(), objects.end(), key,
                       [](const auto& wanted, const DictionaryObject& object) { return wanted < SortKey(object); });
  while (it != objects.begin()) {
    --it;
    if (it->index != index) return nullptr;
    if (it->Covers(subindex)) return &*it;
  }
  return nullptr;
}

const DictionaryObject* FindObjectHead(const std::vector<DictionaryObject>& objects, std::uint16_t index) {
  const auto it = std::ranges::lower_bound(objects, index, {}, &DictionaryObject::index);
  return it != objects.end() && it->index == index ? &*it : nullptr;
}

const DictionaryObject* ObjectDictionary::Find(std::uint16_t index, std::uint8_t subindex) const {
  return FindObject(objects, index, subindex);
}

const DictionaryObject* ObjectDictionary::FindIndex(std::uint16_t index) const {
  return FindObjectHead(objects, index);
}

}  // namespace ecaudit::device
