#include "decoder/base/json.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <nlohmann/json.hpp>

#include "decoder/base/text.h"

namespace ecaudit {
namespace {

using Json = nlohmann::json;

/// What the parser calls. One interface for all that listen, so that the parser is compiled once.
using Sax = nlohmann::json_sax<Json>;

bool Parse(std::string_view text, Sax& listener) {
  return Json::sax_parse(text, &listener);
}

/// Builds the document in one pass. The library's own builder does not say where and why it fails without exceptions,
/// nor that a key stands twice, and nests without limit.
class Builder : public Sax {
 public:
  Builder(std::size_t max_depth, std::string_view stop_after) : max_depth_(max_depth), stop_after_(stop_after) {}

  [[nodiscard]] bool stopped() const { return stopped_; }
  [[nodiscard]] Json TakeRoot() { return std::move(root_); }
  [[nodiscard]] JsonReading TakeRest() { return std::move(reading_); }

  bool null() override { return Add(nullptr); }
  bool boolean(bool value) override { return Add(value); }
  bool number_integer(number_integer_t value) override { return Add(value); }
  bool number_unsigned(number_unsigned_t value) override { return Add(value); }
  bool number_float(number_float_t value, const string_t& /*text*/) override { return Add(value); }
  bool string(string_t& value) override { return Add(std::move(value)); }
  bool binary(binary_t& /*value*/) override { return Fail("binary data"); }
  bool start_object(std::size_t /*elements*/) override { return Open(Json::value_t::object); }
  bool start_array(std::size_t /*elements*/) override { return Open(Json::value_t::array); }
  bool end_object() override { return Close(); }
  bool end_array() override { return Close(); }
  bool key(string_t& name) override {
    const auto [at, added] = open_.back()->get_ref<Json::object_t&>().try_emplace(name, nullptr);
    if (!added && !reading_.repeated_key) reading_.repeated_key = name;
    member_ = &at->second;
    if (open_.size() == 1) stop_here_ = !stop_after_.empty() && name == stop_after_;
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
  /// Where the next value belongs.
  Json& Place() {
    if (open_.empty()) return root_;
    if (open_.back()->is_object()) return *member_;
    return open_.back()->get_ref<Json::array_t&>().emplace_back(nullptr);
  }
  bool Add(Json value) {
    Place() = std::move(value);
    return Continue();
  }
  bool Open(Json::value_t type) {
    if (open_.size() >= max_depth_) return Fail("nested deeper than " + std::to_string(max_depth_) + " levels");
    Json& place = Place();
    place = Json(type);
    // An element of an array may move when the array grows, but never while it is open itself.
    open_.push_back(&place);
    return true;
  }
  bool Close() {
    open_.pop_back();
    return Continue();
  }
  /// After each complete value.
  bool Continue() {
    stopped_ = stop_here_ && open_.size() == 1;
    return !stopped_;
  }

  Json root_;
  std::vector<Json*> open_;
  Json* member_ = nullptr;
  std::size_t max_depth_;
  std::string_view stop_after_;
  bool stop_here_ = false;
  bool stopped_ = false;
  JsonReading reading_;
};

class Teller : public Sax {
 public:
  explicit Teller(JsonListener& listener) : listener_(listener) {}

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
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= 0x20 && c <= 0x7E && c != '"' && c != '\\'; });
}

void AppendDump(std::string& out, const Json& value) {
  out += value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

JsonValue::Kind JsonValue::kind() const {
  if (value_ == nullptr) return Kind::kMissing;
  switch (value_->type()) {
    case Json::value_t::null:
      return Kind::kNull;
    case Json::value_t::object:
      return Kind::kObject;
    case Json::value_t::array:
      return Kind::kArray;
    case Json::value_t::string:
      return Kind::kText;
    case Json::value_t::boolean:
      return Kind::kBoolean;
    default:
      return Kind::kNumber;
  }
}

std::optional<bool> JsonValue::boolean() const {
  const auto* value = value_ == nullptr ? nullptr : value_->get_ptr<const Json::boolean_t*>();
  return value == nullptr ? std::nullopt : std::optional(*value);
}

std::optional<std::uint64_t> JsonValue::natural() const {
  const auto* value = value_ == nullptr ? nullptr : value_->get_ptr<const Json::number_unsigned_t*>();
  return value == nullptr ? std::nullopt : std::optional(*value);
}

std::optional<std::int64_t> JsonValue::integer() const {
  if (const auto value = natural()) {
    if (*value > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) return std::nullopt;
    return static_cast<std::int64_t>(*value);
  }
  const auto* value = value_ == nullptr ? nullptr : value_->get_ptr<const Json::number_integer_t*>();
  return value == nullptr ? std::nullopt : std::optional(*value);
}

std::optional<double> JsonValue::number() const {
  if (const auto value = natural()) return static_cast<double>(*value);
  if (const auto value = integer()) return static_cast<double>(*value);
  const auto* value = value_ == nullptr ? nullptr : value_->get_ptr<const Json::number_float_t*>();
  return value == nullptr ? std::nullopt : std::optional(*value);
}

const std::string* JsonValue::text() const {
  return value_ == nullptr ? nullptr : value_->get_ptr<const Json::string_t*>();
}

bool JsonValue::is_text(std::string_view wanted) const {
  const std::string* held = text();
  return held != nullptr && *held == wanted;
}

std::size_t JsonValue::size() const {
  return is_array() || is_object() ? value_->size() : 0;
}

JsonValue JsonValue::element(std::size_t index) const {
  const auto* elements = value_ == nullptr ? nullptr : value_->get_ptr<const Json::array_t*>();
  return elements == nullptr || index >= elements->size() ? JsonValue() : JsonValue(&(*elements)[index]);
}

JsonValue JsonValue::member(std::string_view key) const {
  const auto* members = value_ == nullptr ? nullptr : value_->get_ptr<const Json::object_t*>();
  if (members == nullptr) return {};
  const auto found = members->find(key);
  return found == members->end() ? JsonValue() : JsonValue(&found->second);
}

std::vector<JsonValue> JsonValue::Elements() const {
  std::vector<JsonValue> all;
  const auto* elements = value_ == nullptr ? nullptr : value_->get_ptr<const Json::array_t*>();
  if (elements == nullptr) return all;
  all.reserve(elements->size());
  for (const Json& element : *elements) all.emplace_back(&element);
  return all;
}

std::vector<JsonMember> JsonValue::Members() const {
  std::vector<JsonMember> all;
  const auto* members = value_ == nullptr ? nullptr : value_->get_ptr<const Json::object_t*>();
  if (members == nullptr) return all;
  all.reserve(members->size());
  for (const auto& [key, value] : *members) all.push_back({key, JsonValue(&value)});
  return all;
}

JsonReading ReadJson(std::string_view text, std::size_t max_depth, std::string_view stop_after) {
  Builder builder(max_depth, stop_after);
  const bool read = Parse(text, builder) || builder.stopped();
  JsonReading reading = builder.TakeRest();
  if (read) reading.document.emplace(std::make_shared<const Json>(builder.TakeRoot()));
  if (!read && reading.problem.empty()) reading.problem = "not a JSON document";
  return reading;
}

bool HearJson(std::string_view text, JsonListener& listener) {
  Teller teller(listener);
  return Parse(text, teller);
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
