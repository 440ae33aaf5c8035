#include "cli/stream/json_line.h"

#include <array>
#include <cstdint>
#include <limits>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace ecaudit::cli {
namespace {

std::string Seconds(std::int64_t ns) {
  std::string out;
  AppendSeconds(out, ns);
  return out;
}

TEST(JsonLine, AnObjectWithEveryKindOfValue) {
  std::string out = "before ";
  JsonLine line(out);
  line.Number("a", 12U);
  line.Number("b", std::int64_t{-3});
  line.Bool("c", true);
  line.Bool("d", false);
  line.Null("e");
  line.Text("f", "x");
  constexpr std::array<std::uint8_t, 3> kBytes{0x00, 0xA5, 0xFF};
  line.Bytes("g", kBytes);
  line.Bytes("h", {});
  line.Close();
  EXPECT_EQ(out, R"(before {"a":12,"b":-3,"c":true,"d":false,"e":null,"f":"x","g":"00a5ff","h":""})");
}

TEST(JsonLine, NoKeys) {
  std::string out;
  JsonLine(out).Close();
  EXPECT_EQ(out, "{}");
}

TEST(JsonLine, AnyBytesStayOneValidString) {
  std::string untrusted;
  for (int byte = 0; byte < 256; ++byte) untrusted += static_cast<char>(byte);
  std::string out;
  AppendJsonString(out, untrusted);
  EXPECT_EQ(out.find('\n'), std::string::npos);
  const nlohmann::json parsed = nlohmann::json::parse(out, nullptr, false);
  ASSERT_TRUE(parsed.is_string());
  const std::string text = parsed;
  EXPECT_NE(text.find("\\x00"), std::string::npos);
  EXPECT_NE(text.find("\\x80"), std::string::npos);
  EXPECT_NE(text.find("\xC3\xBF"), std::string::npos);  // 0xFF in Latin-1
  EXPECT_NE(text.find("!\"#"), std::string::npos);
}

TEST(JsonLine, QuotesBackslashesAndUtf8) {
  std::string out;
  AppendJsonString(out, "a \"b\" \\ \xC3\xA4");
  EXPECT_EQ(out, "\"a \\\"b\\\" \\\\ \xC3\xA4\"");
}

TEST(JsonLine, SecondsHaveNineDecimals) {
  EXPECT_EQ(Seconds(0), "0.000000000");
  EXPECT_EQ(Seconds(12'000'000'345), "12.000000345");
  EXPECT_EQ(Seconds(-1), "-0.000000001");
  EXPECT_EQ(Seconds(std::numeric_limits<std::int64_t>::min()), "-9223372036.854775808");
  EXPECT_EQ(Seconds(std::numeric_limits<std::int64_t>::max()), "9223372036.854775807");
}

TEST(JsonLine, NumbersThatJsonLacks) {
  std::string out;
  AppendJsonNumber(out, std::numeric_limits<double>::infinity());
  out += ' ';
  AppendJsonNumber(out, std::numeric_limits<double>::quiet_NaN());
  out += ' ';
  AppendJsonNumber(out, 0.1);
  EXPECT_EQ(out, "null null 0.1");
}

}  // namespace
}  // namespace ecaudit::cli
