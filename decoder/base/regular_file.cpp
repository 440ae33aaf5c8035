#include "decoder/base/regular_file.h"

#include <cerrno>
#include <span>

#include "decoder/base/system/files.h"

namespace ecaudit {
namespace {

using Outcome = FileContent::Outcome;

constexpr std::size_t kStep = std::size_t{64} << 10U;

void ReadAll(int fd, std::uintmax_t largest, FileContent& content) {
  const std::optional<system::FileStatus> status = system::StatusOf(fd);
  if (!status) {
    content.reason = errno;
    return;
  }
  if (status->kind != system::FileKind::kRegular) {
    content.outcome = status->kind == system::FileKind::kFolder ? Outcome::kFolder : Outcome::kOtherKind;
    return;
  }
  content.outcome = Outcome::kTooLarge;
  if (status->bytes > largest) return;
  // One byte more than it states: whether it ends there.
  content.text.resize(static_cast<std::size_t>(status->bytes) + 1);
  std::size_t filled = 0;
  for (;;) {
    const std::span<char> room = std::span(content.text).subspan(filled);
    const std::ptrdiff_t got = system::Read(fd, {reinterpret_cast<std::uint8_t*>(room.data()), room.size()});
    if (got < 0) {
      content.outcome = Outcome::kFailed;
      content.reason = errno;
      return;
    }
    filled += static_cast<std::size_t>(got);
    if (filled > largest) return;
    if (got == 0) break;
    if (filled == content.text.size()) content.text.resize(filled + kStep);
  }
  content.text.resize(filled);
  content.outcome = Outcome::kRead;
}

}  // namespace

FileContent ReadRegularFile(const std::string& path, std::uintmax_t largest) {
  FileContent content;
  // Opening a pipe without a writer must not wait.
  const int fd = system::OpenToRead(path);
  if (fd < 0) {
    content.reason = errno;
    content.outcome = errno == ENOENT || errno == ENOTDIR ? Outcome::kMissing : Outcome::kFailed;
    return content;
  }
  ReadAll(fd, largest, content);
  system::Close(fd);
  if (content.outcome != Outcome::kRead) content.text.clear();
  return content;
}

}  // namespace ecaudit
