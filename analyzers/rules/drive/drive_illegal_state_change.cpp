#include <optional>
#include <string>

#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/drive_text.h"
#include "decoder/base/text.h"
#include "decoder/base/time.h"

namespace ecaudit::drive_illegal_state_change {
namespace {

constexpr RuleInfo kInfo{
    .id = "drive-illegal-state-change",
    .group = "Drive profile (DS402)",
    .severity = Severity::kError,
    .title = "The drive's state changes without a legal path of commanded and automatic transitions",
    .needs = "two status words 6041h, and every control word 6040h since one second before the first of them",
    .source = "CIA402, state machine; AKD-2011, 4.4; MKD, 4.4; PILZ, 4.4",
    .doc = R"(
## What it checks
When the status word (6041h) shows another state than before: whether transitions lead there that the drive takes by
itself or that a control word (6040h) commanded.

## Why it matters
A drive that enables itself moves when nobody asked for it. Or somebody else commands it: a second control word, a
service tool, a digital input.

## How it is decided
By the transitions 0 to 16 of the state machine. Automatic ones, all that take torque away (supply or hardware enable
lost, limit switch) and the fault reset, which has other ways, are always possible. Transitions 2, 3, 4 and 16 need a
control word that commanded them: the one in force, or one given since a second before the old state was last shown,
also in frames whose answer was lost. Several transitions may have been passed unseen between two status words. Not
judged: words that show no state, changes from a status word of 0 (inputs that were not valid yet), and changes outside
OP.

A drive that leaves Operation enabled by itself, for Quick stop active or a state without torque that is no fault, while
the control word still enables it, and mode and the control word's bits of the state machine were not touched for 0.1 s,
may do so: that is a warning.

## Example
tests/rules/drive-illegal-state-change/violates.trace

## What to do
Look for another source of commands: the service tool, an enable input, a second master. Check that the status word
is mapped where the master reads it.
)"};

/// Bits of the status word that say why, and went to 0 together with the state.
std::string WhatFellWithIt(const model::DriveStateChanged& e) {
  constexpr std::uint16_t kVoltage = 1U << 4U, kRemote = 1U << 9U;
  const std::uint16_t gone = e.word_before.value_or(0) & static_cast<std::uint16_t>(~e.word);
  std::string text;
  if ((gone & kVoltage) != 0)
    text += "Bit 4 (voltage enabled) went to 0 with it: the power stage has lost its supply. ";
  if ((gone & kRemote) != 0) {
    text += "Bit 9 (remote) went to 0 with it: the drive no longer obeys the fieldbus (local control, service tool). ";
  }
  return text;
}

constexpr Word kControlWordsBefore{"control-words-before-change", "control words before a change of state", true};

class DriveIllegalStateChange final : public Rule {
 public:
  DriveIllegalStateChange() : Rule(kInfo) {
    Subscribe<model::DriveIllegalChange>(&DriveIllegalStateChange::On);
    Subscribe<model::DriveStateChanged>(&DriveIllegalStateChange::On);
  }

  /// Torque may be taken away at any time; but somebody who looks for the reason of a stop wants to know where.
  void On(const model::DriveStateChanged& e) {
    using device::DriveState;
    const bool fell = e.to == DriveState::kSwitchOnDisabled || e.to == DriveState::kReadyToSwitchOn ||
                      e.to == DriveState::kSwitchedOn || e.to == DriveState::kQuickStopActive;
    if (!fell || e.from != DriveState::kOperationEnabled || e.command.seen()) return;
    const model::SlaveModel& slave = context().slave(e.slave);
    const std::optional<std::uint16_t> control = slave.drives.axis(e.axis).control_word();
    constexpr std::uint16_t kEnable = 0x008F, kEnabled = 0x000F;
    if (!control || (*control & kEnable) != kEnabled || !slave.al.SettledIn(esc::AlState::OP)) return;
    // What was set shortly before, or in a hole of the capture, may be why.
    constexpr TimeNs kSettled = 100'000'000;
    if (!e.settings_since.seen() || !e.settings_since.has_time || !e.frame.has_time) return;
    if (Elapsed(e.settings_since.time, e.frame.time) < kSettled) return;
    constexpr std::uint64_t kByItself = 1ULL << 32U;
    const std::uint64_t key = AxisKey(e.axis) | kByItself | static_cast<std::uint8_t>(*e.to);
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    finding.confidence = e.inferred ? Confidence::kInferred : Confidence::kObserved;
    finding.title = "The drive left Operation enabled for " + StateText(*e.to) + " by itself";
    finding.message = "The status word shows Operation enabled up to frame " + std::to_string(e.from_last) + " and " +
                      StateText(*e.to) + " (" + Hex(e.word) + ") in frame " + std::to_string(e.frame.number) +
                      ", while the control word is still " + Hex(*control) + ". " + WhatFellWithIt(e) +
                      "A drive may do so when its supply or hardware enable goes (STO), or at a limit. Look at these, "
                      "and at the drive's own messages.";
    AddRelated(finding, e.from_last);
    finding.evidence.push_back(HexNumber("status_word", e.word));
    finding.evidence.push_back(HexNumber("control_word", *control));
    finding.evidence.push_back(Text("state", StateText(*e.to)));
    NameAxis(finding, e.axis);
    Report(key, Severity::kWarning, std::move(finding));
  }

  void On(const model::DriveIllegalChange& e) {
    const std::uint64_t key =
        AxisKey(e.axis) | std::uint64_t{static_cast<std::uint8_t>(e.from)} << 8U | static_cast<std::uint8_t>(e.to);
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    const device::DriveProfile& drive = *context().slave(e.slave).profile->drive;
    const std::string from = StateText(e.from);
    const std::string to = StateText(e.to);
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    finding.confidence = e.inferred ? Confidence::kInferred : Confidence::kObserved;
    finding.title = from + " to " + to + " without a command";
    finding.message = "The status word shows " + from + " (" + Hex(e.word_before) + ") up to frame " +
                      std::to_string(e.from_last) + " and " + to + " (" + Hex(e.word) + ") in frame " +
                      std::to_string(e.frame.number) + ". No control word commanded " + PathText(e.missing) +
                      " of the way there; it is " + Hex(e.control) + " since frame " + std::to_string(e.control_since) +
                      ". Look for another source of commands: service tool, enable input, second master.";
    AddRelated(finding, e.from_last);
    AddRelated(finding, e.control_since);
    finding.evidence.push_back(HexNumber("status_word_before", e.word_before));
    finding.evidence.push_back(HexNumber("status_word", e.word));
    finding.evidence.push_back(HexNumber("control_word", e.control));
    finding.evidence.push_back(Text("state_before", from));
    finding.evidence.push_back(Text("state", to));
    finding.reference = ReferenceTo(drive.source);
    NameAxis(finding, e.axis);
    Report(key, std::move(finding));
  }

  void Finish() override {
    NotEvaluableFor([](const model::SlaveModel& slave) {
      const std::optional<Reason> missing = DriveWordsMissing(slave, true);
      const auto unjudged = [](const model::DriveUnit& axis) { return axis.unjudged_changes() > 0; };
      if (missing || !slave.drives.Any(unjudged)) return missing;
      return std::optional(Reason::Of(ReasonCode::kMissesPackets, kControlWordsBefore));
    });
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveIllegalStateChange>};

}  // namespace
}  // namespace ecaudit::drive_illegal_state_change
