#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/text.h"
#include "decoder/bus/pairing.h"
#include "decoder/pipeline.h"

namespace ecaudit::capture_one_direction {
namespace {

constexpr RuleInfo kInfo{.id = "capture-one-direction",
                         .group = "Capture",
                         .severity = Severity::kInfo,
                         .needs_no_history = true,
                         .title = "The capture holds only outbound or only returned frames",
                         .needs = "nothing",
                         .source = "ESC-1, source address of frames that passed a slave",
                         .doc = R"(
## What it checks
Whether both copies of the frames are in the capture.

## Why it matters
Without returned frames nobody sees what the slaves answered: accesses are assumed to be done, findings are marked
inferred, and rules that need an answer are not judged. Without outbound frames lost frames cannot be seen.

## How it is decided
From the source addresses, working counters and position counters of the first frames. Frames that are repeated under
one index after a pause show that nobody answered: then no direction is missing. Where frames of another sender arrive
that are those of the master, as they were sent, one port of a redundant line was captured.

## Example
samples/captures/outbound-only.pcapng

## What to do
Capture at a place where both directions pass: on the master itself, or with a probe. Of a redundant line capture both
ports into one file.
)"};

class CaptureOneDirection final : public Rule {
 public:
  CaptureOneDirection() : Rule(kInfo) {}
  void Finish() override {
    const bus::PairingStatistics& pairing = context().pairing();
    const bool outbound = pairing.outbound > 0;
    const bool returned = pairing.returned > pairing.other_end;
    if (!outbound && !returned) NotEvaluable(kNoSlave, "no EtherCAT frames in the capture");
    if (pairing.one_port) {
      TellOnePort(pairing);
      return;
    }
    if (outbound == returned || pairing.no_answers) return;
    Finding finding;
    finding.first = context().statistics().first;
    finding.last = context().statistics().last;
    finding.title = outbound ? "Only outbound frames were captured" : "Only returned frames were captured";
    finding.message = outbound
                          ? "No frame in this capture has passed the slaves. What they answered is not known: accesses "
                            "are assumed to be done, and rules that need an answer are not judged."
                          : "No frame in this capture is on its way to the slaves. Answers are complete, but lost "
                            "frames cannot be seen.";
    Report(0, std::move(finding));
  }

 private:
  void TellOnePort(const bus::PairingStatistics& pairing) {
    Finding finding;
    finding.first = context().statistics().first;
    finding.last = context().statistics().last;
    finding.title = "Only one port of a redundant line was captured";
    finding.message = "What this port sends comes back at the other one, which is not in the capture: " +
                      Count(pairing.other_end, "frame") +
                      " that the other one sent arrived as they were sent. What the slaves answered is not known: "
                      "accesses are assumed to be done, and rules that need an answer are not judged.";
    if (pairing.paired > 0) {
      finding.title += ", and the line was broken";
      finding.message += " " + Count(pairing.paired, "frame") +
                         " came back at this port: then the line was broken behind the last slave that answered.";
    }
    finding.evidence = {Number("from_other_port", static_cast<std::int64_t>(pairing.other_end)),
                        Number("came_back", static_cast<std::int64_t>(pairing.paired))};
    const FindingIndex index = Report(0, std::move(finding));
    // Half of the slaves are behind the break.
    if (pairing.paired > 0 && index != kNoFinding) context().store.Regrade(index, Severity::kWarning);
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<CaptureOneDirection>};

}  // namespace
}  // namespace ecaudit::capture_one_direction
