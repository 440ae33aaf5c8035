/// in: a file, standard input or memory, plain or gzip- or zstd-compressed.  out: its bytes in order, decompressed.
///
/// The bytes lie in one window that is reused: Peek() shows them without a copy, Consume() lets go of them. Memory is
/// the window (256 KiB, growing only to the largest Peek() that the input could fill) plus what the decompressor needs
/// (gzip 64 KiB, zstd at most its 128 MiB window), however much the input expands to.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "decoder/base/bytes.h"
#include "decoder/base/result.h"
#include "decoder/capture/byte_reader.h"

namespace ecaudit::capture {

enum class Compression : std::uint8_t { kNone, kGzip, kZstd };

class InputStream {
 public:
  /// More decompressed bytes than this are taken for a decompression bomb, ...
  static constexpr std::uint64_t kDefaultDecompressedLimit = 1ULL << 40U;  // 1 TiB
  /// ... and so is what expands to more than this multiple of its size, once it is larger than kSmallBytes. Captures
  /// with clocks and counters in every frame do not come near.
  static constexpr std::uint64_t kMostTimes = 200;
  static constexpr std::uint64_t kSmallBytes = 256ULL << 20U;

  /// @param path  a file, or "-" for standard input
  /// @param decompressed_limit  in bytes; plain input has no limit
  /// @return the stream at its first byte; or one line: "no such file: x", "x is a directory, not a capture",
  ///         "cannot read x: permission denied". An empty file opens.
  /// @param stop  once it is set the input ends, also where a pipe gives nothing; null: never
  static Result<std::unique_ptr<InputStream>> Open(const std::string& path,
                                                   std::uint64_t decompressed_limit = kDefaultDecompressedLimit,
                                                   const std::atomic<bool>* stop = nullptr);
  /// Reads `fd` (file, pipe, socket) from where it stands; closes it in the end when `owned`.
  static std::unique_ptr<InputStream> FromFd(int fd, bool owned,
                                             std::uint64_t decompressed_limit = kDefaultDecompressedLimit,
                                             const std::atomic<bool>* stop = nullptr);
  /// Reads `bytes`, which must outlive the stream.
  static std::unique_ptr<InputStream> FromMemory(ByteSpan bytes,
                                                 std::uint64_t decompressed_limit = kDefaultDecompressedLimit);

  /// Shows the next bytes: at least `count` of them, or fewer when the input ends or fails before.
  /// The span is valid until the next call of Peek() or Skip().
  [[nodiscard]] ByteSpan Peek(std::size_t count) {
    if (end_ - begin_ < count) Fill(count);
    return {window_.data() + begin_, end_ - begin_};
  }
  /// Lets go of `count` bytes, at most as many as Peek() has shown.
  void Consume(std::size_t count) {
    const std::size_t taken = count < end_ - begin_ ? count : end_ - begin_;
    begin_ += taken;
    offset_ += taken;
  }
  /// Passes over `count` bytes. False when the input ends or fails before.
  [[nodiscard]] bool Skip(std::uint64_t count);

  /// Why the input failed, one line without a full stop ("the gzip data end early"); empty while it has not. The bytes
  /// before the failure are all handed out.
  [[nodiscard]] const std::string& error() const { return error_; }
  /// The input was ended on request: its end is no damage.
  [[nodiscard]] bool stopped() const { return stop_ != nullptr && stop_->load(std::memory_order_relaxed); }
  [[nodiscard]] Compression compression() const { return compression_; }
  /// Decompressed bytes consumed so far.
  [[nodiscard]] std::uint64_t offset() const { return offset_; }
  /// Bytes of the file itself read so far (a window ahead of offset()), and its size, 0 when unknown as for a pipe.
  [[nodiscard]] std::uint64_t bytes_read() const { return reader_->source_bytes(); }
  [[nodiscard]] std::uint64_t bytes_total() const { return total_; }

 private:
  InputStream(std::unique_ptr<ByteReader> reader, std::uint64_t total, std::uint64_t decompressed_limit);
  void Fill(std::size_t count);
  /// Takes the next bytes from the reader into `out`; 0 at the end or at a failure.
  std::size_t Produce(std::span<std::uint8_t> out);

  std::unique_ptr<ByteReader> reader_;
  std::vector<std::uint8_t> window_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  bool ended_ = false;
  Compression compression_ = Compression::kNone;
  std::uint64_t offset_ = 0;
  std::uint64_t produced_ = 0;
  std::uint64_t limit_;
  std::uint64_t total_;
  const std::atomic<bool>* stop_ = nullptr;
  std::string error_;
};

}  // namespace ecaudit::capture
