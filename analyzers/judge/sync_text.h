/// Words and small decisions that the synchronisation rules share.
#pragma once

#include <optional>
#include <string_view>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_events.h"
#include "analyzers/sync/time_base.h"
#include "analyzers/words/al_text.h"
#include "analyzers/words/what.h"

namespace ecaudit {

namespace what {
inline constexpr Word kPause{"process-data-pause", "the pause of the process data"};
inline constexpr Word kActivation{"sync-activation", "the activation of SYNC0 (0x0981)"};
}  // namespace what

/// "the DC time in the frames", "the stamps of the probe", "the stamps of the capture"; its code is that of
/// sync::Name().
[[nodiscard]] const Word& WordOf(sync::TimeBase base);
/// "the capture ends": how a pause ends after which no outputs come; null if outputs come again.
[[nodiscard]] const Word* WordOf(sync::OutputGap::End end);

/// The cycle of the drive itself (FBUS.SAMPLEPERIOD, PTBASE), ns, if it is known.
[[nodiscard]] std::optional<TimeNs> DriveCycle(const model::SlaveModel& slave);

/// Sets the cause of what `rule` found for `slave` in `frame`, unless it has one.
void NameCause(RuleContext& context, std::string_view rule, SlaveId slave, FrameNo frame, FindingIndex cause);

}  // namespace ecaudit
