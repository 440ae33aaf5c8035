/// JSON text, written member by member as the data are walked through. Nothing is kept but the text: reports of
/// thousands of slaves are large as objects. Each writer is a table of fields: a line for each, in the order of the
/// document.
///
///   void Write(JsonObject& out, const FmmuSummary& fmmu) {
///     out.Put("number", fmmu.number);
///     out.Frame("frame", fmmu.since);
///   }
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "decoder/base/ids.h"

namespace ecaudit::report {

/// What a field can hold without having fields itself. Text is borrowed until it is written, so a std::string does not
/// become one by itself: it might be gone by then. Put() and Add() take it as it is.
class JsonScalar {
 public:
  enum class Kind : std::uint8_t { kNull, kBoolean, kNatural, kInteger, kNumber, kText };

  // Implicit, so that a field takes each of them.
  // NOLINTBEGIN(google-explicit-constructor)
  constexpr JsonScalar(std::nullptr_t) {}
  template <std::integral T>
  constexpr JsonScalar(T value)
      : kind_(std::is_same_v<T, bool> ? Kind::kBoolean
              : std::is_signed_v<T>   ? Kind::kInteger
                                      : Kind::kNatural) {
    if constexpr (std::is_signed_v<T>) {
      integer_ = value;
    } else {
      natural_ = value;
    }
  }
  constexpr JsonScalar(double value) : number_(value), kind_(Kind::kNumber) {}
  constexpr JsonScalar(std::string_view text) : text_(text), kind_(Kind::kText) {}
  constexpr JsonScalar(const char* text) : text_(text), kind_(Kind::kText) {}
  JsonScalar(const std::string& text) = delete;
  /// Null where it is unknown.
  template <typename T>
  requires(!std::is_same_v<T, std::string>) constexpr JsonScalar(const std::optional<T>& value)
      : JsonScalar(value ? JsonScalar(*value) : JsonScalar(nullptr)) {}
  // NOLINTEND(google-explicit-constructor)

  [[nodiscard]] constexpr bool is_null() const { return kind_ == Kind::kNull; }
  void AppendTo(std::string& out) const;

 private:
  union {
    std::uint64_t natural_ = 0;
    std::int64_t integer_;
    double number_;
    std::string_view text_;
  };
  Kind kind_ = Kind::kNull;
};

/// A frame number of the capture, from 1; 0 means no frame and becomes null.
[[nodiscard]] constexpr JsonScalar FrameOrNull(FrameNo frame) {
  return frame == 0 ? JsonScalar(nullptr) : JsonScalar(frame);
}

/// `value` where it means something, else null.
[[nodiscard]] constexpr JsonScalar OnlyIf(bool meaningful, JsonScalar value) {
  return meaningful ? value : JsonScalar(nullptr);
}

class JsonArray;
class JsonObject;

/// Takes a text piece by piece.
using TextSink = std::function<void(std::string_view)>;

/// The text that is being written, as nlohmann::json::dump() lays it out; from 256 KiB on each slave and finding is
/// one line.
class JsonText {
 public:
  /// kIndented: by two spaces, a line for each member and element. kLine: no white space.
  enum class Layout : std::uint8_t { kIndented, kLine };

  explicit JsonText(Layout layout) : indented_(layout == Layout::kIndented) {}
  /// @param sink takes the text while it grows; what is left of it is to be taken at the end
  JsonText(Layout layout, TextSink sink) : sink_(std::move(sink)), indented_(layout == Layout::kIndented) {}

  /// Opens the document, which `write(JsonObject&)` fills.
  template <typename Write>
  void Object(Write&& write);
  /// Opens the document, which `write(JsonArray&)` fills.
  template <typename Write>
  void Array(Write&& write);

  [[nodiscard]] std::string Take() { return std::move(out_); }

 private:
  friend class JsonArray;
  friend class JsonCopy;
  friend class JsonObject;

  void Key(std::string_view key);
  void Element();
  void Value(JsonScalar value) { value.AppendTo(out_); }
  void Open(char bracket);
  void Close(char bracket);
  void NewLine();
  /// Reports of many slaves are white space by half, and are not read from top to bottom.
  [[nodiscard]] bool indents() const {
    return indented_ && (depth_ <= kLineDepth || given_ + out_.size() < kIndentedBytes);
  }

  static constexpr std::size_t kIndentedBytes = std::size_t{1} << 18U;
  static constexpr std::size_t kLineDepth = 4;  ///< of the elements of a list of a report
  static constexpr std::size_t kPieceBytes = std::size_t{1} << 16U;

  TextSink sink_;  ///< empty: all text is kept
  std::string out_;
  std::size_t given_ = 0;  ///< bytes that the sink has
  std::size_t depth_ = 0;
  bool empty_ = true;  ///< the object or array that is open has nothing yet
  bool indented_;
};

/// The elements of an array.
class JsonArray {
 public:
  explicit JsonArray(JsonText& text) : text_(text) {}

  void Add(JsonScalar value);
  template <std::same_as<std::string> T>
  void Add(const T& text) {
    Add(std::string_view(text));
  }
  /// Adds a JSON document as it is, in the layout of this text; keys keep their order.
  void AddDocument(std::string_view json);
  /// Adds an object that `write(JsonObject&)` fills.
  template <typename Write>
  void AddObject(Write&& write) {
    text_.Element();
    text_.Object(write);
  }
  /// Adds an array that `write(JsonArray&)` fills.
  template <typename Write>
  void AddArray(Write&& write) {
    text_.Element();
    text_.Array(write);
  }

 private:
  JsonText& text_;
};

/// The members of an object. Keys must differ.
class JsonObject {
 public:
  explicit JsonObject(JsonText& text) : text_(text) {}

  void Put(std::string_view key, JsonScalar value);
  template <std::same_as<std::string> T>
  void Put(std::string_view key, const T& text) {
    Put(key, std::string_view(text));
  }
  /// Untrusted text as PrintableLines() makes it: line breaks kept.
  void Text(std::string_view key, std::string_view text);
  /// As Text(); null for an empty text.
  void TextOrNull(std::string_view key, std::string_view text);
  /// An array of untrusted texts, each as Text() writes it.
  void Texts(std::string_view key, std::span<const std::string> texts);
  /// Null for no frame.
  void Frame(std::string_view key, FrameNo frame) { Put(key, FrameOrNull(frame)); }
  void Frame(std::string_view key, const FrameRef& frame) { Frame(key, frame.number); }

  /// A member that `write(JsonObject&)` fills.
  template <typename Write>
  void Object(std::string_view key, Write&& write) {
    text_.Key(key);
    text_.Object(write);
  }
  /// A member that `write(JsonObject&, *value)` fills; null where `value` is unset.
  template <typename T, typename Write>
  void ObjectOrNull(std::string_view key, const std::optional<T>& value, Write&& write) {
    if (!value) return Put(key, nullptr);
    Object(key, [&](JsonObject& object) { write(object, *value); });
  }
  /// A member that `write(JsonArray&)` fills.
  template <typename Write>
  void Array(std::string_view key, Write&& write) {
    text_.Key(key);
    text_.Array(write);
  }
  /// An array of values that are written as they are.
  template <typename Range>
  void Values(std::string_view key, const Range& values) {
    Array(key, [&](JsonArray& array) {
      for (const auto& value : values) array.Add(value);
    });
  }
  /// An array with an object for each of `items`, which `write(JsonObject&, item)` fills.
  template <typename Range, typename Write>
  void List(std::string_view key, const Range& items, Write&& write) {
    Array(key, [&](JsonArray& array) {
      for (const auto& item : items) array.AddObject([&](JsonObject& object) { write(object, item); });
    });
  }

 private:
  JsonText& text_;
};

/// A whole document, indented, ended by a newline; `write(JsonObject&)` fills it.
template <typename Write>
[[nodiscard]] std::string JsonDocumentText(Write&& write) {
  JsonText text(JsonText::Layout::kIndented);
  text.Object(write);
  return text.Take() + "\n";
}

/// The same piece by piece.
template <typename Write>
void WriteJsonDocument(const TextSink& sink, Write&& write) {
  JsonText text(JsonText::Layout::kIndented, sink);
  text.Object(write);
  sink(text.Take() + "\n");
}

/// The member "tool" that names the program in each of our documents.
void PutTool(JsonObject& out, std::string_view version);

template <typename Write>
void JsonText::Object(Write&& write) {
  Open('{');
  JsonObject object(*this);
  write(object);
  Close('}');
}

template <typename Write>
void JsonText::Array(Write&& write) {
  Open('[');
  JsonArray array(*this);
  write(array);
  Close(']');
}

}  // namespace ecaudit::report
