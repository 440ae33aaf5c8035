#include "analyzers/judge/latch_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"

namespace ecaudit::latch_ack_mismatch {
namespace {

constexpr FindingKind kNotAcknowledged{
    .name = "not-acknowledged",
    .title = "Read selector {selector} not acknowledged: the status word shows {acknowledge}",
    .message = R"(The master set read selector {selector} ({edge}) in {selector_frame}. After {waited_ms} ({frame})
the acknowledge in the status word is {acknowledge} (limit {limit_ms}). By the manual the drive supplies the position
only with the acknowledge of its selector.)",
    .next = "Check whether the drive accepts the control word (working counter, mapping, AL state OP).",
    .identity = "selector"};

constexpr const FindingKind* kKinds[] = {&kNotAcknowledged};

constexpr RuleInfo kInfo{.id = "latch-ack-mismatch",
                         .group = "Latch",
                         .severity = Severity::kError,
                         .history = History::kWhole,
                         .title = "The drive does not acknowledge the read selector in time",
                         .needs = "latch control and status words with time stamps",
                         .source = "AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9",
                         .kinds = kKinds,
                         .notes = kLatchNotes,
                         .doc = R"(
## What it checks
Whether the acknowledge in the status word (20A5h, bits 8 to 11) takes the value of the read selector within the limit
(100 ms, configurable as latch-ack-mismatch).

## Why it matters
Without the acknowledge the drive does not supply the position. A master that waits for it hangs. A master that does not
wait uses another value.

## How it is decided
The selector was set for a valid edge and stays set. Later status words, at least three of them in process data, still
show another acknowledge after the limit. These selectors are not evaluated:

- a selector that the master cleared earlier
- a selector that was set before the valid bit: see latch-read-before-valid
- a selector that does not exist: see latch-invalid-selector

## Example
tests/rules/latch-ack-mismatch/violates.trace

## What to do
Check whether the drive is in OP and accepts the control word (working counter, mapping). Check whether its firmware
supports reading by selector.
)"};

class LatchAckMismatch final : public LatchRule {
 public:
  LatchAckMismatch() : LatchRule(kInfo, model::LatchMisuse::Kind::kAckMismatch) {}

 protected:
  [[nodiscard]] Finding Describe(const model::LatchMisuse& misuse) const override {
    const device::LatchDescription& latch = *context().slave(misuse.slave).profile->latch;
    Finding finding = Found(kNotAcknowledged, misuse.slave, misuse.frame);
    finding.Set("edge", arg::Text(misuse.edge->name))
        .Set("selector", arg::Number(misuse.value))
        .Set("acknowledge", arg::Number(misuse.status ? latch.Acknowledge(*misuse.status) : 0))
        .Set("waited_ms", arg::Ms(misuse.waited_ns))
        .Set("limit_ms", arg::Ms(misuse.limit_ns))
        .Set("selector_frame", arg::Frame(misuse.related[0]));
    return finding;
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<LatchAckMismatch>};

}  // namespace
}  // namespace ecaudit::latch_ack_mismatch
