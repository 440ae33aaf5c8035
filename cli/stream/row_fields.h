/// Named values of a row, in the order in which they were added. Formats decide how each is written.
#pragma once

#include <concepts>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "decoder/base/bytes.h"

namespace ecaudit::cli {

struct RowField {
  enum class Kind : std::uint8_t {
    kNull,
    kNatural,
    kInteger,
    kReal,
    kBool,
    kText,
    kBytes,
    kJson,  ///< a list or an object, as JSON
  };

  std::string_view key;
  Kind kind = Kind::kNull;
  union {
    std::uint64_t natural = 0;  ///< of kNatural, kBool
    std::int64_t integer;
    double real;
  };
  // Of text, bytes and JSON.
  std::size_t begin = 0;
  std::size_t length = 0;
};

class RowFields {
 public:
  /// Room is kept for the next row.
  void Clear();

  // `key` must outlive the row, and needs no escaping.
  template <std::unsigned_integral T>
  void Number(std::string_view key, T value) {
    Add(key, RowField::Kind::kNatural).natural = value;
  }
  template <std::signed_integral T>
  void Number(std::string_view key, T value) {
    Add(key, RowField::Kind::kInteger).integer = value;
  }
  void Real(std::string_view key, double value) { Add(key, RowField::Kind::kReal).real = value; }
  void Bool(std::string_view key, bool value) { Add(key, RowField::Kind::kBool).natural = value ? 1 : 0; }
  void Null(std::string_view key) { Add(key, RowField::Kind::kNull); }
  void Text(std::string_view key, std::string_view text) { AddText(key, RowField::Kind::kText, text); }
  void Bytes(std::string_view key, ByteSpan bytes);
  /// A list or an object: the caller appends it as JSON, before the next field.
  [[nodiscard]] std::string& Json(std::string_view key);
  /// After the last field.
  void Close();

  [[nodiscard]] std::span<const RowField> all() const { return fields_; }
  /// Null where there is none.
  [[nodiscard]] const RowField* Find(std::string_view key) const;
  /// Text or JSON of a field.
  [[nodiscard]] std::string_view TextOf(const RowField& field) const {
    return std::string_view(texts_).substr(field.begin, field.length);
  }
  [[nodiscard]] ByteSpan BytesOf(const RowField& field) const;
  /// Bytes that the values hold, about as many as a line needs for them.
  [[nodiscard]] std::size_t size() const;

 private:
  RowField& Add(std::string_view key, RowField::Kind kind);
  void AddText(std::string_view key, RowField::Kind kind, std::string_view text);

  std::vector<RowField> fields_;
  std::string texts_;
  bool open_ = false;  ///< the last field is appended to by its caller
};

}  // namespace ecaudit::cli
