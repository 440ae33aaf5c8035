#include "cli/summary_run.h"

#include <algorithm>
#include <tuple>

#include "cli/baseline.h"
#include "cli/output_file.h"

namespace ecaudit::cli {

void SortCaptures(report::Digest& digest) {
  std::ranges::sort(digest.captures, [](const report::CaptureDigest& a, const report::CaptureDigest& b) {
    return std::tie(a.path, a.report) < std::tie(b.path, b.report);
  });
}

ExitStatus Deliver(const report::Digest& digest, const ReportOutput& output,
                   const std::optional<std::string>& write_baseline, Console& console) {
  ExitStatus status = report::Gates(report::Summarise(digest)) ? ExitStatus::kFindings : ExitStatus::kClean;
  const auto fail = [&](const std::string& message) {
    console.Error(message);
    status = ExitStatus::kUsage;
  };
  for (const report::CaptureDigest& capture : digest.captures) {
    if (!capture.unreadable.empty()) fail(capture.unreadable);
    for (const std::string& missing : capture.unmet) {
      console.Error(capture.path + ": required and missing: " + missing);
    }
  }
  if (digest.not_reached > 0) status = ExitStatus::kUsage;
  if (const auto error = output.Write(digest, console)) fail(error->message);
  if (write_baseline && digest.not_reached > 0) {
    fail("the baseline " + *write_baseline + " was not written: not all captures were checked");
  } else if (write_baseline) {
    const std::string text = WriteBaseline(digest, BaselineBefore(*write_baseline));
    if (const auto error = WriteOutputFile(*write_baseline, text)) fail(error->message);
  }
  return status;
}

}  // namespace ecaudit::cli
