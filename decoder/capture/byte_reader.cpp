#include "decoder/capture/byte_reader.h"

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

namespace ecaudit::capture {
namespace {

/// False for files and devices that answer at once.
bool MayKeepWaiting(int fd) {
  struct stat status {};
  return ::fstat(fd, &status) != 0 || !(S_ISREG(status.st_mode) || S_ISBLK(status.st_mode));
}

class FdReader final : public ByteReader {
 public:
  FdReader(int fd, bool owned, const std::atomic<bool>* stop)
      : fd_(fd), owned_(owned), stop_(stop), waits_(stop != nullptr && MayKeepWaiting(fd)) {}
  ~FdReader() override {
    if (owned_) ::close(fd_);
  }

  std::size_t Read(std::span<std::uint8_t> out, std::string& error) override {
    for (;;) {
      if (waits_ && !WaitForBytes()) return 0;
      const ssize_t got = ::read(fd_, out.data(), out.size());
      if (got >= 0) {
        count_ += static_cast<std::uint64_t>(got);
        return static_cast<std::size_t>(got);
      }
      if (errno == EINTR) continue;
      error = "cannot read on: " + std::generic_category().message(errno);
      return 0;
    }
  }
  std::uint64_t source_bytes() const override { return count_; }

 private:
  /// Waits until something can be read, or the end; false when it is not wanted any more.
  [[nodiscard]] bool WaitForBytes() const {
    constexpr int kPollEveryMs = 100;
    while (!stop_->load(std::memory_order_relaxed)) {
      pollfd waiting{fd_, POLLIN, 0};
      if (::poll(&waiting, 1, kPollEveryMs) != 0 && errno != EINTR) return true;
      if (waiting.revents != 0) return true;
    }
    return false;
  }

  int fd_;
  bool owned_;
  const std::atomic<bool>* stop_;
  bool waits_;
  std::uint64_t count_ = 0;
};

class MemoryReader final : public ByteReader {
 public:
  explicit MemoryReader(ByteSpan bytes) : bytes_(bytes) {}

  std::size_t Read(std::span<std::uint8_t> out, std::string& /*error*/) override {
    const ByteSpan part = Slice(bytes_, position_, out.size());
    std::copy(part.begin(), part.end(), out.begin());
    position_ += part.size();
    return part.size();
  }
  std::uint64_t source_bytes() const override { return position_; }

 private:
  ByteSpan bytes_;
  std::size_t position_ = 0;
};

}  // namespace

int OpenToRead(const std::string& path, const std::atomic<bool>* stop) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | (stop != nullptr ? O_NONBLOCK : 0));
  if (fd >= 0 && stop != nullptr) ::fcntl(fd, F_SETFL, ::fcntl(fd, F_GETFL) & ~O_NONBLOCK);
  return fd;
}

std::unique_ptr<ByteReader> MakeFdReader(int fd, bool owned, const std::atomic<bool>* stop) {
  return std::make_unique<FdReader>(fd, owned, stop);
}
std::unique_ptr<ByteReader> MakeMemoryReader(ByteSpan bytes) {
  return std::make_unique<MemoryReader>(bytes);
}

}  // namespace ecaudit::capture
