/// What the ESI of each slave requires of its start-up, for a person and for programs.
#pragma once

#include <string>

#include "analyzers/options/slave_names.h"
#include "analyzers/result/analysis_result.h"
#include "cli/report/json_text.h"
#include "cli/report/layout.h"

namespace ecaudit::report {

/// "download of 6060h:0 Modes of operation (PS) = 8 (0x08); the capture shows 7 (0x07) (#12)".
[[nodiscard]] std::string DemandText(const EsiDemand& demand);
/// The list of a slave; nothing where its ESI requires nothing, or none is given.
void WriteEsiDemands(const SlaveSummary& slave, const SlaveNames& names, TextBuilder& text);
/// "esi_demands", likewise.
void PutEsiDemands(JsonObject& out, const SlaveSummary& slave);

}  // namespace ecaudit::report
