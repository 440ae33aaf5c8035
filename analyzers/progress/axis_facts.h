/// What each fact about an axis is called, which rung it holds and which rule reports it.
#pragma once

#include "analyzers/progress/axis_records.h"
#include "analyzers/result/argument.h"

namespace ecaudit::progress {

struct AxisFactRow {
  AxisFact fact = AxisFact::kNoReaction;
  std::string_view rung;  ///< of axis_ladder.cpp
  std::string_view rule;
  Word word;
};

[[nodiscard]] const AxisFactRow& FactRow(AxisFact fact);

}  // namespace ecaudit::progress
