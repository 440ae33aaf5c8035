/// How regularly process data were exchanged: plain data for the writers.
#pragma once

#include <cstdint>
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
};

}  // namespace ecaudit
