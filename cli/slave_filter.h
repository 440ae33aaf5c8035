/// `--slave`: the part of a result that concerns chosen slaves.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "analyzers/options/options.h"
#include "analyzers/options/slave_names.h"
#include "analyzers/result/analysis_result.h"

namespace ecaudit::cli {

[[nodiscard]] bool Selects(const SlaveSelector& selector, const SlaveSummary& slave);

/// "0 (AKD, 0x1001), 1 (EL2004)": for a user who named another.
[[nodiscard]] std::string SlavesThere(const AnalysisResult& result);

/// "0", "0x1001", "AKD": as the user names it.
[[nodiscard]] std::string NameOf(const SlaveSelector& selector, const SlaveNames& names);

/// Those of `selectors` that name no slave of the capture.
[[nodiscard]] std::vector<std::string> MissingSlaves(std::span<const SlaveSelector> selectors,
                                                     const AnalysisResult& result);

/// Keeps the slaves that one of `selectors` names, and of findings and rules that could not be evaluated those of these
/// slaves and of the whole bus, and the causes of kept findings. No selectors: keeps all.
/// @return how many slaves are kept
std::size_t KeepSlaves(std::span<const SlaveSelector> selectors, AnalysisResult& result);

/// Slaves that a profile or a parameter was given for and that the capture does not show, as the user names them.
[[nodiscard]] std::vector<std::string> UnmetSlaves(const AnalysisOptions& options, const AnalysisResult& result);

}  // namespace ecaudit::cli
