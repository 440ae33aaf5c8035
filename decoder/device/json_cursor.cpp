#include "decoder/device/json_cursor.h"

#include <algorithm>
#include <charconv>
#include <utility>

#include "decoder/base/text.h"

namespace ecaudit::device {
namespace {

constexpr std::size_t kMaxDepth = 32;

/// Builds the document in one pass. The library's own builder gives no reason when it fails without exceptions, takes
/// the last of two equal keys, and nests without limit.
class Builder {
 public:
  using number_integer_t = nlohmann::json::number_integer_t;
  using number_unsigned_t = nlohmann::json::number_unsigned_t;
  using number_float_t = nlohmann::json::number_float_t;
  using string_t = nlohmann::json::string_t;
  using binary_t = nlohmann::json::binary_t;

  /// @param stop_after  a key of the document; what follows its value is not read. Empty: read all.
  explicit Builder(std::string_view stop_after) : stop_after_(stop_after) {}

  [[nodiscard]] const std::optional<Error>& error() const { return error_; }
  [[nodiscard]] bool stopped() const { return stopped_; }
  [[nodiscard]] nlohmann::json Take() { return std::move(root_); }

  bool null() { return Add(nullptr); }
  bool boolean(bool value) { return Add(value); }
  bool number_integer(number_integer_t value) { return Add(value); }
  bool number_unsigned(number_unsigned_t value) { return Add(value); }
  bool number_float(number_float_t value, const string_t&) { return Add(value); }
  bool string(string_t& value) { return Add(std::move(value)); }
  bool binary(binary_t&) { return Fail("binary data"); }
  bool start_object(std::size_t) { return Open(nlohmann::json::object()); }
  bool start_array(std::size_t) { return Open(nlohmann::json::array()); }
  bool end_object() { return Close(); }
  bool end_array() { return Close(); }
  bool key(string_t& name) {
    auto& members = open_.back()->get_ref<nlohmann::json::object_t&>();
    const auto [at, added] = members.try_emplace(name, nullptr);
    if (!added) return Fail("key \"" + Printable(name) + "\" appears twice in one object");
    member_ = &at->second;
    if (open_.size() == 1) stop_here_ = !stop_after_.empty() && name == stop_after_;
    return true;
  }
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception& exception) {
    // "[json.exception.parse_error.101] parse error at line 1, column 2: ..."
    std::string_view text = exception.what();
    if (const auto end = text.find("] "); end != std::string_view::npos) text.remove_prefix(end + 2);
    return Fail(Printable(text));
  }

 private:
  bool Fail(std::string message) {
    error_ = Error{std::move(message)};
    return false;
  }
  /// Where the next value belongs.
  nlohmann::json& Place() {
    if (open_.empty()) return root_;
    if (open_.back()->is_object()) return *member_;
    auto& elements = open_.back()->get_ref<nlohmann::json::array_t&>();
    return elements.emplace_back(nullptr);
  }
  template <typename Value>
  bool Add(Value&& value) {
    Place() = std::forward<Value>(value);
    return Continue();
  }
  bool Open(nlohmann::json value) {
    if (open_.size() >= kMaxDepth) return Fail("nested deeper than " + std::to_string(kMaxDepth) + " levels");
    nlohmann::json& place = Place();
    place = std::move(value);
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

  nlohmann::json root_;
  std::vector<nlohmann::json*> open_;
  nlohmann::json* member_ = nullptr;
  std::string_view stop_after_;
  bool stop_here_ = false;
  bool stopped_ = false;
  std::optional<Error> error_;
};

std::string_view TypeName(const nlohmann::json& value) {
  switch (value.type()) {
    case nlohmann::json::value_t::null:
      return "null";
    case nlohmann::json::value_t::object:
      return "an object";
    case nlohmann::json::value_t::array:
      return "an array";
    case nlohmann::json::value_t::string:
      return "text";
    case nlohmann::json::value_t::boolean:
      return "true or false";
    default:
      return "a number";
  }
}

}  // namespace

Result<nlohmann::json> ParseJson(std::string_view text, std::string_view stop_after) {
  Builder builder(stop_after);
  if (!nlohmann::json::sax_parse(text, &builder) && !builder.stopped()) {
    return builder.error().value_or(Error{"not a JSON document"});
  }
  return builder.Take();
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
  known_.reserve(16);
  if (!cursor.value().is_object()) cursor.FailType("an object");
}

const nlohmann::json* ObjectReader::Member(std::string_view key) {
  known_.push_back(key);
  if (!cursor_.value().is_object()) return nullptr;
  const auto it = cursor_.value().find(key);
  return it == cursor_.value().end() ? nullptr : &*it;
}

void ObjectReader::Missing(std::string_view key) const {
  cursor_.Fail("\"" + std::string(key) + "\" is missing");
}

void ObjectReader::Finish() const {
  if (cursor_.failed() || !cursor_.value().is_object()) return;
  for (const auto& [key, value] : cursor_.value().items()) {
    if (std::find(known_.begin(), known_.end(), key) == known_.end()) {
      return cursor_.Fail("unknown key \"" + Printable(key) + "\"");
    }
  }
}

void Read(const Cursor& cursor, bool& out) {
  const auto* value = cursor.value().get_ptr<const nlohmann::json::boolean_t*>();
  if (value == nullptr) return cursor.FailType("true or false");
  out = *value;
}

void Read(const Cursor& cursor, std::string& out) {
  const auto* value = cursor.value().get_ptr<const nlohmann::json::string_t*>();
  if (value == nullptr) return cursor.FailType("text");
  out = *value;
}

void Read(const Cursor& cursor, double& out) {
  if (!cursor.value().is_number()) return cursor.FailType("a number");
  if (const auto* real = cursor.value().get_ptr<const nlohmann::json::number_float_t*>()) {
    out = *real;
  } else if (const auto* natural = cursor.value().get_ptr<const nlohmann::json::number_unsigned_t*>()) {
    out = static_cast<double>(*natural);
  } else if (const auto* integer = cursor.value().get_ptr<const nlohmann::json::number_integer_t*>()) {
    out = static_cast<double>(*integer);
  }
}

std::int64_t ReadInteger(const Cursor& cursor, std::int64_t min, std::int64_t max) {
  std::int64_t result = 0;
  if (const auto* natural = cursor.value().get_ptr<const nlohmann::json::number_unsigned_t*>()) {
    if (*natural > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) {
      cursor.Fail("number too large");
      return 0;
    }
    result = static_cast<std::int64_t>(*natural);
  } else if (const auto* integer = cursor.value().get_ptr<const nlohmann::json::number_integer_t*>()) {
    result = *integer;
  } else if (const auto* text = cursor.value().get_ptr<const nlohmann::json::string_t*>()) {
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
