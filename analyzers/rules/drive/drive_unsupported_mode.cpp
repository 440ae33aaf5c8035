#include <map>
#include <string>
#include <tuple>

#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/drive_text.h"

namespace ecaudit::drive_unsupported_mode {
namespace {

constexpr std::uint16_t kSupportedModes = 0x6502;

constexpr RuleInfo kInfo{
    .id = "drive-unsupported-mode",
    .group = "Drive profile (DS402)",
    .severity = Severity::kError,
    .needs_no_history = true,
    .of_family = true,
    .title = "A mode of operation is selected that is not in the family's list",
    .needs = "modes of operation 6060h, in the process data or by SDO; a family whose manual lists its modes",
    .source = "AKD-2011, 4.7; AKD-2010, 4.7; MKD, 4.8; PILZ, 4.5",
    .doc = R"(
## What it checks
Each value of 6060h that the drive took, by SDO or in the process data, against the modes of operation in the manual.
0 asks for no mode and is never wrong.

## Why it matters
A drive ignores a mode it does not have and stays in the old one: it then reads position setpoints as something else.

## How it is decided
By the list of the family. Where the drive itself shows the mode (6061h) or claims it (6502h) it offers more than its
manual: then it is an information only. A write that the drive refused is not counted here.

## Example
samples/captures/drive-unsupported-mode.pcapng

## What to do
Select a mode of the list, or check whether the drive's firmware is newer than the manual: read 6502h and 6061h.
)"};

class DriveUnsupportedMode final : public Rule {
 public:
  DriveUnsupportedMode() : Rule(kInfo) { Subscribe<model::DriveMode>(&DriveUnsupportedMode::On); }

  void On(const model::DriveMode& e) {
    if (e.value == 0) return;
    const model::SlaveModel& slave = context().slave(e.slave);
    const device::DriveProfile& drive = *slave.profile->drive;
    if (drive.FindMode(e.value) != nullptr) return;
    const std::uint64_t key = AxisKey(e.axis) | static_cast<std::uint8_t>(e.value);
    if (e.shown) {
      const auto found = reported_.find({e.slave, e.axis, e.value});
      if (found == reported_.end()) return;
      Finding& finding = context().store[found->second];
      if (finding.severity == Severity::kInfo) return;
      context().store.Regrade(found->second, Severity::kInfo);
      finding.message += " The drive shows this mode (6061h) in frame " + std::to_string(e.frame.number) +
                         ": it offers more than its manual.";
      AddRelated(finding, e.frame.number);
      return;
    }
    if (!drive.modes_complete) {
      NotEvaluable(e.slave, "the modes of operation of this drive are not known", e.frame.number);
      return;
    }
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    const model::ObjectValue* claimed = slave.objects.Find(model::ObjectOfAxis(kSupportedModes, e.axis), 0);
    const bool claims = claimed != nullptr && e.value > 0 && e.value <= 32 &&
                        (claimed->raw >> static_cast<unsigned>(e.value - 1) & 1U) != 0;
    const bool shows = slave.drives.axis(e.axis).mode_shown() == e.value;
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    finding.confidence = e.inferred ? Confidence::kInferred : Confidence::kObserved;
    finding.title = "Mode of operation " + std::to_string(e.value) + " is not in the manual's list";
    finding.message = "Object " + ObjectName(model::ObjectOfAxis(0x6060, e.axis)) + " is set to " +
                      std::to_string(e.value) + " in frame " + std::to_string(e.frame.number) +
                      (e.by_sdo ? " (SDO)" : " (process data)") + ". " + slave.profile->title + " lists " +
                      List(drive) + ".";
    if (claims) {
      finding.message += " The drive claims the mode in 6502h (frame " + std::to_string(claimed->since) +
                         "): it offers more than its manual.";
      AddRelated(finding, claimed->since);
    } else if (shows) {
      finding.message += " The drive shows this mode (6061h): it offers more than its manual.";
    } else {
      finding.message += " Select one of these, or check 6502h and 6061h whether this firmware has more.";
    }
    finding.evidence.push_back(Number("mode", e.value));
    finding.reference = ReferenceTo(drive.modes.empty() ? std::string_view(drive.source)
                                                        : std::string_view(drive.modes.front().source));
    NameAxis(finding, e.axis);
    const FindingIndex index = Report(key, claims || shows ? Severity::kInfo : kInfo.severity, std::move(finding));
    if (index != kNoFinding) reported_[{e.slave, e.axis, e.value}] = index;
  }

 private:
  /// "3 (Profile velocity), 6 (Homing), 7 (Interpolated position)"
  static std::string List(const device::DriveProfile& drive) {
    std::map<int, std::string> modes;
    for (const device::OperationMode& mode : drive.modes) modes[mode.value] = ModeText(drive, mode.value);
    std::string list;
    for (const auto& [value, text] : modes) list += (list.empty() ? "" : ", ") + text;
    return list;
  }

  std::map<std::tuple<SlaveId, std::uint8_t, std::int8_t>, FindingIndex> reported_;  // slave, axis, mode
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveUnsupportedMode>};

}  // namespace
}  // namespace ecaudit::drive_unsupported_mode
