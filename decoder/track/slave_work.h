/// How often slaves were told of what was meant for all of them, against what the bytes of the frames allow for.
#pragma once

#include <cstdint>

namespace ecaudit::track {

/// Broadcasts are few: a start-up has some dozens, and a poll that shows nothing new is one event for all slaves.
/// Frames full of them to thousands of slaves would take a hundred times as long as others.
class SlaveWork {
 public:
  static constexpr std::uint64_t kAtOnce = 1'000'000;  ///< 500 broadcasts to 2,000 slaves
  static constexpr std::uint64_t kPerByte = 1;         ///< of frames; a broadcast to 100 slaves in each of the smallest

  void Allow(std::uint64_t bytes) { allowed_ += bytes * kPerByte; }
  /// So many slaves are told of one datagram.
  void Take(std::uint64_t slaves) { taken_ += slaves; }
  [[nodiscard]] bool exceeded() const { return taken_ > allowed_; }

 private:
  std::uint64_t allowed_ = kAtOnce;
  std::uint64_t taken_ = 0;
};

}  // namespace ecaudit::track
