#include <string>

#include "analyzers/judge/latch_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"

namespace ecaudit::latch_value_lost {
namespace {

constexpr FindingKind kDisarmedBeforeRead{
    .name = "disarmed-before-read",
    .title = "Position of {edge} lost: disarmed before it was read",
    .message =
        R"(The master disarmed {edge}[{?by_sdo} by SDO] in {frame}.[ The edge was armed in {armed_frame}.][ It became
valid in {valid_frame}.] Its position was not read: no mapped object carried it, selector {selector} was not
acknowledged, and there was no upload by SDO.[ The master set the selector in {selector_frame}, but did not wait for
the acknowledge.])",
    .next = "Read the position before clearing the enable bit.",
    .identity = "edge"};

constexpr const FindingKind* kKinds[] = {&kDisarmedBeforeRead};

// It is its cause.
constexpr std::string_view kAfter[] = {"latch-not-mapped"};

constexpr RuleInfo kInfo{.id = "latch-value-lost",
                         .group = "Latch",
                         .severity = Severity::kError,
                         .history = History::kWhole,
                         .title = "The master disarms a latch before it reads the position",
                         .needs = "latch control and status words; the contents of the inputs",
                         .source = "AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9",
                         .kinds = kKinds,
                         .notes = kLatchNotes,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Whether the position of a valid latch was read before its enable bit was cleared or the latch was armed again.

## Why it matters
The position of that edge is lost: the master misses a measurement.

## How it is decided
A position counts as read in one of these cases:

- The object with the position is mapped, and a frame carried it while the valid bit was set.
- Its read selector was acknowledged.
- It was uploaded by SDO.

The finding cites the control word that cleared the enable bit. It is reported only if the master had seen the valid bit
before. The manuals do not state that the valid bit is cleared together with the enable bit. So the position counts as
lost if the valid bit is clear, or the latch is armed again, and the position was not read until then. If all words
travel by SDO, it also counts as lost if the status word was never read again.

The rule is not evaluated if the contents of the inputs are not known.

## Example
samples/captures/latch-misuse.pcapng

## What to do
Read the position first: map its object, or set the read selector and wait for the acknowledge.
)"};

class LatchValueLost final : public LatchRule {
 public:
  LatchValueLost() : LatchRule(kInfo, model::LatchMisuse::Kind::kValueLost) {}

  void Finish() override {
    LatchRule::Finish();
    // A position that can never be read is lost as a consequence.
    std::vector<Finding>& findings = context().store.findings();
    const auto edge_of = [](const Finding& finding) {
      const Value* edge = finding.arguments.Find("edge");
      return edge == nullptr ? std::string() : ecaudit::KeyOf(*edge);
    };
    for (Finding& own : findings) {
      if (own.rule != kInfo.id) continue;
      for (std::size_t i = 0; i < findings.size(); ++i) {
        const Finding& other = findings[i];
        if (other.rule == "latch-not-mapped" && other.slave == own.slave && edge_of(other) == edge_of(own)) {
          own.caused_by = static_cast<FindingIndex>(i);
        }
      }
    }
  }

 protected:
  [[nodiscard]] Finding Describe(const model::LatchMisuse& misuse) const override {
    Finding finding = Found(kDisarmedBeforeRead, misuse.slave, misuse.frame);
    SetCapture(finding, misuse);
    finding.Set("selector", arg::Number(misuse.edge->selector));
    if (misuse.capture.selected.seen()) finding.Set("selector_frame", arg::Frame(misuse.capture.selected.number));
    return finding;
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<LatchValueLost>};

}  // namespace
}  // namespace ecaudit::latch_value_lost
