#include <optional>
#include <utility>
#include <vector>

#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/drive_text.h"
#include "analyzers/words/what.h"

namespace ecaudit::drive_control_outside_op {
namespace {

constexpr FindingKind kOutsideOp{
    .name = "outside-op",
    .title = "{command} commanded in {al_state}; the drive acts on it in {acting_states} only",
    .message =
        R"(The control word (6040h) in {frame} ({way}) is {control_word} ({command}) while the slave is in {al_state}.
The manual: the drive acts on the control word in {acting_states} only.)",
    .next = "Send control word 0 until the slave is in {acting_states}, then command the states in order.",
    .identity = "al_state command"};
constexpr const FindingKind* kKinds[] = {&kOutsideOp};

constexpr Word kActingStates{"acting-al-states", "the AL states in which the drive acts on the control word", true};

constexpr RuleInfo kInfo{
    .id = "drive-control-outside-op",
    .group = "Drive profile (DS402)",
    .severity = Severity::kWarning,
    .title = "An enable command is sent while the slave is not in OP",
    .needs = "control word 6040h, the slave's AL state, and a family whose manual states when the control word acts",
    .source = "AKD-2011, 4.3; AKD-2010, 4.3; MKD, 4.4; PILZ, 4.4",
    .kinds = kKinds,
    .doc = R"(
## What it checks
Control words (6040h) that command Switch on or Enable operation, in the process data or by SDO, while the slave is
known to be in INIT, PREOP, SAFEOP or BOOT.

## Why it matters
The drive acts on the control word in OP only. A command before OP is lost if the drive needs edges. A drive that
evaluates levels executes it at the moment the slave reaches OP.

## How it is decided
At the frame in which the word changes to one that asks for more than before. A word that stays the same counts once. A
word that stays when the slave drops out of OP is not reported. Nothing is evaluated during a change of state. Shutdown
(0x0006), fault reset and words that remove torque are no enable commands.

## Example
samples/captures/drive-enabled-in-safeop.pcapng

## What to do
Send control word 0 until the slave is in OP, then command the states in order.
)"};

class DriveControlOutsideOp final : public Rule {
 public:
  DriveControlOutsideOp() : Rule(kInfo) { Subscribe<model::DriveCommandOutsideOp>(&DriveControlOutsideOp::On); }

  void On(const model::DriveCommandOutsideOp& e) {
    const std::uint64_t key = AxisKey(e.axis) | e.al_state;
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    const device::DriveProfile& drive = *context().slave(e.slave).profile->drive;
    std::vector<Value> acting;
    for (const esc::AlState state : drive.control_word_in)
      acting.push_back(arg::State(static_cast<std::uint8_t>(state)));
    Finding finding = Found(kOutsideOp, e.slave, e.frame);
    finding.Set("control_word", arg::Hex(e.word))
        .Set("al_state", arg::State(e.al_state))
        .Set("command", arg::Text(CommandName(drive, {}, 0, e.word)))
        .Set("way", WayValue(e.by_sdo))
        .Set("acting_states", arg::List(std::move(acting)));
    finding.reference = ReferenceTo(drive.source);
    NameAxis(finding, e.axis);
    Report(key, std::move(finding));
  }

  void Finish() override {
    NotEvaluableFor([](const model::SlaveModel& slave) -> std::optional<Reason> {
      const auto commanded = [](const model::DriveUnit& axis) { return axis.control().seen(); };
      if (!slave.profile->drive || !slave.drives.Any(commanded)) return std::nullopt;
      if (slave.profile->drive->control_word_in.empty()) {
        return Reason::Of(ReasonCode::kNotInProfile, kActingStates);
      }
      if (slave.al.status_reads() > 0) return std::nullopt;
      return Reason::Of(ReasonCode::kNotRead, what::kAlStatus);
    });
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveControlOutsideOp>};

}  // namespace
}  // namespace ecaudit::drive_control_outside_op
