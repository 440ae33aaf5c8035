#include "cli/report/count_writer.h"

#include "decoder/base/text.h"

namespace ecaudit::report {

std::string WriteCount(const Report& report, const TextStyle& /*style*/) {
  std::size_t findings = 0;
  for (const CaptureReport& capture : report.captures) findings += capture.result.findings.size();
  return Count(findings, "finding") + " in " + Count(report.captures.size(), "capture") + "\n";
}

}  // namespace ecaudit::report
