#include <algorithm>

#include "analyzers/judge/operation_modes.h"
#include "analyzers/judge/refusal/checks.h"
#include "analyzers/judge/refusal/evidence.h"
#include "analyzers/judge/refusal/thresholds.h"
#include "analyzers/sync/sync_type.h"
#include "decoder/esc/al.h"
#include "decoder/esc/dc_registers.h"

namespace ecaudit::refusal {
namespace {

constexpr Word kSyncActive{"sync-active", "SYNC0 is active (0x0981)"};
constexpr Word kSyncInactive{"sync-inactive", "SYNC0 is off (0x0981)"};
constexpr Word kOperationMode{"operation-mode", "0x0981 against the operation modes of the slave"};
constexpr Word kSyncCycle{"sync-cycle", "the SYNC0 cycle (0x09A0)"};

PulseVerdict VerdictOnPulses(const Case& of) {
  const FrameNo changed = of.dc.activation_changed();
  const auto& active = of.dc.active();
  Facts<PulseFact> facts{};
  facts.Set(PulseFact::kNeverSet, of.SyncNeverSet());
  facts.Set(PulseFact::kKnown, of.sync0() && of.Applied(changed));
  facts.Set(PulseFact::kRuns, of.sync0().value_or(false));
  facts.Set(PulseFact::kMayBeReason, of.Counts(changed));
  facts.Set(PulseFact::kAnySync, of.refusal.code == esc::al_code::kSynchronization);
  facts.Set(PulseFact::kShownAfter, active && of.refusal.request != 0 && active->frame.number > of.refusal.request);
  facts.Set(PulseFact::kWrittenActive, active && active->written);
  facts.Set(PulseFact::kWasOff, active && active->was_off);
  return Decide(kPulses, facts);
}

void AddOff(const Case& of, Outcome& found, bool must) {
  Arguments arguments{{"activation", of.Activation()}};
  if (const FrameNo changed = of.dc.activation_changed(); changed != 0) {
    arguments.Set("write_frame", arg::Frame(changed));
  }
  found.Add(must, kSyncOff, std::move(arguments));
}

void AddLate(const Case& of, Outcome& found, bool must) {
  const auto& active = *of.dc.active();
  found.Add(must, kSyncOffAtRequest,
            {{"write_frame", arg::Frame(active.frame.number)},
             {"requested", arg::State(of.refusal.requested)},
             {"request_frame", arg::Frame(of.refusal.request)},
             {"was_off", arg::Flag(active.was_off)}});
}

}  // namespace

void CheckLeftOn(const Case& of, Outcome& found) {
  const auto left = of.dc.left_on();
  if (!left || of.state.returned || !of.Counts(left->clock_set)) return;
  Arguments arguments{{"on_frame", arg::Frame(left->on)},
                      {"on_written", arg::Flag(left->on_written)},
                      {"clock_frame", arg::Frame(left->clock_set)}};
  if (left->off != 0) arguments.Set("off_frame", arg::Frame(left->off));
  found.May(kSyncLeftOn, std::move(arguments));
}

void CheckClock(const Case& of, Outcome& found) {
  const auto features = of.state.registers.Value<std::uint8_t>(esc::kEscFeatures, Certainty::kObserved);
  if (!features || esc::HasClock(*features) || !of.requested()) return;
  const bool must = of.refusal.code != esc::al_code::kSynchronization;  // that one is about any synchronisation
  found.Add(must, kNoClock);
}

void CheckSyncActive(const Case& of, Outcome& found) {
  if (found.Names(kNoClock)) return;
  switch (const PulseVerdict verdict = VerdictOnPulses(of); verdict) {
    case PulseVerdict::kMayBeUnset:
      return found.May(kSyncUnseen, {{"since", arg::Frame(of.state.set_up_since)}});
    case PulseVerdict::kMayBeOff:
    case PulseVerdict::kOff:
      return AddOff(of, found, verdict == PulseVerdict::kOff);
    case PulseVerdict::kMayBeLate:
    case PulseVerdict::kLate:
      return AddLate(of, found, verdict == PulseVerdict::kLate);
    case PulseVerdict::kRight:
      return found.Right(kSyncActive);
    case PulseVerdict::kNothing:
      return;
  }
}

void CheckClockAway(const Case& of, Outcome& found) {
  const auto difference = of.dc.difference();
  if (!difference || difference->ns <= threshold::kClockAwayNs || !of.Counts(difference->frame)) return;
  if (!of.sync0().value_or(false)) return;
  found.value = arg::Ms(difference->ns);
  Arguments arguments{{"difference_ms", arg::Ms(difference->ns)}, {"read_frame", arg::Frame(difference->frame)}};
  if (difference->offset_written == 0 && of.SetUpIsSeen()) {
    arguments.Set("offset_unset", arg::Flag()).Set("since", arg::Frame(of.state.set_up_since));
  }
  found.May(kClockAway, std::move(arguments));
}

void CheckSync1(const Case& of, Outcome& found) {
  const FrameNo changed = of.dc.activation_changed();
  const bool off = found.Has(kSyncActive) && (found.Has(kArrivalFits) || found.Has(kRateFits)) && !of.sync1();
  if (!found.none() || !off || !of.requested() || !of.Counts(changed)) return;
  Arguments arguments{{"activation", of.Activation()}};
  if (changed != 0) arguments.Set("write_frame", arg::Frame(changed));
  found.May(kSync1Off, std::move(arguments));
}

void CheckSync1Cycle(const Case& of, Outcome& found) {
  const auto& active = of.dc.active();
  if (!active || !active->sync1_cycle_ns || !of.Counts(of.sync_changed())) return;
  found.value = arg::Ms(*active->sync1_cycle_ns);
  Arguments arguments{{"cycle_us", arg::Us(*active->sync1_cycle_ns)}};
  if (active->sync0_cycle_ns) arguments.Set("sync0_us", arg::Us(*active->sync0_cycle_ns));
  found.Wrong(kSync1CycleRejected, std::move(arguments));
}

void CheckLatch(const Case& of, Outcome& found) {
  const auto latch0 = of.state.registers.Value<std::uint8_t>(esc::kLatchControl);
  const auto latch1 = of.state.registers.Value<std::uint8_t>(esc::kLatchControl + 1);
  const auto owner = of.state.registers.Value<std::uint8_t>(esc::kCyclicUnitControl);
  if (!latch0 || !latch1 || !owner) return;
  found.May(kLatchSettings,
            {{"latch0", arg::Hex(*latch0, 2)}, {"latch1", arg::Hex(*latch1, 2)}, {"owner", arg::Hex(*owner, 2)}});
}

void CheckSyncUnsupported(const Case& of, Outcome& found) {
  const auto sync0 = of.sync0();
  const FrameNo changed = of.dc.activation_changed();
  if (!sync0 || !of.Applied(changed)) return;
  if (!*sync0) return found.Right(kSyncInactive);
  const auto& active = of.dc.active();
  if (!active || !of.Counts(changed)) return;
  found.Wrong(kSyncOn, {{"activation", of.Activation()},
                        {"write_frame", arg::Frame(active->frame.number)},
                        {"written", arg::Flag(active->written)}});
}

void CheckSyncSet(const Case& of, Outcome& found) {
  const bool off = !of.sync0().value_or(true) && of.Applied(of.dc.activation_changed()) && of.SetUpIsSeen();
  if (!found.none() || (!off && !of.SyncNeverSet())) return;
  if (of.model.objects.Find(sync::kSyncObjects[0], sync::kSyncTypeEntry) != nullptr) return;
  Arguments arguments{{"since", arg::Frame(of.state.set_up_since)}};
  if (off) arguments.Set("activation", of.Activation());
  std::erase(found.right, &kSyncInactive);  // only if the type fits
  found.May(kSyncNeverSet, std::move(arguments));
}

void CheckSyncCycle(const Case& of, Outcome& found) {
  constexpr std::uint8_t kMinimumCycle = 5;
  const auto cycle = of.sync0_cycle_ns();
  if (!cycle) return;
  const bool counts = of.Counts(of.sync_changed());
  if (*cycle == 0) {
    if (counts) found.Wrong(kSyncCycleZero);
    return;
  }
  bool checked = false;
  for (const std::uint16_t object : sync::kSyncObjects) {
    const model::ObjectValue* minimum = of.model.objects.Find(object, kMinimumCycle);
    if (minimum == nullptr || minimum->raw == 0) continue;
    checked = true;
    if (*cycle >= minimum->raw) continue;
    if (!counts) return;
    return found.Wrong(kSyncCycleTooShort, {{"cycle_us", arg::Us(*cycle)},
                                            {"minimum_us", arg::Us(static_cast<std::int64_t>(minimum->raw))},
                                            {"object", arg::Object(object, kMinimumCycle)}});
  }
  if (checked) found.Right(kSyncCycle);
}

void CheckOperationMode(const Case& of, Outcome& found) {
  const auto& active = of.dc.active();
  if (!found.none() || !active || !of.sync0().value_or(false) || !of.Counts(of.sync_changed())) return;
  const OperationModes modes = OperationModesOf(of.context, of.refusal.slave);
  if (modes.modes.empty()) return;
  const ModeMatch match = Match(modes, *active);
  if (match == ModeMatch::kFits) return found.Right(kOperationMode);
  Arguments arguments{{"activation", of.Activation()}, {"write_frame", arg::Frame(active->frame.number)}};
  if (match == ModeMatch::kOtherCycle) arguments.Set("cycle_us", arg::Us(*active->sync0_cycle_ns));
  SetOffered(arguments, modes);
  found.May(match == ModeMatch::kOtherCycle ? kCycleOfNoMode : kNoOperationMode, std::move(arguments));
}

void CheckSyncSettings(const Case& of, Outcome& found) {
  const auto cycle = of.sync0_cycle_ns();
  if (!found.none() || found.Has(kSyncCycle) || cycle.value_or(0) == 0 || !of.Counts(of.sync_changed())) return;
  found.value = arg::Ms(*cycle);
  if (of.refusal.code != esc::al_code::kSyncSettings) {
    return found.Wrong(kSyncCycleRejected, {{"cycle_us", arg::Us(*cycle)}});
  }
  Arguments arguments{{"cycle_us", arg::Us(*cycle)}, {"activation", of.Activation()}};
  if (of.dc.activation_changed() != 0) arguments.Set("write_frame", arg::Frame(of.dc.activation_changed()));
  found.May(kSyncSettings, std::move(arguments));
}

}  // namespace ecaudit::refusal
