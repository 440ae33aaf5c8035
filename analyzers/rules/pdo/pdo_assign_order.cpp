#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/pdo_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/mailbox/events.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit::pdo_assign_order {
namespace {

constexpr FindingKind kCountNotZero{
    .name = "count-not-zero",
    .title = "{object} is written while {count_object} is {number_of_entries} instead of 0",
    .message = R"(The master downloads {value} to {object} in {frame}. At this time {count_object}, the number of
entries, is {number_of_entries} ({count_frame}). Expected: {expected_number_of_entries}. {outcome}[ with {abort_code}].)",
    .next = "Write 0 to {count_object}, then the entries, then their number to {count_object}.",
    .identity = "object"};
constexpr const FindingKind* kKinds[] = {&kCountNotZero};

constexpr Word kEntryCount{"number-of-entries", "the number of entries (subindex 0) of the object"};
constexpr Word kAnswer{"answer-for-number-of-entries", "the answer to the write of subindex 0"};

// ExplainRequest(): the later rule names the nearer cause.
constexpr std::string_view kAfter[] = {"al-invalid-request"};

constexpr RuleInfo kInfo{.id = "pdo-assign-order",
                         .group = "PDO mapping",
                         .severity = Severity::kError,
                         .history = History::kWhole,
                         .subject = Subject::kMappingWrites,
                         .title = "A PDO entry is written while subindex 0 is not zero",
                         .needs = "the last value of subindex 0, from a transfer in the capture",
                         .source = "ETG1000.6, PDO assignment; MKD, 4.5; AKD-2011, 4.5",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Downloads to subindices 1 and up of 1C12h, 1C13h and the mapping objects 1600h-17FFh and 1A00h-1BFFh. At that time
subindex 0, the number of entries, must be 0.

## Why it matters
Otherwise the slave works with a half-written mapping. Most slaves abort the download (0x08000022, 0x06010000). Then the
old entry stays, the process data have another length than the master expects, and the slave refuses SAFEOP.

## How it is decided
Subindex 0 has the value of its last completed download or upload. If none is in the capture, the rule is not evaluated.

- Complete access writes the number and the entries in one transfer and is right.
- The order counts whether or not the slave accepts the download.
- A download that the slave aborts because the object is read-only (a fixed PDO) does not count.

## Example
samples/captures/pdo-assign-order.pcapng

## What to do
Write 0 to subindex 0, then the entries from 1 on, then their number to subindex 0.
)"};

class PdoAssignOrder final : public PdoRule {
 public:
  PdoAssignOrder() : PdoRule(kInfo, WhenAccepted::kStays) {}

 private:
  void OnDownload(const mailbox::SdoTransfer& e, const std::vector<Write>& writes) override {
    if (writes.front().subindex == 0 || AbortedAsReadOnly(e)) return;
    const process::PdoObject* object = context().slave(e.slave).process.seen().Find(e.index);
    const std::uint8_t* count = object != nullptr ? object->count.if_known() : nullptr;
    if (count == nullptr) {
      const bool answer_missing = object != nullptr && object->count_lost;
      NotEvaluable(e.slave, ReasonCode::kNotInCapture, answer_missing ? kAnswer : kEntryCount, FrameOf(e).number);
      return;
    }
    if (*count == 0) return;
    if (context().network().MayMissBetween(object->count.since(), FrameOf(e).number)) {
      NotEvaluable(e.slave, ReasonCode::kCaptureGap, kEntryCount, FrameOf(e).number);
      return;
    }
    const Write& write = writes.front();
    Finding finding = Found(kCountNotZero, e.slave, FrameOf(e));
    finding.Set("object", arg::Object(e.index, write.subindex))
        .Set("index", arg::Hex(e.index))
        .Set("count_object", arg::Object(e.index, 0))
        .Set("value", arg::Hex(write.value, process::IsAssignment(e.index) ? 4 : 8))
        .Set("number_of_entries", arg::Number(*count))
        .Set("expected_number_of_entries", arg::Number(0))
        .Set("count_frame", arg::Frame(object->count.since()));
    AddRelated(finding, object->count.since());
    ReportDownload(e, e.index, std::uint64_t{e.index} << 40U | std::uint64_t{write.subindex} << 32U | write.value,
                   std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<PdoAssignOrder>};

}  // namespace
}  // namespace ecaudit::pdo_assign_order
