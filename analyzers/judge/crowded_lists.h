/// Lists of slaves that a few broadcasts fill for thousands of them: what the report has no room for is left out.
#pragma once

#include <cstdint>

#include "analyzers/result/analysis_result.h"
#include "decoder/pipeline.h"

namespace ecaudit {

struct CrowdedLists {
  /// Settings of sync managers and FMMUs, all slaves together: any capture may have this number, and one more for each
  /// bytes of frames. Where each slave is set up by frames of its own, these are many times as long.
  static constexpr std::uint64_t kUnits = 2'000;
  static constexpr std::uint64_t kBytesAUnit = 160;
  /// Writes to the distributed clock, likewise.
  static constexpr std::uint64_t kDcSteps = 1'000;
  static constexpr std::uint64_t kBytesADcStep = 200;
  /// Clocks of which only broadcasts to all slaves are known, likewise.
  static constexpr std::uint64_t kDcByBroadcast = 100;
  static constexpr std::uint64_t kBytesADc = 1'000;

  std::uint64_t units_left_out = 0;
  std::uint64_t dc_steps_left_out = 0;
  std::uint64_t dc_left_out = 0;
};

/// Call it when everything is evaluated: the evaluation uses the settings of the slaves.
CrowdedLists LeaveOutCrowdedLists(const Pipeline& pipeline, AnalysisResult& result);

}  // namespace ecaudit
