#include "decoder/base/json.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace ecaudit {
namespace {

using nlohmann::json;

JsonDocument Parsed(std::string_view text) {
  JsonReading reading = ReadJson(text);
  EXPECT_TRUE(reading.document) << reading.problem;
  return reading.document ? *reading.document : JsonDocument(nullptr);
}

TEST(Json, EveryKindOfValue) {
  const JsonDocument document = Parsed(
      R"({"null": null, "flag": true, "natural": 18446744073709551615, "integer": -3, "number": 0.5, "text": "x",
          "list": [1, 2], "object": {"b": 1, "a": 2}})");
  const JsonValue root = document.root();
  EXPECT_TRUE(root.is_object());
  EXPECT_EQ(root.size(), 8U);
  EXPECT_TRUE(root.member("null").is_null());
  EXPECT_EQ(root.member("flag").boolean(), true);
  EXPECT_EQ(root.member("natural").natural(), std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(root.member("natural").integer(), std::nullopt);
  EXPECT_EQ(root.member("integer").integer(), -3);
  EXPECT_EQ(root.member("integer").natural(), std::nullopt);
  EXPECT_EQ(root.member("integer").number(), -3.0);
  EXPECT_EQ(root.member("number").number(), 0.5);
  EXPECT_EQ(root.member("number").integer(), std::nullopt);
  EXPECT_TRUE(root.member("text").is_text("x"));
  EXPECT_FALSE(root.member("text").is_text("y"));
  EXPECT_EQ(root.member("list").size(), 2U);
  EXPECT_EQ(root.member("list").element(1).natural(), 2U);
  EXPECT_FALSE(root.member("list").element(2).there());
  EXPECT_EQ(root.member("list").Elements().size(), 2U);
  const std::vector<JsonMember> members = root.member("object").Members();
  ASSERT_EQ(members.size(), 2U);
  EXPECT_EQ(members[0].key, "a");
  EXPECT_EQ(members[1].value.natural(), 1U);
}

TEST(Json, WhatIsNotThereGivesNothing) {
  const JsonDocument document = Parsed("[]");
  for (const JsonValue value : {JsonValue(), document.root().member("x"), document.root().element(0)}) {
    EXPECT_EQ(value.kind(), JsonValue::Kind::kMissing);
    EXPECT_FALSE(value.there() || value.is_null() || value.is_text() || value.is_array());
    EXPECT_FALSE(value.boolean() || value.natural() || value.integer() || value.number());
    EXPECT_EQ(value.size(), 0U);
    EXPECT_TRUE(value.Elements().empty() && value.Members().empty());
    EXPECT_FALSE(value.member("y").there());
  }
}

TEST(Json, ReportsWhereATextStopsBeingJson) {
  const JsonReading reading = ReadJson("{\n  \"a\": 1,\n  ?\n}");
  EXPECT_FALSE(reading.document);
  EXPECT_EQ(reading.position, 15U);
  EXPECT_TRUE(reading.problem.starts_with("parse error at line 3, column 3")) << reading.problem;
  for (const char* text : {"", "{", "[1,]", "nul", "1 2", "\"\xff\""}) EXPECT_FALSE(ReadJson(text).document) << text;
}

TEST(Json, RepeatedKeysAreReported) {
  const JsonReading reading = ReadJson(R"({"a": 1, "b": {"c": 1, "d": 2, "c": [3], "d": 4}})");
  EXPECT_EQ(reading.repeated_key, "c");
  ASSERT_TRUE(reading.document);
  EXPECT_EQ(reading.document->root().member("b").member("c").element(0).natural(), 3U);
  EXPECT_EQ(ReadJson(R"({"a": {"a": 1}})").repeated_key, std::nullopt);
}

TEST(Json, NestsOnlySoDeep) {
  EXPECT_TRUE(ReadJson("[[1]]", 2).document);
  const JsonReading reading = ReadJson("[[[1]]]", 2);
  EXPECT_FALSE(reading.document);
  EXPECT_EQ(reading.problem, "nested deeper than 2 levels");
  const std::string deep(20000, '[');
  EXPECT_FALSE(ReadJson(deep).document);
  EXPECT_TRUE(ReadJson(deep + std::string(deep.size(), ']')).document);
}

TEST(Json, ReadingStopsAfterAKey) {
  const JsonReading reading = ReadJson(R"({"a": {"stop": 1}, "stop": [2], "b": ?)", kAnyJsonDepth, "stop");
  ASSERT_TRUE(reading.document) << reading.problem;
  EXPECT_EQ(reading.document->root().size(), 2U);
  EXPECT_EQ(reading.document->root().member("stop").element(0).natural(), 2U);
}

/// Writes down what it hears.
class Notes : public JsonListener {
 public:
  void Null() override { text += "null "; }
  void Boolean(bool value) override { text += value ? "true " : "false "; }
  void Natural(std::uint64_t value) override { text += std::to_string(value) + " "; }
  void Integer(std::int64_t value) override { text += std::to_string(value) + " "; }
  void Number(double value) override { text += std::to_string(value) + " "; }
  void Text(std::string_view value) override { text += "'" + std::string(value) + "' "; }
  void Key(std::string_view key) override { text += std::string(key) + "="; }
  void BeginObject() override { text += "{ "; }
  void EndObject() override { text += "} "; }
  void BeginArray() override { text += "[ "; }
  void EndArray() override { text += "] "; }
  std::string text;
};

TEST(Json, IsStreamedInTheOrderOfTheText) {
  Notes notes;
  EXPECT_TRUE(StreamJson(R"({"b": [1, -2, 0.5, true, null], "a": {"c": "x"}})", notes));
  EXPECT_EQ(notes.text, "{ b=[ 1 -2 0.500000 true null ] a={ c='x' } } ");
  EXPECT_FALSE(StreamJson("{", notes));
}

TEST(Json, TextIsWrittenAsTheLibraryDoes) {
  std::string all;
  for (int byte = 0; byte < 256; ++byte) all += static_cast<char>(byte);
  for (const std::string& text : {std::string(), std::string("plain"), std::string("a\"b\\c\n"), std::string("\x7F"),
                                  std::string("gr\xC3\xBC\xC3\x9F"), all}) {
    std::string out;
    AppendJson(out, std::string_view(text));
    EXPECT_EQ(out, json(text).dump(-1, ' ', false, json::error_handler_t::replace));
  }
}

TEST(Json, NumbersReadBack) {
  const auto written = [](double value) {
    std::string out;
    AppendJson(out, value);
    return out;
  };
  EXPECT_EQ(written(0), "0.0");
  EXPECT_EQ(written(0.1), "0.1");
  EXPECT_EQ(written(-1e300), "-1e+300");
  EXPECT_EQ(written(std::nan("")), "null");
  EXPECT_EQ(written(std::numeric_limits<double>::infinity()), "null");
}

}  // namespace
}  // namespace ecaudit
