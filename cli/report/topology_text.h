/// The bus as a tree, in words: who is plugged into whom, and which links gave trouble.
#pragma once

#include <string>
#include <vector>

#include "analyzers/options/slave_names.h"
#include "analyzers/result/analysis_result.h"
#include "cli/report/layout.h"

namespace ecaudit::report {

/// "master - 0 - 1 - 2", then a line for each branch: "1 port 3 - 5 - 6". What is not known is open: "? - 7".
[[nodiscard]] std::vector<std::string> TopologyChains(const TopologySummary& topology, const SlaveNames& names);

/// "between slave 1 port 1 and slave 2 port 0"; "at slave 2 port 1" where no slave is known after it.
[[nodiscard]] std::string LinkText(const TopologySummary& topology, const SlaveNames& names, std::size_t node,
                                   std::uint8_t port);

/// Links that came and went, counters that rose, delays that stand out; whether the counters were read at all.
[[nodiscard]] std::vector<std::string> TopologyNotes(const AnalysisResult& result, const TextStyle& style);

}  // namespace ecaudit::report
