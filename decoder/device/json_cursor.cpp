#include "decoder/device/json_cursor.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <utility>

#include "decoder/base/text.h"

namespace ecaudit::device {
namespace {

constexpr std::size_t kMaxDepth = 32;
constexpr std::size_t kBits = 64;  // of ObjectReader::asked_

std::string_view TypeName(JsonValue value) {
  switch (value.kind()) {
    case JsonValue::Kind::kMissing:
      return "nothing";
    case JsonValue::Kind::kNull:
      return "null";
    case JsonValue::Kind::kObject:
      return "an object";
    case JsonValue::Kind::kArray:
      return "an array";
    case JsonValue::Kind::kText:
      return "text";
    case JsonValue::Kind::kBoolean:
      return "true or false";
    case JsonValue::Kind::kNumber:
      break;
  }
  return "a number";
}

}  // namespace

Result<JsonDocument> ParseJson(std::string_view text, std::string_view stop_after) {
  JsonReading reading = ReadJson(text, kMaxDepth, stop_after);
  if (!reading.document) return Error{std::move(reading.problem)};
  if (reading.repeated_key)
    return Error{"key \"" + Printable(*reading.repeated_key) + "\" appears twice in one object"};
  return std::move(*reading.document);
}

std::string Cursor::Path() const {
  std::string path;
  AppendPath(path);
  return path.empty() ? "document" : path;
}

void Cursor::AppendPath(std::string& out) const {
  if (parent_ == nullptr) return;
  parent_->AppendPath(out);
  if (index_ != kNoIndex) {
    out += "[" + std::to_string(index_) + "]";
  } else {
    if (!out.empty()) out += ".";
    out += Printable(key_);
  }
}

void Cursor::Fail(std::string_view what) const {
  if (error_) return;
  error_ = Error{Path() + ": " + std::string(what)};
}

void Cursor::FailType(std::string_view wanted) const {
  Fail("expected " + std::string(wanted) + ", got " + std::string(TypeName(value_)));
}

ObjectReader::ObjectReader(const Cursor& cursor) : cursor_(cursor) {
  if (!cursor.value().is_object()) cursor.FailType("an object");
}

void ObjectReader::ReadMember(std::string_view key, bool required, void* out, void (*read)(const Cursor&, void*)) {
  const JsonValue member = cursor_.value().member(key);
  if (!member.there()) {
    if (required) cursor_.Fail("\"" + std::string(key) + "\" is missing");
    return;
  }
  const std::size_t place = member.PlaceIn(cursor_.value());
  if (place < kBits) {
    asked_ |= std::uint64_t{1} << place;
  } else {
    beyond_.push_back(place);
  }
  read(cursor_.Key(key, member), out);
}

void ObjectReader::Finish() const {
  const JsonValue object = cursor_.value();
  if (cursor_.failed() || !object.is_object()) return;
  if (beyond_.empty() && static_cast<std::size_t>(std::popcount(asked_)) == object.size()) return;
  for (const auto& [key, value] : object.Members()) {
    const std::size_t place = value.PlaceIn(object);
    const bool asked = place < kBits ? (asked_ >> place & 1U) != 0 : std::ranges::find(beyond_, place) != beyond_.end();
    if (!asked) return cursor_.Fail("unknown key \"" + Printable(key) + "\"");
  }
}

void Read(const Cursor& cursor, bool& out) {
  const auto value = cursor.value().boolean();
  if (!value) return cursor.FailType("true or false");
  out = *value;
}

void Read(const Cursor& cursor, std::string& out) {
  const std::string_view* text = cursor.value().text();
  if (text == nullptr) return cursor.FailType("text");
  out = *text;
}

void Read(const Cursor& cursor, double& out) {
  const auto value = cursor.value().number();
  if (!value) return cursor.FailType("a number");
  out = *value;
}

std::int64_t ReadInteger(const Cursor& cursor, std::int64_t min, std::int64_t max) {
  std::int64_t result = 0;
  if (const auto integer = cursor.value().integer()) {
    result = *integer;
  } else if (cursor.value().natural()) {
    cursor.Fail("number too large");
    return 0;
  } else if (const std::string_view* text = cursor.value().text()) {
    const char* end = text->data() + text->size();
    const bool prefixed = text->size() > 2 && (*text)[0] == '0' && (*text)[1] == 'x';
    std::uint64_t value = 0;
    const auto parsed =
        prefixed ? std::from_chars(text->data() + 2, end, value, 16) : std::from_chars_result{nullptr, std::errc{}};
    if (parsed.ptr != end || parsed.ec != std::errc{} || value > 0x7FFF'FFFF'FFFF'FFFFULL) {
      cursor.Fail("\"" + Printable(*text) + "\" is not a number (expected 123 or \"0x7B\")");
      return 0;
    }
    result = static_cast<std::int64_t>(value);
  } else {
    cursor.FailType("a number");
    return 0;
  }
  if (result < min || result > max) {
    cursor.Fail(std::to_string(result) + " is outside " + std::to_string(min) + " to " + std::to_string(max));
    return 0;
  }
  return result;
}

}  // namespace ecaudit::device
