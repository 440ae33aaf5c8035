/// The folder in which `batch` keeps one report for each capture.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "cli/report/digest.h"
#include "cli/report/report.h"
#include "decoder/base/result.h"
#include "decoder/base/system/locks.h"

namespace ecaudit::cli {

/// "trace.pcapng-3fa2b1c04d5e.json" for "axis1/trace.pcapng": the name of the capture and a hash of its path as it is
/// spelled. It depends on nothing else, so two captures of one name do not meet, and a capture has the same report
/// whichever captures are checked with it, and on whichever machine.
[[nodiscard]] std::string ReportName(const std::string& capture);

/// Makes `folder` unless it exists.
[[nodiscard]] std::optional<Error> MakeReportFolder(const std::string& folder);

/// Takes away what a killed run has left: unfinished files of these reports.
void RemoveUnfinished(const std::string& folder, std::span<const std::string> report_names);

/// Held by each batch that writes to a folder. Several may do so at once, on several machines; a batch that is alone
/// there may take away what looks unfinished.
class FolderLock {
 public:
  /// Tries to be alone in `folder`, for a tenth of a second.
  explicit FolderLock(const std::string& folder);
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

  [[nodiscard]] bool alone() const { return alone_; }
  /// From now on others may work there, too.
  void Share();

 private:
  system::FolderHold hold_;
  bool alone_ = false;
};

/// The result of the capture in the report at `path`, also if the capture could not be read.
[[nodiscard]] Result<report::CaptureDigest> ReadOwnReport(const std::string& path);

/// The content of the report at `path`, if it is complete, is about `capture` alone, could read it, and was made by
/// this version of the program with the settings and from the file of `origin`. Nothing else counts as done.
[[nodiscard]] std::optional<report::CaptureDigest> ReadDoneReport(const std::string& path, const std::string& capture,
                                                                  const report::Origin& origin);

}  // namespace ecaudit::cli
