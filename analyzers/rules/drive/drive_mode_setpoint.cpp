#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/objects/relatives.h"
#include "analyzers/progress/progress_model.h"
#include "analyzers/words/drive_text.h"

namespace ecaudit::drive_mode_setpoint {
namespace {

constexpr FindingKind kOtherMode{
    .name = "other-mode",
    .title = "Mode {mode} takes {needed}, but {mapped} is mapped",
    .message =
        R"(In {frame} the drive shows Operation enabled in mode {mode}. By the manual ({source}) the set point of this mode is
{needed}. The process data hold {mapped} instead, which is the set point of mode {mapped_mode}. The drive ignores it.)",
    .next = "Select mode {mapped_mode}, or assign a PDO with {needed}.",
    .identity = "mode mapped"};

constexpr FindingKind kOpmode{
    .name = "opmode",
    .title = "Mode {mode} needs {parameter} {expected}, but it is {value}",
    .message =
        R"(In {frame} the drive shows Operation enabled in mode {mode}. By the manual ({source}) {parameter} is {expected} in
this mode. Object {object} was {value} in {value_frame}.)",
    .next = "Do not write {parameter} beside 6060h: the mode of operation sets it.",
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
- whether DRV.OPMODE and DRV.CMDSOURCE have the values that the manual gives for the mode, if the capture shows them
  (35B4h)

## Why it matters
The drive is enabled and ignores the set points that the master sends.

## How it is decided
By the modes of the family. The rule reports nothing:

- if both set points are mapped
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
  }

  void On(const model::DriveStateChanged& e) {
    if (e.to == device::DriveState::kOperationEnabled) Check(e.slave, e.axis, e.frame, std::nullopt);
  }
  void On(const model::DriveMode& e) {
    const model::DriveUnit& unit = context().slave(e.slave).drives.axis(e.axis);
    if (unit.state() == device::DriveState::kOperationEnabled) Check(e.slave, e.axis, e.frame, e.value);
  }

  void Finish() override {
    for (auto& [id, finding] : held_) {
      const progress::AxisWatch* axis = context().progress().axis(id.first, finding.axis);
      const bool reported = axis != nullptr && Has(axis->records(), progress::AxisFact::kSetpointNotMapped);
      if (!reported) (void)Report(id.second, std::move(finding));
    }
    NotEvaluableFor([](const model::SlaveModel& slave) { return DriveWordsMissing(slave, false); });
  }

 private:
  static bool Has(const progress::AxisRecords& records, progress::AxisFact fact) {
    return std::any_of(records.begin(), records.end(),
                       [fact](const progress::AxisRecord& record) { return record.fact == fact; });
  }

  void Check(SlaveId slave, std::uint8_t axis, const FrameRef& frame, std::optional<std::int8_t> changed) {
    const model::SlaveModel& model = context().slave(slave);
    if (!model.profile->drive) return;
    const device::DriveProfile& drive = *model.profile->drive;
    const model::DriveUnit& unit = model.drives.axis(axis);
    const std::optional<std::int8_t> value = changed             ? changed
                                             : unit.mode_shown() ? unit.mode_shown()
                                                                 : unit.mode_requested();
    const device::OperationMode* mode = value ? drive.FindMode(*value) : nullptr;
    if (mode == nullptr) return;
    CheckSetpoint(slave, axis, frame, *mode);
    if (mode->opmode) CheckParameter(slave, axis, frame, *mode, drive.opmode_parameter, *mode->opmode);
    if (mode->cmdsource) CheckParameter(slave, axis, frame, *mode, drive.cmdsource_parameter, *mode->cmdsource);
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
      Hold(axis, static_cast<std::uint8_t>(mode.value), std::move(finding), mode.source);
      return;
    }
  }

  void CheckParameter(SlaveId slave, std::uint8_t axis, const FrameRef& frame, const device::OperationMode& mode,
                      std::string_view keyword, std::int32_t expected) {
    const model::SlaveModel& model = context().slave(slave);
    bool inferred = false;
    const device::DictionaryObject* object = ObjectOf(*model.profile, keyword);
    if (object == nullptr) {
      inferred = true;
      for (const device::DeviceDescription* other : events::Relatives(*model.profile)) {
        if (object == nullptr) object = ObjectOf(*other, keyword);
      }
    }
    const model::ObjectValue* value = object == nullptr ? nullptr : model.objects.Find(object->index, object->subindex);
    if (value == nullptr || value->as_signed() == expected) return;
    Finding finding = Found(kOpmode, slave, frame);
    if (inferred || value->certainty == Certainty::kInferred) finding.confidence = Confidence::kInferred;
    finding.Set("mode", ModeValue(*model.profile, mode.value))
        .Set("parameter", arg::Text(keyword))
        .Set("expected", arg::Number(expected))
        .Set("value", arg::Number(value->as_signed()))
        .Set("object", arg::Object(object->index, object->subindex))
        .Set("value_frame", arg::Frame(value->since))
        .Set("source", arg::Text(mode.source));
    AddRelated(finding, value->since);
    const std::uint64_t key = 0x100U | static_cast<std::uint8_t>(mode.value) |
                              (keyword == model.profile->drive->cmdsource_parameter ? 0x200U : 0U);
    Hold(axis, key, std::move(finding), mode.source);
  }

  static const device::DictionaryObject* ObjectOf(const device::DeviceDescription& family, std::string_view keyword) {
    if (!family.dictionary || keyword.empty()) return nullptr;
    for (const device::DictionaryObject& row : family.dictionary->objects) {
      if (!row.head && row.keyword == keyword) return &row;
    }
    return nullptr;
  }

  void Hold(std::uint8_t axis, std::uint64_t key, Finding finding, const std::string& source) {
    finding.reference = ReferenceTo(source);
    NameAxis(finding, axis);
    const std::pair id{finding.slave, AxisKey(axis) | key};
    if (const auto known = held_.find(id); known != held_.end()) {
      ++known->second.count;
      known->second.last = finding.first;
    } else {
      held_.emplace(id, std::move(finding));
    }
  }

  std::map<std::pair<SlaveId, std::uint64_t>, Finding> held_;  // until it is known what else reports it
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveModeSetpoint>};

}  // namespace
}  // namespace ecaudit::drive_mode_setpoint
