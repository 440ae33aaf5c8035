/// The order in which findings are reported.
#pragma once

#include <vector>

#include "analyzers/result/finding.h"

namespace ecaudit {

/// Into the order in which they are read (reading_order.h): the worst first with what follows from it, a cause before
/// what it causes, even where it was seen later. Indices in caused_by follow.
/// @return for each finding, by its former place, the new one
std::vector<FindingIndex> SortFindings(std::vector<Finding>& findings);

/// Numbers the sorted findings of the whole capture. The ids of all reports are these, so that the first finding a
/// person sees is f1 for `slice`, too.
void NumberFindings(std::vector<Finding>& findings);

}  // namespace ecaudit
