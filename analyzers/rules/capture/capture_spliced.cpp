#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/pipeline.h"
#include "decoder/track/events.h"

namespace ecaudit::capture_spliced {
namespace {

constexpr FindingKind kAnotherRecording{
    .name = "another-recording",
    .title = "The file has more than one recording: the clock jumps",
    .message = R"(The clock jumps in {frame}, and no frame in flight there shows that the same master continues. So
another recording seems to begin with {frame}. States and settings from before {frame} are not used after it.)",
    .next = "If the file should have one recording only, evaluate the recordings one by one."};
constexpr const FindingKind* kKinds[] = {&kAnotherRecording};

constexpr RuleInfo kInfo{.id = "capture-spliced",
                         .group = "Capture",
                         .severity = Severity::kInfo,
                         .history = History::kNone,
                         .title = "The file has more than one recording",
                         .needs = "time stamps",
                         .source = "PCAPNG, packet blocks; PCAP, packet records",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Whether several recordings were joined into one file, one after the other.

## Why it matters
Between two recordings anything may have happened, and the second one may be of another machine. States, settings and
clocks of the first recording are not used for the second. Each recording is a run of its own in the report.

## How it is decided
The clock goes back by more than a second, or ahead by more than an hour, and no frame in flight there has an index that
shows that the same master continues.

## Example
tests/rules/capture-spliced/violates.trace

## What to do
Nothing, if the recordings were joined on purpose. Otherwise evaluate the recordings one by one: the frame in the
finding is the first of the next recording.
)"};

class CaptureSpliced final : public Rule {
 public:
  CaptureSpliced() : Rule(kInfo) { Subscribe<track::RunBegan>(&CaptureSpliced::On); }

  void On(const track::RunBegan& e) {
    if (e.reason != track::RunBegan::Reason::kClock) return;
    const FindingIndex known = Repeat(kNoSlave, 0, e.frame);
    if (known != kNoFinding) {
      AddRelated(context().store[known], e.frame.number);
      return;
    }
    Finding finding = Found(kAnotherRecording, kNoSlave, e.frame);
    finding.confidence = Confidence::kInferred;  // a clock that is set looks the same
    Report(0, std::move(finding));
  }

  void Finish() override {
    const PipelineStatistics& read = context().statistics();
    if (read.packets > 0 && read.without_time == read.packets) NotEvaluable(kNoSlave, ReasonCode::kNoStamps);
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<CaptureSpliced>};

}  // namespace
}  // namespace ecaudit::capture_spliced
