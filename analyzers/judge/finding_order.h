/// The order in which findings are reported.
#pragma once

#include <vector>

#include "analyzers/result/finding.h"

namespace ecaudit {

/// Into the order in which they are read (reading_order.h): the worst first with what follows from it, a cause before
/// what it causes, even where it was seen later. The ids of all reports count in this order, so that the first finding
/// a person sees is f1 for `slice`, too. Indices in caused_by follow.
void SortFindings(std::vector<Finding>& findings);

}  // namespace ecaudit
