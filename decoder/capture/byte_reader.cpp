#include "decoder/capture/byte_reader.h"

#include <algorithm>
#include <cerrno>
#include <optional>
#include <system_error>

#include "decoder/base/system/files.h"

namespace ecaudit::capture {
namespace {

/// False for files and devices that answer at once.
bool MayKeepWaiting(int fd) {
  const std::optional<system::FileStatus> status = system::StatusOf(fd);
  return !status || (status->kind != system::FileKind::kRegular && status->kind != system::FileKind::kBlockDevice);
}

class FdReader final : public ByteReader {
 public:
  FdReader(int fd, bool owned, const std::atomic<bool>* stop)
      : fd_(fd), owned_(owned), stop_(stop), waits_(stop != nullptr && MayKeepWaiting(fd)) {}
  ~FdReader() override {
    if (owned_) system::Close(fd_);
  }

  std::size_t Read(std::span<std::uint8_t> out, std::string& error) override {
    if (waits_ && !WaitForBytes()) return 0;
    const std::ptrdiff_t got = system::Read(fd_, out);
    if (got < 0) {
      error = "cannot read on: " + std::generic_category().message(errno);
      return 0;
    }
    count_ += static_cast<std::uint64_t>(got);
    return static_cast<std::size_t>(got);
  }
  std::uint64_t source_bytes() const override { return count_; }

 private:
  /// Waits until something can be read, or the end; false when it is not wanted any more.
  [[nodiscard]] bool WaitForBytes() const {
    constexpr int kPollEveryMs = 100;
    while (!stop_->load(std::memory_order_relaxed)) {
      if (system::WaitForBytes(fd_, kPollEveryMs)) return true;
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
    std::ranges::copy(part, out.begin());
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
  return system::OpenToRead(path, stop != nullptr ? system::Open::kAtOnce : system::Open::kWaits);
}

std::unique_ptr<ByteReader> MakeFdReader(int fd, bool owned, const std::atomic<bool>* stop) {
  return std::make_unique<FdReader>(fd, owned, stop);
}
std::unique_ptr<ByteReader> MakeMemoryReader(ByteSpan bytes) {
  return std::make_unique<MemoryReader>(bytes);
}

}  // namespace ecaudit::capture
