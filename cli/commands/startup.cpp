/// `ecaudit startup`: what the master did to bring the slaves to OP, step by step, and whether that is as expected.
#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analyzers/compare/comparison.h"
#include "analyzers/judge/catalogue.h"
#include "analyzers/judge/finding_order.h"
#include "analyzers/result/further_startups.h"
#include "analyzers/words/step_text.h"
#include "cli/capture_run.h"
#include "cli/commands/command.h"
#include "cli/expectation_file.h"
#include "cli/expected_rungs.h"
#include "cli/finding_filter.h"
#include "cli/output_file.h"
#include "cli/output_plan.h"
#include "cli/report/esi_text.h"
#include "cli/report/sentences.h"
#include "cli/report/startup_text.h"
#include "cli/report_output.h"
#include "cli/version.h"
#include "decoder/base/system/files.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

constexpr std::string_view kGroup = "Start-up";

/// Those of `check`, the text about start-ups.
std::vector<report::Format> StartupFormats() {
  std::vector<report::Format> all(report::Formats().begin(), report::Formats().end());
  for (report::Format& format : all) {
    if (format.name == "text") format.write = &report::WriteStartupText;
  }
  return all;
}

bool IsOfStartup(std::string_view rule) {
  const RuleInfo* info = FindRule(rule);
  return info != nullptr && info->group == kGroup;
}

/// A state that was not reached, a transfer that failed for good, a drive that was not enabled.
bool FailedForGood(const StartupStep& step, const StartupSummary& startup) {
  if (step.outcome != StartupOutcome::kRefused && step.outcome != StartupOutcome::kUnanswered) return false;
  if (step.key.kind == StartupKey::Kind::kRequest) return step.key.address > startup.reached;
  if (step.key.kind == StartupKey::Kind::kDrive) return true;
  return step.key.kind == StartupKey::Kind::kDownload &&
         std::ranges::none_of(startup.steps, [&](const StartupStep& other) {
           return other.key == step.key && other.outcome == StartupOutcome::kDone;
         });
}

/// "the request of SAFEOP was refused with 0x001d ... and 1 step more"; empty where all went well.
std::string WhatFailed(const StartupSummary& startup) {
  std::string first;
  std::size_t failed = 0;
  for (const StartupStep& step : startup.steps) {
    if (!FailedForGood(step, startup)) continue;
    if (failed++ == 0) first = "the " + startup::StepNoun(step.key, step.name) + " was " + step.note;
  }
  return failed > 1 ? first + ", and " + Count(failed - 1, "further step") + " failed" : first;
}

bool HoldsStartup(const AnalysisResult& result) {
  return std::ranges::any_of(result.slaves, [](const SlaveSummary& slave) { return slave.startup.seen; }) ||
         (result.bus.startup.seen && !result.bus.startup.steps.empty());
}

/// Leaves the findings about the expectation, and counts the others.
void KeepStartupFindings(report::CaptureReport& capture) {
  std::vector<Finding>& findings = capture.result.findings;
  std::vector<bool> wanted(findings.size());
  std::map<std::uint32_t, std::uint64_t> lines;  // by number
  for (std::size_t i = 0; i < findings.size(); ++i) {
    if (i < capture.decode_lines.size()) lines[findings[i].number] = capture.decode_lines[i];
    wanted[i] = IsOfStartup(findings[i].rule);
    if (wanted[i]) {
      findings[i].caused_by = kNoFinding;
      continue;
    }
    if (findings[i].severity == Severity::kError) ++capture.other_errors;
    if (findings[i].severity == Severity::kWarning) ++capture.other_warnings;
  }
  KeepFindings(wanted, capture.result);
  capture.decode_lines.clear();
  for (const Finding& finding : findings) {
    if (!lines.empty()) capture.decode_lines.push_back(lines[finding.number]);
  }
  // No other report of the capture has these.
  NumberFindings(findings);
  std::erase_if(capture.result.not_evaluable, [](const NotEvaluable& entry) { return !IsOfStartup(entry.rule); });
  capture.result.capture_next.clear();
  std::erase_if(capture.result.coverage, [](const RuleCoverage& rule) { return !IsOfStartup(rule.rule); });
}

class StartupCommand : public Command {
 public:
  StartupCommand()
      : Command("startup", "startup CAPTURE",
                "Show the start-up of each slave, save it, compare it with an expectation") {}

  void Declare(OptionSet& options) override {
    run_.options.Declare(options);
    options.Group("Expectation");
    options.Value("--save", "FILE", save_,
                  "write this start-up as an expectation (JSON); values that vary are left open");
    options.Value("--expect", "FILE", expect_,
                  "compare with an expectation, the init commands of an ENI, or what an ESI requires");
    run_.gate.Declare(options);
    output_.Declare(options, NamesOf(report::Formats()));
    output_.text.DeclareTime(options);
    options.Footer(
        "\nThe start-up of a slave goes from its first frame to OP, of a drive to Operation enabled. With --expect "
        "only\n"
        "what differs from the expectation is a finding; --fail-on, --rule and the baseline work as in check.\n"
        "Exit status: 0 shown, or as expected; 1 it differs; 2 wrong usage, unreadable input, or no start-up in it.\n"
        "Examples: ecaudit startup --save machine.json good.pcapng\n"
        "          ecaudit startup --expect machine.json today.pcapng");
  }

  [[nodiscard]] ExitStatus Run(Console& console) override {
    run_.options.isolates = "startup";
    run_.options.local_time = output_.text.time == Name(report::TimeMode::kLocal);
    if (const auto error = Prepare()) return CaptureRun::Fail(console, *error);
    const Result<ReportOutput> output = ReportOutput::Plan(output_, StartupFormats(), run_.files);
    if (!output) return CaptureRun::Fail(console, output.error());

    run_.wanted = {output->draws(), output->lines()};
    run_.needs_ethercat = true;
    report::Report report;
    report.version = Version();
    report.rules = RuleCatalogue();
    ExitStatus status = run_.Run(run_.jobs().front(), report, console);
    if (report.captures.empty()) {
      // A file of an earlier run must not stand for this one.
      if (const auto error = output->Write(report, console)) status = Worst(status, CaptureRun::Fail(console, *error));
      return status;
    }
    if (run_.ReportMissingSlaves(report, console) != ExitStatus::kClean) return ExitStatus::kUsage;

    report::CaptureReport& capture = report.captures.front();
    if (save_) {
      const auto error = status == ExitStatus::kInterrupted ? Error{"interrupted: " + *save_ + " was not written"}
                                                            : Save(capture.result, console);
      if (error) status = Worst(status, CaptureRun::Fail(console, *error));
      if (status == ExitStatus::kUsage) return status;
    }
    if (esi_) {
      if (const auto error = NothingRequired(capture.result)) return Worst(status, CaptureRun::Fail(console, *error));
      capture.expectation = *expect_;
      KeepStartupFindings(capture);
      for (std::string& unmet : report::UnmetEsiDemands(capture.result.slaves, capture.result.slave_names)) {
        capture.unmet.push_back(std::move(unmet));
      }
      run_.MarkKnown(capture);
    } else if (expectation_ != nullptr) {
      if (const auto error = NothingCompared(capture.result)) return Worst(status, CaptureRun::Fail(console, *error));
      capture.expectation = *expect_;
      KeepStartupFindings(capture);
      for (std::string& missing : startup::RungsMissing(*expectation_, capture.result)) {
        capture.unmet.push_back(std::move(missing));
      }
      run_.MarkKnown(capture);
    } else {
      // Nothing is evaluated here: that is what `check` is for.
      capture.judged = false;
      capture.required.clear();
      capture.unmet.clear();
      KeepFindings(std::vector<bool>(capture.result.findings.size()), capture.result);
      capture.decode_lines.clear();
      capture.result.not_evaluable.clear();
      capture.result.coverage.clear();
      capture.result.capture_next.clear();
      capture.known.clear();
    }
    CaptureRun::ReportUnmet(report, console);
    if (const auto error = output->Write(report, console)) status = Worst(status, CaptureRun::Fail(console, *error));
    if (const auto error = run_.WriteBaselineOf(report)) status = Worst(status, CaptureRun::Fail(console, *error));
    if (status == ExitStatus::kClean && !HoldsStartup(capture.result)) {
      return CaptureRun::Fail(console, Error{run_.jobs().front().name() + " holds no start-up"});
    }
    return Worst(status, report::Gates(report::Summarise(report)) ? ExitStatus::kFindings : ExitStatus::kClean);
  }

 private:
  [[nodiscard]] std::optional<Error> Prepare() {
    if (run_.options.captures.size() > 1 && !run_.options.join) {
      return Error{"startup reads one capture; give --join when these are files of one ring buffer"};
    }
    const GateOptions& gate = run_.gate;
    if (!expect_ && (gate.fail_on || !gate.rules.empty() || gate.baseline || gate.write_baseline || gate.require)) {
      return Error{"startup accepts --fail-on, --rule, --require, --baseline and --write-baseline only with --expect"};
    }
    if (expect_) run_.files.Reads(*expect_, kExpectationRole);
    if (expect_ && IsEsi(*expect_)) {
      esi_ = true;
      run_.options.esi.push_back(*expect_);
    }
    if (auto error = run_.Prepare()) return error;
    if (save_) {
      if (auto error = run_.files.Writes(*save_)) return error;
      if (auto error = CheckSavePath(*save_)) return error;
    }
    if (!expect_ || esi_) return std::nullopt;
    auto expectation = ReadExpectation(*expect_);
    if (!expectation) return expectation.error();
    expectation_ = std::move(*expectation);
    run_.jobs().front().settings.analysis.expectation = expectation_;
    return std::nullopt;
  }

  [[nodiscard]] std::optional<Error> Save(const AnalysisResult& result, Console& console) const {
    const auto holds = [](const SlaveSummary& slave) { return !slave.startup.steps.empty(); };
    if (std::ranges::none_of(result.slaves, holds)) {
      return Error{run_.jobs().front().name() + " holds no start-up that could be saved"};
    }
    for (const SlaveSummary& slave : result.slaves) {
      if (!holds(slave)) {
        console.Warning(result.slave_names.Of(slave.position) + " is saved without steps: the capture holds none");
      } else if (slave.startup.steps_left_out > 0) {
        console.Warning(result.slave_names.Of(slave.position) + " is saved without its last " +
                        std::to_string(slave.startup.steps_left_out) + " steps");
      }
      if (const std::string failed = WhatFailed(slave.startup); !failed.empty()) {
        console.Warning(result.slave_names.Of(slave.position) + " is saved with a start-up that failed: " + failed +
                        "; what failed is not expected to succeed");
      }
    }
    if (const FrameNo next = startup::NextStartup(result); next != 0) {
      console.Warning("the start-up before frame " + std::to_string(next) + " is saved; with --from '#" +
                      std::to_string(next) + "' the one from there on");
    }
    if (system::IsFile(*save_)) console.Warning("the expectation " + *save_ + " is replaced");
    return WriteOutputFile(*save_, WriteExpectation(result));
  }

  /// Likewise for an ESI: of no slave of it a start-up is in the capture.
  [[nodiscard]] std::optional<Error> NothingRequired(const AnalysisResult& result) const {
    const std::string& name = run_.jobs().front().name();
    if (result.slaves.empty()) return Error{name + " shows no slave, so there is nothing to compare"};
    const auto described = [](const SlaveSummary& slave) { return !slave.esi_demands.empty(); };
    if (std::ranges::any_of(result.slaves, described)) return std::nullopt;
    return Error{name + " holds no start-up of a slave that " + *expect_ + " describes, or the ESI requires nothing"};
  }

  /// A capture that shows no slave's start-up must not pass for one that is as expected.
  [[nodiscard]] std::optional<Error> NothingCompared(const AnalysisResult& result) const {
    const startup::Comparison comparison = startup::Compare(*expectation_, result);
    const auto without = std::ranges::count_if(comparison.not_compared, [](const startup::NotCompared& entry) {
      return entry.slave != kNoSlave && !entry.only;
    });
    const std::string& name = run_.jobs().front().name();
    if (result.slaves.empty()) return Error{name + " shows no slave, so there is nothing to compare"};
    const auto hidden = std::ranges::count(comparison.not_compared, startup::Deviation::Kind::kSlaveMissing,
                                           &startup::NotCompared::only);
    if (hidden > 0 && static_cast<std::size_t>(hidden) == expectation_->slaves.size()) {
      return Error{name +
                   " shows none of the expected slaves: " + report::TextOf(comparison.not_compared.back().reason)};
    }
    if (comparison.cut > 0 && comparison.cut + static_cast<std::size_t>(without) >= result.slaves.size() &&
        comparison.deviations.empty()) {
      return Error{name + " holds no whole start-up to compare: it ends while the slaves are started"};
    }
    if (static_cast<std::size_t>(without) < result.slaves.size()) return std::nullopt;
    return Error{name + " holds no start-up to compare: " + report::TextOf(comparison.not_compared.back().reason)};
  }

  CaptureRun run_;
  OutputOptions output_;
  std::optional<std::string> save_, expect_;
  std::shared_ptr<const startup::Expectation> expectation_;
  bool esi_ = false;  ///< the expectation is an ESI file
};

}  // namespace

std::unique_ptr<Command> MakeStartupCommand() {
  return std::make_unique<StartupCommand>();
}

}  // namespace ecaudit::cli
