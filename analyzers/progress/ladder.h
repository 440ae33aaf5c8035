/// in: what the capture shows of each slave, the watches of its axes, the findings.  out: their ladders.
///
/// A rung is a row of the tables in slave_ladder.cpp and axis_ladder.cpp.
#pragma once

#include <initializer_list>
#include <string_view>

#include "analyzers/progress/axis_watch.h"
#include "analyzers/progress/progress_model.h"
#include "analyzers/result/analysis_result.h"
#include "analyzers/result/progress.h"

namespace ecaudit::progress {

/// Fills in the ladders of all slaves. The findings have their final order.
void Climb(const ProgressModel& model, AnalysisResult& result);

[[nodiscard]] Ladder LadderOf(const SlaveSummary& slave, const AnalysisResult& result);
[[nodiscard]] Ladder LadderOf(const AxisWatch& axis, std::uint8_t number, const SlaveSummary& slave,
                              const AnalysisResult& result);

[[nodiscard]] Ladder LadderOf(const MotorWatch& motor, const SlaveSummary& slave, const AnalysisResult& result);

/// Which findings may hold a rung.
struct Holding {
  int axis = -1;      ///< rules about drives: only of this axis; < 0: of any
  FrameRef lost;      ///< where the rung was lost: what was over long before did not do it; not seen(): any
  FrameNo first = 0;  ///< the finding that begins there, where one does; 0: any
};

/// The first warning or error of one of these rules that is about the slave or, where the slave is one of those it
/// names, about several; its cause, where it has one. kNoFinding: there is none.
[[nodiscard]] FindingIndex HolderOf(const AnalysisResult& result, const SlaveSummary& slave,
                                    std::initializer_list<std::string_view> rules, const Holding& holding = {});

/// The first cause of a finding: itself where it has none.
[[nodiscard]] FindingIndex RootOf(const AnalysisResult& result, FindingIndex finding);

/// Of a slave that does not answer any more: what was reached is lost.
void LoseAbove(const Rung& answers, Ladder& ladder);

}  // namespace ecaudit::progress
