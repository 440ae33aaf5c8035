#include "decoder/base/json.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <nlohmann/json.hpp>

#include "decoder/base/json_tree.h"
#include "decoder/base/text.h"

namespace ecaudit {
namespace {

using Json = nlohmann::json;

/// What the parser calls. One interface for all that listen, so that the parser is compiled once.
using Sax = nlohmann::json_sax<Json>;

bool Parse(std::string_view text, Sax& listener, Json::input_format_t format = Json::input_format_t::json) {
  return Json::sax_parse(text, &listener, format);
}

/// Builds the document in one pass. The library's own builder does not report where and why it fails without
/// exceptions, nor that a key appears twice, nests without limit, and takes a block of memory for each value.
class Builder : public Sax {
 public:
  Builder(JsonTree& tree, std::size_t max_depth, std::string_view stop_after)
      : tree_(tree), max_depth_(max_depth), stop_after_(stop_after) {}

  [[nodiscard]] bool stopped() const { return stopped_; }
  [[nodiscard]] JsonReading TakeRest() { return std::move(reading_); }

  bool null() override { return tree_.Null(), Continue(); }
  bool boolean(bool value) override { return tree_.Boolean(value), Continue(); }
  bool number_integer(number_integer_t value) override { return tree_.Integer(value), Continue(); }
  bool number_unsigned(number_unsigned_t value) override { return tree_.Natural(value), Continue(); }
  bool number_float(number_float_t value, const string_t& /*text*/) override { return tree_.Real(value), Continue(); }
  bool string(string_t& value) override { return tree_.Text(value), Continue(); }
  bool binary(binary_t& /*value*/) override { return Fail("binary data"); }
  bool start_object(std::size_t /*elements*/) override { return Open(JsonType::kObject); }
  bool start_array(std::size_t /*elements*/) override { return Open(JsonType::kArray); }
  bool end_object() override { return Close(); }
  bool end_array() override { return Close(); }
  bool key(string_t& name) override {
    if (tree_.depth() == 1) stop_here_ = !stop_after_.empty() && name == stop_after_;
    tree_.Key(name);
    return true;
  }
  bool parse_error(std::size_t position, const std::string& /*token*/,
                   const nlohmann::detail::exception& exception) override {
    reading_.position = position;
    // "[json.exception.parse_error.101] parse error at line 1, column 2: ..."
    std::string_view text = exception.what();
    if (const auto end = text.find("] "); end != std::string_view::npos) text.remove_prefix(end + 2);
    return Fail(Printable(text));
  }

 private:
  bool Fail(std::string problem) {
    reading_.problem = std::move(problem);
    return false;
  }
  bool Open(JsonType type) {
    if (tree_.depth() >= max_depth_) return Fail("nested deeper than " + std::to_string(max_depth_) + " levels");
    tree_.Begin(type);
    return true;
  }
  bool Close() {
    tree_.End();
    return Continue();
  }
  /// After each complete value.
  bool Continue() {
    stopped_ = stop_here_ && tree_.depth() == 1;
    if (stopped_) tree_.End();
    return !stopped_;
  }

  JsonTree& tree_;
  std::size_t max_depth_;
  std::string_view stop_after_;
  bool stop_here_ = false;
  bool stopped_ = false;
  JsonReading reading_;
};

class Forwarder : public Sax {
 public:
  explicit Forwarder(JsonListener& listener) : listener_(listener) {}

  bool null() override { return listener_.Null(), true; }
  bool boolean(bool value) override { return listener_.Boolean(value), true; }
  bool number_integer(number_integer_t value) override { return listener_.Integer(value), true; }
  bool number_unsigned(number_unsigned_t value) override { return listener_.Natural(value), true; }
  bool number_float(number_float_t value, const string_t& /*text*/) override { return listener_.Number(value), true; }
  bool string(string_t& value) override { return listener_.Text(value), true; }
  bool binary(binary_t& /*value*/) override { return false; }
  bool start_object(std::size_t /*elements*/) override { return listener_.BeginObject(), true; }
  bool start_array(std::size_t /*elements*/) override { return listener_.BeginArray(), true; }
  bool end_object() override { return listener_.EndObject(), true; }
  bool end_array() override { return listener_.EndArray(), true; }
  bool key(string_t& name) override { return listener_.Key(name), true; }
  bool parse_error(std::size_t /*position*/, const std::string& /*token*/,
                   const nlohmann::detail::exception& /*exception*/) override {
    return false;
  }

 private:
  JsonListener& listener_;
};

/// What a JSON text holds as it is: nearly all text there is.
bool IsPlain(std::string_view text) {
  return std::ranges::all_of(text, [](char c) { return c >= 0x20 && c <= 0x7E && c != '"' && c != '\\'; });
}

void AppendDump(std::string& out, const Json& value) {
  out += value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

JsonValue::Kind JsonValue::kind() const {
  if (value_ == nullptr) return Kind::kMissing;
  switch (value_->type) {
    case JsonType::kNull:
      return Kind::kNull;
    case JsonType::kObject:
      return Kind::kObject;
    case JsonType::kArray:
      return Kind::kArray;
    case JsonType::kText:
      return Kind::kText;
    case JsonType::kBoolean:
      return Kind::kBoolean;
    case JsonType::kNatural:
    case JsonType::kInteger:
    case JsonType::kReal:
      break;
  }
  return Kind::kNumber;
}

std::optional<bool> JsonValue::boolean() const {
  if (value_ == nullptr || value_->type != JsonType::kBoolean) return std::nullopt;
  return value_->held.boolean;
}

std::optional<std::uint64_t> JsonValue::natural() const {
  if (value_ == nullptr || value_->type != JsonType::kNatural) return std::nullopt;
  return value_->held.natural;
}

std::optional<std::int64_t> JsonValue::integer() const {
  if (const auto value = natural()) {
    if (*value > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) return std::nullopt;
    return static_cast<std::int64_t>(*value);
  }
  if (value_ == nullptr || value_->type != JsonType::kInteger) return std::nullopt;
  return value_->held.integer;
}

std::optional<double> JsonValue::number() const {
  if (const auto value = natural()) return static_cast<double>(*value);
  if (const auto value = integer()) return static_cast<double>(*value);
  if (value_ == nullptr || value_->type != JsonType::kReal) return std::nullopt;
  return value_->held.real;
}

const std::string_view* JsonValue::text() const {
  return value_ != nullptr && value_->type == JsonType::kText ? &value_->text : nullptr;
}

bool JsonValue::is_text(std::string_view wanted) const {
  const std::string_view* held = text();
  return held != nullptr && *held == wanted;
}

std::size_t JsonValue::size() const {
  return value_ != nullptr && value_->holds_children() ? value_->held.children.count : 0;
}

JsonValue JsonValue::element(std::size_t index) const {
  if (value_ == nullptr || value_->type != JsonType::kArray || index >= size()) return {};
  return JsonValue(value_->held.children.first + index);
}

JsonValue JsonValue::member(std::string_view key) const {
  return value_ == nullptr ? JsonValue() : JsonValue(value_->Member(key));
}

std::vector<JsonValue> JsonValue::Elements() const {
  std::vector<JsonValue> all;
  if (!is_array()) return all;
  all.reserve(size());
  for (std::size_t i = 0; i < size(); ++i) all.push_back(element(i));
  return all;
}

std::vector<JsonMember> JsonValue::Members() const {
  std::vector<JsonMember> all;
  if (!is_object()) return all;
  all.reserve(size());
  const JsonNode* const first = value_->held.children.first;
  for (const JsonNode* node = first; node != first + size(); ++node) all.push_back({node->key, JsonValue(node)});
  std::ranges::sort(all, {}, &JsonMember::key);
  return all;
}

std::size_t JsonValue::PlaceIn(JsonValue parent) const {
  return static_cast<std::size_t>(value_ - parent.value_->held.children.first);
}

JsonValue JsonDocument::root() const {
  return tree_ == nullptr ? JsonValue() : JsonValue(&tree_->root());
}

JsonReading ReadJson(std::string_view text, std::size_t max_depth, std::string_view stop_after) {
  auto tree = std::make_shared<JsonTree>();
  Builder builder(*tree, max_depth, stop_after);
  const bool read = Parse(text, builder) || builder.stopped();
  JsonReading reading = builder.TakeRest();
  reading.repeated_key = tree->repeated();
  if (read) reading.document.emplace(std::move(tree));
  if (!read && reading.problem.empty()) reading.problem = "not a JSON document";
  return reading;
}

std::optional<JsonDocument> ReadCbor(std::string_view cbor) {
  constexpr std::size_t kMostNested = 64;
  auto tree = std::make_shared<JsonTree>();
  Builder builder(*tree, kMostNested, {});
  if (!Parse(cbor, builder, Json::input_format_t::cbor)) return std::nullopt;
  return JsonDocument(std::move(tree));
}

bool StreamJson(std::string_view text, JsonListener& listener) {
  Forwarder forwarder(listener);
  return Parse(text, forwarder);
}

void AppendJson(std::string& out, std::string_view text) {
  if (!IsPlain(text)) return AppendDump(out, text);
  out += '"';
  out += text;
  out += '"';
}

void AppendJson(std::string& out, double value) {
  AppendDump(out, value);
}

}  // namespace ecaudit
