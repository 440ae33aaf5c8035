#include "analyzers/sync/output_rate.h"

namespace ecaudit::sync {

void OutputRate::Add(const CyclicImage& image, const Interval& interval, const FrameRef& from, const FrameRef& to,
                     TimeNs configured) {
  if (!image.has_nominal()) return;
  // The median jumps where early and late frames alternate: a configured cycle near it counts better.
  TimeNs nominal = image.nominal_ns;
  if (configured > 0 && nominal != configured && nominal > configured - configured / 3 &&
      nominal < configured + configured / 3) {
    nominal = configured;
  }
  TimeNs shifted = 0;
  if (__builtin_add_overflow(interval.ns, nominal / 2, &shifted)) return;
  const TimeNs count = shifted >= nominal && shifted - nominal < nominal ? 1 : shifted / nominal;
  constexpr TimeNs kPause = 16;
  if (interval.base == TimeBase::kNone || count > kPause) return;
  if (interval.base != base) {
    base = interval.base;
    cycles = 0;
    ns = 0;
  }
  if (cycles == 0) first = from;
  if (__builtin_add_overflow(ns, interval.ns, &ns)) {
    base = TimeBase::kNone;  // begins anew with the next one
    return;
  }
  cycles += static_cast<std::uint64_t>(count);
  usual = image.nominal_ns;
  last = to;
}

}  // namespace ecaudit::sync
