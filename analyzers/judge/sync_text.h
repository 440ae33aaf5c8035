/// Words and small decisions that the synchronisation rules share.
#pragma once

#include <optional>
#include <string_view>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_events.h"
#include "analyzers/sync/sync_type.h"
#include "analyzers/sync/time_base.h"
#include "analyzers/words/al_text.h"
#include "analyzers/words/what.h"

namespace ecaudit {

namespace what {
inline constexpr Word kPause{"process-data-pause", "the pause of the process data"};
inline constexpr Word kSync0{"sync0", "SYNC0"};
inline constexpr Word kSync1{"sync1", "SYNC1"};
inline constexpr Word kActivation{"sync-activation", "the activation of SYNC0 (0x0981)"};
}  // namespace what

/// "the DC time in the frames", "the stamps of the probe", "the stamps of the capture"; its code is that of
/// sync::Name().
[[nodiscard]] const Word& WordOf(sync::TimeBase base);
/// "the capture ends": how a pause ends after which no outputs come; null if outputs come again.
[[nodiscard]] const Word* WordOf(sync::OutputGap::End end);

/// The pulse that outputs or inputs of this type wait for; SYNC0 for types that need none.
[[nodiscard]] inline const Word& PulseOf(sync::SyncType type) {
  return type == sync::SyncType::kSync1 ? what::kSync1 : what::kSync0;
}

/// The cycle of the drive itself (FBUS.SAMPLEPERIOD, PTBASE), ns, if it is known.
[[nodiscard]] std::optional<TimeNs> DriveCycle(const model::SlaveModel& slave);

/// The process data have to come once in each cycle.
[[nodiscard]] bool NeedsOneFrameACycle(const model::SlaveModel& slave);
/// A measured cycle that differs by more than this part of the configured one is another cycle. Deviations up to it
/// are a matter of sync-rate-deviation and of the master's jitter.
inline constexpr double kCycleTolerance = 0.1;
/// The part by which a measured cycle differs from the configured one (> 0). Unless the family needs one frame in each
/// cycle, a multiple of it or a part of it is right, too.
[[nodiscard]] double CycleDeviation(const model::SlaveModel& slave, double measured_ns, TimeNs configured_ns);

/// The interpolated or cyclic synchronous mode that the outputs of the first axis select, if the capture shows that
/// SYNC0 is off: some drives need it for their inputs, or for OP.
[[nodiscard]] std::optional<std::int8_t> ModeWithoutSync0(const RuleContext& context, SlaveId slave);

/// Sets the cause of what `rule` found for `slave` in `frame`, unless it has one.
void NameCause(RuleContext& context, std::string_view rule, SlaveId slave, FrameNo frame, FindingIndex cause);

}  // namespace ecaudit
