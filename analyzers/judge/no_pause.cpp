#include "analyzers/judge/no_pause.h"

#include <cstdint>
#include <utility>

#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_model.h"
#include "decoder/base/time.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/network.h"

namespace ecaudit {
namespace {

constexpr std::size_t kOutputs = 2;         // the sync manager
constexpr std::uint64_t kEnoughFrames = 5;  // fewer show no rhythm

constexpr Word kWatchdogNotRead{
    "watchdog-not-read",
    "No pause of the outputs explains this: read the watchdog of the slave (0x0400, 0x0420), which may be shorter than "
    "its value after power-on"};
constexpr Word kNoTrigger{
    "no-trigger",
    "No pause of the outputs explains this: set bit 6 in the control byte of SM2, so that the outputs restart the "
    "watchdog"};
constexpr Word kOfFirmware{
    "time-out-of-firmware",
    "No pause of the outputs explains this: find in the manual which other time-out the firmware reports with this "
    "code, and whether it reads the outputs in time"};

}  // namespace

std::optional<NoPause> FindNoPause(const RuleContext& context, SlaveId slave, FrameNo held_since,
                                   const FrameRef& shown) {
  const sync::OutputWatch& outputs = context.sync().outputs(slave);
  const FrameRef& last = context.slave(slave).outputs.last;
  if (!outputs.seen || outputs.frames_in_op < kEnoughFrames || outputs.watchdog_ns <= 0) return std::nullopt;
  if (!last.has_time || !shown.has_time || last.number < held_since) return std::nullopt;
  if (!context.sync().Uncertainty(sync::TimeBase::kCapture)) return std::nullopt;
  if (context.network().MayMissBetween(held_since, shown.number)) return std::nullopt;
  if (Elapsed(last.time, shown.time) >= outputs.watchdog_ns / 2) return std::nullopt;
  const track::SlaveState& state = context.network().state(slave);
  const auto divider = state.registers.Value<std::uint16_t>(esc::kWatchdogDivider);
  const auto intervals = state.registers.Value<std::uint16_t>(esc::kProcessWatchdog);
  Arguments arguments{{"last_outputs_frame", arg::Frame(last.number)},
                      {"outputs_in_op", arg::Count(outputs.frames_in_op, "frame")},
                      {"watchdog_ms", arg::Ms(outputs.watchdog_ns)}};
  const bool known = divider && intervals;
  if (known) {
    arguments.Set("divider", arg::Number(*divider));
    arguments.Set("intervals", arg::Number(*intervals));
  } else {
    arguments.Set("assumed", arg::Flag());
  }
  const auto manager = state.sync_manager(kOutputs, Certainty::kInferred);
  const bool of_outputs = manager && manager->enabled() && manager->ecat_writes();
  if (of_outputs) {
    arguments.Set("sync_manager", arg::Number(kOutputs));
    arguments.Set("control", arg::Hex(manager->control, 2));
    arguments.Set("trigger", arg::Flag(manager->watchdog_trigger()));
  }
  const Word* advice = known ? &kOfFirmware : &kWatchdogNotRead;
  if (of_outputs && !manager->watchdog_trigger()) advice = &kNoTrigger;
  return NoPause{{&kNoPause, std::move(arguments)}, advice};
}

}  // namespace ecaudit
