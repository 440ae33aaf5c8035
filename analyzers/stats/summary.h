/// Puts what the stages counted into the plain data of a report.
#pragma once

#include "analyzers/core/analysis_result.h"
#include "analyzers/model/bus_model.h"
#include "analyzers/stats/al_history.h"
#include "analyzers/stats/mailbox_summary.h"
#include "decoder/pipeline.h"

namespace ecaudit {

/// Everything of an AnalysisResult but findings.
[[nodiscard]] AnalysisResult Summarise(const capture::FrameSource& source, const Pipeline& pipeline,
                                       const model::BusModel& model, const AlHistory& history,
                                       const MailboxStatistics& mailboxes);

}  // namespace ecaudit
