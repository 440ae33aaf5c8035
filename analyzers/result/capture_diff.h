/// What differs between two captures: plain data for the writers.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "analyzers/result/analysis_result.h"

namespace ecaudit::diff {

enum class Area : std::uint8_t { kOutcome, kBus, kStep, kMapping, kConfiguration, kFinding, kTiming };
/// "outcome", "bus", "step", "mapping", "configuration", "finding", "timing".
[[nodiscard]] constexpr std::string_view Name(Area area) {
  constexpr std::array<std::string_view, 7> kNames{"outcome",       "bus",     "step",  "mapping",
                                                   "configuration", "finding", "timing"};
  return kNames[static_cast<std::size_t>(area)];
}

/// A slave of A and the one of B that takes its part; one of them may be missing.
struct SlavePair {
  const SlaveSummary* a = nullptr;
  const SlaveSummary* b = nullptr;
};

struct Difference {
  Area area = Area::kStep;
  std::vector<std::size_t> pairs;    ///< places in CaptureDiff::pairs it holds for; empty: the bus
  std::string what;                  ///< "SM2", "download of 60C2h:1 Interpolation time period"
  std::string in_a, in_b;            ///< "6 bytes, ...", "not done"; never both empty
  FrameNo frame_a = 0, frame_b = 0;  ///< of the first pair; 0: none
  bool consequence = false;          ///< follows from an outcome: steps that a start-up did not come to
  bool other_value = false;          ///< a setting that both have
  /// The refusal of one start-up is about this setting, a finding cites it, or the finding explains the refusal.
  bool relevant = false;
  bool counts = true;     ///< false: worth knowing, and no reason to call the captures different
  int rank = 0;           ///< for sorting: the smaller, the more important
  std::size_t place = 0;  ///< likewise, among relevant ones: the likeliest reason of the refusal first
};

struct CaptureDiff {
  std::vector<SlavePair> pairs;
  std::vector<Difference> differences;
  std::vector<std::string> notes;  ///< what could not be compared, and why
  std::uint64_t steps_compared = 0;
  /// Only one start-up of a slave failed at a state: "SAFEOP refused with 0x001d", of the first such slave. Empty: none
  /// did, or both.
  std::string failed;
  bool findings_lead = false;  ///< no other value of a setting explains what differs
  bool compared = false;       ///< both show something of a start-up or a configuration that can be compared

  [[nodiscard]] bool different() const {
    for (const Difference& difference : differences) {
      if (difference.counts) return true;
    }
    return false;
  }
};

}  // namespace ecaudit::diff
