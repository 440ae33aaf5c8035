/// JSON documents as values to read, and the text of single values for those who write. All that is known of the JSON
/// library is in json.cpp: a file that includes it takes seconds to compile. The library has the last word on what is a
/// document; what it surely takes is read without it (json_tree.h), many times faster.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace ecaudit {

struct JsonMember;
struct JsonNode;
class JsonTree;

/// One value of a document, which must outlive it; or none, where an object has no such member. Small, to be copied.
/// A value that is asked for what it does not hold gives nothing.
class JsonValue {
 public:
  enum class Kind : std::uint8_t { kMissing, kNull, kBoolean, kNumber, kText, kArray, kObject };

  JsonValue() = default;
  explicit JsonValue(const JsonNode* value) : value_(value) {}

  [[nodiscard]] Kind kind() const;
  [[nodiscard]] bool there() const { return value_ != nullptr; }
  [[nodiscard]] bool is_null() const { return kind() == Kind::kNull; }
  [[nodiscard]] bool is_number() const { return kind() == Kind::kNumber; }
  [[nodiscard]] bool is_array() const { return kind() == Kind::kArray; }
  [[nodiscard]] bool is_object() const { return kind() == Kind::kObject; }

  [[nodiscard]] std::optional<bool> boolean() const;
  /// A whole number without a sign.
  [[nodiscard]] std::optional<std::uint64_t> natural() const;
  /// A whole number that fits.
  [[nodiscard]] std::optional<std::int64_t> integer() const;
  /// Any number.
  [[nodiscard]] std::optional<double> number() const;
  [[nodiscard]] const std::string_view* text() const;
  [[nodiscard]] bool is_text() const { return text() != nullptr; }
  /// Whether it is exactly this text.
  [[nodiscard]] bool is_text(std::string_view wanted) const;

  /// Elements of an array, members of an object; 0 for all else.
  [[nodiscard]] std::size_t size() const;
  /// @param index  below size() of an array
  [[nodiscard]] JsonValue element(std::size_t index) const;
  [[nodiscard]] JsonValue member(std::string_view key) const;
  /// Elements of an array in their order.
  [[nodiscard]] std::vector<JsonValue> Elements() const;
  /// Members of an object, ordered by key.
  [[nodiscard]] std::vector<JsonMember> Members() const;
  /// Which of the size() children of `parent` this is, in an order that stays.
  [[nodiscard]] std::size_t PlaceIn(JsonValue parent) const;

 private:
  const JsonNode* value_ = nullptr;
};

struct JsonMember {
  std::string_view key;
  JsonValue value;
};

/// Owns what was read; copies share it.
class JsonDocument {
 public:
  explicit JsonDocument(std::shared_ptr<const JsonTree> tree) : tree_(std::move(tree)) {}
  [[nodiscard]] JsonValue root() const;

 private:
  std::shared_ptr<const JsonTree> tree_;
};

struct JsonReading {
  std::optional<JsonDocument> document;     ///< unset when the text is no JSON document
  std::string problem;                      ///< why it is unset
  std::size_t position = 0;                 ///< where it stops being one: bytes read until then; 0 when depth was it
  std::optional<std::string> repeated_key;  ///< one that an object has twice; the last value is the one that was read
};

inline constexpr std::size_t kAnyJsonDepth = static_cast<std::size_t>(-1);

/// Reads `text`.
/// @param max_depth   of arrays and objects in each other
/// @param stop_after  a key of the top-level object: reading ends after its value, and what follows is not examined
[[nodiscard]] JsonReading ReadJson(std::string_view text, std::size_t max_depth = kAnyJsonDepth,
                                   std::string_view stop_after = {});

/// Reads what CborOf() wrote (cbor.h); nothing when it is no such document.
[[nodiscard]] std::optional<JsonDocument> ReadCbor(std::string_view cbor);

/// Receives a document part by part, in the order in which it is written.
class JsonListener {
 public:
  virtual ~JsonListener() = default;
  virtual void Null() = 0;
  virtual void Boolean(bool value) = 0;
  virtual void Natural(std::uint64_t value) = 0;
  virtual void Integer(std::int64_t value) = 0;
  virtual void Number(double value) = 0;
  virtual void Text(std::string_view value) = 0;
  virtual void Key(std::string_view key) = 0;
  virtual void BeginObject() = 0;
  virtual void EndObject() = 0;
  virtual void BeginArray() = 0;
  virtual void EndArray() = 0;
};

/// @return false when `text` is no JSON document; what came before that was received
bool StreamJson(std::string_view text, JsonListener& listener);

/// `text` in quotation marks, escaped; bytes that are not UTF-8 become U+FFFD.
void AppendJson(std::string& out, std::string_view text);
/// Reads back as `value`; always with a point or an exponent, null for infinities and NaN.
void AppendJson(std::string& out, double value);

}  // namespace ecaudit
