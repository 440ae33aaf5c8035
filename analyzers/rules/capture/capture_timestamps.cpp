#include <cstdlib>
#include <optional>
#include <string>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/text.h"
#include "decoder/pipeline.h"

namespace ecaudit::capture_timestamps {
namespace {

constexpr RuleInfo kInfo{.id = "capture-timestamps",
                         .group = "Capture",
                         .severity = Severity::kInfo,
                         .needs_no_history = true,
                         .title = "The time stamps of the capture are too poor for timing rules",
                         .needs = "time stamps",
                         .source = "PCAPNG, packet blocks; PCAP, packet records",
                         .doc = R"(
## What it checks
Stamps that go backwards, steps of 50 us and more, equal stamps for the outbound and returned copy of frames (a tenth of
the pairs or more), returns on another interface that are stamped before the frames they answer, two interfaces whose
clocks are apart, and packets without stamps.

## Why it matters
Durations, cycle times and time-outs measured with such a clock are wrong. The distributed clock that the frames
themselves carry is not affected.

## How it is decided
By counting. Returns stamped first are told by index and content; the clocks of two interfaces then differ by more than
a round trip takes. Where one interface has what was sent and the other what came back, and the two copies of frames are
all apart by the same, more than a millisecond or the wrong way round, the stamps of the second interface are moved by
that, also where its clock runs faster or slower. One microsecond steps, as most capture programs have, are fine.

## Example
samples/captures/coarse-timestamps.pcapng

## What to do
Capture on Linux, or with a probe that stamps in hardware. Where a probe does, but the packets have the stamps of the
host, let the capture program take the probe's.
)"};

std::string WhatWasMoved(const capture::ClockShift& shift) {
  std::string text = "The stamps of interface " + std::to_string(shift.interface) +
                     " were moved so that each return comes as soon behind its frame as the wire allows (" +
                     Count(shift.pairs, "frame") +
                     " at the beginning show by how much, those behind them how it changes).";
  if (shift.renumbered) {
    text +=
        " The packets were put into that order: frame numbers are those of the file that 'ecaudit annotate' writes, "
        "not of this one.";
  }
  return text;
}

class CaptureTimestamps final : public Rule {
 public:
  CaptureTimestamps() : Rule(kInfo) {}
  void Finish() override {
    const PipelineStatistics& read = context().statistics();
    const bus::PairingStatistics& pairing = context().pairing();
    if (read.ethercat_frames == 0) {
      NotEvaluable(kNoSlave, "no EtherCAT frames in the capture");
      return;
    }
    std::string what;
    Finding finding;
    const auto add = [&](const std::string& text, const char* name, std::uint64_t value) {
      what += (what.empty() ? "" : "; ") + text;
      finding.evidence.push_back(Number(name, static_cast<std::int64_t>(value)));
    };
    if (read.without_time > 0)
      add(Count(read.without_time, "packet") + " without a time stamp", "without", read.without_time);
    if (read.backwards > 0) {
      add("stamps go backwards " + Count(read.backwards, "time"), "backwards", read.backwards);
    }
    if (pairing.identical_stamps * 10 >= pairing.paired && pairing.identical_stamps > 2) {
      add(Grouped(pairing.identical_stamps) + " of " + Grouped(pairing.paired) +
              " frames have the same stamp outbound and returned",
          "identical_pairs", pairing.identical_stamps);
    }
    if (pairing.stamped_first > 0) {
      add(Grouped(pairing.stamped_first) + " of " + Grouped(pairing.paired) +
              " frames have a return that is stamped before them: the clocks of two interfaces differ",
          "returns_stamped_first", pairing.stamped_first);
    }
    const std::optional<capture::ClockShift>& shift = context().source().info().clock_shift;
    if (shift) {
      add("the clock of interface " + std::to_string(shift->interface) +
              (shift->ahead_ns > 0 ? " is ahead of" : " is behind") + " that of interface " +
              std::to_string(shift->reference) + " by " + Duration(std::abs(shift->ahead_ns)),
          "clocks_apart_ns", static_cast<std::uint64_t>(std::abs(shift->ahead_ns)));
    }
    if (read.time_step_ns >= 50'000 && read.packets > 10) {
      add("stamps are multiples of " + Duration(read.time_step_ns), "step_ns",
          static_cast<std::uint64_t>(read.time_step_ns));
    }
    if (what.empty()) return;
    finding.first = read.first;
    finding.last = read.last;
    finding.title = "Time stamps are poor: " + what;
    finding.message = "Of " + Grouped(read.packets) + " packets: " + what +
                      (read.esl_frames > 0
                           ? ". Cycle times are measured by the stamps that the probe put into the frames; round trips "
                             "and time-outs by those of the packets, and are not reliable. Let the capture program "
                             "take the probe's stamps for its own."
                           : ". Cycle times and round trips taken from these stamps are not reliable. Capture with a "
                             "machine or probe that stamps each packet when it passes.");
    if (shift) finding.message += " " + WhatWasMoved(*shift);
    Report(0, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<CaptureTimestamps>};

}  // namespace
}  // namespace ecaudit::capture_timestamps
