#include "cli/stream/json_line.h"

#include <cmath>

#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

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
  const char* const end = std::to_chars(digits, digits + sizeof digits, value).ptr;
  out.append(digits, static_cast<std::size_t>(end - digits));  // by length: two iterators make it replace()
}

void AppendSeconds(std::string& out, std::int64_t ns) {
  // Negative when the stamps of a capture go backwards.
  const bool negative = ns < 0;
  const std::uint64_t magnitude = negative ? ~static_cast<std::uint64_t>(ns) + 1 : static_cast<std::uint64_t>(ns);
  char text[32] = "-";
  char* at = std::to_chars(text + (negative ? 1 : 0), text + sizeof text, magnitude / 1'000'000'000U).ptr;
  *at++ = '.';
  auto fraction = static_cast<std::uint32_t>(magnitude % 1'000'000'000U);
  for (int i = 8; i >= 0; --i) {
    at[i] = static_cast<char>('0' + fraction % 10U);
    fraction /= 10U;
  }
  out.append(text, static_cast<std::size_t>(at + 9 - text));
}

void JsonLine::Bytes(std::string_view key, ByteSpan bytes) {
  std::string& out = Key(key);
  out += '"';
  AppendHexBytes(out, bytes);
  out += '"';
}

}  // namespace ecaudit::cli
