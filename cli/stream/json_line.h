/// One JSON object on one line, appended to a string. Fast enough for millions of lines; nothing is allocated but room
/// in the string.
#pragma once

#include <charconv>
#include <concepts>
#include <cstdint>
#include <string>
#include <string_view>

#include "decoder/base/bytes.h"

namespace ecaudit::cli {

/// `text` between quotation marks, escaped; untrusted bytes are written as Printable() does, so that the line is always
/// valid JSON.
void AppendJsonString(std::string& out, std::string_view text);
/// Shortest decimal number that reads back as `value`; null for infinities and NaN.
void AppendJsonNumber(std::string& out, double value);
/// `ns` nanoseconds as seconds with nine decimals: "12.000000345".
void AppendSeconds(std::string& out, std::int64_t ns);
/// Decimal digits.
template <std::integral T>
void AppendNumber(std::string& out, T value) {
  char digits[24];
  const char* const end = std::to_chars(digits, digits + sizeof digits, value).ptr;
  out.append(digits, static_cast<std::size_t>(end - digits));  // by length: two iterators make it replace()
}

class JsonLine {
 public:
  /// Opens the object at the end of `out`, which must outlive this.
  explicit JsonLine(std::string& out) : out_(out) { out_ += '{'; }
  /// Ends the object; nothing may follow.
  void Close() { out_ += '}'; }

  /// The key, to which the caller appends a value. `key` needs no escaping.
  std::string& Key(std::string_view key) {
    out_ += first_ ? "\"" : ",\"";
    first_ = false;
    out_ += key;
    out_ += "\":";
    return out_;
  }
  template <std::integral T>
  void Number(std::string_view key, T value) {
    AppendNumber(Key(key), value);
  }
  void Bool(std::string_view key, bool value) { Key(key) += value ? "true" : "false"; }
  void Null(std::string_view key) { Key(key) += "null"; }
  void Text(std::string_view key, std::string_view text) { AppendJsonString(Key(key), text); }
  /// Two digits a byte.
  void Bytes(std::string_view key, ByteSpan bytes);

 private:
  std::string& out_;
  bool first_ = true;
};

}  // namespace ecaudit::cli
