#include <utility>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/progress/progress_model.h"

namespace ecaudit::drive_motor_terminal {
namespace {

constexpr FindingKind kEnableMissing{
    .name = "enable-missing",
    .title = "Enable ({enable}) stays 0, but the master sends a set point",
    .message =
        R"(From {frame} on, for {lasted_ms} ({shown_frame}), [{?velocity}the velocity set point is
{set_point}][{!velocity}the position set point moves], and Enable ({enable}) is 0. The motor has no current.)",
    .next = "Set Enable ({enable}) in the process data, and wait for Ready ({ready}).",
    .identity = "enable"};

constexpr FindingKind kNotReadyToEnable{
    .name = "not-ready-to-enable",
    .title = "Ready to enable ({ready_to_enable}) stays 0 while Enable is 1",
    .message =
        R"(From {frame} on, for {lasted_ms} ({shown_frame}), Enable ({enable}) is 1 and Ready to enable
({ready_to_enable}) is 0. The terminal does not enable its motor. Error ({error}) is 0.)",
    .next = "Check the power supply of the motor at the terminal, and its hardware enable input.",
    .identity = "ready_to_enable"};

constexpr FindingKind kNotReady{
    .name = "not-ready",
    .title = "Ready ({ready}) stays 0 although Enable is 1",
    .message =
        R"(From {frame} on, for {lasted_ms} ({shown_frame}), Enable ({enable}) and Ready to enable ({ready_to_enable})
are 1. Ready ({ready}) and Error ({error}) are 0.)",
    .next = "Check the operation mode of the terminal, and its enable input. Take Enable to 0 and to 1 again.",
    .identity = "ready"};

constexpr FindingKind kError{
    .name = "error",
    .title = "Error ({error}) is 1: the terminal does not move its motor",
    .message =
        R"(From {frame} on, for {lasted_ms} ({shown_frame}), Error ({error}) is 1 while the master commands the
motor.[{?began} It rose in {frame}.][{?reset_stands} Reset ({reset}) is 1 all the time, and an error is reset by its
rising edge.])",
    .next =
        "Read the diagnosis of the terminal (A000h and following objects, 10F3h) and correct its cause. Then set Reset "
        "({reset}) from 0 to 1.",
    .identity = "error",
    .next_stays = true};

constexpr FindingKind kStandsStill{
    .name = "stands-still",
    .title = "Velocity set point {set_point}, but the motor does not move",
    .message =
        R"(From {frame} on, for {lasted_ms} ({shown_frame}), the velocity set point is {set_point} and Ready ({ready}) is
1. Moving positive and Moving negative stay 0.)",
    .next =
        "Check the operation mode of the terminal, its maximum velocity and motor current, and whether the set point "
        "is too small.",
    .identity = ""};

constexpr const FindingKind* kKinds[] = {&kEnableMissing, &kNotReadyToEnable, &kNotReady, &kError, &kStandsStill};

constexpr RuleInfo kInfo{
    .id = "drive-motor-terminal",
    .group = "Drive profile (DS402)",
    .severity = Severity::kWarning,
    .title = "A stepper or motor terminal gets a command, and its motor does not move",
    .needs = "mapping of the terminal (7000h, 6000h + 10h x channel), process data in OP, time stamps",
    .source = "ETG5001, modular device profile",
    .kinds = kKinds,
    .doc = R"(
## What it checks
Terminals for stepper and DC motors have no control word. Single bits enable each motor (7010h:1), reset it (7010h:2)
and show its state (6010h:1 to 6010h:6). The rule checks whether a motor that gets a command can move.

## Why it matters
The terminal is in OP and its frames are right, and the axis stands still.

## How it is decided
A channel is a motor if it has Enable, Reset, Ready to enable, Ready and Error. In addition one of these holds:

- their names are known, by SDO information or ESI
- 1000h shows module profile 703 (stepper) or 733 (DC motor)
- it has a velocity at subindex 21h; without Warning and Moving the finding is inferred

A command is Enable, a velocity other than 0, or a position that changes 20 times. What stays so for 1 s in OP is a
finding, an error after 20 ms. A motor without a command is healthy.

If Error rises at the end of a pause that is longer than the watchdog, or together with lost frames, lost
synchronisation or a lost state, this is its cause. Error stays after that until Reset rises.

## Example
tests/rules/drive-motor-terminal/violates.trace: Enable stays 0.

## What to do
Follow the finding: supply, Enable, Reset, then the operation mode of the terminal.
)"};

class DriveMotorTerminal final : public Rule {
 public:
  DriveMotorTerminal() : Rule(kInfo) {}

  void Finish() override {
    context().progress().ForEachMotor([this](SlaveId slave, const progress::MotorWatch& watch) {
      for (const progress::MotorRecord& record : watch.records()) ReportOf(slave, record);
    });
  }

 private:
  static const FindingKind& KindOf(progress::MotorFact fact) {
    switch (fact) {
      case progress::MotorFact::kEnableMissing:
        return kEnableMissing;
      case progress::MotorFact::kNotReadyToEnable:
        return kNotReadyToEnable;
      case progress::MotorFact::kNotReady:
        return kNotReady;
      case progress::MotorFact::kError:
        return kError;
      case progress::MotorFact::kStandsStill:
        break;
    }
    return kStandsStill;
  }

  void ReportOf(SlaveId slave, const progress::MotorRecord& record) {
    Finding finding = Found(KindOf(record.fact), slave, record.since);
    finding.last = record.last;
    finding.count = record.count;
    finding.confidence = record.by_shape ? Confidence::kInferred : Confidence::kObserved;
    const auto output = [&](int subindex) {
      return arg::Object(static_cast<std::uint16_t>(0x7000U + 0x10U * record.channel), subindex);
    };
    const auto input = [&](int subindex) {
      return arg::Object(static_cast<std::uint16_t>(0x6000U + 0x10U * record.channel), subindex);
    };
    finding.Set("lasted_ms", arg::Ms(record.lasted)).Set("shown_frame", arg::Frame(record.frame.number));
    finding.Set("enable", output(1)).Set("reset", output(2));
    finding.Set("ready_to_enable", input(1)).Set("ready", input(2)).Set("error", input(4));
    finding.Set("set_point", arg::Number(record.set_point));
    if (record.velocity) finding.Set("velocity", arg::Flag());
    if (record.reset_stands) finding.Set("reset_stands", arg::Flag());
    if (record.began) finding.Set("began", arg::Flag());
    AddRelated(finding, record.frame.number);
    const std::uint64_t key = std::uint64_t{record.channel} << 8U | static_cast<std::uint64_t>(record.fact);
    (void)Report(key, record.fact == progress::MotorFact::kError ? Severity::kError : kInfo.severity,
                 std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveMotorTerminal>};

}  // namespace
}  // namespace ecaudit::drive_motor_terminal
