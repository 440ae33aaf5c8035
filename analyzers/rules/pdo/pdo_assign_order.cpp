#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/pdo_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit::pdo_assign_order {
namespace {

constexpr RuleInfo kInfo{.id = "pdo-assign-order",
                         .group = "PDO mapping",
                         .severity = Severity::kError,
                         .subject = Subject::kMappingWrites,
                         .title = "A PDO assignment or mapping entry is written while its subindex 0 is not zero",
                         .needs = "the last value of subindex 0, from a transfer in the capture",
                         .source = "ETG1000.6, PDO assignment; MKD, 4.5; AKD-2011, 4.5",
                         .doc = R"(
## What it checks
Downloads to subindices 1 and up of 1C12h, 1C13h and the mapping objects 1600h-17FFh and 1A00h-1BFFh: subindex 0, the
number of entries, must be 0 meanwhile.

## Why it matters
The slave would otherwise work with a half-written mapping. Most abort the download (0x08000022, 0x06010000); then the
old entry stays, the length of the process data differs from what the master reckons, and SAFEOP is refused.

## How it is decided
Subindex 0 is what the last completed download or upload of it says. Where none is in the capture the rule says so.
Complete access writes count and entries in one transfer and is right. The order holds whether or not the slave accepts
the download; one that it aborts because the object is read-only (a fixed PDO) does not count.

## Example
samples/captures/pdo-assign-order.pcapng

## What to do
Write 0 to subindex 0, then the entries from 1 on, then their number to subindex 0.
)"};

class PdoAssignOrder final : public PdoRule {
 public:
  PdoAssignOrder() : PdoRule(kInfo, WhenAccepted::kStands) {}

 private:
  void OnDownload(const mailbox::SdoTransfer& e, const std::vector<Write>& writes) override {
    if (writes.front().subindex == 0 || AbortedAsReadOnly(e)) return;
    const process::PdoObject* object = context().slave(e.slave).process.seen().Find(e.index);
    const std::uint8_t* count = object != nullptr ? object->count.if_known() : nullptr;
    if (count == nullptr) {
      NotEvaluable(
          e.slave,
          object != nullptr && object->count_lost
              ? "subindex 0 of the object was written before, and whether that was done the capture does not show"
              : "subindex 0 of the object was neither written nor read before",
          FrameOf(e).number);
      return;
    }
    if (*count == 0) return;
    if (context().network().MayMissBetween(object->count.since(), FrameOf(e).number)) {
      NotEvaluable(e.slave, ReasonCode::kCaptureGap, what::kHistory, FrameOf(e).number);
      return;
    }
    const Write& write = writes.front();
    const std::string name = ObjectName(e.index, write.subindex);
    Finding finding;
    finding.title = name + " is written while " + ObjectName(e.index, 0) + " is " + std::to_string(*count);
    finding.message = "In frame " + std::to_string(FrameOf(e).number) + " the master downloads " +
                      Hex(write.value, process::IsAssignment(e.index) ? 4 : 8) + " to " + name + " while " +
                      ObjectName(e.index, 0) + ", the number of entries, is " + std::to_string(*count) + " (frame " +
                      std::to_string(object->count.since()) + ")." + OutcomeText(e) +
                      " It has to be 0 then: 0 to subindex 0, then the entries, then their number.";
    finding.evidence.push_back(Text("object", name));
    finding.evidence.push_back(HexNumber("index", e.index));
    finding.evidence.push_back(HexNumber("value", write.value));
    finding.evidence.push_back(Number("number_of_entries", *count));
    finding.evidence.push_back(Number("expected_number_of_entries", 0));
    AddRelated(finding, object->count.since());
    Tell(e, e.index, std::uint64_t{e.index} << 40U | std::uint64_t{write.subindex} << 32U | write.value,
         std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<PdoAssignOrder>};

}  // namespace
}  // namespace ecaudit::pdo_assign_order
