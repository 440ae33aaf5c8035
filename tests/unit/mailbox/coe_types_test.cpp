#include "decoder/mailbox/coe_types.h"

#include <gtest/gtest.h>

#include "tests/unit/mailbox/mailbox_test_support.h"

namespace ecaudit::mailbox {
namespace {

std::string Format(DataType type, const char* hex) {
  return FormatValue(type, FromHex(hex));
}

TEST(CoeTypes, NumbersNamesAndLengths) {
  struct Row {
    int number;
    const char* name;
    std::uint32_t bits;
  };
  // ETG.1020 base data types
  const Row rows[] = {{0x0001, "BOOLEAN", 1},
                      {0x0002, "INTEGER8", 8},
                      {0x0003, "INTEGER16", 16},
                      {0x0004, "INTEGER32", 32},
                      {0x0005, "UNSIGNED8", 8},
                      {0x0006, "UNSIGNED16", 16},
                      {0x0007, "UNSIGNED32", 32},
                      {0x0008, "REAL32", 32},
                      {0x0009, "VISIBLE_STRING", 0},
                      {0x000A, "OCTET_STRING", 0},
                      {0x000B, "UNICODE_STRING", 0},
                      {0x000C, "TIME_OF_DAY", 48},
                      {0x000D, "TIME_DIFFERENCE", 48},
                      {0x0010, "INTEGER24", 24},
                      {0x0011, "REAL64", 64},
                      {0x0015, "INTEGER64", 64},
                      {0x0016, "UNSIGNED24", 24},
                      {0x0018, "UNSIGNED40", 40},
                      {0x001B, "UNSIGNED64", 64},
                      {0x001D, "GUID", 128},
                      {0x001E, "BYTE", 8},
                      {0x001F, "WORD", 16},
                      {0x0020, "DWORD", 32},
                      {0x0021, "PDO_MAPPING", 0},
                      {0x002D, "BITARR8", 8},
                      {0x002F, "BITARR32", 32},
                      {0x0030, "BIT1", 1},
                      {0x0037, "BIT8", 8},
                      {0x003F, "BIT16", 16},
                      {0x0260, "ARRAY_OF_INT", 0}};
  for (const Row& row : rows) {
    const auto type = static_cast<DataType>(row.number);
    EXPECT_EQ(Name(type), row.name);
    EXPECT_EQ(BitLength(type), row.bits) << row.name;
    EXPECT_EQ(DataTypeFromName(row.name), type);
  }
  EXPECT_EQ(Name(static_cast<DataType>(0x0800)), "type 0x0800");
  EXPECT_EQ(BitLength(static_cast<DataType>(0x0800)), 0U);
  EXPECT_EQ(DataTypeFromName("BIT17"), DataType::kUnknown);
  EXPECT_EQ(DataTypeFromName("BIT"), DataType::kUnknown);
  EXPECT_EQ(DataTypeFromName("BIT1x"), DataType::kUnknown);
  EXPECT_EQ(DataTypeFromName("unsigned8"), DataType::kUnknown);
  EXPECT_EQ(ObjectCodeName(7), "VAR");
  EXPECT_EQ(ObjectCodeName(9), "RECORD");
  EXPECT_EQ(ObjectCodeName(4), "code 4");
}

TEST(CoeTypes, Integers) {
  EXPECT_EQ(Format(DataType::kUnsigned8, "ff"), "255");
  EXPECT_EQ(Format(DataType::kInteger8, "ff"), "-1");
  EXPECT_EQ(Format(DataType::kUnsigned16, "3412"), "4660");
  EXPECT_EQ(Format(DataType::kInteger16, "0080"), "-32768");
  EXPECT_EQ(Format(DataType::kInteger24, "000080"), "-8388608");
  EXPECT_EQ(Format(DataType::kUnsigned24, "000080"), "8388608");
  EXPECT_EQ(Format(DataType::kInteger32, "ffffffff"), "-1");
  EXPECT_EQ(Format(DataType::kUnsigned32, "92010200"), "131474");
  EXPECT_EQ(Format(DataType::kInteger48, "ffffffffff7f"), "140737488355327");
  EXPECT_EQ(Format(DataType::kInteger64, "ffffffffffffffff"), "-1");
  EXPECT_EQ(Format(DataType::kUnsigned64, "ffffffffffffffff"), "18446744073709551615");
}

TEST(CoeTypes, BitsAndFloats) {
  EXPECT_EQ(Format(DataType::kBoolean, "00"), "false");
  EXPECT_EQ(Format(DataType::kBoolean, "01"), "true");
  EXPECT_EQ(Format(DataType::kWord, "1d00"), "0x001d");
  EXPECT_EQ(Format(DataType::kDword, "10004060"), "0x60400010");
  EXPECT_EQ(Format(DataType::kBitArray8, "81"), "0x81");
  EXPECT_EQ(Format(static_cast<DataType>(0x0033), "0f"), "0x0f");  // BIT4 in a byte of its own
  EXPECT_EQ(Format(DataType::kReal32, "0000c03f"), "1.5");
  EXPECT_EQ(Format(DataType::kReal64, "000000000000f8bf"), "-1.5");
}

TEST(CoeTypes, StringsAreShownAsText) {
  EXPECT_EQ(Format(DataType::kVisibleString, "414b442d656d756c"), "AKD-emul");
  EXPECT_EQ(Format(DataType::kVisibleString, "41420000"), "AB");
  EXPECT_EQ(Format(DataType::kVisibleString, "411b5b"), "A\\x1b[");
  EXPECT_EQ(Format(DataType::kVisibleString, "4bf66c6e"), "Köln");  // Latin-1, as drives write it
  EXPECT_EQ(Format(DataType::kOctetString, "0102ff"), "0102ff");
  EXPECT_EQ(Format(DataType::kUnicodeString, "4100e400ac200000"), "A\xc3\xa4\xe2\x82\xac");
  EXPECT_EQ(Format(DataType::kUnicodeString, "3dd800de"), "\xf0\x9f\x98\x80");  // surrogate pair
  EXPECT_EQ(Format(DataType::kUnicodeString, "00d841"), "\\xed\\xa0\\x80");     // half a pair, half a character
}

TEST(CoeTypes, Times) {
  EXPECT_EQ(Format(DataType::kTimeOfDay, "000000000000"), "1984-01-01 00:00:00.000");
  // 12:34:56.789 is 45,296,789 ms = 0x02B32C95
  EXPECT_EQ(Format(DataType::kTimeOfDay, "952cb302 3c00"), "1984-03-01 12:34:56.789");  // 60 days, leap year 1984
  EXPECT_EQ(Format(DataType::kTimeOfDay, "00000000 113d"), "2026-10-20 00:00:00.000");  // 15,633 days
  EXPECT_EQ(Format(DataType::kTimeOfDay, "00000000 ffff"), "2163-06-06 00:00:00.000");
  EXPECT_EQ(Format(DataType::kTimeDifference, "e8030000 0200"), "2 d 00:00:01.000");
  EXPECT_EQ(Format(DataType::kTimeOfDay, "000000f00000"), "1984-01-01 00:00:00.000");  // upper four bits are reserved
}

TEST(CoeTypes, Guid) {
  EXPECT_EQ(Format(DataType::kGuid, "00112233 4455 6677 8899 aabbccddeeff"), "33221100-5544-7766-8899-aabbccddeeff");
}

TEST(CoeTypes, WhatTheTypeDoesNotShowTheLengthShows) {
  EXPECT_EQ(Format(DataType::kUnknown, ""), "");
  EXPECT_EQ(Format(DataType::kUnknown, "4f"), "0x4f");
  EXPECT_EQ(Format(DataType::kUnknown, "0417"), "0x1704");
  EXPECT_EQ(Format(DataType::kUnknown, "444b4100"), "0x00414b44");  // a number, although it could be text
  EXPECT_EQ(Format(DataType::kUnknown, "414b442d656d756c"), "AKD-emul");
  EXPECT_EQ(Format(DataType::kUnknown, "0100000000000000"), "0x0000000000000001");
  EXPECT_EQ(Format(DataType::kUnknown, "4d5f30312d30302d30300000"), "M_01-00-00");
  EXPECT_EQ(Format(DataType::kUnknown, "0102030405"), "0102030405");
  EXPECT_EQ(Format(DataType::kUnknown, "0000000000"), "0000000000");
  EXPECT_EQ(Format(DataType::kUnsigned32, "0417"), "0x1704");  // two bytes are no UNSIGNED32
  EXPECT_EQ(Format(DataType::kReal32, "00"), "0x00");
  EXPECT_EQ(Format(DataType::kPdoMapping, "040001020304"), "040001020304");
}

}  // namespace
}  // namespace ecaudit::mailbox
