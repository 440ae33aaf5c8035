/// Reports as Markdown: the summary of a CI job, or the text of a ticket.
#pragma once

#include <string>

#include "cli/report/digest.h"

namespace ecaudit::report {

/// A table of the captures where there are several, and for each with findings a section with a table of them, causes
/// first. What comes from captures is escaped.
[[nodiscard]] std::string WriteMarkdown(const Digest& digest);

}  // namespace ecaudit::report
