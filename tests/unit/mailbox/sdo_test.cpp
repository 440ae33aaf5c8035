#include "decoder/mailbox/sdo.h"

#include <regex>
#include <set>

#include <gtest/gtest.h>

#include "tests/unit/mailbox/mailbox_test_support.h"

namespace ecaudit::mailbox {
namespace {

SdoMessage Parse(const char* hex, Direction direction) {
  static Bytes bytes;
  bytes = FromHex(hex);
  return ParseSdo(bytes, direction);
}

/// Every command byte the manuals print, with its meaning and number of data bytes.
TEST(Sdo, CommandBytesOfTheManuals) {
  const auto rows = ReadTable("sdo_command_bytes.csv");
  if (rows.empty()) GTEST_SKIP() << "reference tables not beside the project";
  const std::map<std::string, SdoKind> kinds = {{"write request", SdoKind::kDownloadInitiate},
                                                {"read request", SdoKind::kUploadInitiate},
                                                {"write response ok", SdoKind::kDownloadInitiate},
                                                {"read response ok", SdoKind::kUploadInitiate},
                                                {"error on read or write", SdoKind::kAbort}};
  ASSERT_EQ(rows.size(), 49U);
  for (auto row : rows) {
    SCOPED_TRACE(row["family"] + " " + row["direction"] + " " + row["byte"]);
    Bytes sdo = FromHex("00 12 1c 01 04 17 00 00");
    sdo[0] = static_cast<std::uint8_t>(std::stoul(row["byte"], nullptr, 16));
    const Direction direction = row["direction"] == "out" ? Direction::kOut : Direction::kIn;
    const SdoMessage message = ParseSdo(sdo, direction);
    ASSERT_TRUE(kinds.contains(row["meaning"])) << row["meaning"];
    EXPECT_EQ(message.kind, kinds.at(row["meaning"]));
    EXPECT_EQ(message.index, 0x1C12);
    EXPECT_EQ(message.subindex, 1);
    EXPECT_FALSE(message.complete_access);
    EXPECT_FALSE(message.too_short);
    if (!row["data_bytes"].empty()) {
      EXPECT_TRUE(message.expedited);
      EXPECT_EQ(message.data.size(), std::stoul(row["data_bytes"]));
      EXPECT_EQ(message.size, std::stoul(row["data_bytes"]));
    } else {
      EXPECT_TRUE(message.data.empty());
    }
  }
}

TEST(Sdo, NormalDownloadCarriesItsFirstBytes) {
  const SdoMessage whole = Parse("21 f2 2f 00 05 00 00 00 | 41 42 43 44 45", Direction::kOut);
  EXPECT_FALSE(whole.expedited);
  EXPECT_EQ(whole.size, 5U);
  EXPECT_EQ(Text(whole.data), "ABCDE");
  EXPECT_EQ(whole.excess, 0U);

  const SdoMessage begin = Parse("21 f2 2f 00 05 01 00 00 | 41 42", Direction::kOut);
  EXPECT_EQ(begin.size, 0x105U);
  EXPECT_EQ(Text(begin.data), "AB");

  const SdoMessage padded = Parse("41 08 10 00 01 00 00 00 | 41 42 43", Direction::kIn);
  EXPECT_EQ(Text(padded.data), "A");
  EXPECT_EQ(padded.excess, 2U);
}

TEST(Sdo, SizeNeedNotBeIndicated) {
  const SdoMessage expedited = Parse("22 60 60 00 03 00 00 00", Direction::kOut);
  EXPECT_TRUE(expedited.expedited);
  EXPECT_FALSE(expedited.size.has_value());
  EXPECT_EQ(expedited.data.size(), 4U);
  const SdoMessage normal = Parse("40 08 10 00 00 00 00 00 41", Direction::kIn);
  EXPECT_FALSE(normal.size.has_value());
  EXPECT_EQ(Text(normal.data), "A");
}

TEST(Sdo, CompleteAccess) {
  EXPECT_TRUE(Parse("50 00 1c 00 00 00 00 00", Direction::kOut).complete_access);
  EXPECT_TRUE(Parse("31 12 1c 00 0a 00 00 00 01 00", Direction::kOut).complete_access);
  const SdoMessage answer = Parse("53 12 1c 00 01 00 01 16", Direction::kIn);  // LAN9252: expedited
  EXPECT_TRUE(answer.complete_access);
  EXPECT_EQ(Copy(answer.data), FromHex("01 00 01 16"));
  EXPECT_EQ(answer.size, 4U);
}

TEST(Sdo, Segments) {
  const SdoMessage download = Parse("0b 41 42 00 00 00 00 00", Direction::kOut);  // last, 5 of 7 unused
  EXPECT_EQ(download.kind, SdoKind::kDownloadSegment);
  EXPECT_FALSE(download.has_object);
  EXPECT_FALSE(download.toggle);
  EXPECT_TRUE(download.last);
  EXPECT_EQ(Text(download.data), "AB");

  const SdoMessage ask = Parse("70 00 00 00 00 00 00 00", Direction::kOut);
  EXPECT_EQ(ask.kind, SdoKind::kUploadSegment);
  EXPECT_TRUE(ask.toggle);
  EXPECT_TRUE(ask.data.empty());
  EXPECT_FALSE(ask.last);

  const SdoMessage upload = Parse("10 41 42 43 44 45 46 47 48 49", Direction::kIn);  // longer than the minimum
  EXPECT_EQ(upload.kind, SdoKind::kUploadSegment);
  EXPECT_TRUE(upload.toggle);
  EXPECT_FALSE(upload.last);
  EXPECT_EQ(Text(upload.data), "ABCDEFGHI");

  const SdoMessage confirm = Parse("30", Direction::kIn);  // KickCAT answers with the command alone
  EXPECT_EQ(confirm.kind, SdoKind::kDownloadSegment);
  EXPECT_TRUE(confirm.toggle);
  EXPECT_FALSE(confirm.too_short);
}

TEST(Sdo, AbortsByTheirTopThreeBits) {
  for (int command = 0x80; command <= 0x9F; ++command) {
    Bytes sdo = FromHex("80 ff 5f 00 00 00 02 06");
    sdo[0] = static_cast<std::uint8_t>(command);
    for (const Direction direction : {Direction::kOut, Direction::kIn}) {
      const SdoMessage message = ParseSdo(sdo, direction);
      EXPECT_EQ(message.kind, SdoKind::kAbort);
      EXPECT_EQ(message.abort_code, 0x06020000U);
      EXPECT_EQ(message.index, 0x5FFF);
      EXPECT_FALSE(message.complete_access);
      EXPECT_FALSE(message.displaced_abort_code.has_value());
    }
  }
}

TEST(Sdo, AbortCodeAfterTheSizeOfTheRequest) {
  // sdo-mix packet 588: KickCAT leaves the size of the download where the code belongs
  const SdoMessage message = Parse("81 ff 60 00 08 00 00 00 10 00 07 06 45 46 47 48", Direction::kIn);
  EXPECT_EQ(message.abort_code, 8U);
  EXPECT_EQ(message.displaced_abort_code, 0x06070010U);
}

TEST(Sdo, ReservedSpecifiersAndCutMessages) {
  for (const Direction direction : {Direction::kOut, Direction::kIn}) {
    for (const char* command : {"a0", "c0", "e0"}) {
      EXPECT_EQ(Parse((std::string(command) + " 00 10 00 00 00 00 00").c_str(), direction).kind, SdoKind::kReserved);
    }
  }
  EXPECT_TRUE(Parse("", Direction::kOut).too_short);
  EXPECT_TRUE(Parse("40 00 10", Direction::kOut).too_short);
  EXPECT_FALSE(Parse("40 00 10 00", Direction::kOut).too_short);
  EXPECT_TRUE(Parse("23 00 10 00 01", Direction::kOut).too_short);
  EXPECT_TRUE(Parse("21 00 10 00 01 00 00", Direction::kOut).too_short);
  EXPECT_TRUE(Parse("80 00 10 00 00", Direction::kIn).too_short);
}

TEST(Sdo, EveryAbortCodeOfTheStandardHasItsText) {
  const std::string reference = ReadReference("esc-reference.md");
  if (reference.empty()) GTEST_SKIP() << "reference not beside the project";
  const std::size_t from = reference.find("SDO abort codes:");
  const std::size_t to = reference.find("### 8.5");
  ASSERT_LT(from, to);
  const std::string table = reference.substr(from, to - from);
  const std::regex code("0x0[568][0-9A-F]{6}");
  std::set<std::string_view> texts;
  int codes = 0;
  for (std::sregex_iterator it(table.begin(), table.end(), code); it != std::sregex_iterator(); ++it) {
    const std::string_view text = AbortCodeText(static_cast<std::uint32_t>(std::stoul(it->str(), nullptr, 16)));
    EXPECT_FALSE(text.empty()) << it->str();
    texts.insert(text);
    ++codes;
  }
  EXPECT_EQ(codes, 36);
  EXPECT_EQ(texts.size(), 36U);
  EXPECT_EQ(AbortCodeText(0x06010002), "attempt to write a read-only object");
  EXPECT_EQ(AbortCodeText(0x06090011), "subindex does not exist");
  EXPECT_EQ(AbortCodeText(0x06010007), "");
  EXPECT_EQ(AbortCodeText(0), "");
  EXPECT_EQ(AbortCodeText(0xFFFFFFFF), "");
}

}  // namespace
}  // namespace ecaudit::mailbox
