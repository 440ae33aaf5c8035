#include "cli/stream/row_tape.h"

#include <algorithm>

#include "decoder/base/system/files.h"

namespace ecaudit::cli {
void RowTape::Clear() {
  if (fd_ >= 0) system::Close(fd_);
  fd_ = -1;
  buffer_.clear();
  end_ = at_ = 0;
  failed_ = false;
}

void RowTape::Put(ByteSpan bytes) {
  if (buffer_.size() - end_ < bytes.size()) MakeRoom(bytes.size());
  std::ranges::copy(bytes, buffer_.begin() + static_cast<std::ptrdiff_t>(end_));
  end_ += bytes.size();
}

void RowTape::MakeRoom(std::size_t bytes) {
  constexpr std::size_t kLeast = 256;
  buffer_.resize(std::max({kLeast, 2 * buffer_.size(), end_ + bytes}));
}

void RowTape::Flush() {
  if (fd_ < 0 && !failed_) fd_ = system::MakeNameless().fd;
  failed_ = failed_ || fd_ < 0;
  failed_ = failed_ || !system::WriteAll(fd_, {reinterpret_cast<const char*>(buffer_.data()), end_});
  end_ = 0;
}

void RowTape::Rewind() {
  if (fd_ < 0) return;  // all of it is in the buffer
  Flush();
  failed_ = failed_ || !system::Rewind(fd_);
}

bool RowTape::more() {
  if (failed_) return false;
  if (at_ < end_) return true;
  if (fd_ < 0) return false;
  buffer_.resize(kBufferBytes);
  end_ = at_ = 0;
  const std::ptrdiff_t got = system::Read(fd_, buffer_);
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
