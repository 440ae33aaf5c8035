#include "decoder/device/profile_reader.h"

#include <string>
#include <string_view>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "decoder/device/profile_registry.h"

namespace ecaudit::device {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

/// A profile with `rest` after the obligatory head.
std::string Profile(std::string_view rest) {
  return R"({"schema": "ecaudit.profile/1", "id": "x", "title": "X", "document": "MKD")" + std::string(rest) + "}";
}

std::string ProfileErrorOf(std::string_view json) {
  const Result<DeviceDescription> profile = ReadProfile(json);
  return profile ? "no error" : profile.error().message;
}

TEST(ProfileReader, ReadsTheHead) {
  const auto profile = ReadProfile(Profile(R"(, "edition": "2020-10", "note": "n")"));
  ASSERT_TRUE(profile) << profile.error().message;
  EXPECT_EQ(profile->id, "x");
  EXPECT_EQ(profile->title, "X");
  EXPECT_EQ(profile->edition, "2020-10");
  EXPECT_EQ(profile->document, "MKD");
}

TEST(ProfileReader, SyntaxErrorsNameLineAndColumn) {
  EXPECT_THAT(ProfileErrorOf("{\n  \"id\": }"), HasSubstr("line 2, column 9"));
  EXPECT_THAT(ProfileErrorOf(""), HasSubstr("line 1"));
  EXPECT_THAT(ProfileErrorOf("{} {}"), HasSubstr("line 1, column 4"));
}

TEST(ProfileReader, TruncationAnywhereIsAnError) {
  const std::string whole = Profile(R"(, "match": {"vendor_id": "0x6A", "product_codes": [1, 2], "source": "MKD, 5.2"},
      "registers": [{"address": "0x0120", "length": 2, "name": "n\u00e9\n", "ecat": "rw", "source": "MKD, 4.1"}])");
  ASSERT_EQ(ProfileErrorOf(whole), "no error");
  for (std::size_t length = 0; length < whole.size(); ++length) {
    EXPECT_FALSE(ReadProfile(std::string_view(whole).substr(0, length))) << length;
  }
}

// Whatever single byte of a profile is damaged, the reader answers; sanitizer builds watch it.
TEST(ProfileReader, DamageNeverCrashes) {
  const std::string whole = BuiltinProfileText("pilz-pmcprotego-d").substr(0, 6000);
  std::string damaged = whole;
  for (std::size_t i = 0; i < whole.size(); i += 37) {
    for (const char byte : {'\0', '"', '{', '\xff', '9'}) {
      damaged[i] = byte;
      EXPECT_FALSE(ReadProfile(damaged));  // cut in the middle, so never whole
    }
    damaged[i] = whole[i];
  }
}

TEST(ProfileReader, WrongTypesNameThePlace) {
  EXPECT_EQ(ProfileErrorOf("[]"), "document: expected an object, got an array");
  EXPECT_EQ(ProfileErrorOf(Profile(R"(, "registers": 3)")), "registers: expected an array, got a number");
  EXPECT_EQ(ProfileErrorOf(Profile(R"(, "registers": [{"address": true}])")),
            "registers[0].address: expected a number, got true or false");
  EXPECT_EQ(ProfileErrorOf(Profile(R"(, "edition": 2010)")), "edition: expected text, got a number");
  EXPECT_EQ(ProfileErrorOf(Profile(R"(, "al": null)")), "al: expected an object, got null");
}

TEST(ProfileReader, NumbersAreCheckedAgainstTheirRange) {
  const auto with = [](std::string_view address) {
    return Profile(R"(, "registers": [{"address": )" + std::string(address) +
                   R"(, "length": 2, "name": "n", "source": "MKD, 4.1"}])");
  };
  EXPECT_EQ(ProfileErrorOf(with("288")), "no error");
  EXPECT_EQ(ProfileErrorOf(with("\"0x0120\"")), "no error");
  EXPECT_EQ(ProfileErrorOf(with("65536")), "registers[0].address: 65536 is outside 0 to 65535");
  EXPECT_EQ(ProfileErrorOf(with("-1")), "registers[0].address: -1 is outside 0 to 65535");
  EXPECT_THAT(ProfileErrorOf(with("\"0x\"")), StartsWith("registers[0].address: \"0x\" is not a number"));
  EXPECT_THAT(ProfileErrorOf(with("\"0x12g\"")), StartsWith("registers[0].address: \"0x12g\" is not a number"));
  EXPECT_THAT(ProfileErrorOf(with("\"120h\"")), StartsWith("registers[0].address: \"120h\" is not a number"));
  EXPECT_THAT(ProfileErrorOf(with("1e99")), StartsWith("registers[0].address: "));
  EXPECT_THAT(ProfileErrorOf(with("18446744073709551615")), StartsWith("registers[0].address: "));
  EXPECT_THAT(ProfileErrorOf(with("65535")), HasSubstr("ends inside 0x0000 to 0xFFFF"));
}

TEST(ProfileReader, MissingAndUnknownKeysAreNamed) {
  EXPECT_EQ(ProfileErrorOf("{}"), "document: \"schema\" is missing");
  EXPECT_EQ(ProfileErrorOf(Profile(R"(, "registerz": [])")), "document: unknown key \"registerz\"");
  EXPECT_EQ(ProfileErrorOf(
                Profile(R"(, "registers": [{"address": 1, "length": 1, "name": "n", "acess": "r", "source": "s"}])")),
            "registers[0]: unknown key \"acess\"");
  EXPECT_EQ(ProfileErrorOf(Profile(R"(, "registers": [{"address": 1, "length": 1, "name": "n"}])")),
            "registers[0]: \"source\" is missing");
  EXPECT_EQ(ProfileErrorOf(Profile(R"(, "registers": [{"address": 1, "length": 1, "name": "n", "source": ""}])")),
            "registers[0]: \"source\" is empty");
}

TEST(ProfileReader, AKeyThatAppearsTwiceIsNamed) {
  EXPECT_EQ(ProfileErrorOf(R"({"id": "a", "match": {}, "id": "b"})"), "key \"id\" appears twice in one object");
}

TEST(ProfileReader, WordsMustBeOnTheList) {
  EXPECT_EQ(ProfileErrorOf(
                Profile(R"(, "registers": [{"address": 1, "length": 1, "name": "n", "ecat": "ro", "source": "s"}])")),
            "registers[0].ecat: \"ro\" is none of unknown, -, r, w, rw");
  EXPECT_EQ(ProfileErrorOf(Profile(R"(, "al": {"transitions": [{"from": "SAVEOP"}]})")),
            "al.transitions[0].from: \"SAVEOP\" is none of INIT, PREOP, BOOT, SAFEOP, OP");
}

TEST(ProfileReader, AnotherSchemaIsRefused) {
  EXPECT_THAT(ProfileErrorOf(R"({"schema": "ecaudit.profile/2", "id": "x"})"), HasSubstr("\"ecaudit.profile/2\""));
}

TEST(ProfileReader, DeepNestingIsRefused) {
  EXPECT_THAT(ProfileErrorOf(std::string(100000, '[')), HasSubstr("nested deeper than 32 levels"));
}

TEST(ProfileReader, RowsThatClashAreNamed) {
  EXPECT_THAT(ProfileErrorOf(Profile(R"(, "registers": [
      {"address": "0x0120", "length": 2, "name": "a", "source": "s"},
      {"address": "0x0121", "length": 1, "name": "b", "source": "s"}])")),
              HasSubstr("registers 0x0120 and 0x0121 overlap"));
  EXPECT_THAT(ProfileErrorOf(Profile(R"(, "al": {"status_codes_complete": true, "source": "s", "transitions": [],
      "status_codes": [{"code": 17, "name": "a", "source": "s"}, {"code": 17, "name": "b", "source": "s"}]})")),
              HasSubstr("AL status code 0x0011 is listed twice"));
}

TEST(ProfileReader, WhatAProfileDoesNotSayComesFromTheOneItExtends) {
  const auto profile = ReadProfile(Profile(R"(, "extends": "kollmorgen-mkd-c", "registers": [
      {"address": "0x0134", "length": 2, "name": "mine", "ecat": "rw", "source": "X, 1"}])"));
  ASSERT_TRUE(profile) << profile.error().message;
  EXPECT_EQ(profile->extends, "kollmorgen-mkd-c");
  EXPECT_FALSE(profile->match.vendor_id);  // the identity is never inherited
  EXPECT_EQ(profile->al.status_codes.size(), 3U);
  EXPECT_EQ(profile->register_right(0x0134)->name, "mine");
  EXPECT_EQ(profile->register_right(0x0130)->name, "AL Status");
}

TEST(ProfileReader, TheHeadIsReadWithoutTheRest) {
  const auto head = ReadProfileHead(R"({"schema": "ecaudit.profile/1", "id": "x", "extends": "y", "edition": "2020-10",
      "match": {"vendor_id": 106, "source": "s"}, "al": {damaged)");
  ASSERT_TRUE(head) << head.error().message;
  EXPECT_EQ(head->id, "x");
  EXPECT_EQ(head->extends, "y");
  EXPECT_EQ(head->edition, "2020-10");
  EXPECT_EQ(head->match.vendor_id, 106U);
  // A key of the same name deeper inside does not end the reading.
  EXPECT_FALSE(ReadProfileHead(R"({"schema": "ecaudit.profile/1", "id": "x", "al": {"match": 1}, "al")"));
}

TEST(ProfileReader, ExtendingAnUnknownProfileIsAnError) {
  EXPECT_EQ(ProfileErrorOf(Profile(R"(, "extends": "acme")")), "extends: there is no profile \"acme\"");
}

TEST(ProfileReader, ReservedBitsAreFoundHoweverTheManualPrintsThem) {
  const auto profile = ReadProfile(Profile(R"(, "drive": {"source": "MKD, 4.4", "control_bits": [
      {"bit": 9, "name": "reserved", "source": "MKD, 4.4.2"},
      {"bit": 11, "name": "Reserved (0), for later use", "source": "MKD, 4.4.2"},
      {"bit": 13, "name": "Manufacturer specific", "meaning": "reserved at present", "source": "MKD, 4.4.2"}],
      "mode_bits": [{"mode": 8, "name": "csp", "bit4": "RESERVED", "bit5": "reserved_position", "bit6": "reserved, 0",
                     "source": "MKD, 4.4.2"}]})"));
  ASSERT_TRUE(profile) << profile.error().message;
  ASSERT_TRUE(profile->drive);
  ASSERT_EQ(profile->drive->control_bits.size(), 3U);
  EXPECT_EQ(profile->drive->control_bits[0].reserved, 0x0200);
  EXPECT_EQ(profile->drive->control_bits[1].reserved, 0x0800);
  EXPECT_EQ(profile->drive->control_bits[2].reserved, 0);
  ASSERT_EQ(profile->drive->mode_bits.size(), 1U);
  EXPECT_EQ(profile->drive->mode_bits[0].reserved, 0x0050);
}

TEST(ProfileReader, TextOfAProfileCannotControlTheTerminal) {
  EXPECT_EQ(ProfileErrorOf(Profile(R"(, "\u001b[2J": 1)")).find('\x1b'), std::string::npos);
}

}  // namespace
}  // namespace ecaudit::device
