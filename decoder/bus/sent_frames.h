/// The window of outbound frames: those in flight, and the last ones that returned. Each keeps its bytes.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "decoder/bus/frame_ledger.h"
#include "decoder/bus/thresholds.h"
#include "decoder/bus/transaction.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::bus {

/// How a frame looks beside the one that its sender sent before.
enum class SentAs : std::uint8_t {
  kAnother,        ///< a frame of its own
  kCopy,           ///< may be the packet before it, captured twice
  kAgainInFlight,  ///< the frame before once more, which was in flight
  kAgainAnswered,  ///< the frame before once more, which slaves had answered
};

struct SentFrame {
  enum class State : std::uint8_t { kFree, kOpen, kAnswered, kLost };

  State state = State::kFree;
  std::uint8_t sender = 0;
  SentAs sent_as = SentAs::kAnother;
  bool followed_by_other = false;  ///< the very next packet was no EtherCAT frame
  bool other_end = false;          ///< sent at the other end of a redundant line
  bool slaves_counted = false;     ///< slaves took part in it
  bool before_gap = false;         ///< counted as overtaken once because the indices after it skip
  Loss loss{};                     ///< of one that is lost
  std::optional<Undecided> doubt;  ///< why it may have returned unseen
  std::uint32_t round = 0;         ///< see RepeatedFrame::may_miss_round_of
  std::uint32_t overtaken = 0;     ///< frames sent later that returned
  std::uint64_t key = 0;
  std::uint64_t sequence = 0;
  std::uint64_t sent_before = 0;  ///< outbound frames up to this one
  FrameRef returned;
  std::uint16_t returned_interface = 0;
  wire::FrameView view;
  std::vector<std::uint8_t> bytes;           ///< grows to the largest frame, then stays
  std::vector<std::uint8_t> returned_bytes;  ///< datagrams of the returned copy; empty: unreadable

  [[nodiscard]] bool is_open() const noexcept { return state == State::kOpen; }
  [[nodiscard]] bool is_answered() const noexcept { return state == State::kAnswered; }
  [[nodiscard]] bool may_be_copy() const noexcept { return sent_as == SentAs::kCopy; }
  [[nodiscard]] const FrameRef& ref() const noexcept { return view.ref(); }
  [[nodiscard]] bool HoldsBytes(ByteSpan other) const noexcept {
    return std::equal(bytes.begin(), bytes.end(), other.begin(), other.end());
  }
  [[nodiscard]] bool Returned(ByteSpan datagrams) const noexcept {
    return std::equal(returned_bytes.begin(), returned_bytes.end(), datagrams.begin(), datagrams.end());
  }
  void Doubt(Undecided reason) noexcept {
    if (!doubt) doubt = reason;
  }
  /// A copy that was handed on, or that leaves no answer to compare.
  void CloseWithoutAnswer() noexcept {
    state = State::kAnswered;
    returned_bytes.clear();
  }
};

class SentFrames {
 public:
  static constexpr std::size_t kSlots = 256;

  SentFrames() noexcept;

  [[nodiscard]] std::uint64_t begin() const noexcept { return tail_; }  ///< oldest frame that may be in flight
  [[nodiscard]] std::uint64_t end() const noexcept { return head_; }    ///< number of the next frame
  [[nodiscard]] bool empty() const noexcept { return head_ == tail_; }
  [[nodiscard]] bool IsFull() const noexcept { return head_ - tail_ >= kSlots; }
  [[nodiscard]] SentFrame& operator[](std::uint64_t sequence) noexcept { return slots_[place_[sequence % kSlots]]; }
  /// The frame sent last; it is in the window also if it returned. Not empty().
  [[nodiscard]] SentFrame& last() noexcept { return (*this)[head_ - 1]; }
  /// First of the few frames whose slots are not used again yet.
  [[nodiscard]] std::uint64_t recent() const noexcept { return head_ - std::min(head_, threshold::kRecentFrames); }

  /// The slot of the next frame, in flight from now on; the caller fills in the rest.
  [[nodiscard]] SentFrame& Add(const wire::FrameView& frame, ByteSpan kept) noexcept;
  void DropOldest() noexcept { ++tail_; }
  void DropClosed() noexcept {
    while (tail_ != head_ && !(*this)[tail_].is_open()) ++tail_;
  }
  void DropAll() noexcept { tail_ = head_; }

  /// Calls `visit` for each frame in flight before the one of this number, oldest first.
  template <class Visit>
  void EachOpen(std::uint64_t before, const Visit& visit) noexcept {
    for (std::uint64_t s = tail_; s != before; ++s) {
      if (SentFrame& frame = (*this)[s]; frame.is_open()) visit(frame);
    }
  }
  template <class Visit>
  void EachOpenOf(std::uint8_t sender, std::uint64_t before, const Visit& visit) noexcept {
    EachOpen(before, [&](SentFrame& frame) {
      if (frame.sender == sender) visit(frame);
    });
  }
  /// True when one in flight is as asked for.
  template <class Predicate>
  [[nodiscard]] bool AnyOpen(const Predicate& predicate) noexcept {
    for (std::uint64_t s = tail_; s != head_; ++s) {
      if (const SentFrame& frame = (*this)[s]; frame.is_open() && predicate(frame)) return true;
    }
    return false;
  }
  /// The newest of the recent frames before the one of this number that is as asked for; null: none.
  template <class Predicate>
  [[nodiscard]] const SentFrame* NewestRecent(std::uint64_t before, const Predicate& predicate) noexcept {
    for (std::uint64_t s = before; s > recent(); --s) {
      if (const SentFrame& frame = (*this)[s - 1]; predicate(frame)) return &frame;
    }
    return nullptr;
  }

 private:
  void TakeWarmSlot() noexcept;

  std::array<SentFrame, kSlots> slots_;
  std::array<std::uint16_t, kSlots> place_;  ///< where in slots_ the frame of a sequence number lies
  std::uint64_t head_ = 0;
  std::uint64_t tail_ = 0;
};

/// Copies `bytes`. A slot takes room for any frame of usual size when it is used first, and keeps it.
void TakeBytes(std::vector<std::uint8_t>& room, ByteSpan bytes) noexcept;

}  // namespace ecaudit::bus
