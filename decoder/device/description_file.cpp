#include "decoder/device/description_file.h"

#include <utility>

#include "decoder/base/regular_file.h"
#include "decoder/base/text.h"

namespace ecaudit::device {

Result<std::string> ReadDescriptionFile(const std::filesystem::path& path, std::uintmax_t limit) {
  const std::string name = Printable(path.string());
  FileContent content = ReadRegularFile(path.string(), limit);
  switch (content.outcome) {
    case FileContent::Outcome::kRead:
      return std::move(content.text);
    case FileContent::Outcome::kMissing:
      return Error{name + ": no such file"};
    case FileContent::Outcome::kFolder:
    case FileContent::Outcome::kOtherKind:
      return Error{name + ": not a file"};
    case FileContent::Outcome::kTooLarge:
      return Error{name + ": larger than " + Grouped(limit) + " bytes"};
    case FileContent::Outcome::kFailed:
      break;
  }
  return Error{name + ": cannot be read"};
}

}  // namespace ecaudit::device
