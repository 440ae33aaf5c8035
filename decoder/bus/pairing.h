/// in: FrameView with Direction.  out: BusTransaction (see transaction.h).
///
/// Pairs the returned copy of a frame with its outbound copy by content and order, never by time stamps alone: frames
/// do not overtake each other on the wire. Only where a master repeated a frame (same key twice under way) do good
/// time stamps decide which of the two came back.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "decoder/bus/direction.h"
#include "decoder/bus/transaction.h"

namespace ecaudit::bus {

struct PairingStatistics {
  std::uint64_t outbound = 0;
  std::uint64_t returned = 0;
  std::uint64_t paired = 0;
  std::uint64_t lost = 0;
  std::uint64_t duplicated = 0;
  std::uint64_t unmatched_returned = 0;  ///< came back without an outbound copy in the capture
  std::uint64_t altered = 0;
  std::uint64_t foreign = 0;
  std::uint64_t under_way_at_end = 0;
  std::uint64_t identical_stamps = 0;    ///< pairs whose two copies have the same time stamp
};

class Pairing {
 public:
  static constexpr std::size_t kSlots = 256;
  /// A frame is given up when this many frames sent later came back.
  static constexpr std::uint32_t kOvertakenLimit = 32;

  Pairing(const DirectionLearner& directions, BusSink& sink);

  /// Takes one packet in file order; those that are no EtherCAT frames only matter as neighbours of lost ones.
  void Push(const wire::FrameView& frame) noexcept;
  /// The capture ends: frames that were overtaken are lost, the others are under way.
  void Finish() noexcept;

  [[nodiscard]] const PairingStatistics& statistics() const { return statistics_; }

 private:
  enum class SlotState : std::uint8_t { kFree, kOpen, kAnswered };
  struct Slot {
    SlotState state = SlotState::kFree;
    std::uint64_t key = 0;
    std::uint32_t overtaken = 0;
    bool followed_by_other = false;  ///< the very next packet was no EtherCAT frame
    FrameNo returned = 0;
    std::uint64_t returned_hash = 0;
    wire::FrameView view;
    std::vector<std::uint8_t> bytes;  ///< grows to the largest frame, then stays
  };

  void PushOutbound(const wire::FrameView& frame, std::uint64_t key) noexcept;
  void PushReturned(const wire::FrameView& frame, std::uint64_t key) noexcept;
  void PushUnusable(const wire::FrameView& frame) noexcept;
  [[nodiscard]] Slot* FindOpen(const wire::FrameView& frame, std::uint64_t key) noexcept;
  Slot* FindAlike(const wire::FrameView& frame) noexcept;
  void Answer(Slot& slot, FrameNo returned, std::uint64_t hash) noexcept;
  void Lose(Slot& slot, Loss loss) noexcept;
  void DropAnsweredTail() noexcept;
  Slot& At(std::uint64_t sequence) { return slots_[sequence % kSlots]; }

  const DirectionLearner& directions_;
  BusSink& sink_;
  std::array<Slot, kSlots> slots_;
  std::uint64_t head_ = 0;  ///< sequence number of the next slot to fill
  std::uint64_t tail_ = 0;  ///< oldest slot that may still be open
  std::int64_t typical_round_trip_ns_ = 0;  ///< running average over unambiguous pairs; 0 until there was one
  bool outbound_only_;
  PairingStatistics statistics_;
};

}  // namespace ecaudit::bus
