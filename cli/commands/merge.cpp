/// `ecaudit merge`: reports of many captures, made anywhere, as one summary.
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/judge/catalogue.h"
#include "analyzers/options/options.h"
#include "cli/baseline.h"
#include "cli/capture_options.h"
#include "cli/commands/command.h"
#include "cli/file_list.h"
#include "cli/json_file.h"
#include "cli/output_plan.h"
#include "cli/report/digest_json.h"
#include "cli/report/formats.h"
#include "cli/report_output.h"
#include "cli/summary_run.h"
#include "cli/version.h"

namespace ecaudit::cli {
namespace {

/// Orders captures by their results; the report that holds them does not count. Ordered, not hashed: who makes
/// reports can make any number that share a hash.
struct ByContent {
  using is_transparent = void;
  const std::vector<report::CaptureDigest>& captures;

  bool operator()(std::size_t a, std::size_t b) const { return Before(captures[a], captures[b]); }
  bool operator()(std::size_t a, const report::CaptureContent& b) const { return Before(captures[a], b); }
  bool operator()(const report::CaptureContent& a, std::size_t b) const { return Before(a, captures[b]); }

 private:
  static bool Before(const report::CaptureContent& a, const report::CaptureContent& b) { return a < b; }
};

class MergeCommand : public Command {
 public:
  MergeCommand() : Command("merge", "merge REPORT...", "Join JSON reports of many captures into one summary") {}

  void Declare(OptionSet& options) override {
    options.Arguments("REPORT", paths_,
                      "JSON reports of check and batch, folders with reports, or wildcards in quotes");
    options.Group("How to evaluate");
    options.Value("--fail-on", "SEVERITY", fail_on_,
                  "instead of what the reports were made with: error, warning, info or never");
    options.Words({"error", "warning", "info", "never"});
    options.Value("--baseline", "FILE", baseline_, "known findings, which do not count");
    options.Value("--write-baseline", "FILE", write_baseline_, "write all findings of the reports to FILE");
    output_.Declare(options, NamesOf(report::SummaryFormats()));
    output_.text.DeclareTime(options);
    output_.text.DeclareQuiet(options);
    options.Footer(
        "\nThe summary is that of one batch over all the captures, and so is the exit status.\n"
        "Example: ecaudit merge -o junit=summary.xml host1/reports host2/reports");
  }

  [[nodiscard]] ExitStatus Run(Console& console) override {
    if (const auto error = Prepare()) return Fail(console, *error);
    const Result<ReportOutput> output = ReportOutput::PlanSummary(output_, command_files_);
    if (!output) return Fail(console, output.error());
    for (const std::string& text : ExpiredEntries(known_)) console.Warning(*baseline_ + ": " + text);
    digest_.version = Version();
    digest_.rules = RuleCatalogue();
    bool complete = true;
    for (const std::string& file : files_) {
      if (const auto error = Read(file, console)) {
        console.Error(error->message);
        complete = false;
      }
    }
    // A summary that lacks captures without a note would be worse than none.
    if (!complete) return ExitStatus::kUsage;
    if (digest_.captures.empty()) return Fail(console, Error{"the reports hold no capture"});
    if (versions_.size() > 1 || !versions_.contains(digest_.version)) WarnOfVersions(console);
    if (write_baseline_) {
      for (const report::CaptureDigest& capture : digest_.captures) {
        if (!ShowsPart(capture)) continue;
        return Fail(console,
                    Error{"the report of " + capture.path + " shows a part of the capture (" + Text(capture.selection) +
                          "); the baseline " + *write_baseline_ + " was not written"});
      }
    }
    if (baseline_) {
      std::vector<const report::CaptureDigest*> captures;
      for (const report::CaptureDigest& capture : digest_.captures) captures.push_back(&capture);
      for (const std::string& text : UnmatchedEntries(known_, captures)) console.Warning(*baseline_ + ": " + text);
    }
    SortCaptures(digest_);
    return Deliver(digest_, *output, write_baseline_, console);
  }

 private:
  /// Its findings are not all that the capture has.
  [[nodiscard]] static bool ShowsPart(const report::CaptureDigest& capture) {
    return capture.selection.range() || !capture.selection.slaves.empty();
  }

  [[nodiscard]] std::optional<Error> Prepare() {
    if (fail_on_) {
      parsed_fail_on_ = report::ParseFailOn(*fail_on_);
      if (!parsed_fail_on_) {
        return Error{"--fail-on is '" + *fail_on_ + "' but must be error, warning, info or never"};
      }
    }
    if (baseline_) {
      Result<Baseline> known = ReadBaseline(*baseline_);
      if (!known) return known.error();
      known_ = std::move(*known);
    }
    Result<FileList> list = ExpandPaths(paths_, IsReportName, "report");
    if (!list) return list.error();
    if (!list->unreadable.empty()) return Error{list->unreadable.front().message};
    files_ = std::move(list->files);
    command_files_.Reads(files_, kReportRole);
    command_files_.Reads(baseline_.value_or(""), kBaselineRole);
    return PlanBaseline(write_baseline_, command_files_);
  }

  [[nodiscard]] std::optional<Error> Read(const std::string& file, Console& console) {
    const Result<JsonDocument> document = ReadJsonFile(file, kLargestReport);
    if (!document) return document.error();
    if (document->root().member("schema").is_text("ecaudit.summary/1")) {
      console.Warning(file + " is a summary, not a report: ignored");
      return std::nullopt;
    }
    Result<report::ReportDigest> read = report::ReadReportDigest(document->root());
    if (!read) return Error{file + ": " + read.error().message};
    versions_.insert(read->version);
    for (report::CaptureDigest& capture : read->captures) {
      if (!capture.judged) {
        return Error{file + ": startup without --expect has no verdict, so there is nothing to merge"};
      }
      capture.report = std::filesystem::path(file).filename().string();
      if (parsed_fail_on_) capture.fail_on = *parsed_fail_on_;
      if (baseline_) {
        capture.baseline = *baseline_;
        ApplyBaseline(known_, capture);
      }
      if (const auto same = counted_.find(capture); same != counted_.end()) {
        console.Warning(capture.path + " has the same result in " + digest_.captures[*same].report + " and " +
                        capture.report + ": counted once");
        continue;
      }
      digest_.captures.push_back(std::move(capture));
      counted_.insert(digest_.captures.size() - 1);
    }
    return std::nullopt;
  }

  void WarnOfVersions(Console& console) const {
    std::string text;
    for (const std::string& version : versions_) text += (text.empty() ? "" : ", ") + version;
    console.Warning("the reports were made by ecaudit " + text + ", this is " + std::string(Version()) +
                    ": rules may have changed in between");
  }

  std::vector<std::string> paths_;
  std::vector<std::string> files_;
  CommandFiles command_files_;
  std::optional<std::string> fail_on_, baseline_, write_baseline_;
  std::optional<report::FailOn> parsed_fail_on_;
  Baseline known_;
  OutputOptions output_;
  report::Digest digest_;
  std::set<std::size_t, ByContent> counted_{ByContent{digest_.captures}};  ///< places in the digest
  std::set<std::string> versions_;                                         ///< that made the reports
};

}  // namespace

std::unique_ptr<Command> MakeMergeCommand() {
  return std::make_unique<MergeCommand>();
}

}  // namespace ecaudit::cli
