#include <vector>

#include "analyzers/judge/latch_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"

namespace ecaudit::latch_invalid_selector {
namespace {

constexpr FindingKind kNoSuchSelector{
    .name = "no-such-selector",
    .title = "Read selector {selector} does not exist",
    .message =
        R"(The master set read selector {selector} in the latch control word ({control_word})[{?by_sdo} by SDO] in
{frame}. The manual defines {defined}.)",
    .next = "Use one of these selectors, or 0.",
    .identity = "selector"};

constexpr const FindingKind* kKinds[] = {&kNoSuchSelector};

constexpr RuleInfo kInfo{.id = "latch-invalid-selector",
                         .group = "Latch",
                         .severity = Severity::kError,
                         .history = History::kNone,
                         .title = "The read selector of the latch control word does not exist",
                         .needs = "the latch control word that the drive accepted",
                         .source = "AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9",
                         .kinds = kKinds,
                         .notes = kLatchNotes,
                         .doc = R"(
## What it checks
Whether the read selector (20A4h, bits 8 to 12) is 0 or one that the family defines: 1 to 4, for Pilz 1 to 5.

## Why it matters
The drive has no position to supply. Its answer means nothing.

## How it is decided
Each change of the selector to a value that the manual of the family does not list counts. Different values of one slave
are one finding that counts them.

## Example
samples/captures/latch-misuse.pcapng

## What to do
Correct the selector: 1 and 2 read latch 1 (rising, falling), 3 and 4 latch 2, 5 the internal latch C of Pilz drives.
)"};

class LatchInvalidSelector final : public LatchRule {
 public:
  LatchInvalidSelector() : LatchRule(kInfo, model::LatchMisuse::Kind::kInvalidSelector) {}

 protected:
  [[nodiscard]] Finding Describe(const model::LatchMisuse& misuse) const override {
    std::vector<Value> defined;
    for (const device::LatchEdge& edge : context().slave(misuse.slave).profile->latch->edges) {
      defined.push_back(arg::Number(edge.selector, edge.name));
    }
    Finding finding = Found(kNoSuchSelector, misuse.slave, misuse.frame);
    finding.Set("selector", arg::Number(misuse.value))
        .Set("by_sdo", arg::Flag(misuse.by_sdo))
        .Set("defined", arg::List(std::move(defined)));
    return finding;
  }
  [[nodiscard]] std::uint64_t KeyOf(const model::LatchMisuse&) const override { return 0; }
};

const RuleRegistration kRegistration{kInfo, MakeRule<LatchInvalidSelector>};

}  // namespace
}  // namespace ecaudit::latch_invalid_selector
