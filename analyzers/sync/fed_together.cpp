#include "analyzers/sync/fed_together.h"

#include <algorithm>
#include <limits>

#include "decoder/base/wrapping.h"

namespace ecaudit::sync {

void FedTogether::Begin(const CyclicImage& image, const FrameAtHand& at_hand) {
  image_ = &image;
  nominal_of_ = image.nominal_of;
  limit_ = 0;
  last_ = at_hand.time();
  last_sent_ = at_hand.sent().number;
  way_ = at_hand.WayTo(0);
  late_ = 0;
  least_ = std::numeric_limits<TimeNs>::min();
  most_ = std::numeric_limits<TimeNs>::max();
}

bool FedTogether::Join(const model::AlMachine& al, OutputWatch& watch, const DcUnit& dc) {
  const bool fed = watch.seen && watch.in_op && watch.last.frame.number == last_.frame.number && last_.dc;
  if (!fed || watch.together != nullptr || watch.image != image_ || !image_->has_nominal()) return false;
  if (!watch.rate.Follows(*image_)) return false;
  if (!watch.rate.IsSteady() || dc.pulse_cycle_ns() == 0 || !watch.phase.IsSteady(dc, *last_.dc)) return false;
  const SteadyIntervals none = watch.rate.Steady();
  if (members_.empty()) {
    intervals_ = none;
    cycle_ = dc.pulse_cycle_ns();
  } else if (none.nominal != intervals_.nominal || none.base != intervals_.base || dc.pulse_cycle_ns() != cycle_) {
    return false;
  }
  const TimeNs limit = watch.GapLimit(image_);
  if (limit > 0) limit_ = limit_ > 0 ? std::min(limit_, limit) : limit;
  const TimeNs phase = watch.phase.last_ns();
  const TimeNs margin = Sync0Phase::UncertaintyOf(dc);
  least_ = std::max(least_, margin - phase);
  most_ = std::min(most_, cycle_ - margin - phase - 1);
  watch.together = this;
  members_.push_back({&al, &watch, phase});
  return true;
}

bool FedTogether::Take(const CyclicImage& image, const FrameAtHand& at_hand) {
  if (members_.empty()) return false;
  const FrameTime& time = at_hand.time();
  const bool follows = image.gap_from == last_.frame.number && time.frame.number > last_.frame.number;
  if (!follows || image.nominal_of != nominal_of_ || !image.has_nominal() || at_hand.WayTo(0) != way_) return false;
  if (image.gap.base != TimeBase::kNone && limit_ > 0 && image.gap.ns >= limit_) return false;
  if (!time.dc || time.dc->epoch != last_.dc->epoch) return false;
  const auto since = static_cast<TimeNs>(WrappingDifference(time.dc->ns, last_.dc->ns));
  if (since <= 0 || since >= cycle_ + cycle_ / 2) return false;
  const TimeNs late = late_ + since - cycle_;
  if (late < least_ || late > most_) return false;
  for (const Member& member : members_) {
    if (!member.al->SettledIn(esc::AlState::OP)) return false;
  }
  if (!intervals_.Add(image.rhythm)) return false;
  late_ = late;
  last_ = time;
  last_sent_ = at_hand.sent().number;
  for (const Member& member : members_) {
    member.watch->last_status_word = member.watch->status_word;
    member.watch->phase.CountSteady(time.frame, member.phase + late, cycle_);
  }
  return true;
}

void FedTogether::Settle() {
  for (const Member& member : members_) {
    OutputWatch& watch = *member.watch;
    watch.together = nullptr;
    if (intervals_.count == 0) continue;
    watch.rate.AddSteady(intervals_, last_.frame);
    watch.phase.GoOn(last_.frame, intervals_.count, member.phase + late_, cycle_);
    watch.last = last_;
    watch.last_sent = last_sent_;
    watch.frames_in_op += intervals_.count;
  }
  members_.clear();
}

void OutputWatch::Part() {
  if (together != nullptr) together->Settle();
}

}  // namespace ecaudit::sync
