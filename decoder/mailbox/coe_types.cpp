#include "decoder/mailbox/coe_types.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <iterator>

#include "decoder/base/names.h"
#include "decoder/base/text.h"

namespace ecaudit::mailbox {
namespace {

struct TypeRow {
  std::string_view name;
  std::uint32_t bits;
  DataType type;
};

constexpr TypeRow kTypes[] = {
    {"BOOLEAN", 1, DataType::kBoolean},
    {"INTEGER8", 8, DataType::kInteger8},
    {"INTEGER16", 16, DataType::kInteger16},
    {"INTEGER32", 32, DataType::kInteger32},
    {"UNSIGNED8", 8, DataType::kUnsigned8},
    {"UNSIGNED16", 16, DataType::kUnsigned16},
    {"UNSIGNED32", 32, DataType::kUnsigned32},
    {"REAL32", 32, DataType::kReal32},
    {"VISIBLE_STRING", 0, DataType::kVisibleString},
    {"OCTET_STRING", 0, DataType::kOctetString},
    {"UNICODE_STRING", 0, DataType::kUnicodeString},
    {"TIME_OF_DAY", 48, DataType::kTimeOfDay},
    {"TIME_DIFFERENCE", 48, DataType::kTimeDifference},
    {"DOMAIN", 0, DataType::kDomain},
    {"INTEGER24", 24, DataType::kInteger24},
    {"REAL64", 64, DataType::kReal64},
    {"INTEGER40", 40, DataType::kInteger40},
    {"INTEGER48", 48, DataType::kInteger48},
    {"INTEGER56", 56, DataType::kInteger56},
    {"INTEGER64", 64, DataType::kInteger64},
    {"UNSIGNED24", 24, DataType::kUnsigned24},
    {"UNSIGNED40", 40, DataType::kUnsigned40},
    {"UNSIGNED48", 48, DataType::kUnsigned48},
    {"UNSIGNED56", 56, DataType::kUnsigned56},
    {"UNSIGNED64", 64, DataType::kUnsigned64},
    {"GUID", 128, DataType::kGuid},
    {"BYTE", 8, DataType::kByte},
    {"WORD", 16, DataType::kWord},
    {"DWORD", 32, DataType::kDword},
    {"PDO_MAPPING", 0, DataType::kPdoMapping},
    {"IDENTITY", 0, DataType::kIdentity},
    {"COMMAND_PAR", 0, DataType::kCommandParameter},
    {"PDO_PARAMETER", 0, DataType::kPdoParameter},
    {"ENUM", 0, DataType::kEnum},
    {"SM_SYNCHRONISATION", 0, DataType::kSyncManagerSynchronisation},
    {"RECORD", 0, DataType::kRecord},
    {"BACKUP_PARAMETER", 0, DataType::kBackupParameter},
    {"MODULAR_DEVICE_PROFILE", 0, DataType::kModularDeviceProfile},
    {"BITARR8", 8, DataType::kBitArray8},
    {"BITARR16", 16, DataType::kBitArray16},
    {"BITARR32", 32, DataType::kBitArray32},
    {"ARRAY_OF_INT", 0, DataType::kArrayOfInt},
    {"ARRAY_OF_SINT", 0, DataType::kArrayOfSint},
    {"ARRAY_OF_DINT", 0, DataType::kArrayOfDint},
    {"ARRAY_OF_UDINT", 0, DataType::kArrayOfUdint},
    {"ERROR_SETTING", 0, DataType::kErrorSetting},
    {"DIAGNOSIS_HISTORY", 0, DataType::kDiagnosisHistory},
    {"EXTERNAL_SYNC_STATUS", 0, DataType::kExternalSyncStatus},
    {"EXTERNAL_SYNC_SETTINGS", 0, DataType::kExternalSyncSettings},
    {"FSOE_FRAME", 0, DataType::kFsoeFrame},
    {"FSOE_COMMUNICATION_PARAMETER", 0, DataType::kFsoeCommunicationParameter},
};

const TypeRow* Find(DataType type) {
  const auto* row = std::ranges::find(kTypes, type, &TypeRow::type);
  return row != std::end(kTypes) ? row : nullptr;
}

bool IsBitField(DataType type) {
  return type >= DataType::kBit1 && type <= DataType::kBit16;
}

template <typename Number>
std::string Shortest(Number value) {
  char buffer[64];
  const auto result = std::to_chars(std::begin(buffer), std::end(buffer), value);
  return {std::begin(buffer), result.ptr};
}

ByteSpan WithoutTrailingZeros(ByteSpan bytes) {
  while (!bytes.empty() && bytes.back() == 0) bytes = bytes.first(bytes.size() - 1);
  return bytes;
}

std::string Characters(ByteSpan bytes) {
  return Printable(std::string(bytes.begin(), bytes.end()));
}

void AppendUtf8(std::string& out, std::uint32_t code) {
  const auto put = [&](std::uint32_t byte) { out += static_cast<char>(static_cast<std::uint8_t>(byte)); };
  if (code < 0x80) {
    put(code);
  } else if (code < 0x800) {
    put(0xC0U | code >> 6U);
    put(0x80U | (code & 0x3FU));
  } else if (code < 0x10000) {
    put(0xE0U | code >> 12U);
    put(0x80U | (code >> 6U & 0x3FU));
    put(0x80U | (code & 0x3FU));
  } else {
    put(0xF0U | code >> 18U);
    put(0x80U | (code >> 12U & 0x3FU));
    put(0x80U | (code >> 6U & 0x3FU));
    put(0x80U | (code & 0x3FU));
  }
}

std::string Utf16(ByteSpan bytes) {
  std::string text;
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
    std::uint32_t code = LittleEndian<std::uint16_t>(bytes, i);
    if (code >= 0xD800 && code < 0xDC00) {
      const std::uint32_t low = LittleEndian<std::uint16_t>(bytes, i + 2);
      if (low >= 0xDC00 && low < 0xE000) {
        code = 0x10000U + ((code - 0xD800U) << 10U) + (low - 0xDC00U);
        i += 2;
      }
    }
    AppendUtf8(text, code);  // half a pair becomes bytes that Printable() escapes
  }
  while (!text.empty() && text.back() == '\0') text.pop_back();
  return Printable(text);
}

std::string TwoDigits(std::uint64_t value) {
  std::string text = std::to_string(value);
  return text.size() < 2 ? "0" + text : text;
}

/// "hh:mm:ss.mmm" of milliseconds since midnight.
std::string Clock(std::uint32_t ms) {
  const std::string fraction = std::to_string(ms % 1000U);
  return TwoDigits(ms / 3'600'000U) + ":" + TwoDigits(ms / 60'000U % 60U) + ":" + TwoDigits(ms / 1000U % 60U) + "." +
         std::string(3 - fraction.size(), '0') + fraction;
}

/// Days since 1984-01-01 (CiA 301) as a calendar date, by the usual civil-from-days arithmetic.
std::string Date(std::uint32_t days) {
  const std::uint32_t z = days + 5113U + 719468U;  // days from 0000-03-01; 5113 from 1970 to 1984
  const std::uint32_t era = z / 146097U;
  const std::uint32_t day_of_era = z - era * 146097U;
  const std::uint32_t year_of_era =
      (day_of_era - day_of_era / 1460U + day_of_era / 36524U - day_of_era / 146096U) / 365U;
  const std::uint32_t day_of_year = day_of_era - (365U * year_of_era + year_of_era / 4U - year_of_era / 100U);
  const std::uint32_t shifted_month = (5U * day_of_year + 2U) / 153U;
  const std::uint32_t day = day_of_year - (153U * shifted_month + 2U) / 5U + 1U;
  const std::uint32_t month = shifted_month < 10U ? shifted_month + 3U : shifted_month - 9U;
  const std::uint32_t year = year_of_era + era * 400U + (month <= 2U ? 1U : 0U);
  return std::to_string(year) + "-" + TwoDigits(month) + "-" + TwoDigits(day);
}

std::string Guid(ByteSpan bytes) {
  // The first three groups are little endian numbers, the others bytes in order.
  std::string text = Hex(LittleEndian<std::uint32_t>(bytes, 0), 8).substr(2) + "-" +
                     Hex(LittleEndian<std::uint16_t>(bytes, 4)).substr(2) + "-" +
                     Hex(LittleEndian<std::uint16_t>(bytes, 6)).substr(2) + "-";
  AppendHexBytes(text, bytes.subspan(8, 2));
  text += "-";
  AppendHexBytes(text, bytes.subspan(10, 6));
  return text;
}

std::string FormatUntyped(ByteSpan bytes) {
  if (bytes.empty()) return {};
  const bool number = bytes.size() == 1 || bytes.size() == 2 || bytes.size() == 4;
  if (number) return Hex(UnsignedOf(bytes), static_cast<int>(2 * bytes.size()));
  const ByteSpan text = WithoutTrailingZeros(bytes);
  const bool printable =
      text.size() >= 5 && std::ranges::all_of(text, [](std::uint8_t c) { return c >= 0x20 && c < 0x7F; });
  if (printable) return Characters(text);
  if (bytes.size() == 3 || bytes.size() == 8) return Hex(UnsignedOf(bytes), static_cast<int>(2 * bytes.size()));
  return HexBytes(bytes);
}

}  // namespace

std::string Name(DataType type) {
  if (const TypeRow* row = Find(type)) return std::string(row->name);
  const auto number = static_cast<std::uint16_t>(type);
  if (IsBitField(type)) return "BIT" + std::to_string(number - static_cast<unsigned>(DataType::kBit1) + 1U);
  return "type " + Hex(number);
}

DataType DataTypeFromName(std::string_view name) {
  for (const TypeRow& row : kTypes) {
    if (row.name == name) return row.type;
  }
  if (name.starts_with("BIT")) {
    const std::string_view digits = name.substr(3);
    unsigned bits = 0;
    const auto result = std::from_chars(digits.data(), digits.data() + digits.size(), bits);
    if (result.ec == std::errc() && result.ptr == digits.data() + digits.size() && bits >= 1 && bits <= 16) {
      return static_cast<DataType>(static_cast<unsigned>(DataType::kBit1) + bits - 1U);
    }
  }
  return DataType::kUnknown;
}

bool IsUnsigned(DataType type) {
  const TypeRow* row = Find(type);
  return row != nullptr && row->name.starts_with("UNSIGNED");
}

bool IsSigned(DataType type) {
  const TypeRow* row = Find(type);
  return row != nullptr && row->name.starts_with("INTEGER");
}

bool IsBitString(DataType type) {
  return type == DataType::kByte || type == DataType::kWord || type == DataType::kDword ||
         type == DataType::kBitArray8 || type == DataType::kBitArray16 || type == DataType::kBitArray32 ||
         IsBitField(type);
}

std::uint32_t BitLength(DataType type) {
  if (const TypeRow* row = Find(type)) return row->bits;
  return IsBitField(type) ? static_cast<std::uint32_t>(type) - static_cast<std::uint32_t>(DataType::kBit1) + 1U : 0U;
}

std::string ObjectCodeName(std::uint8_t code) {
  static constexpr Named<std::uint8_t> kNames[] = {
      {0x00, "NULL"}, {0x02, "DOMAIN"}, {0x05, "DEFTYPE"}, {0x06, "DEFSTRUCT"},
      {0x07, "VAR"},  {0x08, "ARRAY"},  {0x09, "RECORD"},
  };
  const std::string_view name = NameIn(kNames, code);
  return !name.empty() ? std::string(name) : "code " + std::to_string(code);
}

std::string FormatValue(DataType type, ByteSpan bytes) {
  const std::uint32_t bits = BitLength(type);
  if (bytes.empty() || (bits != 0 && bytes.size() != (bits + 7U) / 8U)) return FormatUntyped(bytes);
  if (IsUnsigned(type)) return std::to_string(UnsignedOf(bytes));
  if (IsSigned(type)) return std::to_string(SignExtend(UnsignedOf(bytes), 8 * static_cast<unsigned>(bytes.size())));
  if (IsBitString(type)) return Hex(UnsignedOf(bytes), static_cast<int>(2 * bytes.size()));
  switch (type) {
    case DataType::kBoolean:
      return bytes[0] == 0 ? "false" : "true";
    case DataType::kReal32:
      return Shortest(std::bit_cast<float>(LittleEndian<std::uint32_t>(bytes, 0)));
    case DataType::kReal64:
      return Shortest(std::bit_cast<double>(LittleEndian<std::uint64_t>(bytes, 0)));
    case DataType::kVisibleString:
      return Characters(WithoutTrailingZeros(bytes));
    case DataType::kOctetString:
    case DataType::kDomain:
      return HexBytes(bytes);
    case DataType::kUnicodeString:
      return Utf16(bytes);
    case DataType::kTimeOfDay:
      return Date(LittleEndian<std::uint16_t>(bytes, 4)) + " " +
             Clock(LittleEndian<std::uint32_t>(bytes, 0) & 0x0FFFFFFFU);
    case DataType::kTimeDifference:
      return std::to_string(LittleEndian<std::uint16_t>(bytes, 4)) + " d " +
             Clock(LittleEndian<std::uint32_t>(bytes, 0) & 0x0FFFFFFFU);
    case DataType::kGuid:
      return Guid(bytes);
    default:
      return FormatUntyped(bytes);
  }
}

}  // namespace ecaudit::mailbox
