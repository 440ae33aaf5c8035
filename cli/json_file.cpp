#include "cli/json_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <system_error>
#include <vector>

#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

/// Finds where a text stops being JSON, which the parser without exceptions does not tell otherwise.
class ErrorLocator : public nlohmann::json_sax<nlohmann::json> {
 public:
  [[nodiscard]] std::size_t position() const { return position_; }

  bool null() override { return true; }
  bool boolean(bool /*value*/) override { return true; }
  bool number_integer(number_integer_t /*value*/) override { return true; }
  bool number_unsigned(number_unsigned_t /*value*/) override { return true; }
  bool number_float(number_float_t /*value*/, const string_t& /*text*/) override { return true; }
  bool string(string_t& /*value*/) override { return true; }
  bool binary(binary_t& /*value*/) override { return true; }
  bool start_object(std::size_t /*elements*/) override { return true; }
  bool key(string_t& /*value*/) override { return true; }
  bool end_object() override { return true; }
  bool start_array(std::size_t /*elements*/) override { return true; }
  bool end_array() override { return true; }
  bool parse_error(std::size_t position, const std::string& /*token*/,
                   const nlohmann::detail::exception& /*e*/) override {
    position_ = position;
    return false;
  }

 private:
  std::size_t position_ = 0;
};

/// Finds a key that an object has twice: the parser would take the last one without a word.
class RepeatedKey : public ErrorLocator {
 public:
  [[nodiscard]] const std::string& key() const { return repeated_; }

  bool start_object(std::size_t /*elements*/) override {
    keys_.emplace_back();
    return true;
  }
  bool key(string_t& key) override {
    if (keys_.back().insert(key).second) return true;
    repeated_ = key;
    return false;
  }
  bool end_object() override {
    keys_.pop_back();
    return true;
  }

 private:
  std::vector<std::set<std::string>> keys_;
  std::string repeated_;
};

/// ":3:14" for the byte before `position` (which counts from 1).
std::string LineAndColumn(const std::string& text, std::size_t position) {
  const std::size_t at = std::min(position == 0 ? 0 : position - 1, text.size());
  const auto begin = text.begin();
  const auto end = begin + static_cast<std::ptrdiff_t>(at);
  const auto line = std::count(begin, end, '\n') + 1;
  const std::size_t line_start = at == 0 ? std::string::npos : text.rfind('\n', at - 1);
  const std::size_t column = line_start == std::string::npos ? at + 1 : at - line_start;
  return ":" + std::to_string(line) + ":" + std::to_string(column);
}

}  // namespace

Result<std::string> ReadSmallFile(const std::string& path, std::uintmax_t largest) {
  std::error_code code;
  const auto status = std::filesystem::status(path, code);
  if (!std::filesystem::exists(status)) return Error{"no such file: " + path};
  if (std::filesystem::is_directory(status)) return Error{path + " is a directory, not a file"};
  if (std::filesystem::is_regular_file(status) && std::filesystem::file_size(path, code) > largest) {
    return Error{path + " is too large (more than " + std::to_string(largest >> 20U) + " MiB)"};
  }
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{"cannot read " + path + ": " + std::strerror(errno)};
  std::string text((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (file.bad()) return Error{"cannot read " + path};
  return text;
}

Result<nlohmann::json> ReadJsonFile(const std::string& path, std::uintmax_t largest) {
  const Result<std::string> text = ReadSmallFile(path, largest);
  if (!text) return text.error();
  auto document = nlohmann::json::parse(*text, nullptr, false);
  if (document.is_discarded()) {
    ErrorLocator locator;
    nlohmann::json::sax_parse(*text, &locator);
    return Error{path + LineAndColumn(*text, locator.position()) + ": not valid JSON"};
  }
  if (largest == kLargestWritten) {
    RepeatedKey repeated;
    if (!nlohmann::json::sax_parse(*text, &repeated)) {
      return Error{path + ": the key '" + Printable(repeated.key()) + "' stands twice in one object"};
    }
  }
  return document;
}

std::optional<Error> CheckReplaced(const std::string& path, std::string_view schema, std::string_view noun) {
  std::error_code code;
  if (!std::filesystem::is_regular_file(path, code) || std::filesystem::file_size(path, code) == 0) return std::nullopt;
  const Result<nlohmann::json> document = ReadJsonFile(path);
  if (document && document->is_object() && document->value("schema", nlohmann::json()) == schema) return std::nullopt;
  return Error{Printable(path) + " is there already and no " + std::string(noun) + "; it will not be overwritten"};
}

}  // namespace ecaudit::cli
