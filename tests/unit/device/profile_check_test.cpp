// What the check says of small profiles; tests/cli/test_families.py plants mistakes into a large one.
#include "decoder/device/profile_check.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "decoder/device/profile_registry.h"

namespace ecaudit::device {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::string> Lines(const std::string& members) {
  std::vector<std::string> lines;
  for (const ProfileProblem& problem : CheckProfile(
           "{\"schema\": \"ecaudit.profile/1\", \"id\": \"x\", \"title\": \"t\", \"document\": \"D\"" + members + "}",
           BuiltinProfile)) {
    lines.push_back(std::to_string(problem.line) + " " + problem.place + ": " + problem.what);
  }
  return lines;
}

TEST(ProfileCheck, BuiltInProfilesHaveNoMistake) {
  for (const std::string& name : BuiltinProfileNames()) {
    EXPECT_THAT(CheckProfile(BuiltinProfileText(name), BuiltinProfile), IsEmpty()) << name;
  }
}

TEST(ProfileCheck, GoesOnAfterEachMistake) {
  EXPECT_THAT(
      Lines(",\n\"limits\": [{\"name\": 1},\n{\"name\": \"a\", \"value\": \"b\", \"source\": \"D\"},\n"
            "{\"name\": \"a\", \"value\": \"b\", \"source\": \"\"},\n{}],\n\"what\": 1"),
      ElementsAre("2 limits[0].name: expected text, got a number", HasSubstr("4 limits[2]: \"source\" is empty"),
                  "5 limits[3]: \"name\" is missing", "6 : unknown key \"what\""));
}

TEST(ProfileCheck, AnythingEnds) {
  for (const char* text : {"", "{", "[]", "1", "{\"schema\": 3}", "{\"schema\": \"ecaudit.profile/2\"}", "{}",
                           "{\"al\": 1, \"al\": 2}", "{\"schema\": \"ecaudit.profile/1\", \"id\": \"\"}"}) {
    EXPECT_THAT(CheckProfile(text, BuiltinProfile), testing::Not(IsEmpty())) << text;
  }
}

TEST(ProfileCheck, FaultObjectsFitTheRestOfTheProfile) {
  const std::string row = "{\"index\": \"0x2001\", \"sub\": 1, \"kind\": \"fault number\", \"bits\": 32, ";
  const std::string end = "\"basis\": \"printed\", \"source\": \"D\"}";
  const auto lines = [](const std::string& rows, const std::string& rest = "") {
    return Lines(", \"drive\": {\"source\": \"D\", \"fault_objects\": [\n" + rows + "]}" + rest);
  };
  EXPECT_THAT(lines(row + "\"prefix\": \"F\", " + end), IsEmpty());
  EXPECT_THAT(lines(row + end + ",\n" + row + end), ElementsAre(HasSubstr("3 drive.fault_objects[1]: this object")));
  EXPECT_THAT(lines("{\"index\": \"0x603F\", \"kind\": \"error code\", \"bits\": 16, \"prefix\": \"F\", " + end),
              ElementsAre(HasSubstr("\"prefix\" belongs to the kind")));
  EXPECT_THAT(lines("{\"index\": \"0x603F\", \"kind\": \"error code\", \"bits\": 8, " + end),
              ElementsAre(HasSubstr("\"bits\" is 8, neither 16 nor 32")));
  const std::string codes =
      ", \"emergency\": {\"source\": \"D\", \"codes\": [{\"code\": \"0x7305\", "
      "\"id\": \"F401\", \"text\": \"t\", \"source\": \"D\"}]}";
  EXPECT_THAT(lines(row + "\"prefix\": \"F\", " + end, codes), IsEmpty());
  EXPECT_THAT(lines(row + "\"prefix\": \"E\", " + end, codes), ElementsAre(HasSubstr("is \"E\" and a number")));
  const std::string dictionary =
      ", \"dictionary\": {\"source\": \"D\", \"objects\": [{\"index\": \"0x2001\", "
      "\"sub\": 1, \"type\": \"U16\", \"source\": \"D\"}]}";
  EXPECT_THAT(lines(row + end, dictionary), ElementsAre(HasSubstr("\"bits\" is 32, but the dictionary has UINT16")));
}

TEST(ProfileCheck, LatchWordsHaveNoUsualObject) {
  EXPECT_THAT(Lines(",\n\"latch\": {\"source\": \"D\"}"),
              ElementsAre(HasSubstr("2 latch: \"control_object\" is missing")));
  EXPECT_THAT(Lines(",\n\"latch\": {\"source\": \"D\", \"control_object\": 8356, \"status_object\": 8357}"), IsEmpty());
}

TEST(ProfileCheck, WhatItExtendsMustBeThere) {
  EXPECT_THAT(Lines(",\n\"extends\": \"nobody\""), ElementsAre(HasSubstr("2 extends: there is no profile")));
}

}  // namespace
}  // namespace ecaudit::device
