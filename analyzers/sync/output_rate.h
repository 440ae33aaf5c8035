/// in: intervals between frames with outputs for one slave in OP.  out: their mean, pauses left out.
#pragma once

#include <cstdint>

#include "analyzers/sync/cyclic_images.h"
#include "analyzers/sync/time_base.h"

namespace ecaudit::sync {

struct OutputRate {
  std::uint64_t cycles = 0;
  TimeNs ns = 0;     ///< length of all of them
  TimeNs usual = 0;  ///< median of the intervals: where it keeps to a cycle, a mean that does not tells of pauses
  TimeBase base = TimeBase::kNone;
  FrameRef first, last;

  /// @param configured cycle by the master's settings, 0 when not known
  void Add(const CyclicImage& image, const Interval& interval, const FrameRef& from, const FrameRef& to,
           TimeNs configured);
};

}  // namespace ecaudit::sync
