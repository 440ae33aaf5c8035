#include "analyzers/judge/latch_rule.h"
#include "analyzers/model/model_events.h"
#include "decoder/base/text.h"

namespace ecaudit::latch_not_mapped {
namespace {

constexpr RuleInfo kInfo{
    .id = "latch-not-mapped",
    .group = "Latch",
    .severity = Severity::kError,
    .title = "An edge is captured whose position can reach the master in no way",
    .needs = "latch words; what the inputs hold; a manual that says which object holds the position",
    .source = "AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9",
    .doc = R"(
## What it checks
Whether an edge that is enabled has its position in the inputs, or else is read by selector or SDO.

## Why it matters
The drive captures, and the master never gets the position.

## How it is decided
Over the whole capture: the edge became valid, none of the objects that hold its position is in the known inputs, and
no valid position was ever read by selector or SDO. A position that lies unread for less than a second when the capture
ends does not count. So does an edge that stays enabled for more than a second while the status word is not in the
inputs either, and neither of them was ever uploaded: nothing can tell the master of a capture. Not evaluable where the
inputs are not known, or the manual does not say which object it is.

## Example
tests/rules/latch-not-mapped/violates.trace

## What to do
Map the position object of this edge into the inputs, or read by selector and wait for the acknowledge.
)"};

class LatchNotMapped final : public LatchRule {
 public:
  LatchNotMapped() : LatchRule(kInfo, model::LatchMisuse::Kind::kNotMapped) {}

 protected:
  void Describe(const model::LatchMisuse& misuse, Finding& finding) const override {
    std::string objects;
    for (const device::ObjectAddress& object : misuse.edge->positions) {
      objects += (objects.empty() ? "" : " or ") + ObjectName(object.index, object.subindex);
    }
    if (!misuse.capture.valid.seen()) {
      finding.title = "Neither status nor position of " + EdgeText(misuse) + " can reach the master";
      finding.message = "The master enabled " + EdgeText(misuse) + CaptureText(misuse.capture) +
                        ", but neither the latch status word nor " +
                        (objects.empty() ? "any latch position" : objects + ", which holds its position,") +
                        " is in the inputs, and the capture holds no upload of them: the "
                        "master cannot learn of a capture. Map both, or read them by SDO.";
      finding.evidence.push_back(Text("edge", misuse.edge->name));
      if (!objects.empty()) finding.evidence.push_back(Text("position_objects", objects));
      return;
    }
    finding.title = "Position of " + EdgeText(misuse) + " is neither mapped nor read";
    finding.message =
        "The master enabled " + EdgeText(misuse) + CaptureText(misuse.capture) + ", but " + objects +
        ", which holds its position, is not in the inputs, and in the whole capture the position is neither "
        "read by selector " +
        std::to_string(misuse.edge->selector) + " nor uploaded by SDO. Map the object or read it.";
    finding.evidence.push_back(Text("edge", misuse.edge->name));
    finding.evidence.push_back(Text("position_objects", objects));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<LatchNotMapped>};

}  // namespace
}  // namespace ecaudit::latch_not_mapped
