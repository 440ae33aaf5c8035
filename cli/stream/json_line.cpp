#include "cli/stream/json_line.h"

#include <cmath>

#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

constexpr std::string_view kHexDigits = "0123456789abcdef";

/// Printable ASCII without what JSON escapes: nearly all text there is.
bool IsPlain(std::string_view text) {
  for (const char c : text) {
    if (c < 0x20 || c > 0x7E || c == '"' || c == '\\') return false;
  }
  return true;
}

void AppendEscaped(std::string& out, std::string_view text) {
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
}

}  // namespace

void AppendJsonString(std::string& out, std::string_view text) {
  out += '"';
  if (IsPlain(text)) {
    out += text;
  } else {
    AppendEscaped(out, Printable(text));
  }
  out += '"';
}

void AppendJsonNumber(std::string& out, double value) {
  if (!std::isfinite(value)) {
    out += "null";
    return;
  }
  char digits[40];
  out.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

void AppendSeconds(std::string& out, std::int64_t ns) {
  // Negative when the stamps of a capture go backwards.
  std::uint64_t magnitude = static_cast<std::uint64_t>(ns);
  if (ns < 0) {
    out += '-';
    magnitude = ~magnitude + 1;
  }
  AppendNumber(out, magnitude / 1'000'000'000U);
  std::uint64_t fraction = magnitude % 1'000'000'000U;
  char digits[10] = ".";
  for (int i = 9; i > 0; --i) {
    digits[i] = static_cast<char>('0' + fraction % 10U);
    fraction /= 10U;
  }
  out.append(digits, sizeof digits);
}

void JsonLine::Bytes(std::string_view key, ByteSpan bytes) {
  std::string& out = Key(key);
  out += '"';
  const std::size_t at = out.size();
  out.resize(at + 2 * bytes.size());
  char* to = out.data() + at;
  for (const std::uint8_t byte : bytes) {
    *to++ = kHexDigits[byte >> 4U];
    *to++ = kHexDigits[byte & 0x0FU];
  }
  out += '"';
}

}  // namespace ecaudit::cli
