/// `ecaudit check`: the main job.
#include <memory>
#include <string>

#include "analyzers/judge/catalogue.h"
#include "cli/capture_run.h"
#include "cli/commands/command.h"
#include "cli/output_plan.h"
#include "cli/report_output.h"
#include "cli/version.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

class CheckCommand : public Command {
 public:
  CheckCommand() : Command("check", "check CAPTURE...", "Decode captures, follow each slave, report what is wrong") {}

  void Declare(OptionSet& options) override {
    run_.options.Declare(options);
    run_.options.DeclareIsolate(options);
    run_.gate.Declare(options);
    output_.Declare(options, NamesOf(report::Formats()));
    output_.text.DeclareTime(options);
    output_.text.DeclareQuiet(options);
    options.Footer("\n" + std::string(kExitStatusHelp) +
                   "130 interrupted: the report\n"
                   "covers what was read until then.\n"
                   "Example: ecaudit check --rule al-timeout=warning -o json=report.json trace.pcapng");
  }

  [[nodiscard]] ExitStatus Run(Console& console) override {
    run_.options.local_time = output_.text.time == Name(report::TimeMode::kLocal);
    if (const auto error = run_.Prepare()) return CaptureRun::Fail(console, *error);
    const Result<ReportOutput> output = ReportOutput::Plan(output_, run_.files);
    if (!output) return CaptureRun::Fail(console, output.error());

    report::Report report;
    report.version = Version();
    report.rules = RuleCatalogue();
    ExitStatus status = ExitStatus::kClean;
    run_.wanted = {output->draws(), output->lines()};
    for (std::size_t i = 0; i < run_.jobs().size(); ++i) {
      status = Worst(status, run_.Run(run_.jobs()[i], report, console));
      if (status != ExitStatus::kInterrupted) continue;
      if (const std::size_t rest = run_.jobs().size() - i - 1; rest > 0) {
        console.Error(Count(rest, "capture") + " not read");
      }
      break;
    }
    if (report.captures.empty()) {
      // A CI server that expects a file finds the reason in it.
      if (const auto error = output->Write(report, console)) status = Worst(status, CaptureRun::Fail(console, *error));
      return status;
    }

    // Captures without the slaves of --slave: wrong usage when that is all of them.
    if (run_.ReportMissingSlaves(report, console) != ExitStatus::kClean) return ExitStatus::kUsage;
    CaptureRun::ReportUnmet(report, console);
    run_.ReportUnmatched(report, console);
    if (const auto error = output->Write(report, console)) status = Worst(status, CaptureRun::Fail(console, *error));
    if (const auto error = run_.WriteBaselineOf(report)) status = Worst(status, CaptureRun::Fail(console, *error));
    return Worst(status, report::Gates(report::Summarise(report)) ? ExitStatus::kFindings : ExitStatus::kClean);
  }

 private:
  CaptureRun run_;
  OutputOptions output_;
};

}  // namespace

std::unique_ptr<Command> MakeCheckCommand() {
  return std::make_unique<CheckCommand>();
}

}  // namespace ecaudit::cli
