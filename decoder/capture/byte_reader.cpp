#include "decoder/capture/byte_reader.h"

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <unistd.h>

namespace ecaudit::capture {
namespace {

class FdReader final : public ByteReader {
 public:
  FdReader(int fd, bool owned) : fd_(fd), owned_(owned) {}
  ~FdReader() override {
    if (owned_) ::close(fd_);
  }

  std::size_t Read(std::span<std::uint8_t> out, std::string& error) override {
    for (;;) {
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
  int fd_;
  bool owned_;
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

std::unique_ptr<ByteReader> MakeFdReader(int fd, bool owned) {
  return std::make_unique<FdReader>(fd, owned);
}
std::unique_ptr<ByteReader> MakeMemoryReader(ByteSpan bytes) {
  return std::make_unique<MemoryReader>(bytes);
}

}  // namespace ecaudit::capture
