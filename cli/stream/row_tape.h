/// Rows kept until the columns are known: bytes that are written once from front to back, and then read so.
///
/// Few stay in memory; more lie in a file without a name.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "decoder/base/bytes.h"

namespace ecaudit::cli {

class RowTape {
 public:
  RowTape() = default;
  RowTape(const RowTape&) = delete;
  RowTape& operator=(const RowTape&) = delete;
  ~RowTape() { Clear(); }

  /// Forgets everything, also that something failed.
  void Clear();
  /// A file could not be made or written: what was kept is of no use.
  [[nodiscard]] bool failed() const { return failed_; }

  void Put(ByteSpan bytes);
  /// Small numbers take few bytes.
  void PutNumber(std::uint64_t value) {
    if (value >= 0x80) return PutLong(value);
    buffer_.push_back(static_cast<std::uint8_t>(value));
  }
  /// Likewise; small are those near 0.
  void PutSigned(std::int64_t value) {
    constexpr std::uint64_t kAllBits = ~std::uint64_t{0};
    PutNumber((static_cast<std::uint64_t>(value) & kAllBits >> 1U) << 1U ^ (value < 0 ? kAllBits : 0));
  }
  /// Call it between rows: hands what came so far to the file when it is much.
  void EndRow() {
    if (buffer_.size() >= kBufferBytes) Flush();
  }

  /// Nothing more is written; reading begins at the front.
  void Rewind();
  /// There is more to read.
  [[nodiscard]] bool more();
  [[nodiscard]] std::uint64_t TakeNumber() {
    return at_ < buffer_.size() && buffer_[at_] < 0x80 ? buffer_[at_++] : TakeLong();
  }
  [[nodiscard]] std::int64_t TakeSigned() {
    const std::uint64_t value = TakeNumber();
    return static_cast<std::int64_t>(value >> 1U ^ ((value & 1U) != 0 ? ~std::uint64_t{0} : 0));
  }
  void Take(std::vector<std::uint8_t>& out, std::size_t size);

 private:
  static constexpr std::size_t kBufferBytes = std::size_t{64} << 10U;

  void Flush();
  void PutLong(std::uint64_t value);
  [[nodiscard]] std::uint64_t TakeLong();
  [[nodiscard]] std::uint8_t TakeByte() { return more() ? buffer_[at_++] : std::uint8_t{0}; }

  std::vector<std::uint8_t> buffer_;
  std::size_t at_ = 0;  ///< read up to here
  int fd_ = -1;
  bool failed_ = false;
};

}  // namespace ecaudit::cli
