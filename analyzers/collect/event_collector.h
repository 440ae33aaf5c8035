/// Puts what is known of events into the plain data of a report.
#pragma once

#include <span>
#include <vector>

#include "analyzers/model/bus_model.h"
#include "analyzers/result/event_summary.h"

namespace ecaudit {

/// The bits that were ever set, by number.
/// @param stories of the bits from 0 on
[[nodiscard]] std::vector<EventBitSummary> SummariseEventField(std::span<const model::EventUnit::Story> stories);
[[nodiscard]] EventSummary SummariseEvents(const model::BusModel& model, SlaveId slave);

}  // namespace ecaudit
