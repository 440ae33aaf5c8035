#include <vector>

#include "analyzers/judge/latch_rule.h"
#include "analyzers/model/model_events.h"

namespace ecaudit::latch_not_mapped {
namespace {

constexpr FindingKind kUnreachable{
    .name = "unreachable",
    .title = "Status and position of {edge} are [{?watched_ms}not mapped and not ][{!watched_ms}never ]read",
    .message = R"(The master enabled {edge}[ in {armed_frame}]. The inputs contain neither the latch status word nor
[its position ({position_objects})][{!position_objects}any latch position]. The capture has no upload of them by SDO.
[{!watched_ms}So the master cannot know that the drive captured a position.][{?watched_ms}The capture ends {watched_ms}
after the edge was armed: {cycles} without the position. Each SDO of the slave took {sdo_ms} at most, so the master had
the time to upload it. It may still do that after the capture.])",
    .next = "Map the status word and the position into the inputs, or read them by SDO.",
    .identity = "edge"};

constexpr FindingKind kNotRead{
    .name = "not-read",
    .title = "Position of {edge} is neither mapped nor read",
    .message = R"(The drive captured a position of {edge}.[ The edge was armed in {armed_frame}.][ It became valid in
{valid_frame}.] Its position ({position_objects}) is not in the inputs. The whole capture has no read of it, neither
by selector {selector} nor by SDO.)",
    .next = "Map the object into the inputs, or read it by selector and wait for the acknowledge.",
    .identity = "edge"};

constexpr const FindingKind* kKinds[] = {&kUnreachable, &kNotRead};

constexpr RuleInfo kInfo{
    .id = "latch-not-mapped",
    .group = "Latch",
    .severity = Severity::kError,
    .history = History::kWhole,
    .title = "The latched position is neither mapped nor read",
    .needs = "latch words; the contents of the inputs; the object with the position, from the manual",
    .source = "AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9",
    .kinds = kKinds,
    .notes = kLatchNotes,
    .doc = R"(
## What it checks
Whether the master reads the position of an edge that it enables: in the inputs, by selector or by SDO.

## Why it matters
The drive captures, and the master never gets the position.

## How it is decided
Over the whole capture:

- The edge became valid. None of the objects with its position is in the known inputs, and no valid position was ever
  read by selector or SDO. A position that stays unread for less than a second until the capture ends does not count.
- Or the edge stays enabled for more than a second, and neither its position nor the status word is in the inputs or was
  ever uploaded. Nothing shows the master a captured position.
- If the capture ends within this second, the finding is an inferred warning. It needs the control word in 100 cycles of
  the process data after the edge was armed. The time must be enough for 100 SDOs of the slave, as slow as its slowest.

The rule is not evaluated if the inputs are not known, or if the manual does not give the object.

## Example
tests/rules/latch-not-mapped/violates.trace

## What to do
Map the object with the position of this edge into the inputs. Or read it by selector and wait for the acknowledge.
)"};

class LatchNotMapped final : public LatchRule {
 public:
  LatchNotMapped() : LatchRule(kInfo, model::LatchMisuse::Kind::kNotMapped) {}

 protected:
  [[nodiscard]] Finding Describe(const model::LatchMisuse& misuse) const override {
    std::vector<Value> objects;
    for (const device::ObjectAddress& object : misuse.edge->positions) {
      objects.push_back(arg::Object(object.index, object.subindex));
    }
    Finding finding = Found(misuse.capture.valid.seen() ? kNotRead : kUnreachable, misuse.slave, misuse.frame);
    SetCapture(finding, misuse);
    if (!objects.empty()) finding.Set("position_objects", arg::List(std::move(objects)));
    finding.Set("selector", arg::Number(misuse.edge->selector));
    if (misuse.waited_ns > 0) {
      finding.Set("watched_ms", arg::Ms(misuse.waited_ns))
          .Set("cycles", arg::Count(misuse.cycles, "cycle"))
          .Set("sdo_ms", arg::Ms(misuse.limit_ns));
    }
    return finding;
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<LatchNotMapped>};

}  // namespace
}  // namespace ecaudit::latch_not_mapped
