/// Rows kept until the columns are known: bytes that are written once from front to back, and then read so.
///
/// Few stay in memory; more lie in a file without a name.
#pragma once

#include <cstddef>
#include <cstdint>
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
  void PutNumber(std::uint64_t value) { PutUpTo(PutAt(RoomForNumbers(1), value)); }
  /// Likewise; small are those near 0.
  void PutSigned(std::int64_t value) {
    constexpr std::uint64_t kAllBits = ~std::uint64_t{0};
    PutNumber((static_cast<std::uint64_t>(value) & kAllBits >> 1U) << 1U ^ (value < 0 ? kAllBits : 0));
  }
  /// Many numbers at once: PutAt() each of them in room for all, then PutUpTo() the end.
  [[nodiscard]] std::uint8_t* RoomForNumbers(std::size_t count) {
    if (buffer_.size() - end_ < count * kLongestNumber) MakeRoom(count * kLongestNumber);
    return buffer_.data() + end_;
  }
  [[nodiscard]] static std::uint8_t* PutAt(std::uint8_t* to, std::uint64_t value) {
    for (; value >= 0x80; value >>= 7U) *to++ = static_cast<std::uint8_t>(value | 0x80U);
    *to++ = static_cast<std::uint8_t>(value);
    return to;
  }
  void PutUpTo(const std::uint8_t* end) { end_ = static_cast<std::size_t>(end - buffer_.data()); }
  /// Call it between rows: hands what came so far to the file when it is much.
  void EndRow() {
    if (end_ >= kBufferBytes) Flush();
  }

  /// Nothing more is written; reading begins at the front.
  void Rewind();
  /// There is more to read.
  [[nodiscard]] bool more();
  [[nodiscard]] std::uint64_t TakeNumber() {
    if (end_ - at_ < kLongestNumber) return TakeLong();
    const std::uint8_t* from = buffer_.data() + at_;
    std::uint64_t value = *from & 0x7FU;
    for (unsigned shift = 7; *from >= 0x80 && shift < 64; shift += 7) {
      value |= static_cast<std::uint64_t>(*++from & 0x7FU) << shift;
    }
    at_ = static_cast<std::size_t>(from + 1 - buffer_.data());
    return value;
  }
  [[nodiscard]] std::int64_t TakeSigned() {
    const std::uint64_t value = TakeNumber();
    return static_cast<std::int64_t>(value >> 1U ^ ((value & 1U) != 0 ? ~std::uint64_t{0} : 0));
  }
  void Take(std::vector<std::uint8_t>& out, std::size_t size);

 private:
  static constexpr std::size_t kBufferBytes = std::size_t{64} << 10U;
  static constexpr std::size_t kLongestNumber = 10;  ///< 64 bits, 7 in a byte

  void Flush();
  void MakeRoom(std::size_t bytes);
  [[nodiscard]] std::uint64_t TakeLong();
  [[nodiscard]] std::uint8_t TakeByte() { return more() ? buffer_[at_++] : std::uint8_t{0}; }

  std::vector<std::uint8_t> buffer_;
  std::size_t end_ = 0;  ///< of what it holds
  std::size_t at_ = 0;   ///< read up to here
  int fd_ = -1;
  bool failed_ = false;
};

}  // namespace ecaudit::cli
