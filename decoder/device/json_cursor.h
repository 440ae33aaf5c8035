/// Checked walk through a JSON document that remembers where it is, so that an error names its place ("al.codes[3]").
///
/// Reading goes on after an error with the target unchanged; only the first error is kept.
#pragma once

#include <concepts>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "decoder/base/json.h"
#include "decoder/base/result.h"

namespace ecaudit::device {

/// Parses `text` with limits on depth, and errors by line and column; duplicate keys are errors.
///
/// @param stop_after  a key of the top-level object: reading ends after its value, and what follows is not examined
[[nodiscard]] Result<JsonDocument> ParseJson(std::string_view text, std::string_view stop_after = {});

/// One value and the way to it. Lives on the stack of the function that reads it; parents outlive children.
class Cursor {
 public:
  /// The document itself. `error` receives the first error.
  Cursor(JsonValue value, std::optional<Error>& error) : value_(value), error_(error) {}

  [[nodiscard]] Cursor Key(std::string_view key, JsonValue value) const {
    return Cursor(value, error_, this, key, kNoIndex);
  }
  [[nodiscard]] Cursor Index(std::size_t index) const { return Cursor(value_.element(index), error_, this, {}, index); }

  [[nodiscard]] JsonValue value() const { return value_; }
  [[nodiscard]] bool failed() const { return error_.has_value(); }
  /// "al.transitions[3].from"; "document" for the whole.
  [[nodiscard]] std::string Path() const;
  /// Records "PATH: what" unless an earlier error is recorded.
  void Fail(std::string_view what) const;
  /// Fail("expected WANTED, got ACTUAL").
  void FailType(std::string_view wanted) const;

 private:
  static constexpr std::size_t kNoIndex = std::numeric_limits<std::size_t>::max();

  Cursor(JsonValue value, std::optional<Error>& error, const Cursor* parent, std::string_view key, std::size_t index)
      : value_(value), error_(error), parent_(parent), key_(key), index_(index) {}
  void AppendPath(std::string& out) const;

  JsonValue value_;
  std::optional<Error>& error_;
  const Cursor* parent_ = nullptr;
  std::string_view key_;
  std::size_t index_ = kNoIndex;
};

/// Reads the members of one object and reports those that were not asked for.
class ObjectReader {
 public:
  explicit ObjectReader(const Cursor& cursor);

  /// The member must be there.
  template <typename T>
  void Require(std::string_view key, T& out) {
    ReadMember(key, true, &out, ReadAs<T>);
  }
  /// The member may be missing; `out` then keeps its value.
  template <typename T>
  void Allow(std::string_view key, T& out) {
    ReadMember(key, false, &out, ReadAs<T>);
  }
  /// Hands the member, if it is there, to `read(cursor)`.
  template <typename Function>
  void AllowWith(std::string_view key, Function read) {
    ReadMember(key, false, &read,
               [](const Cursor& cursor, void* function) { (*static_cast<Function*>(function))(cursor); });
  }
  /// Fails with the name of a member that was neither required nor allowed.
  void Finish() const;

 private:
  template <typename T>
  static void ReadAs(const Cursor& cursor, void* out) {
    Read(cursor, *static_cast<T*>(out));
  }
  /// Calls `read` with the member and `out`. Members of all types come through here, which keeps the tables of fields
  /// small.
  void ReadMember(std::string_view key, bool required, void* out, void (*read)(const Cursor&, void*));

  const Cursor& cursor_;
  std::uint64_t asked_ = 0;          ///< members that were asked for, a bit each
  std::vector<std::size_t> beyond_;  ///< those that have no bit
};

void Read(const Cursor& cursor, bool& out);
void Read(const Cursor& cursor, std::string& out);
void Read(const Cursor& cursor, double& out);
/// A JSON number, or text with a hexadecimal number ("0x1A00"), in [min, max].
[[nodiscard]] std::int64_t ReadInteger(const Cursor& cursor, std::int64_t min, std::int64_t max);

template <typename T>
requires(std::integral<T> && !std::same_as<T, bool>) void Read(const Cursor& cursor, T& out) {
  static_assert(sizeof(T) < sizeof(std::int64_t) || std::is_signed_v<T>);
  const std::int64_t value = ReadInteger(cursor, std::numeric_limits<T>::min(), std::numeric_limits<T>::max());
  if (!cursor.failed()) out = static_cast<T>(value);
}

/// null leaves it empty.
template <typename T>
void Read(const Cursor& cursor, std::optional<T>& out) {
  out.reset();
  if (cursor.value().is_null()) return;
  Read(cursor, out.emplace());
  if (cursor.failed()) out.reset();
}

template <typename T>
void Read(const Cursor& cursor, std::vector<T>& out) {
  out.clear();
  if (!cursor.value().is_array()) return cursor.FailType("an array");
  // Not element by element: a vector that can grow is far more to compile.
  std::vector<T> elements(cursor.value().size());
  for (std::size_t i = 0; i < elements.size() && !cursor.failed(); ++i) Read(cursor.Index(i), elements[i]);
  if (!cursor.failed()) out = std::move(elements);
}

/// Text that must be one of a fixed list of words.
template <typename Enum>
struct Word {
  std::string_view text;
  Enum value;
};

/// @tparam Entry  Word<Enum>, or another with `text` and `value`
template <typename Enum, typename Entry, std::size_t kCount>
void ReadWord(const Cursor& cursor, const Entry (&words)[kCount], Enum& out) {
  std::string text;
  Read(cursor, text);
  if (cursor.failed()) return;
  for (const Entry& word : words) {
    if (word.text == text) {
      out = word.value;
      return;
    }
  }
  std::string all;
  for (const Entry& word : words) {
    if (!all.empty()) all += ", ";
    all += word.text;
  }
  cursor.Fail("\"" + text + "\" is none of " + all);
}

}  // namespace ecaudit::device
