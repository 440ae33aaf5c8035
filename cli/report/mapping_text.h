/// A PDO mapping that went wrong as lines of text: wanted, accepted and resulting layout side by side.
#pragma once

#include <string>
#include <vector>

#include "analyzers/result/mapping_table.h"

namespace ecaudit::report {

/// The first line has lengths, the second names the columns.
[[nodiscard]] std::vector<std::string> MappingLines(const MappingTable& table);

}  // namespace ecaudit::report
