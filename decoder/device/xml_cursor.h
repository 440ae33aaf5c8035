/// Checked walk through an XML document; internal to the ESI and ENI readers. Keeps Qt out of their headers.
///
/// Document type declarations are refused, so there are no entities to expand. After an error every step ends the
/// loops of the caller; only the first error is kept, with line and column.
#pragma once

#include <concepts>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "decoder/base/result.h"
#include "decoder/base/text.h"
#include "decoder/base/time.h"

namespace ecaudit::device {

/// Larger documents are refused; the largest ESI files known have about 40 MB.
inline constexpr std::size_t kMaxXmlBytes = 256U << 20U;
/// Longer texts (names, hexadecimal data) are refused.
inline constexpr std::size_t kMaxXmlText = 1U << 20U;
/// Longer names and comments are cut, in bytes.
inline constexpr std::size_t kMaxXmlLabel = 250;
/// Of one element; the largest known has about 20.
inline constexpr std::size_t kMaxXmlAttributes = 1000;

class XmlChild;

class XmlCursor {
 public:
  /// `xml` must outlive the cursor.
  explicit XmlCursor(std::string_view xml);
  ~XmlCursor();
  XmlCursor(const XmlCursor&) = delete;
  XmlCursor& operator=(const XmlCursor&) = delete;

  /// Moves to the document element; fails unless it is called `name`.
  void EnterRoot(std::string_view name);
  /// Moves to the next child of the current element, or after that element when it has no more.
  /// A child must be left by Text(), Number(), Skip() or a loop over its own children.
  [[nodiscard]] bool NextChild();
  /// Reads the children of the current element that are listed, and skips the others.
  void Children(std::initializer_list<XmlChild> listed);
  /// Local name of the current element.
  [[nodiscard]] const std::string& name() const { return name_; }
  /// Text of the current element, without white space at its ends; leaves it.
  [[nodiscard]] std::string Text();
  /// The same for what reports repeat for each finding: a name, a title, a comment. A long one is cut.
  [[nodiscard]] std::string Label() { return Shortened(Text(), kMaxXmlLabel); }
  /// Leaves the current element.
  void Skip();
  /// An attribute of the current element; empty when it has none of that name.
  [[nodiscard]] std::string Attribute(std::string_view name) const;
  /// True for "1" and "true".
  [[nodiscard]] bool Flag(std::string_view name) const;
  /// Text as a number, decimal, "#x1A00" or "0x1A00"; leaves the element. Fails when it is outside the range of T.
  template <typename T>
  [[nodiscard]] T Number() {
    static_assert(sizeof(T) < sizeof(std::int64_t) || std::is_signed_v<T>);
    return static_cast<T>(Integer(Text(), std::numeric_limits<T>::min(), std::numeric_limits<T>::max()));
  }
  /// An attribute as a number; nothing when it is missing or empty.
  template <typename T>
  [[nodiscard]] std::optional<T> NumberAttribute(std::string_view name) {
    const std::string text = Attribute(name);
    if (text.empty()) return std::nullopt;
    return static_cast<T>(Integer(text, std::numeric_limits<T>::min(), std::numeric_limits<T>::max()));
  }
  /// Text as hexadecimal bytes ("0a00ff"); leaves the element.
  [[nodiscard]] std::vector<std::uint8_t> Bytes();

  /// What the element holds goes to a variable of its type; leaves the element.
  void ReadInto(std::string& out) { out = Label(); }
  void ReadInto(std::vector<std::uint8_t>& out) { out = Bytes(); }
  void ReadInto(bool& out) {
    const std::string text = Text();
    out = text == "1" || text == "true";
  }
  template <std::integral T>
  void ReadInto(T& out) {
    out = Number<T>();
  }
  template <std::integral T>
  void ReadInto(std::optional<T>& out) {
    out = Number<T>();
  }
  /// Text as a number of milliseconds, in nanoseconds; leaves the element.
  [[nodiscard]] TimeNs Milliseconds() { return TimeNs{Number<std::int32_t>()} * 1'000'000; }

  /// Line of the parser, from 1.
  [[nodiscard]] std::uint32_t line() const;
  /// Records "line 3, column 7: what".
  void Fail(std::string_view what);
  [[nodiscard]] bool failed() const { return error_.has_value(); }
  /// Only when failed().
  [[nodiscard]] const Error& error() const { return *error_; }

 private:
  struct Parser;
  [[nodiscard]] std::int64_t Integer(std::string_view text, std::int64_t min, std::int64_t max);
  void CheckParser();

  std::unique_ptr<Parser> parser_;
  std::string name_;
  std::optional<Error> error_;
};

/// A child element by its name, and what takes its content: a variable, or a function that leaves the element.
class XmlChild {
 public:
  template <typename Target>
  XmlChild(std::string_view name, Target&& target) : name_(name) {
    if constexpr (std::is_invocable_v<Target>) {
      read_ = [function = std::forward<Target>(target)](XmlCursor&) { function(); };
    } else {
      read_ = [&target](XmlCursor& xml) { xml.ReadInto(target); };
    }
  }

  [[nodiscard]] std::string_view name() const { return name_; }
  void Read(XmlCursor& xml) const { read_(xml); }

 private:
  std::string_view name_;
  std::function<void(XmlCursor&)> read_;
};

}  // namespace ecaudit::device
