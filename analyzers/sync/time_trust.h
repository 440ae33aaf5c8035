/// in: round trips of frames, and what the reader saw of the stamps.  out: how wrong an interval by a clock may be.
#pragma once

#include <optional>

#include "analyzers/sync/interval_statistics.h"
#include "analyzers/sync/time_base.h"
#include "decoder/pipeline.h"

namespace ecaudit::sync {

class TimeTrust {
 public:
  /// @param pipeline must outlive this
  explicit TimeTrust(const Pipeline& pipeline) : pipeline_(pipeline) {}

  /// A frame with process data came back.
  void AddRoundTrip(const FrameRef& sent, const FrameRef& returned) {
    if (!sent.has_time || !returned.has_time) return;
    const TimeNs trip = Elapsed(sent.time, returned.time);
    if (trip >= 0) round_trips_.Add(trip);
  }
  /// What hardly any frame with process data takes longer than, ns; unset without enough good stamps.
  [[nodiscard]] std::optional<TimeNs> UsualRoundTrip() const;
  /// Of frames with process data; null without enough good stamps.
  [[nodiscard]] const IntervalHistogram* RoundTrips() const { return UsualRoundTrip() ? &round_trips_ : nullptr; }
  /// ns; unset when the clock cannot be trusted at all.
  [[nodiscard]] std::optional<TimeNs> Uncertainty(TimeBase base) const;
  /// Of a pause, ns: coarse steps make it inexact, not unknown. Unset when the clock cannot be trusted at all.
  [[nodiscard]] std::optional<TimeNs> UncertaintyOfPause(TimeBase base) const;

 private:
  [[nodiscard]] bool IsCoarse() const;

  const Pipeline& pipeline_;
  IntervalHistogram round_trips_;
};

}  // namespace ecaudit::sync
