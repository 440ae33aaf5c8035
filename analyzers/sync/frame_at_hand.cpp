#include "analyzers/sync/frame_at_hand.h"

#include <algorithm>

#include "decoder/base/time.h"
#include "decoder/base/wrapping.h"

namespace ecaudit::sync {
namespace {

/// Time of a byte at 100 Mbit/s.
constexpr TimeNs kNsPerByte = 80;
/// Frame check sequence, which captures leave out.
constexpr std::uint32_t kFcsBytes = 4;
/// Captures leave out the padding of short frames as well.
constexpr std::uint32_t kMinFrameBytes = 60;
/// Since the last frame with a time, ns: masters that send several frames a cycle let one of them carry it.
constexpr TimeNs kMostWithoutTime = 20'000'000;

std::optional<DcTime> TimeByStamps(const DcClock& clock, const FrameRef& now) {
  const std::optional<DcTime>& last = clock.last();
  const FrameRef& at = clock.last_frame();
  if (!last || last->epoch != clock.epoch() || !at.has_time || !now.has_time) return std::nullopt;
  const TimeNs since = Elapsed(at.time, now.time);
  if (since < 0 || since > kMostWithoutTime) return std::nullopt;
  return DcTime{WrappingSum(last->ns, static_cast<std::uint64_t>(since)), last->epoch};
}

}  // namespace

/// Each field is set here, which is cheaper than a new one for each frame.
bool FrameAtHand::Complete(const SentFrames& frames, const DcClock& clock, SlaveDelays& delays) {
  if (count_ == 0 || !frame().seen()) return false;
  time_.frame = frame();
  time_.stamp.reset();
  if (frame().has_time) time_.stamp = frame().time;
  by_stamps_.reset();
  if (!time_.dc) by_stamps_ = TimeByStamps(clock, returned_);
  time_.esl.reset();
  delays.Look();
  way_ns_ = -delays.Of(clock.reference());
  wide_clock_ = clock.is_64_bit();
  if (const FrameFacts* facts = frames.FactsOf(frame().number)) {
    time_.esl = facts->esl;
    way_ns_ += static_cast<TimeNs>(std::max(facts->bytes, kMinFrameBytes) + kFcsBytes) * kNsPerByte;
  }
  return true;
}

}  // namespace ecaudit::sync
