/// in: FrameView.  out: its Direction. Learns the masters' MAC addresses from the first frames of a capture.
///
/// Every ESC sets bit 1 of the first byte of the source MAC, so a set bit says "has passed a slave" - unless the
/// master's own address has it (virtual NICs, KickCAT), or the tap sits between slaves. Then the copies are told apart
/// by pairs: the copy with the lower position counter and working counter is the outbound one (esc-reference 3.1).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "decoder/wire/frame_view.h"

namespace ecaudit::bus {

enum class Direction : std::uint8_t {
  kOutbound,  ///< on its way from the master
  kReturned,  ///< on its way back, all slaves passed
  kByPair,    ///< decided by whether a frame under way matches (Pairing does that)
  kForeign,   ///< sent by somebody else than the bus's masters
};

class DirectionLearner {
 public:
  static constexpr std::size_t kMaxMasters = 16;

  /// Looks at one frame of the look-ahead window, before any call of Classify().
  void Learn(const wire::FrameView& frame) noexcept;
  /// Ends the look-ahead: fixes how each MAC address is read.
  void Finish() noexcept;
  [[nodiscard]] Direction Classify(const wire::FrameView& frame) const noexcept;

  /// True when the window held frames of the master and none that came back: then returns are not waited for.
  [[nodiscard]] bool outbound_only() const { return outbound_only_; }
  /// True when the window held only frames that came back.
  [[nodiscard]] bool returned_only() const { return returned_only_; }

 private:
  enum class Reading : std::uint8_t { kUnused, kMacBit, kByFlag, kByPair, kAllReturned, kAllOutbound, kForeign };
  struct Open {
    std::uint64_t key = 0;
    std::uint32_t progress = 0;
  };
  struct Sender {
    std::uint64_t mac = 0;  ///< with bit 1 of the first byte cleared
    std::uint32_t bit_clear = 0;
    std::uint32_t bit_set = 0;
    std::uint32_t bit_set_counted = 0;  ///< bit set and a working counter above 0
    std::uint32_t pairs = 0;            ///< bit set, and answers an open frame of the same sender
    std::uint32_t flag_in = 0;
    std::uint32_t flag_out = 0;
    Reading reading = Reading::kUnused;
    std::array<Open, 32> open{};        ///< frames not answered yet, a small ring
    std::uint8_t open_next = 0;
  };

  Sender* Find(std::uint64_t mac) noexcept;
  [[nodiscard]] const Sender* Find(std::uint64_t mac) const noexcept;

  std::array<Sender, kMaxMasters> senders_{};
  std::size_t count_ = 0;
  bool master_proven_ = false;
  bool outbound_only_ = false;
  bool returned_only_ = false;
};

/// Identifies a frame by what slaves never change: commands, indices, lengths and addresses (without the position
/// counter of position-addressed and broadcast commands). Equal for the outbound and returned copy of one frame.
[[nodiscard]] std::uint64_t FrameKey(const wire::FrameView& frame) noexcept;

/// How far a frame has come: working counters plus position counters. Grows on the way, so of two copies of one frame
/// the one with the lower figure is the earlier one.
[[nodiscard]] std::uint32_t FrameProgress(const wire::FrameView& frame) noexcept;

/// True when a slave visibly acted on any datagram: a working counter above 0.
[[nodiscard]] bool AnyWorkingCounter(const wire::FrameView& frame) noexcept;

}  // namespace ecaudit::bus
