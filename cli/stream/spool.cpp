#include "cli/stream/spool.h"

#include <array>
#include <cerrno>
#include <fcntl.h>
#include <filesystem>
#include <poll.h>
#include <system_error>
#include <unistd.h>

#include "cli/interrupt.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

Error Failed(const std::string& what) {
  return Error{what + ": " + std::generic_category().message(errno)};
}

/// All bytes, or false with errno.
bool WriteAll(int fd, const char* data, std::size_t size) {
  while (size > 0) {
    const ssize_t written = ::write(fd, data, size);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    data += written;
    size -= static_cast<std::size_t>(written);
  }
  return true;
}

}  // namespace

Spool::Spool(int fd) : fd_(fd), path_("/dev/fd/" + std::to_string(fd)) {}

Spool::~Spool() {
  ::close(fd_);
}

bool Spool::CanBeReadTwice(const std::string& path) {
  std::error_code ignored;
  return path != "-" && !std::filesystem::is_fifo(path, ignored) &&
         !std::filesystem::is_character_file(path, ignored) && !std::filesystem::is_socket(path, ignored);
}

Result<std::unique_ptr<Spool>> Spool::Read(const std::string& path) {
  const int in = path == "-" ? ::dup(STDIN_FILENO) : ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (in < 0) return Failed("cannot read " + (path == "-" ? "standard input" : Printable(path)));
  const std::unique_ptr<Spool> input(new Spool(in));

  std::error_code ignored;
  std::string name = (std::filesystem::temp_directory_path(ignored) / "ecaudit-XXXXXX").string();
  const int fd = ::mkstemp(name.data());
  if (fd < 0) return Failed("cannot keep the capture in " + name);
  std::unique_ptr<Spool> spool(new Spool(fd));
  ::unlink(name.c_str());
  std::array<char, 1U << 16U> buffer;
  while (!InterruptFlag()) {
    constexpr int kLookEveryMs = 100;
    pollfd waiting{in, POLLIN, 0};
    if (::poll(&waiting, 1, kLookEveryMs) == 0) continue;  // a pipe that gives nothing must not hold up Ctrl-C
    const ssize_t got = ::read(in, buffer.data(), buffer.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return Failed("cannot read " + (path == "-" ? "standard input" : Printable(path)));
    if (got == 0) break;
    if (!WriteAll(fd, buffer.data(), static_cast<std::size_t>(got))) {
      return Failed("cannot keep the capture in a temporary file");
    }
  }
  return spool;
}

}  // namespace ecaudit::cli
