/// Puts what is known of events into the plain data of a report.
#pragma once

#include <vector>

#include "analyzers/core/event_summary.h"
#include "analyzers/model/bus_model.h"

namespace ecaudit {

/// The bits that were ever set, by number.
[[nodiscard]] std::vector<EventBitSummary> SummariseEventField(const model::EventUnit::Stories& stories);
[[nodiscard]] EventSummary SummariseEvents(const model::BusModel& model, SlaveId slave);

}  // namespace ecaudit
