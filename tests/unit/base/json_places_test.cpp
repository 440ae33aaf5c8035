#include "decoder/base/json_places.h"

#include <string>
#include <string_view>

#include <gtest/gtest.h>

namespace ecaudit {
namespace {

constexpr std::string_view kText = R"({
  "a": {"b": [1, "two, [not a list]", {"c": null}]},
  "d": "x\"y",
  "a2": true
})";

std::string At(const JsonPlaces& places, std::string_view path, bool outer = false) {
  const JsonPlace* place = places.Find(path);
  if (place == nullptr) return "-";
  const std::size_t begin = outer ? place->outer : place->begin;
  return std::string(kText.substr(begin, place->end - begin));
}

TEST(JsonPlaces, ValuesByTheWayToThem) {
  const JsonPlaces places(kText);
  EXPECT_EQ(At(places, "a.b[0]"), "1");
  EXPECT_EQ(At(places, "a.b[1]"), R"("two, [not a list]")");
  EXPECT_EQ(At(places, "a.b[2].c"), "null");
  EXPECT_EQ(At(places, "d", true), R"("d": "x\"y")");
  EXPECT_EQ(At(places, "a2"), "true");
  EXPECT_EQ(At(places, ""), kText);
  EXPECT_EQ(places.Find("a.b[3]"), nullptr);
  EXPECT_EQ(LineOf(kText, places.Find("d")->begin), 3U);
}

TEST(JsonPlaces, RepeatedKeys) {
  const JsonPlaces places(R"({"a": 1, "b": {"a": 2}, "a": 3})");
  ASSERT_EQ(places.repeated().size(), 1U);
  EXPECT_EQ(places.repeated().front().first, "a");
  EXPECT_EQ(places.repeated().front().second.outer, 24U);
}

TEST(JsonPlaces, WhatIsNoJsonEnds) {
  for (const std::string_view text :
       {"", "{", "[", "{\"a\"", "{\"a\":", "[1,", "[,]", "{]", "\"", "\"\\", "}", "[[[["}) {
    const JsonPlaces places(text);
    EXPECT_EQ(places.Find("nowhere"), nullptr) << text;
  }
  EXPECT_EQ(JsonPlaces(std::string(100'000, '[')).Find("x"), nullptr) << "as deep as it likes";
}

}  // namespace
}  // namespace ecaudit
