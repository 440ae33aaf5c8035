#include "cli/report/json_text.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace ecaudit::report {
namespace {

using Json = nlohmann::ordered_json;

struct Row {
  int number;
  std::string name;
};

void PutRow(JsonObject& out, const Row& row) {
  out.Put("number", row.number);
  out.TextOrNull("name", row.name);
}

/// Something of everything.
void Fill(JsonObject& out) {
  out.Put("natural", std::numeric_limits<std::uint64_t>::max());
  out.Put("integer", std::numeric_limits<std::int64_t>::min());
  out.Put("byte", std::uint8_t{65});
  out.Put("number", 1.0);
  out.Put("small", 1e-9);
  out.Put("flag", true);
  out.Put("null", nullptr);
  out.Put("literal", "a \"quoted\" word");
  out.Put("no bytes of UTF-8", std::string("\xff"));
  out.Put("unknown", std::optional<std::uint16_t>());
  out.Put("known", std::optional<std::uint16_t>(7));
  out.Put("no meaning", OnlyIf(false, 7));
  out.Text("lines", "a\nb\x01");
  out.TextOrNull("nothing", "");
  out.Frame("frame", FrameRef{12, 0, false});
  out.Frame("no frame", 0);
  out.Object("empty object", [](JsonObject&) {});
  out.Array("empty array", [](JsonArray&) {});
  out.Values("values", std::vector<std::uint8_t>{1, 2});
  out.Values("bools", std::vector<bool>{true, false});
  out.Texts("texts", std::vector<std::string>{"x", "y"});
  out.List("rows", std::vector<Row>{{1, "one"}, {2, ""}}, PutRow);
  out.ObjectOrNull("row", std::optional(Row{3, ""}), PutRow);
  out.ObjectOrNull("no row", std::optional<Row>(), PutRow);
  out.Array("nested", [](JsonArray& array) {
    array.Add(1);
    array.AddArray([](JsonArray& inner) { inner.Add("x"); });
    array.AddArray([](JsonArray&) {});
    array.AddObject([](JsonObject& object) { object.Put("a", 1); });
    array.AddDocument(R"({"z": [1, {"y": -2.5}, [], {}], "b": "t"})");
  });
  out.Put("key with \"quotes\"", 0);
}

Json Expected() {
  Json json;
  json["natural"] = std::numeric_limits<std::uint64_t>::max();
  json["integer"] = std::numeric_limits<std::int64_t>::min();
  json["byte"] = 65;
  json["number"] = 1.0;
  json["small"] = 1e-9;
  json["flag"] = true;
  json["null"] = nullptr;
  json["literal"] = "a \"quoted\" word";
  json["no bytes of UTF-8"] = "\xff";
  json["unknown"] = nullptr;
  json["known"] = 7;
  json["no meaning"] = nullptr;
  json["lines"] = "a\nb\\x01";
  json["nothing"] = nullptr;
  json["frame"] = 12;
  json["no frame"] = nullptr;
  json["empty object"] = Json::object();
  json["empty array"] = Json::array();
  json["values"] = {1, 2};
  json["bools"] = {true, false};
  json["texts"] = {"x", "y"};
  json["rows"] = Json::parse(R"([{"number": 1, "name": "one"}, {"number": 2, "name": null}])");
  json["row"] = Json::parse(R"({"number": 3, "name": null})");
  json["no row"] = nullptr;
  json["nested"] = Json::parse(R"([1, ["x"], [], {"a": 1}, {"z": [1, {"y": -2.5}, [], {}], "b": "t"}])");
  json["key with \"quotes\""] = 0;
  return json;
}

TEST(JsonText, IndentedAsTheLibraryDoes) {
  EXPECT_EQ(JsonDocumentText(Fill), Expected().dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

TEST(JsonText, OnOneLineAsTheLibraryDoes) {
  JsonText text(JsonText::Layout::kLine);
  text.Object(Fill);
  EXPECT_EQ(text.Take(), Expected().dump(-1, ' ', false, Json::error_handler_t::replace));
}

TEST(JsonText, PiecesAreTheWholeDocument) {
  const auto fill = [](JsonObject& out) {
    out.List("slaves", std::vector<Row>(50'000, Row{7, "seven"}), [](JsonObject& json, const Row& row) {
      json.Object("deep",
                  [&](JsonObject& deep) { deep.Object("deeper", [&](JsonObject& most) { PutRow(most, row); }); });
    });
  };
  std::string joined;
  std::size_t largest = 0;
  WriteJsonDocument(
      [&](std::string_view piece) {
        joined += piece;
        largest = std::max(largest, piece.size());
      },
      fill);
  EXPECT_EQ(joined, JsonDocumentText(fill));
  EXPECT_LT(largest, joined.size() / 10);
}

TEST(JsonText, ADocumentOfNothing) {
  EXPECT_EQ(JsonDocumentText([](JsonObject&) {}), "{}\n");
  JsonText text(JsonText::Layout::kIndented);
  text.Array([](JsonArray&) {});
  EXPECT_EQ(text.Take(), "[]");
}

}  // namespace
}  // namespace ecaudit::report
