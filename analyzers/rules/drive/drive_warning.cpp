#include <map>
#include <utility>

#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/objects/object_words.h"
#include "analyzers/objects/relatives.h"
#include "analyzers/words/drive_text.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::drive_warning {
namespace {

constexpr FindingKind kWarning{.name = "warning",
                               .title = "The drive shows a warning (status bit 7)[: {reason}]",
                               .message =
                                   "Bit 7 (warning) of the status word is 1 in {frame} ({status_word})."
                                   "[{!warning_object} The emergency message of {reason_frame} reports {reason}. Only "
                                   "its time connects it with the warning.]"
                                   "[ {warning_object}, read in {reason_frame}, reports {reason}.]"
                                   "[{!reason} The capture does not show which warning it is.]",
                               .next =
                                   "[{?reason}Look this warning up in the manual of the drive.]"
                                   "[{!reason}Read [{read_object}][{!read_object}603Fh and 1003h:1] from the drive.]",
                               .identity = "reason"};

constexpr const FindingKind* kKinds[] = {&kWarning};

constexpr RuleInfo kInfo{.id = "drive-warning",
                         .group = "Drive profile (DS402)",
                         .severity = Severity::kInfo,
                         .title = "The warning bit of the status word is set",
                         .needs = "status word 6041h; emergency messages or 603Fh for the reason",
                         .source = "CIA402, status word",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Bit 7 of the status word, and what the drive reports at the same time: an emergency message that is no fault.

## Why it matters
A warning often comes before the fault that stops the axis: temperature, load, a fan, the encoder battery.

## How it is decided
The bit rises, or is set when the drive is first seen. An emergency counts as its reason, and the finding is inferred,
if all of this holds:

- it came up to 1 s before
- its code is no documented fault
- the slave has one axis: an emergency does not name its axis

Where the manual of the family has an object with the numbers of warnings (MKD 2000h: 439 is n439), a value read while
the bit is set is the reason.

## Example
tests/rules/drive-warning/violates.trace

## What to do
Look the number up in the manual of the drive.
)"};

class DriveWarningRule final : public Rule {
 public:
  DriveWarningRule() : Rule(kInfo) {
    Subscribe<model::DriveWarning>(&DriveWarningRule::On);
    Subscribe<mailbox::Emergency>(&DriveWarningRule::On);
    Subscribe<mailbox::SdoTransfer>(&DriveWarningRule::On);
  }

  void On(const mailbox::Emergency& e) {
    const events::EmergencyInfo info = events::FindEmergency(context().slave(e.slave).profile, e.data.error_code);
    const bool numbered = info.code != nullptr && !info.code->id.empty();  // classes of codes cover both
    if (e.data.error_code == 0) {
      last_.erase(e.slave);
    } else if (!numbered || info.code->kind != device::EmergencyKind::kFault) {
      last_.insert_or_assign(e.slave, std::pair(e.frame, e.data.error_code));
    }
  }

  void On(const model::DriveWarning& e) {
    if (!e.set) {
      open_.erase(e.slave);
      return;
    }
    const std::uint64_t key = AxisKey(e.axis) | 1U;
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    Finding finding = Found(kWarning, e.slave, e.frame);
    finding.confidence = e.inferred ? Confidence::kInferred : Confidence::kObserved;
    finding.Set("status_word", arg::Hex(e.word));
    const auto known = last_.find(e.slave);
    if (known != last_.end() && IsRecent(known->second.first, e.frame) && AxesOf(e.slave) <= 1) {
      finding.confidence = Confidence::kInferred;
      model::DriveFaultExplained reason;
      reason.code = known->second.second;
      finding.Set("reason", arg::Text(FaultText(*context().slave(e.slave).profile, reason)));
      finding.Set("reason_frame", arg::Frame(known->second.first.number));
      AddRelated(finding, known->second.first.number);
    }
    if (const device::FaultObject* row = WarningObject(e.slave)) {
      finding.Set("read_object", arg::Object(row->index, row->subindex));
    }
    NameAxis(finding, e.axis);
    const FindingIndex index = Report(key, std::move(finding));
    if (index != kNoFinding) open_.insert_or_assign(e.slave, index);
  }

  /// The object of the manual that has the number of the warning: read while the bit is set, it is the reason.
  void On(const mailbox::SdoTransfer& t) {
    const auto open = open_.find(t.slave);
    if (open == open_.end() || t.service != mailbox::SdoService::kUpload || t.complete_access || !t.has_object) return;
    if (t.outcome != mailbox::SdoOutcome::kCompleted || t.data.empty() || t.data.size() > 8) return;
    const device::DeviceDescription& family = *context().slave(t.slave).profile;
    const device::FaultObject* row = family.number_object(t.index, t.subindex);
    const std::uint64_t number = UnsignedOf(t.data);
    if (row == nullptr || row->kind != device::FaultValue::kWarningNumber || number == 0) return;
    Finding& finding = context().store[open->second];
    finding.Set("warning_object", arg::Object(t.index, t.subindex))
        .Set("reason", arg::Text(events::NumberWords(family, *row, number)))
        .Set("reason_frame", arg::Frame(t.response.number));
    finding.reference = ReferenceTo(row->source);
    AddRelated(finding, t.response.number);
    open_.erase(open);
  }

  void Finish() override {
    NotEvaluableFor([](const model::SlaveModel& slave) { return DriveWordsMissing(slave, false); });
  }

 private:
  [[nodiscard]] unsigned AxesOf(SlaveId slave) const {
    unsigned axes = 0;
    context().slave(slave).drives.ForEachSeen([&axes](const model::DriveUnit&) { ++axes; });
    return axes;
  }

  [[nodiscard]] const device::FaultObject* WarningObject(SlaveId slave) const {
    for (const device::FaultObject& row : context().slave(slave).profile->reported_objects) {
      if (row.kind == device::FaultValue::kWarningNumber) return &row;
    }
    return nullptr;
  }

  static bool IsRecent(const FrameRef& emergency, const FrameRef& frame) {
    constexpr TimeNs kRecentNs = 1'000'000'000;
    return !emergency.has_time || !frame.has_time || frame.time - emergency.time <= kRecentNs;
  }

  std::map<SlaveId, FindingIndex> open_;                        // of each slave: its warning, while the bit is set
  std::map<SlaveId, std::pair<FrameRef, std::uint16_t>> last_;  // of each slave: its last emergency
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveWarningRule>};

}  // namespace
}  // namespace ecaudit::drive_warning
