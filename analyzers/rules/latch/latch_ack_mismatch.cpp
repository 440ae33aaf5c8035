#include "analyzers/judge/latch_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"

namespace ecaudit::latch_ack_mismatch {
namespace {

constexpr RuleInfo kInfo{.id = "latch-ack-mismatch",
                         .group = "Latch",
                         .severity = Severity::kError,
                         .title = "The drive does not acknowledge the read selector in time",
                         .needs = "latch control and status words with time stamps",
                         .source = "AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9",
                         .doc = R"(
## What it checks
Whether the acknowledge in the status word (20A5h, bits 8 to 11) takes the value of the read selector within the limit
(100 ms, configurable as latch-ack-mismatch).

## Why it matters
Without it the position is not supplied; a master that waits for it hangs, one that does not takes another value.

## How it is decided
The selector was set for a valid edge and stays set; later status words (at least three of them in process data) still
show another acknowledge after the limit. A selector that is taken back earlier is not judged, nor one that was set
before the valid bit or that does not exist: those have findings of their own.

## Example
tests/rules/latch-ack-mismatch/violates.trace

## What to do
Look whether the drive is in OP and really takes the control word (working counter, mapping), and whether its firmware
supports reading by selector.
)"};

class LatchAckMismatch final : public LatchRule {
 public:
  LatchAckMismatch() : LatchRule(kInfo, model::LatchMisuse::Kind::kAckMismatch) {}

 protected:
  void Describe(const model::LatchMisuse& misuse, Finding& finding) const override {
    const device::LatchDescription& latch = *context().slave(misuse.slave).profile->latch;
    const unsigned shown = misuse.status ? latch.Acknowledge(*misuse.status) : 0U;
    finding.title = "Read selector " + std::to_string(misuse.value) + " not acknowledged: the status word shows " +
                    std::to_string(shown);
    finding.message =
        "The master set read selector " + std::to_string(misuse.value) + " (" + EdgeText(misuse) + ") in frame " +
        std::to_string(misuse.related[0]) + "; after " + Duration(misuse.waited_ns) + ", in frame " +
        std::to_string(misuse.frame.number) + ", the status word acknowledges " + std::to_string(shown) +
        " instead (limit " + Duration(misuse.limit_ns) +
        "). By the manual the acknowledge tells that the position is supplied. Look whether the drive takes "
        "the control word.";
    finding.evidence.push_back(Text("edge", misuse.edge->name));
    finding.evidence.push_back(Number("selector", misuse.value));
    finding.evidence.push_back(Number("acknowledge", shown));
    finding.evidence.push_back(Real("waited_ms", static_cast<double>(misuse.waited_ns) / 1e6));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<LatchAckMismatch>};

}  // namespace
}  // namespace ecaudit::latch_ack_mismatch
