/// Data types of the CoE object dictionary and values as text.
///
/// Source: ETG.1000.6 table 64, ETG.1020 base data types; CiA 301 for the time types.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "decoder/base/bytes.h"

namespace ecaudit::mailbox {

/// Index of a type in the object dictionary (the data type field of SDO information). Other numbers occur: records of
/// the device, enumerations 0x0800-0x0FFF.
enum class DataType : std::uint16_t {
  kUnknown = 0x0000,
  kBoolean = 0x0001,
  kInteger8 = 0x0002,
  kInteger16 = 0x0003,
  kInteger32 = 0x0004,
  kUnsigned8 = 0x0005,
  kUnsigned16 = 0x0006,
  kUnsigned32 = 0x0007,
  kReal32 = 0x0008,
  kVisibleString = 0x0009,
  kOctetString = 0x000A,
  kUnicodeString = 0x000B,
  kTimeOfDay = 0x000C,
  kTimeDifference = 0x000D,
  kDomain = 0x000F,
  kInteger24 = 0x0010,
  kReal64 = 0x0011,
  kInteger40 = 0x0012,
  kInteger48 = 0x0013,
  kInteger56 = 0x0014,
  kInteger64 = 0x0015,
  kUnsigned24 = 0x0016,
  kUnsigned40 = 0x0018,
  kUnsigned48 = 0x0019,
  kUnsigned56 = 0x001A,
  kUnsigned64 = 0x001B,
  kGuid = 0x001D,
  kByte = 0x001E,
  kWord = 0x001F,
  kDword = 0x0020,
  kPdoMapping = 0x0021,
  kIdentity = 0x0023,
  kCommandParameter = 0x0025,
  kPdoParameter = 0x0027,
  kEnum = 0x0028,
  kSyncManagerSynchronisation = 0x0029,
  kRecord = 0x002A,
  kBackupParameter = 0x002B,
  kModularDeviceProfile = 0x002C,
  kBitArray8 = 0x002D,
  kBitArray16 = 0x002E,
  kBitArray32 = 0x002F,
  kBit1 = 0x0030,  ///< kBit1 + n: n + 1 bits, up to BIT16 at 0x003F
  kBit16 = 0x003F,
  kArrayOfInt = 0x0260,
  kArrayOfSint = 0x0261,
  kArrayOfDint = 0x0262,
  kArrayOfUdint = 0x0263,
  kErrorSetting = 0x0281,
  kDiagnosisHistory = 0x0282,
  kExternalSyncStatus = 0x0283,
  kExternalSyncSettings = 0x0284,
  kFsoeFrame = 0x0285,
  kFsoeCommunicationParameter = 0x0286,
};

/// "UNSIGNED16"; "type 0x0800" for a number without a name.
[[nodiscard]] std::string Name(DataType type);
/// The type that Name() writes; kUnknown for any other text.
[[nodiscard]] DataType DataTypeFromName(std::string_view name);
/// Bits of a value; 0 where the type has no fixed length (strings, records) or is not known.
[[nodiscard]] std::uint32_t BitLength(DataType type);

/// An integer without sign, INTEGERn, or a string of bits that people read in hexadecimal (BYTE, BITARRn, BITn, ...).
[[nodiscard]] bool IsUnsigned(DataType type);
[[nodiscard]] bool IsSigned(DataType type);
[[nodiscard]] bool IsBitString(DataType type);

/// Object code of an object description (ETG.1000.5): 7 "VAR", 8 "ARRAY", 9 "RECORD", ...; "code 4" otherwise.
[[nodiscard]] std::string ObjectCodeName(std::uint8_t code);

/// `bytes` as a value of `type`: integers in decimal, bit strings in hexadecimal, strings without trailing zero bytes
/// and with control characters escaped, TIME_OF_DAY as "1984-01-01 00:00:00.000".
/// Where the length does not fit the type, or the type is unknown: 1 to 4 and 8 bytes as a hexadecimal number
/// ("0x4f"), text where all bytes (at least 5) are printable, else two digits a byte. "" for no bytes.
[[nodiscard]] std::string FormatValue(DataType type, ByteSpan bytes);

}  // namespace ecaudit::mailbox
