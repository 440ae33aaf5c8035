// What is kept of a document against what the library makes of it.
#include "decoder/base/json_tree.h"

#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "decoder/base/cbor.h"
#include "decoder/base/json.h"

namespace ecaudit {
namespace {

using nlohmann::json;

/// Where they differ first; empty when they do not.
std::string Differ(JsonValue value, const json& wanted, const std::string& path) {
  switch (wanted.type()) {
    case json::value_t::null:
      return value.is_null() ? "" : path;
    case json::value_t::boolean:
      return value.boolean() == wanted.get<bool>() ? "" : path;
    case json::value_t::string:
      return value.is_text(wanted.get_ref<const std::string&>()) ? "" : path;
    case json::value_t::number_unsigned:
      return value.natural() == wanted.get<std::uint64_t>() ? "" : path;
    case json::value_t::number_integer:
      return !value.natural() && value.integer() == wanted.get<std::int64_t>() ? "" : path;
    case json::value_t::number_float:
      return !value.integer() && value.number() == wanted.get<double>() ? "" : path;
    case json::value_t::array:
      if (!value.is_array() || value.size() != wanted.size()) return path;
      for (std::size_t i = 0; i < wanted.size(); ++i) {
        std::string element = Differ(value.element(i), wanted[i], path + "[" + std::to_string(i) + "]");
        if (!element.empty()) return element;
      }
      return "";
    case json::value_t::object: {
      if (!value.is_object() || value.size() != wanted.size()) return path;
      const std::vector<JsonMember> members = value.Members();
      std::size_t number = 0;
      for (const auto& [key, held] : wanted.items()) {
        const std::string at = path + "." + key;
        if (members[number].key != key || !value.member(key).there()) return at;
        if (members[number].value.PlaceIn(value) != value.member(key).PlaceIn(value)) return at;
        ++number;
        std::string member = Differ(value.member(key), held, at);
        if (!member.empty()) return member;
      }
      return "";
    }
    default:
      return path + " is of no JSON type";
  }
}

void ExpectAsTheLibrary(const std::string& text) {
  const json wanted = json::parse(text, nullptr, false);
  const JsonReading reading = ReadJson(text);
  ASSERT_EQ(reading.document.has_value(), !wanted.is_discarded()) << text << "\n" << reading.problem;
  if (!reading.document) return;
  EXPECT_EQ(Differ(reading.document->root(), wanted, "root"), "") << text;
  const std::string cbor = CborOf(text);
  EXPECT_EQ(cbor.empty(), reading.repeated_key.has_value()) << text;
  if (cbor.empty()) return;
  const std::optional<JsonDocument> unpacked = ReadCbor(cbor);
  ASSERT_TRUE(unpacked.has_value()) << text;
  // -0 is 0 in CBOR.
  EXPECT_EQ(Differ(unpacked->root(), json::from_cbor(json::to_cbor(wanted)), "root"), "") << text;
}

constexpr std::string_view kDocument =
    " {\"a\": [1, -2, 0, 1.5e3, -0.25E-2, {}, []],\t\"text\": \"gr\xC3\xBC\xC3\x9F \xE2\x82\xAC \xF0\x9F\x98\x80 "
    "\\\"\\\\\\/\\b\\f\\n\\r\\t\",\r\n \"b\": {\"c\": true, \"d\": false, \"e\": null, \"\": \"\"}, "
    "\"big\": 18446744073709551615, \"low\": -9223372036854775808} ";

TEST(JsonTree, KeepsWhatThereIs) {
  ExpectAsTheLibrary(std::string(kDocument));
  for (const char* text : {"1", "\"x\"", "[]", "{}", " null ", "-0", "[[[[]]]]", "0.1", "1e0", "-1"}) {
    ExpectAsTheLibrary(text);
  }
}

TEST(JsonTree, WhatIsNoWholeCborIsNothing) {
  const std::string cbor = CborOf(kDocument);
  ASSERT_FALSE(cbor.empty());
  for (std::size_t length = 0; length < cbor.size(); ++length) {
    EXPECT_FALSE(ReadCbor(std::string_view(cbor).substr(0, length)).has_value()) << length;
  }
  EXPECT_FALSE(ReadCbor(cbor + '\0').has_value());
  std::string nested;
  for (unsigned i = 0; i < 1000; ++i) nested += "\x81";  // an array of one
  EXPECT_FALSE(ReadCbor(nested).has_value());
  EXPECT_TRUE(CborOf("[1").empty());
}

TEST(JsonTree, TakesAndRefusesWhatTheLibraryDoes) {
  for (const char* text : {"",
                           " ",
                           "01",
                           "-",
                           "+1",
                           ".5",
                           "1.",
                           "1e",
                           "1e+",
                           "18446744073709551616",
                           "-9223372036854775809",
                           "1e999",
                           "1e-999",
                           "5e-324",
                           "nul",
                           "nulll",
                           "tru",
                           "[1,]",
                           "[,1]",
                           "[1 2]",
                           "{\"a\"}",
                           "{\"a\":}",
                           "{\"a\":1,}",
                           "{,}",
                           "{1:2}",
                           "[}",
                           "{]",
                           "1 2",
                           "\"",
                           "\"\\",
                           "\"\\u0041\"",
                           "\"\\ud83d\\ude00\"",
                           "\"\\ud83d\"",
                           "\"\\x\"",
                           "\"\t\"",
                           "\"\xFF\"",
                           "\"\xC0\x80\"",
                           "\"\xED\xA0\x80\"",
                           "\"\xF4\x90\x80\x80\"",
                           "\"\xE2\x82\"",
                           "\xEF\xBB\xBF[]",
                           "{\"a\":1,\"a\":2}",
                           "// x\n1",
                           "[1]]"}) {
    ExpectAsTheLibrary(text);
  }
}

TEST(JsonTree, EveryChangeOfAByteIsReadAsTheLibraryDoes) {
  const std::string text(kDocument);
  for (std::size_t i = 0; i < text.size(); ++i) {
    ExpectAsTheLibrary(text.substr(0, i));
    for (const char other :
         {'"', '\\', ',', ':', '{', '}', '[', ']', '0', '9', '-', '.', 'e', 'u', ' ', '\x01', '\x80'}) {
      std::string changed = text;
      changed[i] = other;
      ExpectAsTheLibrary(changed);
    }
  }
}

TEST(JsonTree, LargeObjectsAreOrderedByKey) {
  json wanted;
  for (int i = 0; i < 500; ++i) wanted[std::to_string(i * 7919 % 500)] = i;
  std::string text = "{";
  for (int i = 499; i >= 0; --i) {
    const std::string key = std::to_string(i * 7919 % 500);
    text += (text.size() > 1 ? ",\"" : "\"") + key + "\":" + std::to_string(wanted[key].get<int>());
  }
  text += "}";
  ExpectAsTheLibrary(text);
  text.back() = ',';
  text += "\"250\": \"last\"}";
  const JsonReading reading = ReadJson(text);
  EXPECT_EQ(reading.repeated_key, "250");
  EXPECT_TRUE(reading.document->root().member("250").is_text("last"));
  EXPECT_EQ(reading.document->root().size(), 500U);
}

TEST(JsonTree, TextsLongerThanABlockAreKept) {
  const std::string longer(100'000, 'x');
  const JsonReading reading = ReadJson("[\"a\", \"" + longer + "\", \"b\"]");
  ASSERT_TRUE(reading.document);
  EXPECT_TRUE(reading.document->root().element(0).is_text("a"));
  EXPECT_TRUE(reading.document->root().element(1).is_text(longer));
  EXPECT_TRUE(reading.document->root().element(2).is_text("b"));
}

}  // namespace
}  // namespace ecaudit
