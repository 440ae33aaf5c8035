#include <algorithm>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/lrw_support.h"
#include "analyzers/judge/refusal/checks.h"
#include "analyzers/judge/refusal/evidence.h"
#include "analyzers/judge/refusal/thresholds.h"
#include "decoder/base/time.h"
#include "decoder/esc/al.h"

namespace ecaudit::refusal {
namespace {

using Since = model::ProcessTraffic::SinceRequest;

constexpr Word kLrw{"lrw", "support of LRW (0x0008)"};
constexpr Word kOutputsArrive{"outputs", "the arrival of outputs"};
constexpr Word kInputsArrive{"inputs", "the arrival of inputs"};
constexpr Word kWatchdogTimes{"watchdog", "the watchdog time (0x0420) is not 0"};

/// What would reach the slave would be in the capture: some FMMU writes, it is known of all of them, and no frame is
/// missing.
bool WouldShow(const Case& of, FrameNo since) {
  const track::KnownFmmus& fmmus = of.context.network().fmmus(of.refusal.slave);
  const bool writes =
      std::ranges::any_of(fmmus.active, [](const track::KnownFmmus::Unit& unit) { return unit.fmmu.writes(); });
  return fmmus.all && writes && !MissesPackets(of.context.pairing()) && of.context.network().last_gap() <= since;
}

Facts<ExchangeFact> FactsOf(const Case& of, const Since& data) {
  Facts<ExchangeFact> facts{};
  facts.Set(ExchangeFact::kRequested, of.requested());
  facts.Set(ExchangeFact::kExchanged, data.exchanged > 0);
  facts.Set(ExchangeFact::kMissed, data.missed > 0);
  return facts;
}

Arguments MissedBy(const Since& data) {
  return {{"since", arg::Frame(data.request)},
          {"missed", arg::Count(data.missed, "datagram")},
          {"last_missed", arg::Frame(data.last_missed)}};
}

}  // namespace

void CheckLrw(const Case& of, Outcome& found) {
  static constexpr Word kRegister{"register", "bit 9 of 0x0008 is 1"};
  static constexpr Word kEeprom{"eeprom", "bit 1 of the flags in the general category of its EEPROM is 1"};
  constexpr std::uint16_t kNoLrw = 0x0200;  // of 0x0008
  if (!of.ExchangeCounts()) return;
  const auto& outputs = of.model.outputs.since;
  const auto& inputs = of.model.inputs.since;
  const auto features = of.state.registers.Value<std::uint16_t>(esc::kEscFeatures, Certainty::kObserved);
  const bool by_register = features && (*features & kNoLrw) != 0;
  const bool by_eeprom = of.sii.general && of.sii.general->no_lrw();
  const std::uint64_t missed = std::max(outputs.missed_by_lrw, inputs.missed_by_lrw);
  if (missed == 0) return;
  if (!by_register && !by_eeprom) {
    if (MayRejectSeparateLrw(of.context, of.refusal.slave)) {
      found.May(kLrwApart, {{"missed", arg::Count(missed, "LRW datagram")}});
    } else if (features) {
      found.Right(kLrw);
    }
    return;
  }
  if (outputs.exchanged + inputs.exchanged > 0) return;
  Arguments arguments{{"source", arg::Of(by_register ? kRegister : kEeprom)},
                      {"missed", arg::Count(missed, "LRW datagram")}};
  if (outputs.request != 0) arguments.Set("since", arg::Frame(outputs.request));
  found.Wrong(kLrwUnsupported, std::move(arguments));
}

void CheckOutputs(const Case& of, Outcome& found) {
  const auto& outputs = of.model.outputs.since;
  if (found.reason == &kLrwUnsupported.title || !of.ExchangeCounts() || outputs.request == 0) return;
  if (!of.state.process_manager(esc::SmDirection::ECAT_WRITES)) return;
  Facts<ExchangeFact> facts = FactsOf(of, outputs);
  facts.Set(ExchangeFact::kNotSent, outputs.exchanged + outputs.missed == 0 && WouldShow(of, outputs.request));
  switch (Decide(kExchanges, facts)) {
    case ExchangeVerdict::kRight:
      return found.Right(kOutputsArrive);
    case ExchangeVerdict::kNotCounted:
      return found.Wrong(kOutputsNotAccepted, MissedBy(outputs));
    case ExchangeVerdict::kNotSent:
      return found.Wrong(kOutputsNotSent, {{"since", arg::Frame(outputs.request)}});
    case ExchangeVerdict::kNothing:
      return;
  }
}

void CheckInputs(const Case& of, Outcome& found) {
  const auto& inputs = of.model.inputs.since;
  if (inputs.request == 0 || !of.ExchangeCounts()) return;
  const ExchangeVerdict verdict = Decide(kExchanges, FactsOf(of, inputs));
  if (verdict == ExchangeVerdict::kRight) found.Right(kInputsArrive);
  if (verdict == ExchangeVerdict::kNotCounted) found.Wrong(kInputsNotRead, MissedBy(inputs));
}

void CheckWatchdog(const Case& of, Outcome& found) {
  const auto time = of.state.registers.Value<std::uint16_t>(esc::kProcessWatchdog);
  const FrameNo changed = of.model.set_up.watchdog_changed();
  if (!time || !of.Applied(changed)) return;
  if (*time != 0) return found.Right(kWatchdogTimes);
  const auto outputs = of.manager(kOutputs);
  const FrameNo both = std::max(changed, of.manager_changed(kOutputs));
  if (!outputs || !outputs->enabled() || !outputs->watchdog_trigger() || !of.Counts(both)) return;
  found.Wrong(kWatchdogZero,
              {{"register", arg::Register(esc::kProcessWatchdog)}, {"sync_manager", NumberOf(kOutputs)}});
}

/// A watchdog that nothing triggers expires soon: a slave that held OP for longer does not read it. A pause of the
/// outputs is a nearer reason.
void CheckTrigger(const Case& of, Outcome& found) {
  if (of.refusal.code != esc::al_code::kWatchdog || !found.none() || !of.ExchangeCounts()) return;
  if (!of.requested() && of.refusal.shown > of.refusal.held_since + threshold::kShortlyFrames) return;
  const auto outputs = of.manager(kOutputs);
  if (!outputs || !outputs->enabled() || outputs->length == 0 || outputs->watchdog_trigger()) return;
  if (outputs->direction() != esc::SmDirection::ECAT_WRITES || !of.Applied(of.manager_changed(kOutputs))) return;
  const model::ProcessTraffic& traffic = of.model.outputs;
  if (traffic.since.exchanged == 0) return;
  const bool timed = traffic.last.has_time && of.refusal.time;
  if (timed && Elapsed(traffic.last.time, *of.refusal.time) > threshold::kNoPauseNs) return;
  found.May(kNoTrigger, {{"sync_manager", NumberOf(kOutputs)}, {"control", arg::Hex(outputs->control, 2)}});
}

}  // namespace ecaudit::refusal
