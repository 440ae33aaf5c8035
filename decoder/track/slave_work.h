/// How often datagrams for many slaves were handed to a slave, against the number that the bytes of the frames allow.
#pragma once

#include <algorithm>
#include <cstdint>

namespace ecaudit::track {

/// Broadcasts are few: a start-up has some dozens, and a poll that shows nothing new is one event for all slaves. Of
/// process data each slave has a part of its own. Frames full of broadcasts to thousands of slaves, or of datagrams of
/// a byte that thousands of FMMUs lead to, would take hundreds of times as long as others.
class SlaveWork {
 public:
  static constexpr std::uint64_t kAtOnce = 1'000'000;  ///< 500 broadcasts to 2,000 slaves
  static constexpr std::uint64_t kPerByte = 1;         ///< of frames; a broadcast to 100 slaves in each of the smallest
  /// Slaves that have a part of their own in a byte of process data: inputs of one bit each, and outputs of one.
  static constexpr std::uint64_t kPerByteOfData = 16;

  void Allow(std::uint64_t bytes) { allowed_ += bytes * kPerByte; }
  /// Adds the slaves that received one datagram.
  void Take(std::uint64_t slaves) { taken_ += slaves; }
  /// Adds the slaves that received, or were checked for, one or more datagrams with a number of bytes of process data.
  void TakeForData(std::uint64_t slaves, std::uint64_t bytes) { Take(slaves - std::min(slaves, Due(bytes))); }
  [[nodiscard]] bool exceeded() const { return taken_ > allowed_; }

  /// Number of slaves whose data a number of bytes may hold.
  [[nodiscard]] static constexpr std::uint64_t Due(std::uint64_t bytes) { return bytes * kPerByteOfData; }

 private:
  std::uint64_t allowed_ = kAtOnce;
  std::uint64_t taken_ = 0;
};

}  // namespace ecaudit::track
