/// Text from numbers and untrusted bytes, in the notation of the field ("0x1001", "1018h:1").
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "decoder/base/bytes.h"

namespace ecaudit {

/// "0x0130": at least `digits` hexadecimal digits, lower case, zero filled.
[[nodiscard]] std::string Hex(std::uint64_t value, int digits = 4);
/// "0011aaff": two digits a byte, no separators.
[[nodiscard]] std::string HexBytes(ByteSpan bytes);
/// Appends what HexBytes() returns.
void AppendHexBytes(std::string& out, ByteSpan bytes);
/// "01:02:03:04:05:06": six bytes of an Ethernet address.
[[nodiscard]] std::string MacText(ByteSpan mac);
/// "1C12h:1" as the manuals print an object; without ":1" when `subindex` is negative.
[[nodiscard]] std::string ObjectName(std::uint16_t index, int subindex = -1);
/// `value` with `decimals` digits after the point, for example Fixed(1.5, 3) = "1.500".
[[nodiscard]] std::string Fixed(double value, int decimals);
/// "1 234 567" is hard to grep; this is "1,234,567".
[[nodiscard]] std::string Grouped(std::uint64_t value);
/// A duration for reading: "12 ns", "3.45 us", "1.200 ms", "3.000 s".
[[nodiscard]] std::string Duration(std::int64_t ns);
/// 1 -> "1 frame", 2 -> "2 frames" (adds an s).
[[nodiscard]] std::string Count(std::uint64_t n, std::string_view noun);
/// For nouns whose plural is not made by an "s".
[[nodiscard]] std::string Count(std::uint64_t n, std::string_view noun, std::string_view plural);
/// "1 of 4 frames was", "2 of 4 frames were", "0 of 1 frame was": the beginning of a sentence about a part.
[[nodiscard]] std::string PartWas(std::uint64_t part, std::uint64_t whole, std::string_view noun);
/// "1st", "2nd", "11th".
[[nodiscard]] std::string Ordinal(std::uint64_t n);
/// Untrusted `text` as UTF-8 that can never control the reader's terminal. Valid UTF-8 stays. Bytes that belong to none
/// are Latin-1, which EEPROMs and drives use for names: 0xA0 to 0xFF become its characters. Control characters, changes
/// of direction and all other bytes become \xNN.
[[nodiscard]] std::string Printable(std::string_view text);

/// The text where it has at most `most` bytes; else its beginning, cut between UTF-8 characters, and " ...".
[[nodiscard]] std::string Shortened(std::string text, std::size_t most);

}  // namespace ecaudit
