#include "analyzers/judge/reached_limits.h"

#include <string>
#include <utility>

#include "analyzers/collect/al_history.h"
#include "analyzers/collect/drive_history.h"
#include "analyzers/collect/startup_recorder.h"
#include "decoder/base/text.h"
#include "decoder/bus/slave_set.h"
#include "decoder/track/slave_work.h"

namespace ecaudit {
namespace {

/// A program that looks for slaves where there are none is no bus.
constexpr std::uint64_t kFewOfOtherBus = 8;

}  // namespace

void AddLimits(const FindingStore& store, const Pipeline& pipeline, const CrowdedLists& lists, AnalysisResult& result) {
  const auto add = [&result](std::string what, std::uint64_t limit, std::uint64_t left_out) {
    if (left_out > 0) result.limits.push_back({std::move(what), limit, left_out});
  };
  const std::uint64_t slaves = pipeline.network().slaves().left_out();
  const FrameRef& overworked = pipeline.statistics().overworked;
  add("slaves updated with broadcasts and shared process data, and one for each byte of the frames; the packets "
      "after #" +
          std::to_string(overworked.number) + " are not read",
      track::SlaveWork::kAtOnce, overworked.seen() ? 1 : 0);
  add("slaves that are modelled", bus::SlaveSet::kMaxSlaves, slaves);
  add("findings of one severity that are listed one by one", FindingStore::kMaxFindings, store.findings_left_out());
  add("findings of one rule, slave and severity that are listed one by one", FindingStore::kMaxPerRuleAndSlave,
      store.counted_on_slave());
  add("lines about what could not be evaluated", FindingStore::kMaxListed, store.lines_left_out());
  std::uint64_t steps = result.bus.startup.steps_left_out;
  std::uint64_t al = 0;
  std::uint64_t drive = 0;
  for (const SlaveSummary& slave : result.slaves) {
    steps += slave.startup.steps_left_out;
    al += slave.al_history_left_out;
    if (slave.drive) drive += slave.drive->history_left_out;
    for (const DriveSummary& axis : slave.further_axes) drive += axis.history_left_out;
  }
  add("steps of a start-up that are kept", startup::StartupRecorder::kMaxSteps, steps);
  add("steps of an AL history that are kept", AlHistory::kMaxSteps, al);
  add("steps of a drive history that are kept", DriveHistory::kMaxSteps, drive);
  add("settings of sync managers and FMMUs, and one for each " + std::to_string(CrowdedLists::kBytesAUnit) +
          " bytes of the frames",
      CrowdedLists::kUnits, lists.units_left_out);
  add("writes to distributed clocks, and one for each " + std::to_string(CrowdedLists::kBytesADcStep) +
          " bytes of the frames",
      CrowdedLists::kDcSteps, lists.dc_steps_left_out);
  add("distributed clocks that only broadcasts show, and one for each " + std::to_string(CrowdedLists::kBytesADc) +
          " bytes of the frames",
      CrowdedLists::kDcByBroadcast, lists.dc_left_out);
  const CaptureSummary& capture = result.capture;
  add("bytes of interface names that are kept", capture::CaptureInfo::kNameBytes, capture.file.name_bytes_left_out);
  if (capture.unusable > 0 && capture.unusable * 2 >= capture.may_be_ethercat) {
    result.cut = Grouped(capture.unusable) + " of " + Grouped(capture.may_be_ethercat) +
                 " packets that may have been EtherCAT could not be used";
  }
  const bus::PairingStatistics& pairing = pipeline.pairing();
  if (pairing.other_bus > kFewOfOtherBus) {
    result.cut = "interface " + std::to_string(pairing.other_bus_interface) + " recorded another bus (--interface " +
                 std::to_string(pairing.other_bus_interface) + " evaluates it)";
  }
  if (overworked.seen()) {
    result.cut = "packets after " + Grouped(overworked.number) + " were not read: they concern too many slaves at once";
  }
  if (slaves > 0) {
    result.cut = "the bus has more than the " + Grouped(bus::SlaveSet::kMaxSlaves) + " slaves that are modelled";
  }
}

}  // namespace ecaudit
