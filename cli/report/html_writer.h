/// The report as one HTML page: no network, readable by people who were not there.
///
/// The page is made from cli/report/html/ when the program is built (npm), and holds everything but the data. The data
/// are the JSON report, and what is drawn over time, in an element that no browser runs; scripts put texts of the
/// capture into the page as text only.
#pragma once

#include <string>
#include <string_view>

#include "cli/report/report.h"

namespace ecaudit::report {

/// Only when MissingHtml() is empty.
[[nodiscard]] std::string WriteHtml(const Report& report);

/// Why this program has no HTML reports; empty when it has.
[[nodiscard]] std::string_view MissingHtml();

/// The page without data, as it was built in; empty when there is none. It holds kTitleMark and kDataMark once each.
[[nodiscard]] std::string_view HtmlPage();

inline constexpr std::string_view kTitleMark = "ecaudit-title-goes-here";
inline constexpr std::string_view kSummaryMark = "ecaudit-summary-goes-here";
inline constexpr std::string_view kDataMark = "ecaudit-data-go-here";

}  // namespace ecaudit::report
