#include <array>
#include <charconv>
#include <string>

#include "decoder/base/json_tree.h"

namespace ecaudit {
namespace {

/// Bytes that a text may hold as they are: all but quotation marks, backslashes, control characters, and what is not
/// ASCII.
constexpr std::array<bool, 256> kPlain = [] {
  std::array<bool, 256> plain{};
  for (unsigned c = 0x20; c < 0x80; ++c) plain[c] = c != '"' && c != '\\';
  return plain;
}();

/// Length of the well-formed UTF-8 sequence of several bytes at `at`; 0 when there is none.
std::size_t LongSequence(const char* at, const char* end) {
  const auto byte = [&](std::size_t i) {
    return i < static_cast<std::size_t>(end - at) ? static_cast<unsigned char>(at[i]) : 0U;
  };
  const auto within = [&](std::size_t i, unsigned low, unsigned high) { return byte(i) >= low && byte(i) <= high; };
  const unsigned first = byte(0);
  if (first >= 0xC2 && first <= 0xDF) return within(1, 0x80, 0xBF) ? 2 : 0;
  if (first >= 0xE0 && first <= 0xEF) {
    const bool second = within(1, first == 0xE0 ? 0xA0 : 0x80, first == 0xED ? 0x9F : 0xBF);
    return second && within(2, 0x80, 0xBF) ? 3 : 0;
  }
  if (first >= 0xF0 && first <= 0xF4) {
    const bool second = within(1, first == 0xF0 ? 0x90 : 0x80, first == 0xF4 ? 0x8F : 0xBF);
    return second && within(2, 0x80, 0xBF) && within(3, 0x80, 0xBF) ? 4 : 0;
  }
  return 0;
}

class Scanner {
 public:
  Scanner(std::string_view text, std::size_t max_depth, std::string_view stop_after, JsonTree& tree)
      : at_(text.data()), end_(at_ + text.size()), max_depth_(max_depth), stop_after_(stop_after), tree_(tree) {}

  bool Document() {
    for (;;) {
      if (!Value()) return false;
      if (opened_) continue;
      if (!Behind()) return false;
      if (complete_) return true;
    }
  }

 private:
  void Space() {
    while (at_ != end_ && (*at_ == ' ' || *at_ == '\n' || *at_ == '\r' || *at_ == '\t')) ++at_;
  }
  [[nodiscard]] bool Take(char c) {
    if (at_ == end_ || *at_ != c) return false;
    ++at_;
    return true;
  }
  [[nodiscard]] bool Literal(std::string_view word) {
    if (static_cast<std::size_t>(end_ - at_) < word.size() || std::string_view(at_, word.size()) != word) return false;
    at_ += word.size();
    return true;
  }

  /// A value, or the beginning of one with children (`opened_`).
  bool Value() {
    opened_ = false;
    Space();
    if (at_ == end_) return false;
    switch (*at_) {
      case '{':
        return Begin(JsonType::kObject, '}') && (!opened_ || Key());
      case '[':
        return Begin(JsonType::kArray, ']');
      case '"': {
        std::string_view text;
        if (!Text(text)) return false;
        tree_.Text(text);
        return true;
      }
      case 't':
        if (!Literal("true")) return false;
        tree_.Boolean(true);
        return true;
      case 'f':
        if (!Literal("false")) return false;
        tree_.Boolean(false);
        return true;
      case 'n':
        if (!Literal("null")) return false;
        tree_.Null();
        return true;
      default:
        return Number();
    }
  }

  bool Begin(JsonType type, char close) {
    if (tree_.depth() >= max_depth_) return false;
    ++at_;
    tree_.Begin(type);
    Space();
    opened_ = !Take(close);
    if (!opened_) tree_.End();
    return true;
  }

  /// After a complete value: ends what ends here, up to the next value or the end of the document.
  bool Behind() {
    for (;;) {
      if (tree_.depth() == 1 && stop_here_) {
        tree_.End();
        return complete_ = true;
      }
      Space();
      if (tree_.depth() == 0) {
        complete_ = at_ == end_;
        return complete_;
      }
      const bool object = tree_.in_object();
      if (Take(',')) {
        Space();
        return !object || Key();
      }
      if (!Take(object ? '}' : ']')) return false;
      tree_.End();
    }
  }

  bool Key() {
    std::string_view key;
    if (!Text(key)) return false;
    tree_.Key(key);
    if (tree_.depth() == 1) stop_here_ = !stop_after_.empty() && key == stop_after_;
    Space();
    return Take(':');
  }

  /// @param out  lies in the document, or in `unescaped_` until the next one
  bool Text(std::string_view& out) {
    if (!Take('"')) return false;
    const char* const begin = at_;
    const char* const escape = Run();
    if (at_ == end_) return false;
    if (escape == nullptr) {
      out = {begin, static_cast<std::size_t>(at_ - begin)};
      return Take('"');
    }
    return Escaped(begin, out);
  }

  /// Goes up to a quotation mark, which it leaves, or to a backslash, which it returns. At the end of the document when
  /// neither comes, or something that does not belong into a text.
  const char* Run() {
    for (;;) {
      while (at_ != end_ && kPlain[static_cast<unsigned char>(*at_)]) ++at_;
      if (at_ == end_ || *at_ == '"') return nullptr;
      if (*at_ == '\\') return at_;
      const std::size_t length = LongSequence(at_, end_);
      if (length == 0) {
        at_ = end_;
        return nullptr;
      }
      at_ += length;
    }
  }

  bool Escaped(const char* begin, std::string_view& out) {
    unescaped_.assign(begin, at_);
    for (;;) {
      if (end_ - at_ < 2) return false;
      switch (at_[1]) {
        case '"':
        case '\\':
        case '/':
          unescaped_ += at_[1];
          break;
        case 'b':
          unescaped_ += '\b';
          break;
        case 'f':
          unescaped_ += '\f';
          break;
        case 'n':
          unescaped_ += '\n';
          break;
        case 'r':
          unescaped_ += '\r';
          break;
        case 't':
          unescaped_ += '\t';
          break;
        default:
          return false;  // \u among others
      }
      at_ += 2;
      const char* const more = at_;
      const char* const escape = Run();
      if (at_ == end_) return false;
      unescaped_.append(more, at_);
      if (escape != nullptr) continue;
      out = unescaped_;
      return Take('"');
    }
  }

  bool Digits() {
    const char* const begin = at_;
    while (at_ != end_ && *at_ >= '0' && *at_ <= '9') ++at_;
    return at_ != begin;
  }

  bool Number() {
    const char* const begin = at_;
    const bool negative = Take('-');
    if (!Take('0') && !Digits()) return false;
    bool whole = true;
    if (Take('.')) {
      whole = false;
      if (!Digits()) return false;
    }
    if (at_ != end_ && (*at_ == 'e' || *at_ == 'E')) {
      whole = false;
      ++at_;
      if (!Take('+')) static_cast<void>(Take('-'));
      if (!Digits()) return false;
    }
    if (!whole) return Put<double>(begin, [this](double value) { tree_.Real(value); });
    if (negative) return Put<std::int64_t>(begin, [this](std::int64_t value) { tree_.Integer(value); });
    return Put<std::uint64_t>(begin, [this](std::uint64_t value) { tree_.Natural(value); });
  }

  /// What does not fit is no common number.
  template <typename T, typename Function>
  bool Put(const char* begin, Function put) {
    T value{};
    const auto [end, code] = std::from_chars(begin, at_, value);
    if (code != std::errc() || end != at_) return false;
    put(value);
    return true;
  }

  const char* at_;
  const char* end_;
  std::size_t max_depth_;
  std::string_view stop_after_;
  JsonTree& tree_;
  bool opened_ = false;
  bool complete_ = false;
  bool stop_here_ = false;
  std::string unescaped_;
};

}  // namespace

bool ScanJson(std::string_view text, std::size_t max_depth, std::string_view stop_after, JsonTree& tree) {
  return Scanner(text, max_depth, stop_after, tree).Document() && !tree.repeated();
}

}  // namespace ecaudit
