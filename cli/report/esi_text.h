/// What the ESI of each slave requires of its start-up, for a person and for programs.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "analyzers/options/slave_names.h"
#include "analyzers/result/analysis_result.h"
#include "cli/report/json_text.h"
#include "cli/report/layout.h"

namespace ecaudit::report {

/// "download of 6060h:0 Modes of operation (PS) = 8 (0x08); the capture shows 7 (0x07) (#12)".
[[nodiscard]] std::string DemandText(const EsiDemand& demand);
/// The lists of these slaves, one for all to whom the same was done; nothing where the ESI requires nothing, or none is
/// given.
void WriteEsiDemands(std::span<const SlaveSummary> slaves, const SlaveNames& names, TextBuilder& text);
/// What is not met, a line for each requirement and all slaves of which it is not: "slaves 0-7: the ESI requires ...".
[[nodiscard]] std::vector<std::string> UnmetEsiDemands(std::span<const SlaveSummary> slaves, const SlaveNames& names);
/// "esi_demands", likewise.
void PutEsiDemands(JsonObject& out, const SlaveSummary& slave);

}  // namespace ecaudit::report
