#include <string>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/pipeline.h"
#include "decoder/track/events.h"

namespace ecaudit::capture_spliced {
namespace {

constexpr RuleInfo kInfo{.id = "capture-spliced",
                         .group = "Capture",
                         .severity = Severity::kInfo,
                         .needs_no_history = true,
                         .title = "The file holds more than one recording",
                         .needs = "time stamps",
                         .source = "PCAPNG, packet blocks; PCAP, packet records",
                         .doc = R"(
## What it checks
Whether recordings were put behind one another in one file.

## Why it matters
In between anything may have happened, to another machine even. Nothing is carried over: states, settings and clocks of
the first recording do not judge the second, and each is a run of its own in the report.

## How it is decided
The clock goes back by more than a second, or ahead by more than an hour, and no frame is under way there whose index
shows that the same master goes on.

## Example
tests/rules/capture-spliced/violates.trace

## What to do
Nothing, where it was meant. Else look at the recordings one by one: the frame named begins the next.
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
    Finding finding;
    finding.first = e.frame;
    finding.title = "Another recording begins";
    finding.message = "With frame " + std::to_string(e.frame.number) +
                      " the clock jumps, and nothing shows that the frames before go on: another recording follows. "
                      "What is known from before is not used behind it.";
    Report(0, std::move(finding));
  }

  void Finish() override {
    const PipelineStatistics& read = context().statistics();
    if (read.packets > 0 && read.without_time == read.packets)
      NotEvaluable(kNoSlave, "the packets carry no time stamps");
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<CaptureSpliced>};

}  // namespace
}  // namespace ecaudit::capture_spliced
