/// `ecaudit diff`: "it worked yesterday" - two captures side by side.
#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "analyzers/compare/compare_captures.h"
#include "analyzers/judge/refusal_reasons.h"
#include "cli/capture_run.h"
#include "cli/commands/command.h"
#include "cli/output_file.h"
#include "cli/output_plan.h"
#include "cli/report/diff_writer.h"
#include "cli/report/sentences.h"
#include "cli/version.h"

namespace ecaudit::cli {
namespace {

enum Format : std::size_t { kText, kJson };
constexpr std::array kDiffFormats{OutputFormat{"text", ".txt"}, OutputFormat{"json", ".json"}};

class DiffCommand : public Command {
 public:
  DiffCommand() : Command("diff", "diff A B", "Compare two captures: start-ups, configuration, timing, findings") {}

  void Declare(OptionSet& options) override {
    run_.options.Declare(options);
    options.Group("Comparison");
    options.Flag("--all", all_, "print all differences, also where the settings that a refusal is about lead");
    output_.Declare(options, kDiffFormats);
    options.Footer(
        "\nSlaves are matched by identity and position; values that vary between two runs of one master are not "
        "compared.\nWhere only one start-up of a slave is refused a state, the settings that its AL status code is "
        "about "
        "lead.\n"
        "With --from and --to both captures are cut. Exit status: 0 no difference, 1 they differ, 2 wrong usage,\n"
        "unreadable input, or nothing that both show.\n"
        "Example: ecaudit diff yesterday.pcapng today.pcapng");
  }

  [[nodiscard]] ExitStatus Run(Console& console) override {
    run_.options.isolates = "diff";
    if (run_.options.join) return CaptureRun::Fail(console, Error{"diff compares two captures; it cannot join them"});
    if (run_.options.captures.size() != 2) {
      return CaptureRun::Fail(console, Error{"diff compares two captures, A and B; " +
                                             std::to_string(run_.options.captures.size()) + " given"});
    }
    if (const auto error = run_.Prepare()) return CaptureRun::Fail(console, *error);
    const Result<std::vector<OutputTarget>> targets = PlanOutputs(output_, kDiffFormats, run_.files);
    if (!targets) return CaptureRun::Fail(console, targets.error());

    report::Report both;
    run_.needs_ethercat = true;
    ExitStatus status = ExitStatus::kClean;
    for (const CaptureJob& job : run_.jobs()) {
      status = Worst(status, run_.Run(job, both, console));
      if (status != ExitStatus::kClean) return status;
    }
    if (run_.ReportMissingSlaves(both, console) != ExitStatus::kClean) return ExitStatus::kUsage;

    const AnalysisResult& a = both.captures[0].result;
    const AnalysisResult& b = both.captures[1].result;
    const diff::CaptureDiff differences = diff::Compare(a, b, {&report::TitleOf, &SettingsOfRefusal});
    if (!differences.compared && !differences.different()) {
      std::string why = "nothing to compare: " + run_.jobs()[0].name() + " and " + run_.jobs()[1].name() +
                        " show no start-up and no configuration of the same slave";
      if (!differences.notes.empty()) why += " (" + differences.notes.back() + ")";
      return CaptureRun::Fail(console, Error{std::move(why)});
    }
    const report::DiffReport report{std::string(Version()), a, b, differences, all_};
    for (const OutputTarget& target : *targets) {
      const report::TextStyle style = output_.text.Style(console, target.standard());
      const std::string text =
          target.format == kJson ? report::WriteDiffJson(report) : report::WriteDiffText(report, style);
      const auto error = target.standard() ? console.Write(text) : WriteOutputFile(target.path, text);
      if (error) return CaptureRun::Fail(console, *error);
    }
    return differences.different() ? ExitStatus::kFindings : ExitStatus::kClean;
  }

 private:
  CaptureRun run_;
  OutputOptions output_;
  bool all_ = false;
};

}  // namespace

std::unique_ptr<Command> MakeDiffCommand() {
  return std::make_unique<DiffCommand>();
}

}  // namespace ecaudit::cli
