/// Words and small decisions that the synchronisation rules share.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/time_base.h"
#include "analyzers/words/what.h"

namespace ecaudit {

/// "by the DC time in the frames", "by the probe's stamps", "by the capture's stamps".
[[nodiscard]] std::string_view BaseText(sync::TimeBase base);
/// ", +-40 ns by the DC time in the frames".
[[nodiscard]] std::string PrecisionText(const sync::Interval& interval, TimeNs uncertainty);

/// The drive's own cycle (FBUS.SAMPLEPERIOD, PTBASE), ns, where it is known.
[[nodiscard]] std::optional<TimeNs> DriveCycle(const model::SlaveModel& slave);

/// Sets the cause of what `rule` found for `slave` in `frame`, unless it has one.
void NameCause(RuleContext& context, std::string_view rule, SlaveId slave, FrameNo frame, FindingIndex cause);

}  // namespace ecaudit
