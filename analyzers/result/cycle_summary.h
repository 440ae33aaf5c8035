/// How regularly process data were exchanged: plain data for the writers.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "decoder/base/ids.h"

namespace ecaudit {

/// `count` intervals of at least `from_us` and less than `to_us`.
struct CycleBin {
  double from_us = 0, to_us = 0;
  std::uint64_t count = 0;
};

/// Process data that were exchanged again and again.
struct CyclicDatagram {
  std::string command;  ///< "LRW"
  std::uint32_t logical_address = 0;
  std::uint16_t length = 0;
  std::uint64_t count = 0;
};

/// Where differences between the cycles arise. Each width holds 98 of 100 values. A share is the part in the sum of the
/// squared widths, in percent.
struct DelayOrigins {
  double master_us = 0;               ///< of the intervals at which frames are sent
  double return_us = 0;               ///< of round trips: line, slaves and network card
  std::optional<double> recorder_us;  ///< of its stamps; unset: no other clock shows the same intervals
  double round_trip_us = 0;           ///< median
  double longest_round_trip_us = 0;

  [[nodiscard]] double width_us() const {
    return std::sqrt(master_us * master_us + return_us * return_us + recorder_us.value_or(0) * recorder_us.value_or(0));
  }
  /// Part of the whole, in percent. @param part one of the widths above
  [[nodiscard]] double ShareOf(double part) const {
    const double whole = width_us();
    return whole > 0 ? 100 * part * part / (whole * whole) : 0;
  }
};

struct CycleSummary {
  std::uint64_t cycles = 0;  ///< intervals measured; 0: no cyclic process data
  double mean_us = 0, min_us = 0, max_us = 0, stddev_us = 0;
  double median_us = 0, p1_us = 0, p99_us = 0, p999_us = 0;
  /// Cycles without process data: an interval of n medians counts as n - 1 missing ones.
  std::uint64_t missing = 0;
  std::uint64_t bursts = 0;           ///< intervals shorter than a quarter of the median
  FrameRef longest_from, longest_to;  ///< frames around the longest interval
  std::vector<CycleBin> histogram;    ///< bins in use only, by ascending interval
  std::string time_source;            ///< "dc", "esl", "capture"; empty when cycles is 0
  double uncertainty_us = 0;          ///< of one interval; 0 when it could not be measured
  std::string command;                ///< "LRW": the datagram that is the cycle
  std::uint32_t logical_address = 0;
  std::optional<DelayOrigins> origins;  ///< unset: the capture does not show both copies with good stamps
};

}  // namespace ecaudit
