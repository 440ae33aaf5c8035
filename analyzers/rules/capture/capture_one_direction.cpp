#include <utility>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/bus/pairing.h"
#include "decoder/pipeline.h"

namespace ecaudit::capture_one_direction {
namespace {

constexpr FindingKind kOnlyOutbound{
    .name = "only-outbound",
    .title = "Only outbound frames were captured",
    .message =
        R"(No frame in this capture has passed the slaves, so the answers of the slaves are not in it. Accesses are
assumed to be accepted. Rules that need an answer are not evaluated.)",
    .next = "Capture at a place where both directions pass: on the master itself, or with a probe."};
constexpr FindingKind kOnlyReturned{
    .name = "only-returned",
    .title = "Only returned frames were captured",
    .message =
        R"(No frame in this capture is on its way to the slaves. The answers are complete, but lost frames are not
visible.)",
    .next = "Capture at a place where both directions pass: on the master itself, or with a probe."};
constexpr FindingKind kOnePort{
    .name = "one-port",
    .title = "Only one port of a redundant line was captured",
    .message =
        R"(Frames that this port sends return at the other port, which is not in the capture. {from_other_port} of
the other port arrived unchanged. The answers of the slaves are not in the capture. Accesses are assumed to be accepted.
Rules that need an answer are not evaluated.)",
    .next = "Capture both ports of the master into one file."};
constexpr FindingKind kBrokenLine{
    .name = "one-port-of-broken-line",
    .title = "Only one port of a redundant, broken line was captured",
    .message =
        R"(Frames that this port sends return at the other port, which is not in the capture. {from_other_port} of
the other port arrived unchanged, but {came_back} returned at this port. During that time the line was broken downstream
of the last slave that answered. Slaves after the break are not in the capture.)",
    .next = "Check the cable after the last slave that answers. Capture both ports of the master into one file."};
constexpr const FindingKind* kKinds[] = {&kOnlyOutbound, &kOnlyReturned, &kOnePort, &kBrokenLine};

constexpr RuleInfo kInfo{.id = "capture-one-direction",
                         .group = "Capture",
                         .severity = Severity::kInfo,
                         .history = History::kNone,
                         .title = "The capture has only outbound or only returned frames",
                         .needs = "nothing",
                         .source = "ESC-1, source address of frames that passed a slave",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Whether both copies of each frame are in the capture: outbound and returned.

## Why it matters
Without returned frames the answers of the slaves are unknown. Accesses are assumed to be accepted, findings are marked
inferred, and rules that need an answer are not evaluated. Without outbound frames lost frames are not visible.

## How it is decided
From the source addresses, working counters and position counters of the first frames.

- Frames that are repeated under one index after a pause show that no slave answers. Then no direction is missing.
- If unchanged frames of the master arrive from another sender, one port of a redundant line was captured.

## Example
samples/captures/outbound-only.pcapng

## What to do
Capture at a place where both directions pass: on the master itself, or with a probe. For a redundant line capture both
ports into one file.
)"};

class CaptureOneDirection final : public Rule {
 public:
  CaptureOneDirection() : Rule(kInfo) {}
  void Finish() override {
    const bus::PairingStatistics& pairing = context().pairing();
    const bool outbound = pairing.outbound > 0;
    const bool returned = pairing.returned > pairing.other_end;
    if (!outbound && !returned) NotEvaluable(kNoSlave, ReasonCode::kNoEtherCat);
    if (pairing.one_port) {
      ReportOnePort(pairing);
      return;
    }
    if (outbound == returned || pairing.no_answers) return;
    Report(0, Made(outbound ? kOnlyOutbound : kOnlyReturned));
  }

 private:
  [[nodiscard]] Finding Made(const FindingKind& kind) const {
    Finding finding = Found(kind, kNoSlave, context().statistics().first);
    finding.last = context().statistics().last;
    return finding;
  }

  void ReportOnePort(const bus::PairingStatistics& pairing) {
    const bool broken = pairing.paired > 0;
    Finding finding = Made(broken ? kBrokenLine : kOnePort);
    finding.Set("from_other_port", arg::Count(pairing.other_end, "frame"))
        .Set("came_back", arg::Count(pairing.paired, "frame"));
    const FindingIndex index = Report(0, std::move(finding));
    // Some of the slaves are downstream of the break.
    if (broken && index != kNoFinding) context().store.Regrade(index, Severity::kWarning);
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<CaptureOneDirection>};

}  // namespace
}  // namespace ecaudit::capture_one_direction
