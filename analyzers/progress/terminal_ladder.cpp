#include <array>

#include "analyzers/progress/ladder.h"

namespace ecaudit::progress {
namespace {

constexpr Word kMotorNoFault{"no-fault", "no fault"};
constexpr Word kMotorVoltage{"voltage", "voltage enabled"};
constexpr Word kMotorEnabled{"enabled", "enabled"};
constexpr Word kMotorMode{"mode", "mode shown"};
constexpr Word kMotorCommanded{"commanded", "commanded"};
constexpr Word kMotorFollows{"follows", "follows"};

/// In the order of MotorFact.
constexpr std::array kWhy{
    Word{"enable-missing", "the bit Enable stays 0"},
    Word{"not-ready-to-enable", "the terminal is not ready to enable its motor"},
    Word{"not-ready", "the terminal does not show Ready"},
    Word{"error", "the terminal shows an error"},
    Word{"stands-still", "a velocity is set, and the motor does not move"},
};

Rung MotorRung(const Word& word, RungStatus status) {
  Rung rung;
  rung.rung = &word;
  rung.status = status;
  return rung;
}

/// The first record of this rung that was not over before `reached`.
const MotorRecord* RecordOf(const MotorWatch& motor, bool follows, const FrameRef& reached) {
  for (const MotorRecord& record : motor.records()) {
    if ((record.fact == MotorFact::kStandsStill) == follows && record.last.number >= reached.number) return &record;
  }
  return nullptr;
}

void HoldBy(Rung& rung, const MotorRecord& record, const SlaveSummary& slave, const AnalysisResult& result) {
  rung.why = &kWhy[static_cast<std::size_t>(record.fact)];
  rung.held_since = record.since;
  rung.held_by = HolderOf(result, slave, {"drive-motor-terminal"}, {-1, record.last, record.since.number});
}

}  // namespace

/// As an axis of CiA 402 has it; a terminal shows neither a voltage nor a mode.
Ladder LadderOf(const MotorWatch& motor, const SlaveSummary& slave, const AnalysisResult& result) {
  Rung no_fault = MotorRung(kMotorNoFault, RungStatus::kNotAsked);
  no_fault.since = motor.without_error();
  if (motor.without_error().seen()) no_fault.status = RungStatus::kReached;

  Rung enabled = MotorRung(kMotorEnabled, RungStatus::kNotAsked);
  enabled.since = motor.ready_since();
  enabled.until = motor.ready_lost();
  const bool ready = motor.ready_since().seen();
  const MotorRecord* const held = RecordOf(motor, false, motor.ready_lost());
  if (ready && !motor.ready_lost().seen()) {
    enabled.status = RungStatus::kReached;
  } else if (held != nullptr) {
    enabled.status = ready ? RungStatus::kLost : RungStatus::kNotReached;
    HoldBy(enabled, *held, slave, result);
  } else if (ready) {
    enabled.status = RungStatus::kReached;
  }

  Rung commanded = MotorRung(kMotorCommanded, RungStatus::kNotAsked);
  commanded.since = motor.commanded();
  if (motor.commanded().seen()) commanded.status = RungStatus::kReached;

  Rung follows = MotorRung(kMotorFollows, RungStatus::kNotAsked);
  follows.since = motor.first_moved();
  if (const MotorRecord* const still = RecordOf(motor, true, motor.moved())) {
    follows.status = motor.first_moved().seen() ? RungStatus::kLost : RungStatus::kNotReached;
    if (follows.status == RungStatus::kLost) follows.until = still->since;
    HoldBy(follows, *still, slave, result);
  } else if (motor.first_moved().seen()) {
    follows.status = RungStatus::kReached;
  }

  Ladder ladder;
  ladder.rungs = {no_fault,  MotorRung(kMotorVoltage, RungStatus::kNotAsked),
                  enabled,   MotorRung(kMotorMode, RungStatus::kNotAsked),
                  commanded, follows};
  return ladder;
}

}  // namespace ecaudit::progress
