#include "analyzers/judge/crowded_lists.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "analyzers/collect/step_room.h"

namespace ecaudit {
namespace {

class Room {
 public:
  Room(const Pipeline& pipeline, std::uint64_t at_once, std::uint64_t bytes_an_entry)
      : room_(pipeline, at_once, bytes_an_entry) {}

  [[nodiscard]] bool Take() {
    if (!room_.HasRoomFor(taken_)) return false;
    ++taken_;
    return true;
  }
  /// Keeps the first entries of the list.
  /// @return how many there was no room for
  template <typename T>
  std::uint64_t Cut(std::vector<T>& list) {
    std::size_t kept = 0;
    while (kept < list.size() && Take()) ++kept;
    const std::uint64_t left_out = list.size() - kept;
    list.resize(kept);
    return left_out;
  }

 private:
  StepRoom room_;
  std::uint64_t taken_ = 0;
};

bool ByBroadcastsOnly(const DcSummary& dc) {
  return !dc.reference && dc.latched_frame == 0 && dc.difference_reads == 0 && !dc.phase && !dc.pll &&
         std::ranges::all_of(dc.configuration, &DcStep::broadcast);
}

}  // namespace

CrowdedLists LeaveOutCrowdedLists(const Pipeline& pipeline, AnalysisResult& result) {
  CrowdedLists lists;
  Room units(pipeline, CrowdedLists::kUnits, CrowdedLists::kBytesAUnit);
  Room dc_steps(pipeline, CrowdedLists::kDcSteps, CrowdedLists::kBytesADcStep);
  Room dc(pipeline, CrowdedLists::kDcByBroadcast, CrowdedLists::kBytesADc);
  for (SlaveSummary& slave : result.slaves) {
    lists.units_left_out += units.Cut(slave.sync_managers) + units.Cut(slave.fmmus);
    if (slave.dc && ByBroadcastsOnly(*slave.dc) && !dc.Take()) {
      ++lists.dc_left_out;
      slave.dc.reset();
    }
    if (!slave.dc) continue;
    const std::uint64_t left_out = dc_steps.Cut(slave.dc->configuration);
    slave.dc->configuration_left_out += left_out;
    lists.dc_steps_left_out += left_out;
  }
  return lists;
}

}  // namespace ecaudit
