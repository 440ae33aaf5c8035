/// `ecaudit check`: the main job.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/analysis.h"
#include "cli/baseline.h"
#include "cli/capture_check.h"
#include "cli/capture_options.h"
#include "cli/commands/command.h"
#include "cli/interrupt.h"
#include "cli/output_file.h"
#include "cli/output_plan.h"
#include "cli/progress.h"
#include "cli/report_output.h"
#include "cli/version.h"

namespace ecaudit::cli {
namespace {

/// One analysis: one capture, or all of them joined.
struct Job {
  std::vector<std::string> paths;
  Settings settings;
};

class CheckCommand : public Command {
 public:
  [[nodiscard]] std::string_view name() const override { return "check"; }
  [[nodiscard]] std::string_view usage() const override { return "check CAPTURE..."; }
  [[nodiscard]] std::string_view summary() const override {
    return "Decode captures, follow each slave, report what is wrong";
  }

  void Declare(OptionSet& options) override {
    options_.Declare(options);
    gate_.Declare(options);
    output_.Declare(options, report::FormatList(report::Formats()));
    options.Footer(
        "\nExit status: 0 nothing at or above --fail-on, 1 findings, 2 wrong usage or unreadable input.\n"
        "Example: ecaudit check --rule al-timeout=warning -o json=report.json trace.pcapng");
  }

  [[nodiscard]] ExitStatus Run(Console& console) override {
    // Everything that can be wrong with the command line is found before the first capture is read.
    if (const auto error = Prepare()) return Fail(console, *error);
    const Result<ReportOutput> output = ReportOutput::Plan(output_, options_.captures);
    if (!output) return Fail(console, output.error());
    if (gate_.write_baseline) {
      if (const auto error = CheckOutputPath(*gate_.write_baseline)) return Fail(console, *error);
    }

    ListenForInterrupt();
    report::Report report;
    report.version = Version();
    report.rules = RuleCatalogue();
    ExitStatus status = ExitStatus::kClean;
    draws_ = output->draws();
    for (const Job& job : jobs_) status = Worst(status, RunJob(job, report, console));
    if (report.captures.empty()) return status;

    // Captures without the slaves of --slave: wrong usage when that is all of them.
    if (without_slave_.size() == report.captures.size())
      return Fail(console, Error{WithoutSlave(without_slave_.front())});
    for (const std::string& name : without_slave_) console.Warning(WithoutSlave(name));
    if (const auto error = output->Write(report, console)) status = Worst(status, Fail(console, *error));
    if (gate_.write_baseline) {
      if (const auto error = WriteOutputFile(*gate_.write_baseline, WriteBaseline(report))) {
        status = Worst(status, Fail(console, *error));
      }
    }
    return Worst(status, report::Summarise(report).fail ? ExitStatus::kFindings : ExitStatus::kClean);
  }

 private:
  static ExitStatus Fail(Console& console, const Error& error) {
    console.Error(error.message);
    return ExitStatus::kUsage;
  }

  [[nodiscard]] std::string WithoutSlave(const std::string& capture) const {
    std::string slaves;
    for (const std::string& slave : options_.slaves) slaves += (slaves.empty() ? "" : " or ") + slave;
    return capture + " has no slave " + slaves;
  }

  [[nodiscard]] std::optional<Error> Prepare() {
    if (std::count(options_.captures.begin(), options_.captures.end(), "-") > 1) {
      return Error{"standard input (-) can be read only once"};
    }
    if (options_.join) {
      jobs_.push_back({options_.captures, {}});
    } else {
      for (const std::string& capture : options_.captures) jobs_.push_back({{capture}, {}});
    }
    for (Job& job : jobs_) {
      Result<Settings> settings = ResolveSettings(options_, gate_, job.paths.front());
      if (!settings) return settings.error();
      job.settings = std::move(*settings);
      if (auto error = baselines_.Load(job.settings.baseline)) return error;
    }
    return std::nullopt;
  }

  [[nodiscard]] ExitStatus RunJob(const Job& job, report::Report& report, Console& console) {
    const std::string& name = job.paths.front();
    Progress progress(console, std::filesystem::path(name).filename().string());
    Result<CheckedCapture> capture = CheckCapture(
        job.paths, job.settings, baselines_.Find(job.settings.baseline), InterruptFlag(),
        [&progress](std::uint64_t done, std::uint64_t total, std::uint64_t frames) {
          progress.Update(done, total, frames);
        },
        draws_);
    progress.Clear();
    if (!capture) {
      report.unreadable.push_back({name, capture.error().message});
      return Fail(console, capture.error());
    }

    const CaptureSummary& read = capture->report.result.capture;
    if (report::WithoutEtherCat(capture->report.result)) {
      console.Warning(name + ": no EtherCAT frame among " + std::to_string(read.packets) + " packets");
    }
    if (capture->lacks_slave) without_slave_.push_back(name);
    const bool cut_short = InterruptFlag() && !read.complete;
    report.captures.push_back(std::move(capture->report));
    if (cut_short) {
      return Fail(console, Error{name + ": interrupted, the report covers the first " +
                                 std::to_string(report.captures.back().result.capture.packets) + " packets"});
    }
    return ExitStatus::kClean;
  }

  CaptureOptions options_;
  GateOptions gate_;
  OutputOptions output_;
  bool draws_ = false;  ///< a report wants what happened over time
  std::vector<Job> jobs_;
  BaselineShelf baselines_;
  std::vector<std::string> without_slave_;  ///< captures that lack the slaves of --slave
};

}  // namespace

std::unique_ptr<Command> MakeCheckCommand() {
  return std::make_unique<CheckCommand>();
}

}  // namespace ecaudit::cli
