#include "decoder/capture/input_stream.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>
#include <utility>

#include "decoder/base/system/files.h"
#include "decoder/base/text.h"

namespace ecaudit::capture {
namespace {

constexpr std::size_t kWindowBytes = std::size_t{256} * 1024;
constexpr std::uint32_t kZstdMagic = 0xFD2FB528;
constexpr std::uint32_t kZstdSkippableMagic = 0x184D2A50;  // and the 15 numbers above it

Compression Sniff(ByteSpan head) {
  if (Fits(head, 0, 2) && head[0] == 0x1F && head[1] == 0x8B) return Compression::kGzip;
  if (!Fits(head, 0, 4)) return Compression::kNone;
  const auto magic = LittleEndian<std::uint32_t>(head, 0);
  return magic == kZstdMagic || (magic & 0xFFFFFFF0U) == kZstdSkippableMagic ? Compression::kZstd : Compression::kNone;
}

std::uint64_t RegularSize(int fd) {
  const std::optional<system::FileStatus> status = system::StatusOf(fd);
  return status && status->kind == system::FileKind::kRegular ? status->bytes : 0;
}

}  // namespace

Result<std::unique_ptr<InputStream>> InputStream::Open(const std::string& path, std::uint64_t decompressed_limit,
                                                       const std::atomic<bool>* stop) {
  if (path == "-") return FromFd(system::kStandardInput, false, decompressed_limit, stop);
  const int fd = OpenToRead(path, stop);
  if (fd < 0) {
    const int reason = errno;
    if (reason == ENOENT) return Error{"no such file: " + Printable(path)};
    std::string why = system::ReasonText(reason);
    if (reason == EACCES) why = "permission denied";
    return Error{"cannot read " + Printable(path) + ": " + why};
  }
  const std::optional<system::FileStatus> status = system::StatusOf(fd);
  if (status && status->kind == system::FileKind::kFolder) {
    system::Close(fd);
    return Error{Printable(path) + " is a directory, not a capture"};
  }
  return FromFd(fd, true, decompressed_limit, stop);
}

std::unique_ptr<InputStream> InputStream::FromFd(int fd, bool owned, std::uint64_t decompressed_limit,
                                                 const std::atomic<bool>* stop) {
  const std::uint64_t size = RegularSize(fd);
  std::unique_ptr<InputStream> stream(new InputStream(MakeFdReader(fd, owned, stop), size, decompressed_limit));
  stream->stop_ = stop;
  return stream;
}

std::unique_ptr<InputStream> InputStream::FromMemory(ByteSpan bytes, std::uint64_t decompressed_limit) {
  return std::unique_ptr<InputStream>(new InputStream(MakeMemoryReader(bytes), bytes.size(), decompressed_limit));
}

InputStream::InputStream(std::unique_ptr<ByteReader> reader, std::uint64_t total, std::uint64_t decompressed_limit)
    : reader_(std::move(reader)), window_(kWindowBytes), limit_(decompressed_limit), total_(total) {
  const ByteSpan head = Peek(4);
  compression_ = Sniff(head);
  if (compression_ == Compression::kNone) return;
  reader_ = compression_ == Compression::kGzip ? MakeGzipReader(std::move(reader_), head)
                                               : MakeZstdReader(std::move(reader_), head);
  begin_ = 0;
  end_ = 0;
  produced_ = 0;
  ended_ = false;
}

void InputStream::Fill(std::size_t count) {
  if (ended_) return;
  if (begin_ > 0) {
    std::memmove(window_.data(), window_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  while (end_ < count && !ended_) {
    // Grows only after bytes that really came: a length field alone cannot make it allocate.
    if (end_ == window_.size()) window_.resize(std::min(window_.size() * 2, std::max(count, window_.size() + 1)));
    end_ += Produce(std::span(window_).subspan(end_));
  }
}

std::size_t InputStream::Produce(std::span<std::uint8_t> out) {
  if (stopped()) {
    ended_ = true;
    return 0;
  }
  std::size_t got = reader_->Read(out, error_);
  ended_ = got == 0 || !error_.empty();
  if (compression_ != Compression::kNone && got > limit_ - produced_) {
    got = static_cast<std::size_t>(limit_ - produced_);
    error_ = "the compressed data expand to more than " + Grouped(limit_) + " bytes";
    ended_ = true;
  }
  produced_ += got;
  if (compression_ != Compression::kNone && produced_ > kSmallBytes &&
      produced_ / kMostTimes > reader_->source_bytes() && error_.empty()) {
    error_ = "the compressed data expand to more than " + std::to_string(kMostTimes) + " times their size";
    ended_ = true;
  }
  return got;
}

bool InputStream::Skip(std::uint64_t count) {
  while (count > 0) {
    const std::size_t available = Peek(1).size();
    if (available == 0) return false;
    const auto step = static_cast<std::size_t>(std::min<std::uint64_t>(count, available));
    Consume(step);
    count -= step;
  }
  return true;
}

}  // namespace ecaudit::capture
