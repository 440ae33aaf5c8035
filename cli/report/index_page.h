/// The page over many captures: a table to sort and to filter, the captures grouped by their first cause. Each row
/// leads to the page of its capture, where there is one. One file, without network, as the pages are.
#pragma once

#include <string>

#include "cli/report/digest.h"
#include "cli/report/layout.h"

namespace ecaudit::report {

/// Readable without JavaScript; scripts only sort and filter.
/// @param style  times as people want them; colours and width mean nothing here
[[nodiscard]] std::string WriteIndexPage(const Digest& digest, const TextStyle& style);

}  // namespace ecaudit::report
