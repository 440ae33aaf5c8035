/// Healthy captures of any length: start-up, then process data cycle after cycle, as a field capture of an hour looks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "samples/builder/recorder.h"

namespace ecaudit::perf {

/// Drives with distributed clocks and SYNC0; each frame is ARMW 0x0910 + LRW + BRD 0x0130, both copies are captured.
struct LongRun {
  std::size_t slaves = 3;
  std::uint64_t frames = 1'000'000;  ///< at least; both copies counted, start-up included
  samples::FileFormat format = samples::FileFormat::kPcapNg;
  TimeNs cycle_ns = 1'000'000;
  /// The axes follow a sine, and bit 10 of the status word toggles as 60DAh can ask for: words and values change in
  /// every cycle. Else they hold their position, and only the system time changes.
  bool moving = false;
  /// Instead of drives terminals with one byte of inputs each: as many as an LRW has bytes. Without clocks.
  bool terminals = false;
};

/// Hands the file piece by piece to `write`; memory does not grow with the length.
/// @return packets in the file
std::uint64_t WriteLongRun(const LongRun& run, const std::function<void(const samples::Bytes&)>& write);

/// The whole file in memory, for short ones.
[[nodiscard]] samples::Bytes MakeLongRun(const LongRun& run);

}  // namespace ecaudit::perf
