/// `--require slaves=N,state=OP,axis=enabled,sync=ok,judged`: what must be true of a capture besides having no
/// findings.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "analyzers/result/analysis_result.h"
#include "cli/report/coverage_tally.h"
#include "decoder/base/result.h"
#include "decoder/esc/al.h"

namespace ecaudit::cli {

struct Requirements {
  std::string text;  ///< as typed; empty: nothing is required
  std::optional<std::uint16_t> slaves;
  std::optional<esc::AlState> state;
  std::optional<esc::AlState> reached;  ///< at any time, by each slave
  std::string axis;   ///< rung that each axis has to reach: "enabled", "commanded" or "follows"; empty: none
  bool sync = false;  ///< each slave with SYNC0 has to be in sync
  bool judged = false;
  std::uint64_t judged_percent = report::kLeastJudgedPercent;  ///< of what applies, at least

  [[nodiscard]] bool any() const { return !text.empty(); }
};

/// Reads "slaves=N,state=OP,axis=enabled,sync=ok,judged": each part at most once, at least one.
[[nodiscard]] Result<Requirements> ParseRequirements(std::string_view text);

/// What of `required` is missing, each a sentence without a full stop; empty when it is all there.
/// @param result  of the whole bus, or what --slave left of it
/// @param slaves  that the capture shows, also those that --slave left out
/// @param part    --slave selects slaves: all parts but `slaves=` are about these
[[nodiscard]] std::vector<std::string> MissingOf(const Requirements& required, const AnalysisResult& result,
                                                 std::size_t slaves, bool part);

}  // namespace ecaudit::cli
