/// in: what one sender sends, and returns without an outbound copy.  out: whether the capture misses frames before it.
///
/// Where it does, frames in flight may have returned unseen: they are in doubt. gap_evidence.h has the tables.
#pragma once

#include <cstdint>

#include "decoder/bus/gap_evidence.h"
#include "decoder/bus/pairing_context.h"
#include "decoder/bus/retransmissions.h"

namespace ecaudit::bus {

class CaptureGaps {
 public:
  explicit CaptureGaps(PairingContext& context) : context_(context) {}

  /// The next frame of a sender. @param orphan see IndexFact::kOrphan
  GapBefore Follow(std::uint8_t number, const wire::FrameView& frame, Repeats repeats, bool orphan = false) noexcept;
  /// The same for an outbound frame that waits for its return: what it shows is kept for Take().
  void FollowSent(std::uint8_t number, const wire::FrameView& frame, Repeats repeats) noexcept;
  /// A return without its outbound copy: whether the capture misses more than that copy.
  [[nodiscard]] GapBefore Before(const wire::FrameView& orphan) noexcept;
  /// The capture gap to be reported with the frame of this number; each once.
  [[nodiscard]] GapBefore Take(std::uint64_t sequence) noexcept;
  /// A master whose first frame returns when another one has long been at work. @param sent null: not in the capture
  [[nodiscard]] GapBefore AppearsLate(const Sender& master, const wire::FrameView* sent, const FrameRef& at) noexcept;

 private:
  /// @param rounds  only whole rounds of indices can be missing, see GapBefore::kRounds
  [[nodiscard]] GapBefore Apply(GapVerdict verdict, std::uint8_t number, const FrameRef& at,
                                bool rounds = false) noexcept;
  [[nodiscard]] bool AnyOverdue(std::uint8_t number, const FrameRef& now) noexcept;
  [[nodiscard]] bool BelongsIntoCapture(const Sender& sender, const wire::FrameView& orphan) const noexcept;
  void DoubtInFlight(std::uint8_t number, Undecided reason) noexcept;
  void OnGap(std::uint8_t number) noexcept;

  PairingContext& context_;
  GapBefore open_ = GapBefore::kNone;  ///< not reported yet ...
  std::uint64_t after_ = 0;            ///< ... and the first frame after it
};

}  // namespace ecaudit::bus
