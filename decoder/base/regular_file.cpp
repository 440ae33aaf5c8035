#include "decoder/base/regular_file.h"

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace ecaudit {
namespace {

using Outcome = FileContent::Outcome;

constexpr std::size_t kStep = std::size_t{64} << 10U;

void ReadAll(int fd, std::uintmax_t largest, FileContent& content) {
  struct stat status {};
  if (::fstat(fd, &status) != 0) {
    content.reason = errno;
    return;
  }
  if (!S_ISREG(status.st_mode)) {
    content.outcome = S_ISDIR(status.st_mode) ? Outcome::kFolder : Outcome::kOtherKind;
    return;
  }
  content.outcome = Outcome::kTooLarge;
  if (static_cast<std::uintmax_t>(status.st_size) > largest) return;
  // One byte more than it states: whether it ends there.
  content.text.resize(static_cast<std::size_t>(status.st_size) + 1);
  std::size_t filled = 0;
  for (;;) {
    const ssize_t got = ::read(fd, content.text.data() + filled, content.text.size() - filled);
    if (got < 0 && errno == EINTR) continue;
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
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (fd < 0) {
    content.reason = errno;
    content.outcome = errno == ENOENT || errno == ENOTDIR ? Outcome::kMissing : Outcome::kFailed;
    return content;
  }
  ReadAll(fd, largest, content);
  ::close(fd);
  if (content.outcome != Outcome::kRead) content.text.clear();
  return content;
}

}  // namespace ecaudit
