/// Text of bounded length, put together piece by piece before it joins a long one: no piece checks the room left.
#pragma once

#include <array>
#include <charconv>
#include <concepts>
#include <cstddef>
#include <cstring>
#include <string>
#include <string_view>

namespace ecaudit::cli {

/// @tparam kRoom  at least what all pieces can come to
template <std::size_t kRoom>
class ShortText {
 public:
  /// A literal: its length is known when this is compiled.
  template <std::size_t kSize>
  void Put(const char (&text)[kSize]) {
    std::memcpy(at_, text, kSize - 1);
    at_ += kSize - 1;
  }
  void Put(std::string_view text) {
    std::memcpy(at_, text.data(), text.size());
    at_ += text.size();
  }
  void Put(char c) { *at_++ = c; }
  /// Decimal digits.
  template <std::unsigned_integral T>
  void Number(T value) {
    if (value < 10) {
      *at_++ = static_cast<char>('0' + value);
    } else {
      at_ = std::to_chars(at_, text_.data() + kRoom, value).ptr;
    }
  }
  void Bool(bool value) {
    if (value) {
      Put("true");
    } else {
      Put("false");
    }
  }
  void AppendTo(std::string& out) const { out.append(text_.data(), static_cast<std::size_t>(at_ - text_.data())); }

 private:
  std::array<char, kRoom> text_;
  char* at_ = text_.data();
};

}  // namespace ecaudit::cli
