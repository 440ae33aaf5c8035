/// The report for code-scanning views and editors: SARIF 2.1.0 (OASIS), one run.
#pragma once

#include <string>
#include <string_view>

#include "cli/report/digest.h"

namespace ecaudit::report {

/// One UTF-8 document, ended by a newline. The whole catalogue stands in tool.driver.rules with its help; each finding
/// is a result at its capture (physical location; the line is that of its frame in the text of `decode`) and slave
/// (logical location), with frames and times as properties. Findings of the baseline are suppressed results. What could
/// not be evaluated, and captures that could not be read, are notifications of the invocation.
///
/// partialFingerprints["ecauditFinding/v1"] is the hash of rule, slave and title without counting numbers (as in
/// baselines), a colon, and which of its equals within the capture it is: the same in every run that finds the same.
///
/// @param folder  of the project: paths in it are relative to it
/// @param homepage  of the project, as ECAUDIT_HOMEPAGE names it when it is built: rules link to its docs/rules.md;
///                  empty: no links
[[nodiscard]] std::string WriteSarif(const Digest& digest, std::string_view folder = {},
                                     std::string_view homepage = ECAUDIT_HOMEPAGE);

/// Of the library at run time: "6.4.2".
[[nodiscard]] std::string QtVersion();

}  // namespace ecaudit::report
