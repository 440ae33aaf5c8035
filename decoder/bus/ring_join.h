/// in: BusTransaction, of both ends of a redundant line.  out: the same, joined while the line is broken.
///
/// A whole line: the frames sent at its other end meet no slave, and Pairing keeps them to itself. When it breaks, each
/// end reaches the slaves on its side of the break: what the master asked for is answered half here and half there. The
/// two halves become one transaction, as the master makes one of them: working counters add up, and what one half did
/// not fill comes from the other. Positions and broadcasts count from the end they were sent at, so those of the main
/// end stay what they are.
#pragma once

#include <cstdint>
#include <vector>

#include "decoder/bus/transaction.h"

namespace ecaudit::bus {

class RingJoin {
 public:
  /// A line counts as broken for this number of packets after one that shows it.
  static constexpr FrameNo kBrokenFor = 256;
  /// The halves of one request are sent within this.
  static constexpr std::int64_t kAtOnceNs = 50'000;
  /// One half waits for the other for this number of packets.
  static constexpr FrameNo kTogether = 16;

  explicit RingJoin(BusSink& to) : to_(to) {}

  void Push(const BusTransaction& transaction);
  /// Packet `number` is next.
  void Pass(FrameNo number) {
    if (waits_ && number > half_.returned.ref().number + kTogether) Flush();
  }
  /// No other half comes any more.
  void Flush();

 private:
  struct Half {
    wire::FrameView sent;
    wire::FrameView returned;
    std::vector<std::uint8_t> sent_bytes;  ///< these grow to the largest frame, then stay
    std::vector<std::uint8_t> returned_bytes;
    bool other_end = false;
    GapBefore gap = GapBefore::kNone;
  };

  void Keep(const BusTransaction& transaction);
  [[nodiscard]] bool IsOtherHalf(const BusTransaction& transaction) const;

  BusSink& to_;
  Half half_;
  std::vector<std::uint8_t> joined_;
  bool waits_ = false;  ///< `half_` does
  FrameNo broken_until_ = 0;
};

}  // namespace ecaudit::bus
