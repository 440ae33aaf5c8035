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

TEST(ProfileCheck, GoesOnBehindEachMistake) {
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

TEST(ProfileCheck, WhatItExtendsMustBeThere) {
  EXPECT_THAT(Lines(",\n\"extends\": \"nobody\""), ElementsAre(HasSubstr("2 extends: there is no profile")));
}

}  // namespace
}  // namespace ecaudit::device
