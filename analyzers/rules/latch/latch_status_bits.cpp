#include "analyzers/judge/latch_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"

namespace ecaudit::latch_status_bits {
namespace {

using StatusBits = model::LatchMisuse::StatusBits;

constexpr FindingKind kReserved{
    .name = "reserved-bits",
    .title = "Reserved bits {bits} of the latch status word are 1",
    .message = R"(The latch status word is {status_word} in {frame}[{?by_sdo} (by SDO)]. The manual gives the bits
{reserved_bits} no meaning. Of these {bits} are 1.)",
    .next = "Compare the PDO mapping with what the master reads: another object may lie there.",
    .identity = "bits"};

constexpr FindingKind kUnarmed{
    .name = "valid-without-arming",
    .title = "Latch status: {edge} is valid, but was never armed",
    .message = R"(The latch status word changes to {status_word} in {frame}[{?by_sdo} (by SDO)]: {edge} is valid. In
the control words that the capture shows since SAFEOP its enable bits {bits} are not all 1. The last one is
{control_word}.)",
    .next = "Check whether a control word by SDO or a program in the drive arms this edge.",
    .identity = "edge"};

constexpr FindingKind kUnselected{
    .name = "acknowledge-without-selector",
    .title = "Selector {selector} is acknowledged, but was never set",
    .message = R"(The latch status word changes to {status_word} in {frame}[{?by_sdo} (by SDO)]: it acknowledges read
selector {selector}. No control word that the capture shows since SAFEOP has this selector. The last one is
{control_word}.)",
    .next = "Compare the PDO mapping with what the master reads: another object may lie there.",
    .identity = "selector"};

constexpr const FindingKind* kKinds[] = {&kReserved, &kUnarmed, &kUnselected};

constexpr RuleInfo kInfo{.id = "latch-status-bits",
                         .group = "Latch",
                         .severity = Severity::kInfo,
                         .history = History::kWhole,
                         .title = "The latch status word shows what the master never asked for",
                         .needs = "latch control and status words",
                         .source = "AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9",
                         .kinds = kKinds,
                         .notes = kLatchNotes,
                         .doc = R"(
## What it checks
The latch status word (20A5h):

- bits that the manual reserves: 4 to 7, for Pilz 5 to 7
- a valid bit of an edge that no control word armed
- an acknowledge of a selector that no control word had

## Why it matters
Such a word is often no status word: the mapping is shifted, and positions are read at a wrong place as well.

## How it is decided
- Reserved bits count each time they change to 1, and in the first word.
- Valid bits and acknowledges count from the third status word since SAFEOP on, while the control word is known.
- All control words since SAFEOP count, also those that the drive may not have accepted, or that never returned.
- An edge that shares its capture unit with a touch probe is not evaluated while 60B8h has enabled that touch probe.
- After a capture gap valid bits and acknowledges are not evaluated: control words may be missing.
- An acknowledge while another selector is set belongs to latch-ack-mismatch.

## Example
tests/rules/latch-status-bits/violates.trace

## What to do
Compare the PDO mapping of the inputs with the layout that the master uses.
)"};

class LatchStatusBits final : public LatchRule {
 public:
  LatchStatusBits() : LatchRule(kInfo, model::LatchMisuse::Kind::kStatusBits) {}

 protected:
  [[nodiscard]] Finding Describe(const model::LatchMisuse& misuse) const override {
    const device::LatchDescription& latch = *context().slave(misuse.slave).profile->latch;
    Finding finding = Found(KindOf(misuse.status_bits), misuse.slave, misuse.frame);
    finding.Set("by_sdo", arg::Flag(misuse.by_sdo));
    switch (misuse.status_bits) {
      case StatusBits::kReserved:
        finding.Set("bits", arg::Hex(misuse.value)).Set("reserved_bits", arg::Hex(latch.reserved_status));
        break;
      case StatusBits::kUnarmed:
        finding.Set("edge", arg::Text(misuse.edge->name)).Set("bits", arg::Hex(misuse.edge->enable));
        break;
      case StatusBits::kUnselected:
        finding.Set("selector", arg::Number(misuse.value));
        break;
    }
    return finding;
  }
  [[nodiscard]] std::uint64_t KeyOf(const model::LatchMisuse& misuse) const override {
    const std::uint64_t of_value = misuse.status_bits == StatusBits::kReserved ? 0 : misuse.value;
    return of_value << 8U | static_cast<std::uint64_t>(misuse.status_bits);
  }

 private:
  static const FindingKind& KindOf(StatusBits bits) {
    switch (bits) {
      case StatusBits::kReserved:
        return kReserved;
      case StatusBits::kUnarmed:
        return kUnarmed;
      case StatusBits::kUnselected:
        break;
    }
    return kUnselected;
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<LatchStatusBits>};

}  // namespace
}  // namespace ecaudit::latch_status_bits
