/// The runs of a bus within one capture: plain data for the writers.
#pragma once

#include <cstdint>

#include "decoder/base/ids.h"

namespace ecaudit {

/// From one start of the bus, or of the capture, to the next.
struct RunSummary {
  /// Why it is another run: the capture begins, another recording, the master initialised the slaves again.
  enum class Why : std::uint8_t { kCapture, kClock, kInitialised };
  FrameRef first, last;  ///< packets; `last` is the one before the next run
  Why why = Why::kCapture;
  std::uint8_t highest = 0;          ///< AL state that some slave reached or was in, 0: none was read
  std::uint64_t slaves_in_op = 0;    ///< slaves that were in OP at some time
  std::uint64_t preop_requests = 0;  ///< attempts to leave INIT: the most that one slave saw
  double cycle_us = 0;               ///< median distance of the cyclic frames, 0: none
};

}  // namespace ecaudit
