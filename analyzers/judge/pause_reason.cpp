#include "analyzers/judge/pause_reason.h"

#include <cstdint>
#include <utility>

#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_model.h"
#include "decoder/base/time.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/network.h"

namespace ecaudit {
namespace {

/// What sync-watchdog-margin needs.
bool IsMeasured(const RuleContext& context, SlaveId slave) {
  const esc::RegisterImage& registers = context.network().state(slave).registers;
  return context.network().fmmus(slave).any && registers.Value<std::uint16_t>(esc::kWatchdogDivider) &&
         registers.Value<std::uint16_t>(esc::kProcessWatchdog);
}

/// Shortly before the slave stopped to take outputs, or before it shows the code.
bool IsNear(const RuleContext& context, SlaveId slave, const sync::ProcessDataPauses::Pause& pause,
            const FrameRef& now) {
  constexpr TimeNs kTakes = 20'000'000;   // a slave notices and answers within this time
  constexpr TimeNs kShows = 100'000'000;  // a master that looks at AL Status does within this time
  const FrameRef& last = context.slave(slave).outputs.last;
  const bool stopped = last.has_time && Elapsed(pause.to.time, last.time) <= kTakes;
  return stopped || Elapsed(pause.to.time, now.time) <= kShows;
}

}  // namespace

std::optional<sync::ProcessDataPauses::Pause> PauseReason(const RuleContext& context, SlaveId slave, FrameNo before,
                                                          const FrameRef& now) {
  if (IsMeasured(context, slave) || !context.sync().Uncertainty(sync::TimeBase::kCapture)) return std::nullopt;
  const auto pause = context.sync().pauses().LongestBetween(before, now);
  if (pause && context.network().MayMissBetween(pause->from.number, pause->to.number)) return std::nullopt;
  if (pause && context.network().fmmus(slave).any) {
    constexpr std::uint64_t kRhythm = 50;  // frames before that a pause stands out from
    const sync::OutputWatch& outputs = context.sync().outputs(slave);
    if (outputs.frames_in_op < kRhythm || pause->length() >= outputs.watchdog_ns) return std::nullopt;
    if (!IsNear(context, slave, *pause, now)) return std::nullopt;
  }
  return pause;
}

Note NoteOf(const RuleContext& context, SlaveId slave, const sync::ProcessDataPauses::Pause& pause) {
  Arguments arguments{{"paused_from", arg::Frame(pause.from.number)},
                      {"paused_to", arg::Frame(pause.to.number)},
                      {"pause_ms", arg::Ms(pause.length())}};
  if (context.network().fmmus(slave).any) {
    arguments.Set("mapped", arg::Flag());
    arguments.Set("watchdog_ms", arg::Ms(context.sync().outputs(slave).watchdog_ns));
  }
  return {&kAllPaused, std::move(arguments)};
}

}  // namespace ecaudit
