#include "decoder/device/description_file.h"

#include <fstream>
#include <system_error>

#include "decoder/base/text.h"

namespace ecaudit::device {

Result<std::string> ReadDescriptionFile(const std::filesystem::path& path, std::uintmax_t limit) {
  const std::string name = Printable(path.string());
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (error || !std::filesystem::exists(status)) return Error{name + ": no such file"};
  if (!std::filesystem::is_regular_file(status)) return Error{name + ": not a file"};
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) return Error{name + ": " + error.message()};
  if (size > limit) return Error{name + ": larger than " + Grouped(limit) + " bytes"};
  std::ifstream stream(path, std::ios::binary);
  std::string text(static_cast<std::size_t>(size), '\0');
  if (!stream || !stream.read(text.data(), static_cast<std::streamsize>(size))) {
    return Error{name + ": cannot be read"};
  }
  return text;
}

}  // namespace ecaudit::device
