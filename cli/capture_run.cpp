#include "cli/capture_run.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "cli/crash.h"
#include "cli/interrupt.h"
#include "cli/output_file.h"
#include "cli/progress.h"
#include "decoder/base/system/files.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {

ExitStatus CaptureRun::Fail(Console& console, const Error& error) {
  console.Error(error.message);
  return ExitStatus::kUsage;
}

ExitStatus CaptureRun::Interrupted(Console& console, const std::string& message) {
  interrupted_ = true;
  console.Error(message);
  return ExitStatus::kInterrupted;
}

std::optional<Error> CaptureRun::Prepare() {
  if (std::ranges::count(options.captures, "-") > 1) {
    return Error{"standard input (-) can be read only once"};
  }
  for (const std::string& capture : options.captures) {
    if (!system::IsFolder(capture)) continue;
    return Error{capture + " is a folder, not a capture; to check all captures in it: ecaudit batch " + capture};
  }
  if (auto error = CheckBaselineIsWhole(options, gate)) return error;
  if (auto error = AddFiles(options, files)) return error;
  if (options.join) {
    jobs_.push_back({options.captures, {}});
  } else {
    for (const std::string& capture : options.captures) jobs_.push_back({{capture}, {}});
  }
  for (CaptureJob& job : jobs_) {
    Result<Settings> settings = ResolveSettings(options, gate, job.name());
    if (!settings) return settings.error();
    job.settings = std::move(*settings);
    AddFiles(job.settings, files);
    if (auto error = baselines_.Load(job.settings.baseline)) return error;
  }
  if (auto error = PlanBaseline(gate.write_baseline, files)) return error;
  ListenForInterrupt();
  return std::nullopt;
}

ExitStatus CaptureRun::Run(const CaptureJob& job, report::Report& report, Console& console) {
  options.ReportSkipped(console);
  baselines_.WarnOfExpired(console);
  Progress progress(console, std::filesystem::path(job.name()).filename().string());
  Result<CheckedCapture> capture = CheckCapture(
      job.paths, job.settings, baselines_.Find(job.settings.baseline), InterruptFlag(),
      [&progress](std::uint64_t done, std::uint64_t total, std::uint64_t frames) {
        progress.Update(done, total, frames);
      },
      wanted, &ReachedFrame());
  progress.Clear();
  if (!capture && InterruptFlag()) return Interrupted(console, job.name() + ": interrupted before its first packet");
  if (!capture) {
    report.unreadable.push_back({job.name(), capture.error().message});
    return Fail(console, capture.error());
  }

  const CaptureSummary read = capture->report.result.capture;
  const bool interrupted = InterruptFlag() && !read.complete;
  if (!interrupted && report::WithoutEtherCat(capture->report.result)) {
    const std::string nothing = job.name() + ": no EtherCAT frame among " + Count(read.packets, "packet");
    if (needs_ethercat) {
      report.unreadable.push_back({job.name(), nothing});
      return Fail(console, Error{nothing});
    }
    console.Warning(nothing);
  }
  for (const std::string& slave : capture->unmet) {
    console.Warning(job.name() + " has no slave " + slave +
                    ": the profile and the parameters given for it are not used");
  }
  for (const std::string& notice : capture->notices) console.Warning(notice);
  for (const std::string& slave : capture->missing) console.Warning(job.name() + " has no slave " + slave);
  if (capture->lacks_slave) without_slave_.emplace_back(job.name(), capture->slaves_there);
  report.captures.push_back(std::move(capture->report));
  if (interrupted) {
    return Interrupted(console, job.name() + ": interrupted after " + Count(read.packets, "packet"));
  }
  return ExitStatus::kClean;
}

void CaptureRun::ReportUnmet(const report::Report& report, Console& console) {
  for (const report::CaptureReport& capture : report.captures) {
    for (const std::string& missing : capture.unmet) {
      console.Error(capture.result.capture.file.path + ": required and missing: " + missing);
    }
  }
}

void CaptureRun::ReportUnmatched(const report::Report& report, Console& console) const {
  const bool any = std::ranges::any_of(report.captures,
                                       [](const report::CaptureReport& capture) { return !capture.baseline.empty(); });
  if (any && !interrupted_) baselines_.WarnOfUnmatched(DigestOf(report).captures, console);
}

void CaptureRun::MarkKnown(report::CaptureReport& capture) const {
  if (const Baseline* baseline = baselines_.Find(capture.baseline)) ApplyBaseline(*baseline, capture);
}

std::string CaptureRun::WithoutSlave(const std::pair<std::string, std::string>& capture) const {
  std::string slaves;
  for (const std::string& slave : options.slaves) slaves += (slaves.empty() ? "" : " or ") + slave;
  return capture.first + " has no slave " + slaves +
         (capture.second.empty() ? "; it shows no slave" : "; " + capture.second);
}

ExitStatus CaptureRun::ReportMissingSlaves(const report::Report& report, Console& console) const {
  if (interrupted_) return ExitStatus::kClean;
  if (without_slave_.size() == report.captures.size()) {
    return without_slave_.empty() ? ExitStatus::kClean : Fail(console, Error{WithoutSlave(without_slave_.front())});
  }
  for (const auto& capture : without_slave_) console.Warning(WithoutSlave(capture));
  return ExitStatus::kClean;
}

std::optional<Error> CaptureRun::WriteBaselineOf(const report::Report& report) const {
  if (!gate.write_baseline) return std::nullopt;
  if (interrupted_) return Error{"interrupted: the baseline " + *gate.write_baseline + " was not written"};
  return WriteOutputFile(*gate.write_baseline, WriteBaseline(report, BaselineBefore(*gate.write_baseline)));
}

}  // namespace ecaudit::cli
