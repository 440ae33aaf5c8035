#include "decoder/base/text.h"

#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>

namespace ecaudit {
namespace {

constexpr std::string_view kDigits = "0123456789abcdef";

/// "000102...ff": both digits of a byte at once.
constexpr std::array<char, 512> kBytePairs = [] {
  std::array<char, 512> pairs{};
  for (std::size_t byte = 0; byte < 256; ++byte) {
    pairs[2 * byte] = kDigits[byte >> 4U];
    pairs[2 * byte + 1] = kDigits[byte & 0xFU];
  }
  return pairs;
}();

/// The eight digits of four bytes, the first one lowest.
constexpr std::uint64_t DigitsOf(std::uint32_t bytes) {
  std::uint64_t apart = bytes;  // a byte in 16 bits
  apart = (apart | apart << 16U) & 0x0000'FFFF'0000'FFFF;
  apart = (apart | apart << 8U) & 0x00FF'00FF'00FF'00FF;
  const std::uint64_t nibbles = (apart >> 4U & 0x000F'000F'000F'000F) | (apart & 0x000F'000F'000F'000F) << 8U;
  const std::uint64_t letters = (nibbles + 0x0606'0606'0606'0606) >> 4U & 0x0101'0101'0101'0101;
  return nibbles + 0x3030'3030'3030'3030 + letters * ('a' - '0' - 10);
}
static_assert(DigitsOf(0xF09A'BC01) == 0x3066'6139'6362'3130);  // "01bc9af0"

#if __has_builtin(__builtin_shufflevector)
#define ECAUDIT_HEX_BY_BLOCK 1
/// Bytes of which processors work on all at once.
using Block [[gnu::vector_size(16)]] = std::uint8_t;

/// The digits of 16 bytes, in the order of the bytes. Both halves of each at once: data are most of what `decode`
/// writes.
void PutDigits(char* to, const std::uint8_t* from) {
  Block bytes;
  std::memcpy(&bytes, from, sizeof bytes);
  const auto digits = [](Block nibbles) {
    const Block letters = reinterpret_cast<Block>(nibbles > 9);
    return nibbles + static_cast<std::uint8_t>('0') + (letters & static_cast<std::uint8_t>('a' - '0' - 10));
  };
  const Block high = digits(bytes >> 4), low = digits(bytes & 0xF);
  const Block first = __builtin_shufflevector(high, low, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
  const Block second = __builtin_shufflevector(high, low, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
  std::memcpy(to, &first, sizeof first);
  std::memcpy(to + sizeof first, &second, sizeof second);
}
#endif

void AppendByte(std::string& out, std::uint8_t byte) {
  out += kDigits[byte >> 4];
  out += kDigits[byte & 0xF];
}

/// What a text begins with.
struct Character {
  enum class Kind : std::uint8_t {
    kText,
    kForbidden,  ///< UTF-8 in form, but a control character, a change of direction, half a pair, or cut by the end
    kStray,      ///< a byte that begins no UTF-8
  };
  Kind kind = Kind::kStray;
  std::size_t length = 1;
};

/// Lead bytes of UTF-8 and what may follow: RFC 3629, without overlong forms and values past U+10FFFF.
std::size_t WantedLength(unsigned first, unsigned second) {
  if (first >= 0xC2 && first < 0xE0) return 2;
  if (first >= 0xE0 && first < 0xF0) return first == 0xE0 && second < 0xA0 ? 0 : 3;
  if (first >= 0xF0 && first < 0xF5) {
    return (first == 0xF0 && second < 0x90) || (first == 0xF4 && second >= 0x90) ? 0 : 4;
  }
  return 0;
}

/// Code points that move the reader's cursor or turn the text around.
bool IsForbidden(std::string_view character) {
  const auto at = [&](std::size_t i) { return static_cast<std::uint8_t>(character[i]); };
  if (character.size() == 2) return at(0) == 0xC2 && at(1) < 0xA0;  // U+0080-U+009F are control characters
  if (character.size() != 3) return false;
  if (at(0) == 0xED) return at(1) >= 0xA0;  // surrogate
  if (at(0) != 0xE2) return false;
  return (at(1) == 0x80 && at(2) >= 0xAA && at(2) <= 0xAE) ||  // direction overrides
         (at(1) == 0x81 && at(2) >= 0xA6 && at(2) <= 0xA9);    // direction isolates
}

Character FirstOf(std::string_view text) {
  using Kind = Character::Kind;
  const auto at = [&](std::size_t i) { return i < text.size() ? static_cast<std::uint8_t>(text[i]) : 0U; };
  if (at(0) < 0x80) return {at(0) >= 0x20 && at(0) < 0x7F ? Kind::kText : Kind::kForbidden, 1};
  const std::size_t wanted = WantedLength(at(0), at(1));
  std::size_t length = 1;
  while (length < wanted && (at(length) & 0xC0U) == 0x80U) ++length;
  if (wanted == 0 || (length < wanted && (length == 1 || length < text.size()))) return {Kind::kStray, 1};
  if (length < wanted || IsForbidden(text.substr(0, length))) return {Kind::kForbidden, length};
  return {Kind::kText, length};
}

/// The character of ISO 8859-1, as UTF-8.
void AppendLatin1(std::string& out, std::uint8_t byte) {
  out += static_cast<char>(0xC0U | byte >> 6U);
  out += static_cast<char>(0x80U | (byte & 0x3FU));
}

}  // namespace

std::string Hex(std::uint64_t value, int digits) {
  std::array<char, 16> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, 16).ptr;
  const auto length = static_cast<int>(end - buffer.data());
  std::string out = "0x";
  for (int i = length; i < digits; ++i) out += '0';
  out.append(buffer.data(), end);
  return out;
}

void AppendHexBytes(std::string& out, ByteSpan bytes) {
  const std::size_t at = out.size();
  out.resize(at + 2 * bytes.size());
  char* to = out.data() + at;
  const std::uint8_t* from = bytes.data();
  const std::uint8_t* const end = from + bytes.size();
#ifdef ECAUDIT_HEX_BY_BLOCK
  for (; end - from >= 16; from += 16, to += 32) PutDigits(to, from);
#endif
  if constexpr (std::endian::native == std::endian::little) {
    for (; end - from >= 4; from += 4, to += 8) {
      const std::uint64_t digits = DigitsOf(LoadLittleEndian<std::uint32_t>(from));
      std::memcpy(to, &digits, sizeof digits);
    }
  }
  for (; from != end; ++from, to += 2) std::memcpy(to, kBytePairs.data() + 2 * std::size_t{*from}, 2);
}

std::string HexBytes(ByteSpan bytes) {
  std::string out;
  out.reserve(bytes.size() * 2);
  AppendHexBytes(out, bytes);
  return out;
}

std::string MacText(ByteSpan mac) {
  std::string text;
  for (const std::uint8_t byte : mac) {
    if (!text.empty()) text += ':';
    AppendHexBytes(text, ByteSpan(&byte, 1));
  }
  return text;
}

std::string ObjectName(std::uint16_t index, int subindex) {
  constexpr std::string_view kUpper = "0123456789ABCDEF";
  std::string out;
  for (int shift = 12; shift >= 0; shift -= 4) out += kUpper[(index >> shift) & 0xF];
  out += 'h';
  if (subindex >= 0) out += ':' + std::to_string(subindex);
  return out;
}

std::string Fixed(double value, int decimals) {
  std::array<char, 400> buffer{};
  const auto result =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, std::chars_format::fixed, decimals);
  return result.ec == std::errc() ? std::string(buffer.data(), result.ptr) : std::string("?");
}

std::string Grouped(std::uint64_t value) {
  std::string digits = std::to_string(value);
  for (std::ptrdiff_t i = static_cast<std::ptrdiff_t>(digits.size()) - 3; i > 0; i -= 3) {
    digits.insert(static_cast<std::size_t>(i), ",");
  }
  return digits;
}

std::string Duration(std::int64_t ns) {
  const double magnitude = std::abs(static_cast<double>(ns));
  if (magnitude < 1e3) return std::to_string(ns) + " ns";
  if (magnitude < 1e6) return Fixed(static_cast<double>(ns) / 1e3, 2) + " us";
  if (magnitude < 1e9) return Fixed(static_cast<double>(ns) / 1e6, 3) + " ms";
  return Fixed(static_cast<double>(ns) / 1e9, 3) + " s";
}

std::string Ordinal(std::uint64_t n) {
  const std::uint64_t last = n / 10 % 10 == 1 ? 0 : n % 10;
  const char* ending = last == 1 ? "st" : last == 2 ? "nd" : last == 3 ? "rd" : "th";
  return Grouped(n) + ending;
}

std::string Count(std::uint64_t n, std::string_view noun, std::string_view plural) {
  return Grouped(n) + " " + std::string(n == 1 ? noun : plural);
}

std::string Count(std::uint64_t n, std::string_view noun) {
  std::string out = Grouped(n);
  out += ' ';
  out += noun;
  if (n == 1) return out;
  const bool ies = noun.size() > 1 && noun.back() == 'y' &&
                   std::string_view("aeou").find(noun[noun.size() - 2]) == std::string_view::npos;
  if (ies) out.back() = 'i';
  out += ies ? "es" : "s";
  return out;
}

std::string PartWas(std::uint64_t part, std::uint64_t whole, std::string_view noun) {
  return Grouped(part) + " of " + Count(whole, noun) + (part == 1 || whole == 1 ? " was" : " were");
}

std::string Printable(std::string_view text) {
  constexpr std::uint8_t kFirstLatin1 = 0xA0;
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const Character first = FirstOf(text);
    for (std::size_t i = 0; i < first.length; ++i) {
      const auto byte = static_cast<std::uint8_t>(text[i]);
      if (first.kind == Character::Kind::kText) {
        out += text[i];
      } else if (first.kind == Character::Kind::kStray && byte >= kFirstLatin1) {
        AppendLatin1(out, byte);
      } else {
        out += "\\x";
        AppendByte(out, byte);
      }
    }
    text.remove_prefix(first.length);
  }
  return out;
}

std::string Shortened(std::string text, std::size_t most) {
  if (text.size() <= most) return text;
  std::size_t end = most;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  text.resize(end);
  return text + " ...";
}

}  // namespace ecaudit
