#include "cli/stream/row_tape.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <string>
#include <system_error>
#include <unistd.h>

namespace ecaudit::cli {
namespace {

/// An open file without a name; -1 when there can be none.
int MakeNameless() {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::temp_directory_path(error);
  if (error) return -1;
  std::string name = (folder / "ecaudit-XXXXXX").string();
  const int fd = ::mkstemp(name.data());
  if (fd >= 0) ::unlink(name.c_str());
  return fd;
}

}  // namespace

void RowTape::Clear() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
  buffer_.clear();
  end_ = at_ = 0;
  failed_ = false;
}

void RowTape::Put(ByteSpan bytes) {
  if (buffer_.size() - end_ < bytes.size()) MakeRoom(bytes.size());
  std::copy(bytes.begin(), bytes.end(), buffer_.begin() + static_cast<std::ptrdiff_t>(end_));
  end_ += bytes.size();
}

void RowTape::MakeRoom(std::size_t bytes) {
  constexpr std::size_t kLeast = 256;
  buffer_.resize(std::max({kLeast, 2 * buffer_.size(), end_ + bytes}));
}

void RowTape::Flush() {
  if (fd_ < 0 && !failed_) fd_ = MakeNameless();
  failed_ = failed_ || fd_ < 0;
  const std::uint8_t* data = buffer_.data();
  for (std::size_t left = end_; left > 0 && !failed_;) {
    const ssize_t written = ::write(fd_, data, left);
    if (written < 0 && errno == EINTR) continue;
    failed_ = written <= 0;
    if (failed_) break;
    data += written;
    left -= static_cast<std::size_t>(written);
  }
  end_ = 0;
}

void RowTape::Rewind() {
  if (fd_ < 0) return;  // all of it is in the buffer
  Flush();
  failed_ = failed_ || ::lseek(fd_, 0, SEEK_SET) != 0;
}

bool RowTape::more() {
  if (failed_) return false;
  if (at_ < end_) return true;
  if (fd_ < 0) return false;
  buffer_.resize(kBufferBytes);
  end_ = at_ = 0;
  ssize_t got = 0;
  do {
    got = ::read(fd_, buffer_.data(), buffer_.size());
  } while (got < 0 && errno == EINTR);
  failed_ = got < 0;
  end_ = got > 0 ? static_cast<std::size_t>(got) : 0;
  return end_ > 0;
}

std::uint64_t RowTape::TakeLong() {
  std::uint64_t value = 0;
  for (unsigned shift = 0; shift < 64; shift += 7) {
    const std::uint8_t byte = TakeByte();
    value |= static_cast<std::uint64_t>(byte & 0x7FU) << shift;
    if ((byte & 0x80U) == 0) break;
  }
  return value;
}

void RowTape::Take(std::vector<std::uint8_t>& out, std::size_t size) {
  out.clear();
  for (std::size_t i = 0; i < size && more(); ++i) out.push_back(buffer_[at_++]);
}

}  // namespace ecaudit::cli
