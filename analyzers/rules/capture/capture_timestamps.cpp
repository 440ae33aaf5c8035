#include <cstdlib>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/pipeline.h"

namespace ecaudit::capture_timestamps {
namespace {

constexpr Word kMissing{"missing", "some missing"};
constexpr Word kBackwards{"backwards", "going backwards"};
constexpr Word kIdentical{"identical", "the same for both copies"};
constexpr Word kReturnsFirst{"returns-first", "returns before outbound"};
constexpr Word kClocksApart{"clocks-apart", "two clocks"};
constexpr Word kCoarse{"coarse", "coarse steps"};

constexpr Word kLater{"later", "later"};
constexpr Word kEarlier{"earlier", "earlier"};

constexpr FindingKind kPoor{
    .name = "poor-stamps",
    .title = "Poor time stamps: {problems}",
    .message = R"([{without} of {packets:number} {without?has|have} no time stamp.][ The stamps go backwards
{backwards}.][ {identical_pairs} of {paired:number} {identical_pairs?has|have} the same stamp outbound and returned.][ The
returned copy of {returns_stamped_first} of {paired:number} is stamped before the outbound copy: the clocks of two
interfaces differ.][ The stamps of interface {moved_interface} are {clocks_apart_ns} {side} than those of
interface {reference_interface}.][ All stamps are multiples of {step_ns}.][{?stamps_in_frames} Cycle times are measured by the stamps
that the probe put into the frames. Round trips and time-outs are measured by the stamps of the packets, and are not
reliable.][{!stamps_in_frames} Cycle times and round trips that are measured by these stamps are not reliable.])",
    .next = R"([{?stamps_in_frames}Set the capture program to use the stamps of the probe for the
packets.][{!stamps_in_frames}Capture with a machine or probe that stamps each packet when it passes.])",
    .identity = "problems"};
constexpr const FindingKind* kKinds[] = {&kPoor};

constexpr NoteKind kStampsMoved{
    .name = "stamps-moved",
    .text = R"(The stamps of interface {moved_interface} were moved so that each return follows its frame as soon as the
wire allows. {pairs} at the beginning {pairs?shows|show} the difference, and later frames show how it changes.)"};
constexpr NoteKind kRenumbered{
    .name = "renumbered",
    .text = R"(The packets were sorted by the moved stamps. Frame numbers are those of the file that 'ecaudit annotate'
writes, not those of this file.)"};
constexpr const NoteKind* kNotes[] = {&kStampsMoved, &kRenumbered};

constexpr RuleInfo kInfo{.id = "capture-timestamps",
                         .group = "Capture",
                         .severity = Severity::kInfo,
                         .history = History::kNone,
                         .title = "The time stamps of the capture are too poor for timing rules",
                         .needs = "time stamps",
                         .source = "PCAPNG, packet blocks; PCAP, packet records",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .doc = R"(
## What it checks
- stamps that go backwards
- steps of 50 us and more
- equal stamps of the outbound and the returned copy of a frame, for a tenth of the pairs or more
- returns on another interface that are stamped before the frames that they answer
- two interfaces whose clocks differ
- packets without stamps

## Why it matters
Durations, cycle times and time-outs measured with such a clock are wrong. The distributed clock in the frames
themselves is not affected.

## How it is decided
By counting.

- Returns that are stamped first are found by index and content. Then the clocks of two interfaces differ by more than
  the time of a round trip.
- One interface may have the frames that were sent, and the other one those that returned. If the two copies of all
  frames differ by the same time, more than a millisecond or with the wrong sign, the stamps of the second interface are
  moved by that time. They are moved as well if its clock runs faster or slower.
- Steps of one microsecond, as most capture programs have, are fine.

## Example
samples/captures/coarse-timestamps.pcapng

## What to do
Capture on Linux, or with a probe that stamps in hardware. If a probe stamps in hardware, but the packets have the
stamps of the host, set the capture program to use those of the probe.
)"};

class CaptureTimestamps final : public Rule {
 public:
  CaptureTimestamps() : Rule(kInfo) {}
  void Finish() override {
    const PipelineStatistics& read = context().statistics();
    const bus::PairingStatistics& pairing = context().pairing();
    if (read.ethercat_frames == 0) return NotEvaluable(kNoSlave, ReasonCode::kNoEtherCat);
    std::vector<Value> problems;
    Finding finding = Found(kPoor, kNoSlave, read.first);
    finding.last = read.last;
    const auto add = [&](const Word& problem, std::string_view name, Value value) {
      problems.push_back(arg::Of(problem));
      finding.Set(name, std::move(value));
    };
    if (read.without_time > 0) add(kMissing, "without", arg::Count(read.without_time, "packet"));
    if (read.backwards > 0) add(kBackwards, "backwards", arg::Count(read.backwards, "time"));
    if (pairing.identical_stamps * 10 >= pairing.paired && pairing.identical_stamps > 2) {
      add(kIdentical, "identical_pairs", arg::Count(pairing.identical_stamps, "frame"));
    }
    if (pairing.stamped_first > 0) {
      add(kReturnsFirst, "returns_stamped_first", arg::Count(pairing.stamped_first, "frame"));
    }
    const std::optional<capture::ClockShift>& shift = context().source().info().clock_shift;
    if (shift) {
      add(kClocksApart, "clocks_apart_ns", arg::Ns(std::abs(shift->ahead_ns)));
      finding.Set("moved_interface", arg::Number(shift->interface))
          .Set("reference_interface", arg::Number(shift->reference))
          .Set("side", arg::Of(shift->ahead_ns > 0 ? kLater : kEarlier));
    }
    if (read.time_step_ns >= 50'000 && read.packets > 10) add(kCoarse, "step_ns", arg::Ns(read.time_step_ns));
    if (problems.empty()) return;
    finding.Set("problems", arg::List(std::move(problems)))
        .Set("packets", arg::Count(read.packets, "packet"))
        .Set("paired", arg::Count(pairing.paired, "frame"))
        .Set("stamps_in_frames", arg::Flag(read.esl_frames > 0));
    if (shift) {
      finding.Add(kStampsMoved,
                  {{"moved_interface", arg::Number(shift->interface)}, {"pairs", arg::Count(shift->pairs, "frame")}});
      if (shift->renumbered) finding.Add(kRenumbered);
    }
    Report(0, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<CaptureTimestamps>};

}  // namespace
}  // namespace ecaudit::capture_timestamps
