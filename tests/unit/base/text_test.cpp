#include "decoder/base/text.h"

#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace ecaudit {
namespace {

TEST(Text, HexPadsToTheNotationOfTheField) {
  EXPECT_EQ(Hex(0x130), "0x0130");
  EXPECT_EQ(Hex(0x1D, 2), "0x1d");
  EXPECT_EQ(Hex(0x12345678), "0x12345678");
}

TEST(Text, ObjectsAreWrittenAsInTheManuals) {
  EXPECT_EQ(ObjectName(0x1C12, 1), "1C12h:1");
  EXPECT_EQ(ObjectName(0x6040), "6040h");
}

TEST(Text, DurationsPickTheirUnit) {
  EXPECT_EQ(Duration(12), "12 ns");
  EXPECT_EQ(Duration(3450), "3.45 us");
  EXPECT_EQ(Duration(-1'200'000), "-1.200 ms");
  EXPECT_EQ(Duration(3'000'000'000), "3.000 s");
}

TEST(Text, Ordinals) {
  EXPECT_EQ(Ordinal(1), "1st");
  EXPECT_EQ(Ordinal(2), "2nd");
  EXPECT_EQ(Ordinal(3), "3rd");
  EXPECT_EQ(Ordinal(4), "4th");
  EXPECT_EQ(Ordinal(11), "11th");
  EXPECT_EQ(Ordinal(112), "112th");
  EXPECT_EQ(Ordinal(1123), "1,123rd");
}

TEST(Text, CountsAreGroupedAndPlural) {
  EXPECT_EQ(Count(1, "frame"), "1 frame");
  EXPECT_EQ(Count(1234567, "frame"), "1,234,567 frames");
  EXPECT_EQ(Count(1, "entry"), "1 entry");
  EXPECT_EQ(Count(3, "entry"), "3 entries");
  EXPECT_EQ(Count(2, "day"), "2 days");
}

TEST(Text, AVerbAgreesWithItsPart) {
  EXPECT_EQ(PartWas(1, 4, "frame"), "1 of 4 frames was");
  EXPECT_EQ(PartWas(3, 1234, "frame"), "3 of 1,234 frames were");
  EXPECT_EQ(PartWas(0, 4, "frame"), "0 of 4 frames were");
  EXPECT_EQ(PartWas(0, 1, "frame"), "0 of 1 frame was");
}

TEST(Text, ControlSequencesNeverReachTheTerminal) {
  EXPECT_EQ(Printable("EL2004"), "EL2004");
  EXPECT_EQ(Printable("a\x1b[31mb\n"), "a\\x1b[31mb\\x0a");
  EXPECT_EQ(Printable("gr\xc3\xbc\xc3\x9f"), "gr\xc3\xbc\xc3\x9f");
  EXPECT_EQ(Printable("\xc2\x9b"), "\\xc2\\x9b");           // C1 control
  EXPECT_EQ(Printable("\xe2\x80\xae"), "\\xe2\\x80\\xae");  // right-to-left override
  EXPECT_EQ(Printable("\xed\xa0\x80"), "\\xed\\xa0\\x80");  // half a surrogate pair
  EXPECT_EQ(Printable("\xe2\x82"), "\\xe2\\x82");           // cut sequence
}

TEST(Text, BytesThatAreNoUtf8AreLatin1) {
  EXPECT_EQ(Printable("10\xb5s"), "10µs");
  EXPECT_EQ(Printable("Kl\xf6"
                      "ckner"),
            "Klöckner");
  EXPECT_EQ(Printable("\xa0\xff"), "\xc2\xa0\xc3\xbf");  // the first and the last of its characters
  EXPECT_EQ(Printable("K\xfchlung 20\xb0"), "Kühlung 20°");
  EXPECT_EQ(Printable("zur\xe4"), "zurä");  // begins a character of three bytes, and nothing follows
  // A name in UTF-8 stays, also beside one that is none.
  EXPECT_EQ(Printable("Klöckner 10µs, 10\xb5s"), "Klöckner 10µs, 10µs");
  // What is made printable once stays as it is.
  EXPECT_EQ(Printable(Printable("10\xb5s\x1b")), "10µs\\x1b");
}

TEST(Text, ControlBytesOfLatin1StayEscaped) {
  for (unsigned byte = 0x7F; byte < 0xA0; ++byte) {
    const std::string text{'a', static_cast<char>(byte), 'b'};
    EXPECT_EQ(Printable(text), "a\\x" + HexBytes(std::vector<std::uint8_t>{static_cast<std::uint8_t>(byte)}) + "b");
  }
  EXPECT_EQ(Printable("\xf6\x9b"
                      "2J"),
            "ö\\x9b2J");
  EXPECT_EQ(Printable("\xc0\xaf"), "À¯");  // an overlong slash is no slash
  EXPECT_EQ(Printable("\xe0\x80\xaf"), "à\\x80¯");
}

/// Whatever comes, what is shown has no control character and is valid UTF-8.
TEST(Text, PrintableIsPrintable) {
  for (unsigned first = 0; first < 256; ++first) {
    for (unsigned second = 0; second < 256; ++second) {
      const std::string text{static_cast<char>(first), static_cast<char>(second), '!'};
      const std::string shown = Printable(text);
      ASSERT_EQ(Printable(shown), shown) << first << " " << second;
      for (const char c : shown) ASSERT_FALSE(static_cast<unsigned char>(c) < 0x20 || c == 0x7F);
    }
  }
}

TEST(Text, BytesInHexadecimalOfEveryValueAndLength) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::vector<std::uint8_t> bytes;
  std::string wanted = "before ";
  for (unsigned value = 0; value < 300; ++value) {
    std::string out = "before ";
    AppendHexBytes(out, bytes);
    ASSERT_EQ(out, wanted);
    bytes.push_back(static_cast<std::uint8_t>(value * 37));
    wanted += kDigits[bytes.back() >> 4U];
    wanted += kDigits[bytes.back() & 0x0FU];
  }
}

}  // namespace
}  // namespace ecaudit
