/// Reads reports that were written earlier back into digests.
#pragma once

#include <string>
#include <vector>

#include "cli/report/digest.h"
#include "cli/report/report.h"
#include "decoder/base/json.h"
#include "decoder/base/result.h"

namespace ecaudit::report {

/// What one document of schema "ecaudit.report/1" shows.
struct ReportDigest {
  std::string version;  ///< of the program that wrote it
  Origin origin;        ///< empty unless `ecaudit batch` wrote it
  std::vector<CaptureDigest> captures;
};

/// @return fails, in one line, for a document of another schema or version, and for one that lacks what the schema
///         demands
[[nodiscard]] Result<ReportDigest> ReadReportDigest(JsonValue document);

}  // namespace ecaudit::report
