/// What commands that analyse whole captures share: the captures of the command line, settings and baseline of each,
/// and the analysis itself with progress and Ctrl-C. `check`, `startup` and `diff` add what they do with the results.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/capture_check.h"
#include "cli/capture_options.h"
#include "cli/console.h"
#include "cli/exit_status.h"
#include "cli/report/report.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

/// One analysis: one capture, or all of them joined.
struct CaptureJob {
  std::vector<std::string> paths;
  Settings settings;

  [[nodiscard]] const std::string& name() const { return paths.front(); }
};

/// Reads and analyses captures one after the other.
class CaptureRun {
 public:
  CaptureOptions options;
  CommandFiles files;           ///< a command adds what it reads and writes itself
  GateOptions gate;             ///< commands whose exit status does not depend on findings leave it alone
  WantedExtras wanted;          ///< by the reports
  bool needs_ethercat = false;  ///< a capture without EtherCAT is an error, not only a warning

  /// Resolves settings and reads baselines, so that everything that can be wrong with the command line is found before
  /// the first capture is read. Stop signals of the user are handled from here on.
  [[nodiscard]] std::optional<Error> Prepare();
  [[nodiscard]] std::vector<CaptureJob>& jobs() { return jobs_; }
  [[nodiscard]] const std::vector<CaptureJob>& jobs() const { return jobs_; }

  /// Analyses one job and adds its report: only the slaves of --slave, known findings marked.
  /// What is worth a word goes to `console`, that a capture cannot be opened or was not read to its end as well.
  [[nodiscard]] ExitStatus Run(const CaptureJob& job, report::Report& report, Console& console);
  /// After all jobs: reports which captures lack the slaves of --slave; kUsage when all of them do. An interrupted run
  /// does not know.
  [[nodiscard]] ExitStatus ReportMissingSlaves(const report::Report& report, Console& console) const;

  /// Reports which entries of the baselines match no finding.
  void ReportUnmatched(const report::Report& report, Console& console) const;
  /// Reports what is missing of what --require asks for.
  static void ReportUnmet(const report::Report& report, Console& console);

  /// Marks what the job's baseline lists, again. For commands that change the findings of a report.
  void MarkKnown(report::CaptureReport& capture) const;
  /// Writes --write-baseline, where it is given and all was read: half a baseline in the place of a whole one would
  /// make known findings new.
  [[nodiscard]] std::optional<Error> WriteBaselineOf(const report::Report& report) const;

  /// Reports `error` on the console.
  static ExitStatus Fail(Console& console, const Error& error);

 private:
  ExitStatus Interrupted(Console& console, const std::string& message);
  [[nodiscard]] std::string WithoutSlave(const std::pair<std::string, std::string>& capture) const;

  std::vector<CaptureJob> jobs_;
  BaselineShelf baselines_;
  bool interrupted_ = false;
  /// Captures that lack the slaves of --slave, and those that they have.
  std::vector<std::pair<std::string, std::string>> without_slave_;
};

}  // namespace ecaudit::cli
