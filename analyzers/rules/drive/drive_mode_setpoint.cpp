#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/pending_findings.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/drive_places.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/objects/relatives.h"
#include "analyzers/progress/progress_model.h"
#include "analyzers/words/drive_text.h"
#include "decoder/mailbox/events.h"
#include "decoder/track/events.h"

namespace ecaudit::drive_mode_setpoint {
namespace {

constexpr FindingKind kOtherMode{
    .name = "other-mode",
    .title = "Mode {mode} takes {needed}, but {mapped} is mapped",
    .message =
        R"(From {frame} on the drive shows Operation enabled in mode {mode}. By the manual ({source}) the set point
of this mode is {needed}. The process data hold {mapped} instead, which is the set point of mode {mapped_mode}. The
drive ignores it.)",
    .next = "Select mode {mapped_mode}, or assign a PDO with {needed}.",
    .identity = "mode mapped"};

constexpr FindingKind kOpmode{
    .name = "opmode",
    .title = "Mode {mode} needs {parameter} {expected}, but it is {value}",
    .message =
        R"(From {frame} on the drive shows Operation enabled in mode {mode}. By the manual ({source}) {parameter} is
{expected} in this mode. The master [{?written}wrote][{!written}read] {value} [{?written}to][{!written}from] {object}
in {value_frame}, after the mode was selected.)",
    .next =
        R"([{?written}Do not write {parameter} beside 6060h: the mode of operation sets it.][{!written}Check what else
sets {parameter}: the mode of operation should.])",
    .identity = "mode parameter"};

constexpr const FindingKind* kKinds[] = {&kOtherMode, &kOpmode};

// It reports the same where the set point changes.
constexpr std::string_view kAfter[] = {"drive-not-commanded"};

constexpr RuleInfo kInfo{.id = "drive-mode-setpoint",
                         .group = "Drive profile (DS402)",
                         .severity = Severity::kWarning,
                         .of_family = true,
                         .title = "The mapped set point does not belong to the mode of operation",
                         .needs = "mode of operation (6060h, 6061h), the PDO mapping, the status word 6041h",
                         .source = "AKD-2010, 4.7; AKD-2011, 4.7; MKD, 4.8",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
When an axis reaches Operation enabled, or changes its mode there:

- whether the set point of its mode is in the process data, where that of another mode is: 60C1h:1 for Interpolated
  position (7), 60FFh for Profile velocity (3)
- whether DRV.OPMODE and DRV.CMDSOURCE have the values that the manual gives for the mode, if they were read or written
  by SDO (35B4h) after the mode changed

## Why it matters
The drive is enabled and ignores the set points that the master sends.

## How it is decided
By the modes of the family. The drive has to stay enabled in the mode for 1 s. The mode is that of 6061h; if 6061h is
not mapped, the newer one of 6060h and 6061h. The rule reports nothing:

- if both set points are mapped
- if the master writes a set point of the mode by SDO
- if the mapping or the mode is not known
- if drive-not-commanded reports that the other set point changes

## Example
tests/rules/drive-mode-setpoint/violates.trace

## What to do
Select the mode that fits the PDO (1701h: mode 7, 1702h: mode 3), or assign the PDO that fits the mode.
)"};

class DriveModeSetpoint final : public Rule {
 public:
  DriveModeSetpoint() : Rule(kInfo) {
    Subscribe<model::DriveStateChanged>(&DriveModeSetpoint::On);
    Subscribe<model::DriveMode>(&DriveModeSetpoint::On);
    Subscribe<mailbox::SdoTransfer>(&DriveModeSetpoint::On);
    Subscribe<track::CaptureGap>(&DriveModeSetpoint::On);
    Subscribe<track::RunBegan>(&DriveModeSetpoint::On);
  }

  void On(const model::DriveStateChanged& e) {
    Axis& axis = axes_[{e.slave, e.axis}];
    Evaluate(axis, e.slave, e.axis, e.frame);
    axis.mode.reset();
    if (e.to == device::DriveState::kOperationEnabled) Watch(axis, e.slave, e.axis, e.frame);
  }
  void On(const model::DriveMode& e) {
    Axis& axis = axes_[{e.slave, e.axis}];
    Evaluate(axis, e.slave, e.axis, e.frame);
    (e.shown ? axis.shown : axis.requested) = e.frame;
    const model::DriveUnit& unit = context().slave(e.slave).drives.axis(e.axis);
    if (unit.status().state == device::DriveState::kOperationEnabled) Watch(axis, e.slave, e.axis, e.frame);
  }
  /// A set point that the master writes by SDO needs no place in the process data.
  void On(const mailbox::SdoTransfer& e) {
    if (e.has_object && e.service == mailbox::SdoService::kDownload) {
      written_.emplace(e.slave, std::uint32_t{e.index} << 8U | e.subindex);
    }
  }
  void On(const track::CaptureGap&) { ForgetModes(); }
  void On(const track::RunBegan&) { ForgetModes(); }

  void Finish() override {
    for (auto& [id, axis] : axes_) {
      Evaluate(axis, id.first, id.second, context().slave(id.first).inputs.last);
    }
    pending_.Release([this](std::uint64_t key, Finding finding) {
      const progress::AxisWatch* const axis = context().progress().axis(finding.slave, finding.axis);
      const bool reported = axis != nullptr && Has(axis->records(), progress::AxisFact::kSetpointNotMapped);
      if (!reported && !IsWritten(finding, key)) (void)Report(key, std::move(finding));
    });
    NotEvaluableFor([](const model::SlaveModel& slave) { return DriveWordsMissing(slave, false); });
  }

 private:
  /// A master that jogs, or changes its mode in two steps, does not stay in a mode.
  static constexpr TimeNs kLastingNs = 1'000'000'000;
  static constexpr std::uint64_t kOpmodeKey = 0x100, kCommandSourceKey = 0x300;  ///< below: the mode

  struct Axis {
    FrameRef shown, requested;        ///< last changes of 6061h and 6060h
    std::optional<std::int8_t> mode;  ///< in which it is enabled; unset: it is not, or the mode is not known
    FrameRef since;                   ///< likewise
  };

  /// The drive may have left its state unseen: only the time from the next change on counts.
  void ForgetModes() {
    for (auto& [id, axis] : axes_) axis.mode.reset();
  }

  static bool Has(const progress::AxisRecords& records, progress::AxisFact fact) {
    return std::any_of(records.begin(), records.end(),
                       [fact](const progress::AxisRecord& record) { return record.fact == fact; });
  }

  /// By 6061h, or where the process data do not hold it, by the newer one of both objects.
  [[nodiscard]] std::optional<std::int8_t> ModeOf(const Axis& axis, SlaveId slave, std::uint8_t number) const {
    const model::SlaveModel& model = context().slave(slave);
    const model::DriveUnit& unit = model.drives.axis(number);
    if (!unit.modes().requested()) return unit.modes().shown();
    if (!unit.modes().shown()) return unit.modes().requested();
    const bool mapped = model.process.tx().Find(model::ObjectOfAxis(model::kModesDisplay, number), 0) != nullptr;
    return mapped || axis.shown.number > axis.requested.number ? unit.modes().shown() : unit.modes().requested();
  }

  void Watch(Axis& axis, SlaveId slave, std::uint8_t number, const FrameRef& frame) {
    const std::optional<std::int8_t> mode = ModeOf(axis, slave, number);
    if (mode == axis.mode) return;
    axis.mode = mode;
    axis.since = frame;
  }

  /// What held up to `until`.
  void Evaluate(const Axis& axis, SlaveId slave, std::uint8_t number, const FrameRef& until) {
    const model::SlaveModel& model = context().slave(slave);
    if (!axis.mode || !model.profile->drive) return;
    if (!axis.since.has_time || !until.has_time) return NotEvaluable(slave, ReasonCode::kNoStamps, until.number);
    if (Elapsed(axis.since.time, until.time) < kLastingNs) return;
    const device::DriveProfile& drive = *model.profile->drive;
    const device::OperationMode* const mode = drive.FindMode(*axis.mode);
    if (mode == nullptr) return;
    CheckSetpoint(slave, number, axis.since, *mode);
    const FrameNo newest = std::max(axis.shown.number, axis.requested.number);
    if (mode->opmode) {
      CheckParameter(slave, number, axis.since, newest, *mode,
                     {drive.opmode_parameter, *mode->opmode, mode->printed_opmode, kOpmodeKey});
    }
    if (mode->cmdsource) {
      CheckParameter(slave, number, axis.since, newest, *mode,
                     {drive.cmdsource_parameter, *mode->cmdsource, std::nullopt, kCommandSourceKey});
    }
  }

  void CheckSetpoint(SlaveId slave, std::uint8_t axis, const FrameRef& frame, const device::OperationMode& mode) {
    const model::SlaveModel& model = context().slave(slave);
    const model::ProcessLayout& layout = model.process.rx();
    if (mode.setpoints.empty() || !layout.known()) return;
    const auto mapped = [&](const device::ObjectAddress& object) {
      return layout.Find(model::ObjectOfAxis(object.index, axis), object.subindex) != nullptr;
    };
    if (std::any_of(mode.setpoints.begin(), mode.setpoints.end(), mapped)) return;
    for (const device::OperationMode& other : model.profile->drive->modes) {
      const auto found = std::find_if(other.setpoints.begin(), other.setpoints.end(), mapped);
      if (found == other.setpoints.end()) continue;
      const device::ObjectAddress& needed = mode.setpoints.front();
      Finding finding = Found(kOtherMode, slave, frame);
      finding.Set("mode", ModeValue(*model.profile, mode.value))
          .Set("needed", arg::Object(model::ObjectOfAxis(needed.index, axis), needed.subindex))
          .Set("mapped", arg::Object(model::ObjectOfAxis(found->index, axis), found->subindex))
          .Set("mapped_mode", ModeValue(*model.profile, other.value))
          .Set("source", arg::Text(mode.source));
      Keep(axis, static_cast<std::uint8_t>(mode.value), std::move(finding), mode.source);
      return;
    }
  }

  /// Whether the master wrote a set point of the mode by SDO. @param key  of a pending finding
  [[nodiscard]] bool IsWritten(const Finding& finding, std::uint64_t key) const {
    if (finding.kind != &kOtherMode) return false;
    const device::OperationMode* const mode =
        context().slave(finding.slave).profile->drive->FindMode(static_cast<std::int8_t>(key & 0xFFU));
    return mode != nullptr &&
           std::any_of(mode->setpoints.begin(), mode->setpoints.end(), [&](const device::ObjectAddress& object) {
             const std::uint32_t index = model::ObjectOfAxis(object.index, finding.axis);
             return written_.contains({finding.slave, index << 8U | object.subindex});
           });
  }

  /// A parameter of the drive that goes with the mode.
  struct Parameter {
    std::string_view keyword;
    std::int32_t expected = 0;
    std::optional<std::int32_t> printed;  ///< what the manual prints, if it is read otherwise
    std::uint64_t key = 0;
  };

  /// @param newest  the last change of the mode: it sets the parameter, and older values mean nothing
  void CheckParameter(SlaveId slave, std::uint8_t axis, const FrameRef& frame, FrameNo newest,
                      const device::OperationMode& mode, const Parameter& parameter) {
    const model::SlaveModel& model = context().slave(slave);
    bool inferred = false;
    const device::DictionaryObject* object = ObjectOf(*model.profile, parameter.keyword);
    if (object == nullptr) {
      inferred = true;
      for (const device::DeviceDescription* other : events::Relatives(*model.profile)) {
        if (object == nullptr) object = ObjectOf(*other, parameter.keyword);
      }
    }
    if (object == nullptr) return;
    const std::uint16_t index = model::ObjectForAxis(object->index, axis);
    const model::ObjectValue* const value = model.objects.Find(index, object->subindex);
    if (value == nullptr || value->since <= newest || value->as_signed() == parameter.expected) return;
    // What this manual prints is no mistake, even if it is read otherwise.
    if (value->as_signed() == parameter.printed) return;
    Finding finding = Found(kOpmode, slave, frame);
    if (inferred || value->certainty == Certainty::kInferred) finding.confidence = Confidence::kInferred;
    finding.Set("mode", ModeValue(*model.profile, mode.value))
        .Set("parameter", arg::Text(parameter.keyword))
        .Set("expected", arg::Number(parameter.expected))
        .Set("value", arg::Number(value->as_signed()))
        .Set("written", arg::Flag(value->written))
        .Set("object", arg::Object(index, object->subindex))
        .Set("value_frame", arg::Frame(value->since))
        .Set("source", arg::Text(mode.source));
    AddRelated(finding, value->since);
    Keep(axis, parameter.key | static_cast<std::uint8_t>(mode.value), std::move(finding), mode.source);
  }

  static const device::DictionaryObject* ObjectOf(const device::DeviceDescription& family, std::string_view keyword) {
    if (!family.dictionary || keyword.empty()) return nullptr;
    for (const device::DictionaryObject& row : family.dictionary->objects) {
      if (!row.head && row.keyword == keyword) return &row;
    }
    return nullptr;
  }

  void Keep(std::uint8_t axis, std::uint64_t key, Finding finding, const std::string& source) {
    if (pending_.Repeat(finding.slave, AxisKey(axis) | key, finding.first)) return;
    finding.reference = ReferenceTo(source);
    NameAxis(finding, axis);
    pending_.Keep(AxisKey(axis) | key, std::move(finding));
  }

  std::map<std::pair<SlaveId, std::uint8_t>, Axis> axes_;
  std::set<std::pair<SlaveId, std::uint32_t>> written_;  ///< objects and subindices by downloads
  PendingFindings pending_;                              // what else reports it is known at the end
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveModeSetpoint>};

}  // namespace
}  // namespace ecaudit::drive_mode_setpoint
