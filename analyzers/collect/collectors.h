/// The collectors there are.
#pragma once

#include <memory>
#include <vector>

#include "analyzers/collect/collector.h"
#include "analyzers/collect/explanations.h"
#include "analyzers/observation.h"

namespace ecaudit {

struct Timeline;

/// @param drawn  what a report draws over time is collected here; null: nothing is drawn
/// All arguments must outlive the collectors.
[[nodiscard]] std::vector<std::unique_ptr<Collector>> MakeCollectors(Observation& observation,
                                                                     const Explanations& explanations, Timeline* drawn);

}  // namespace ecaudit
