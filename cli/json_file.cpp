#include "cli/json_file.h"

#include <algorithm>
#include <utility>

#include "decoder/base/regular_file.h"
#include "decoder/base/system/files.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

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
  FileContent content = ReadRegularFile(path, largest);
  switch (content.outcome) {
    case FileContent::Outcome::kRead:
      return std::move(content.text);
    case FileContent::Outcome::kMissing:
      return Error{"no such file: " + path};
    case FileContent::Outcome::kFolder:
      return Error{path + " is a directory, not a file"};
    case FileContent::Outcome::kOtherKind:
      return Error{path + " is a pipe or device, not a file"};
    case FileContent::Outcome::kTooLarge:
      return Error{path + " is too large (more than " + std::to_string(largest >> 20U) + " MiB)"};
    case FileContent::Outcome::kFailed:
      break;
  }
  return Error{"cannot read " + path + ": " + system::ReasonText(content.reason)};
}

Result<JsonDocument> ReadJsonFile(const std::string& path, std::uintmax_t largest) {
  const Result<std::string> text = ReadSmallFile(path, largest);
  if (!text) return text.error();
  JsonReading reading = ReadJson(*text);
  if (!reading.document) return Error{path + LineAndColumn(*text, reading.position) + ": not valid JSON"};
  if (reading.repeated_key && largest == kLargestWritten) {
    return Error{path + ": the key '" + Printable(*reading.repeated_key) + "' appears twice in one object"};
  }
  return std::move(*reading.document);
}

std::optional<Error> CheckReplaced(const std::string& path, std::string_view schema, std::string_view noun) {
  const std::optional<system::FileStatus> status = system::StatusOf(path);
  if (!status || status->kind != system::FileKind::kRegular || status->bytes == 0) return std::nullopt;
  const Result<JsonDocument> document = ReadJsonFile(path);
  if (document && document->root().member("schema").is_text(schema)) return std::nullopt;
  return Error{Printable(path) + " exists and is not " + std::string(noun) + "; it will not be overwritten"};
}

}  // namespace ecaudit::cli
