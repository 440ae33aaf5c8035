/// in: capture gaps, and what the frames after them show.  out: CaptureGap, AlStateForgotten.
///
/// keeps: how many slaves are presumed to be as they were before a capture gap, and how logical datagrams came back
/// last.
///
/// In frames that the capture misses the master may have done anything. In OP it does nothing mostly: what is known of
/// slaves in OP is presumed until the capture shows them again. Likewise, in SAFEOP and over a short gap, all but the
/// AL state. So is what slaves hold that were gone for a while.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "decoder/base/event_sink.h"
#include "decoder/bus/transaction.h"
#include "decoder/track/addressing.h"
#include "decoder/track/datagram_pair.h"
#include "decoder/track/events.h"
#include "decoder/track/slave_mailboxes.h"
#include "decoder/track/slave_states.h"

namespace ecaudit::track {

class CaptureGaps {
 public:
  CaptureGaps(EventSink& events, Addressing& addressing, SlaveStates& states, SlaveMailboxes& mailboxes)
      : events_(events), addressing_(addressing), states_(states), mailboxes_(mailboxes) {}

  /// @param frame the first after the capture gap  @param before the last one before it that has a time stamp
  void OnGap(const FrameRef& frame, const FrameRef& before, bus::GapBefore gap);
  /// Another recording begins: in between anything may have happened, for any time.
  void OnOtherRecording(const FrameRef& frame);
  /// What the capture shows of slaves after a gap.
  enum class Still : std::uint8_t {
    kNo,      ///< they may have been set up again
    kMapped,  ///< they are in SAFEOP or OP, or are to go there
    kInOp,    ///< they are in OP, or exchange the same process data as before
  };
  /// The capture shows whether what is presumed of this slave still holds.
  void Presume(SlaveId id, Still still, const FrameRef& frame) {
    if (states_[id].presumed != Presumed::kNothing) Settle(id, still, frame);
  }
  /// The same for all slaves.
  void PresumeAll(Still still, const FrameRef& frame) {
    if (presumed_ > 0) SettleAll(still, frame);
  }
  /// The first frame after the last place where frames are missing, or may be; 0: there was none.
  [[nodiscard]] FrameNo last() const { return count_ == 0 ? 0 : first_after_[(count_ - 1) % first_after_.size()]; }
  /// True when such a place follows frame `from`, and not after frame `to`. Of many the first are forgotten: then
  /// one may lie anywhere before those that are left.
  [[nodiscard]] bool AnyBetween(FrameNo from, FrameNo to) const {
    return AnyBetween(from, to, [](bus::GapBefore) { return true; });
  }
  /// The same without the places where only numbers skip, or go on after a silence.
  [[nodiscard]] bool AnyButSkipsBetween(FrameNo from, FrameNo to) const {
    return AnyBetween(
        from, to, [](bus::GapBefore gap) { return gap != bus::GapBefore::kSkip && gap != bus::GapBefore::kRounds; });
  }
  /// Only the places where frames are missing, certainly or most likely.
  [[nodiscard]] bool AnyLikelyBetween(FrameNo from, FrameNo to) const {
    return AnyBetween(from, to, [](bus::GapBefore gap) { return gap >= bus::GapBefore::kLikelySkip; });
  }
  /// Something is presumed of some slave.
  [[nodiscard]] bool presumes() const { return presumed_ > 0; }
  /// A logical datagram came back: with the working counter it had before the capture gap, if all is as it was.
  void OnLogical(const DatagramPair& d);

  /// More slaves answer than before, and new ones have taken no broadcast so far. Those from this position on come
  /// back: after a power cycle, or because a cable had no contact for a moment, and then they hold what they held
  /// before. So do those of a branch in the middle, where some after it were seen all the while. Who answers at
  /// its station address, or is in another state than INIT, was not without power.
  void OnReturnFrom(std::uint16_t first_position, const FrameRef& frame);
  /// What an access to a slave that returned shows of that.
  void OnAccess(const SlaveAccess& access) {
    const bool shown = addressing_.InDoubt(access.slave) && access.command != wire::Command::ARMW;
    if (states_[access.slave].returned || shown) AssessReturn(access);
  }
  /// Addresses are given again: where slaves may have moved, others may be.
  void OnStationsCleared(const FrameRef& frame);
  /// Likewise, AL Status as it was read.
  void OnState(SlaveId id, esc::AlWord status, const FrameRef& frame);

 private:
  [[nodiscard]] bool WasAway(SlaveId id, std::uint16_t first_position, bool branch) const;
  template <class Counts>
  [[nodiscard]] bool AnyBetween(FrameNo from, FrameNo to, Counts counts) const {
    const std::size_t kept = std::min(count_, first_after_.size());
    for (std::size_t i = count_ - kept; i < count_; ++i) {
      const FrameNo after = first_after_[i % first_after_.size()];
      if (from < after && after <= to && counts(kinds_[i % kinds_.size()])) return true;
    }
    return kept < count_ && from < first_after_[count_ % first_after_.size()];
  }
  void Note(const FrameRef& frame, bus::GapBefore gap) {
    kinds_[count_ % kinds_.size()] = gap;
    first_after_[count_++ % first_after_.size()] = frame.number;
  }
  using Presumed = SlaveState::Presumed;

  void Settle(SlaveId id, Still still, const FrameRef& frame);
  void SettleAll(Still still, const FrameRef& frame);
  /// What was so before this gap, and is presumed to be so after it.
  [[nodiscard]] Presumed PresumedOver(SlaveId id, const CaptureGap& gap) const;
  void Forget(SlaveId id, const FrameRef& frame, bool device_stays = false);
  void AssessReturn(const SlaveAccess& access);

  /// Working counter with which a logical datagram came back last. Where the first one after a capture gap comes back
  /// with the same, the slaves that were in OP before it still are, and are mapped as before.
  struct Habit {
    wire::Command command = wire::Command::NOP;
    std::uint32_t address = 0;
    std::uint16_t length = 0;
    std::uint16_t wkc = 0;
  };

  EventSink& events_;
  Addressing& addressing_;
  SlaveStates& states_;
  SlaveMailboxes& mailboxes_;
  std::array<Habit, 8> habits_{};
  std::size_t presumed_ = 0;                // slaves whose state is presumed
  std::array<FrameNo, 32> first_after_{};   // first frames after the last capture gaps
  std::array<bus::GapBefore, 32> kinds_{};  // of these
  std::size_t count_ = 0;                   // of capture gaps
};

}  // namespace ecaudit::track
