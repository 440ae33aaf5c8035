#include <map>
#include <set>
#include <tuple>
#include <vector>

#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/drive_text.h"

namespace ecaudit::drive_unsupported_mode {
namespace {

constexpr std::uint16_t kSupportedModes = 0x6502;

constexpr FindingKind kNotListed{
    .name = "not-listed",
    .title = "Mode of operation {mode} is not in the manual's list",
    .message = R"({object} is set to {mode} in {frame} ({way}). {manual} lists the modes {modes}.)",
    .next = R"([{!offered}Select a listed mode, or read 6502h and 6061h to check whether this firmware has more.])",
    .identity = "mode"};
constexpr const FindingKind* kKinds[] = {&kNotListed};

constexpr NoteKind kClaimed{
    .name = "claimed",
    .text = "The drive reports this mode as supported in 6502h ({at}): it offers more than its manual."};
constexpr NoteKind kShown{.name = "shown",
                          .text = "The drive shows this mode in 6061h[ ({at})]: it offers more than its manual."};
constexpr const NoteKind* kNotes[] = {&kClaimed, &kShown};

constexpr Word kModes{"modes-of-operation", "a complete list of modes of operation"};

constexpr RuleInfo kInfo{
    .id = "drive-unsupported-mode",
    .group = "Drive profile (DS402)",
    .severity = Severity::kError,
    .history = History::kNone,
    .of_family = true,
    .title = "A mode of operation is selected that is not in the family's list",
    .needs = "modes of operation 6060h, in the process data or by SDO; a family whose manual lists its modes",
    .source = "AKD-2011, 4.7; AKD-2010, 4.7; MKD, 4.8; PILZ, 4.5",
    .kinds = kKinds,
    .notes = kNotes,
    .doc = R"(
## What it checks
Each value of 6060h that the drive accepted, by SDO or in the process data, against the modes of operation in the
manual. 0 selects no mode and is always right.

## Why it matters
A drive ignores a mode it does not have and stays in the old one. It then takes set points for something else.

## How it is decided
By the list of the family. If the drive shows the mode (6061h) or reports it as supported (6502h), it offers more than
its manual: the finding is an info. A write that the drive refused does not count.

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
      finding.Set("offered", arg::Flag()).Add(kShown, {{"at", arg::Frame(e.frame.number)}});
      AddRelated(finding, e.frame.number);
      return;
    }
    if (!drive.modes_complete) {
      NotEvaluable(e.slave, ReasonCode::kNotInProfile, kModes, e.frame.number);
      return;
    }
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    const model::ObjectValue* claimed = slave.objects.Find(model::ObjectOfAxis(kSupportedModes, e.axis), 0);
    const bool claims = claimed != nullptr && e.value > 0 && e.value <= 32 &&
                        (claimed->raw >> static_cast<unsigned>(e.value - 1) & 1U) != 0;
    const bool shows = slave.drives.axis(e.axis).modes().shown() == e.value;
    Finding finding = Found(kNotListed, e.slave, e.frame);
    finding.confidence = e.inferred ? Confidence::kInferred : Confidence::kObserved;
    finding.Set("mode", arg::Number(e.value))
        .Set("object", arg::Object(model::ObjectOfAxis(0x6060, e.axis)))
        .Set("way", WayValue(e.by_sdo))
        .Set("manual", arg::Text(slave.profile->title))
        .Set("modes", arg::List(ModesOf(*slave.profile)))
        .Set("offered", arg::Flag(claims || shows));
    if (claims) {
      finding.Add(kClaimed, {{"at", arg::Frame(claimed->since)}});
      AddRelated(finding, claimed->since);
    } else if (shows) {
      finding.Add(kShown);
    }
    finding.reference = ReferenceTo(drive.modes.empty() ? std::string_view(drive.source)
                                                        : std::string_view(drive.modes.front().source));
    NameAxis(finding, e.axis);
    const FindingIndex index = Report(key, claims || shows ? Severity::kInfo : kInfo.severity, std::move(finding));
    if (index != kNoFinding) reported_[{e.slave, e.axis, e.value}] = index;
  }

 private:
  /// "3 (Profile velocity)", ... by number.
  static std::vector<Value> ModesOf(const device::DeviceDescription& family) {
    std::set<std::int8_t> modes;
    for (const device::OperationMode& mode : family.drive->modes) modes.insert(mode.value);
    std::vector<Value> list;
    for (const std::int8_t value : modes) list.push_back(ModeValue(family, value));
    return list;
  }

  std::map<std::tuple<SlaveId, std::uint8_t, std::int8_t>, FindingIndex> reported_;  // slave, axis, mode
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveUnsupportedMode>};

}  // namespace
}  // namespace ecaudit::drive_unsupported_mode
