/// The bytes under an InputStream: a file descriptor, memory, or a decompressor over one of them.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "decoder/base/bytes.h"

namespace ecaudit::capture {

class ByteReader {
 public:
  ByteReader() = default;
  ByteReader(const ByteReader&) = delete;
  ByteReader& operator=(const ByteReader&) = delete;
  virtual ~ByteReader() = default;

  /// Reads 1 to out.size() bytes.
  /// @param error  set to one line when the source fails, if need be together with the last good bytes
  /// @return how many; 0 at the end or after a failure
  [[nodiscard]] virtual std::size_t Read(std::span<std::uint8_t> out, std::string& error) = 0;
  /// Bytes taken from the file itself so far, compressed as they lie there.
  [[nodiscard]] virtual std::uint64_t source_bytes() const = 0;
};

/// Opens a file for MakeFdReader().
/// @param stop  as there. Where it is given, a named pipe without a writer opens at once, and is waited for in
///              Read(), which can be stopped; else here.
/// @return the descriptor; -1 with errno when the file does not open
[[nodiscard]] int OpenToRead(const std::string& path, const std::atomic<bool>* stop);
/// Reads `fd` from where it stands; closes it at the end when `owned`.
/// @param stop  once it is set, the bytes end, within a moment also where a pipe gives none; null: never
std::unique_ptr<ByteReader> MakeFdReader(int fd, bool owned, const std::atomic<bool>* stop);
/// Reads `bytes`, which must outlive the reader.
std::unique_ptr<ByteReader> MakeMemoryReader(ByteSpan bytes);

/// Decompresses all members of a gzip file; zero bytes after the last one are padding (as tape and block devices add).
/// @param head  bytes already taken from `source`
std::unique_ptr<ByteReader> MakeGzipReader(std::unique_ptr<ByteReader> source, ByteSpan head);
/// Decompresses all frames of a zstd file; a frame that wants a window above 128 MiB is an error, not an allocation.
/// @param head  bytes already taken from `source`
std::unique_ptr<ByteReader> MakeZstdReader(std::unique_ptr<ByteReader> source, ByteSpan head);

}  // namespace ecaudit::capture
