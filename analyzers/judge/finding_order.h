/// The order in which findings are told.
#pragma once

#include <vector>

#include "analyzers/result/finding.h"

namespace ecaudit {

/// By first frame; a cause stands before what it causes, even where it was seen later. Indices in caused_by follow.
void SortFindings(std::vector<Finding>& findings);

}  // namespace ecaudit
