/// `ecaudit batch`: many captures, one report each and one summary.
#include <algorithm>
#include <charconv>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "analyzers/judge/catalogue.h"
#include "analyzers/options/options.h"
#include "cli/baseline.h"
#include "cli/batch_run.h"
#include "cli/capture_check.h"
#include "cli/capture_options.h"
#include "cli/commands/command.h"
#include "cli/config.h"
#include "cli/file_list.h"
#include "cli/interrupt.h"
#include "cli/output_file.h"
#include "cli/output_plan.h"
#include "cli/report/formats.h"
#include "cli/report/layout.h"
#include "cli/report_folder.h"
#include "cli/report_output.h"
#include "cli/settings_key.h"
#include "cli/summary_run.h"
#include "cli/version.h"
#include "decoder/base/system/files.h"
#include "decoder/base/system/process.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kMostWorkers = 512;
constexpr const char* kDefaultFolder = "ecaudit-reports";

class BatchCommand : public Command {
 public:
  BatchCommand()
      : Command("batch", "batch PATH...", "Check many captures in parallel: a report for each, one summary") {}

  void Declare(OptionSet& options) override {
    options.Arguments("PATH", options_.captures,
                      "captures, folders with captures (and folders in them), or wildcards in quotes");
    options.Group("How to work");
    options.Value("--jobs", "N", jobs_text_, "captures to check at the same time (default: one for each processor)");
    options.Value("--output-dir", "DIR", folder_,
                  "folder for the reports, one JSON each (default: ecaudit-reports); also -o DIR");
    options.Flag("--skip-done", batch_.skip_done, "keep reports that are whole and up to date, from an earlier run");
    options.Group("What to read");
    options.Flag("--join", options_.join, "read the files of each ring buffer as one capture (grouped by their names)");
    options_.DeclareSettings(options);
    options_.DeclareIsolate(options);
    gate_.Declare(options);
    output_.Declare(options, NamesOf(report::SummaryFormats()),
                    "of the summary: " + report::FormatList(report::SummaryFormats()));
    output_.text.DeclareTime(options);
    output_.text.DeclareQuiet(options);
    options.Footer(
        "\n-o and --format are for the summary; -o html=DIR makes a page for each capture, and an index of them.\n"
        "The exit status is the highest that check would give.\n"
        "Example: ecaudit batch --skip-done -o json=summary.json -o junit=summary.xml captures/");
  }

  [[nodiscard]] ExitStatus Run(Console& console) override {
    // Everything that can be wrong with the command line is found before the first capture is read.
    if (const auto error = Prepare()) return Fail(console, *error);
    // Lines always: `merge` has no captures to count them in, and its summary is to be that of one batch.
    batch_.wanted = {!batch_.pages.empty(), true};
    if (system::WorkerTask()) ServeBatch(jobs_, batch_);
    options_.ReportSkipped(console);
    files_.Reads(paths_, kCaptureRole);
    // First the folder: the summary may be meant to stand in it.
    std::error_code ignored;
    const bool new_folder = !system::Exists(*folder_);
    const bool new_pages = !batch_.pages.empty() && !system::Exists(batch_.pages);
    const ExitStatus status = RunIn(console);
    // A command line that was wrong leaves no folder; one with something in it is not removed.
    if (new_pages) fs::remove(batch_.pages, ignored);
    if (new_folder) fs::remove(*folder_, ignored);
    return status;
  }

 private:
  [[nodiscard]] ExitStatus RunIn(Console& console) {
    if (const auto error = MakeReportFolder(*folder_)) return Fail(console, *error);
    if (!batch_.pages.empty()) {
      if (const auto error = MakeReportFolder(batch_.pages)) return Fail(console, *error);
    }
    for (const BatchJob& job : jobs_) {
      if (const auto error = files_.Claims(job.report)) return Fail(console, *error);
    }
    const Result<ReportOutput> output = ReportOutput::PlanSummary(output_, files_);
    if (!output) return Fail(console, output.error());
    if (const auto error = PlanBaseline(gate_.write_baseline, files_)) return Fail(console, *error);
    std::vector<std::string> names;
    for (const BatchJob& job : jobs_) names.push_back(fs::path(job.report).filename().string());
    FolderLock lock(*folder_);
    if (lock.alone()) RemoveUnfinished(*folder_, names);
    lock.Share();
    ReportSkippedPaths(console);

    baselines_.WarnOfExpired(console);
    ListenForInterrupt();
    std::vector<BatchResult> results;
    const std::optional<Error> error = RunBatch(jobs_, batch_, results, console);
    ExitStatus status = ExitStatus::kClean;
    if (error) status = Fail(console, *error);
    const report::Digest digest = Collect(results, console);
    // As check has it: wrong usage when no capture has any of them.
    if (lack_slaves_) return Fail(console, Error{"no capture has a slave of --slave; there is no summary"});
    if (digest.not_reached == 0) baselines_.WarnOfUnmatched(digest.captures, console);
    status = Worst(status, Deliver(digest, *output, gate_.write_baseline, console));
    ReportOutcome(results, digest, console);
    const bool crashed = std::ranges::any_of(results, &BatchResult::crashed);
    if (crashed) status = Worst(status, ExitStatus::kInternal);
    return digest.not_reached > 0 && InterruptFlag() ? Worst(status, ExitStatus::kInterrupted) : status;
  }

  [[nodiscard]] std::optional<Error> Prepare() {
    options_.local_time = output_.text.time == Name(report::TimeMode::kLocal);
    if (auto error = ReadWorkers()) return error;
    if (auto error = CheckBaselineIsWhole(options_, gate_)) return error;
    TakePagesFromOutputs();
    TakeFolderFromOutputs();
    if (!folder_) folder_ = kDefaultFolder;
    if (std::ranges::find(options_.captures, "-") != options_.captures.end()) {
      return Error{"batch does not read standard input (-); use check"};
    }
    return system::WorkerTask() ? AddTasks(*system::WorkerTask()) : AddPaths();
  }

  /// In a worker: the jobs of its parent, in their order.
  [[nodiscard]] std::optional<Error> AddTasks(std::string_view text) {
    for (BatchTask& task : ReadTask(text)) {
      if (task.is_problem) {
        AddUnreadable(task.texts.front(), task.texts.back());
      } else if (auto error = AddJob(std::move(task.texts))) {
        return error;
      }
    }
    return std::nullopt;
  }

  [[nodiscard]] std::optional<Error> AddPaths() {
    Result<FileList> list = ExpandPaths(options_.captures, IsCaptureName, "capture");
    if (!list) return list.error();
    paths_ = std::move(list->files);
    passed_over_ = std::move(list->passed_over);
    const bool none = std::ranges::none_of(paths_, &system::Exists);
    if (none && !paths_.empty() && list->unreadable.empty()) return Error{"no such file: " + paths_.front()};
    if (options_.join) {
      for (std::vector<std::string>& files : GroupRingBuffers(paths_)) {
        if (auto error = AddJob(std::move(files))) return error;
      }
    } else {
      for (const std::string& path : paths_) {
        if (auto error = AddJob({path})) return error;
      }
    }
    for (const report::UnreadableCapture& folder : list->unreadable) AddUnreadable(folder.path, folder.message);
    return std::nullopt;
  }

  void ReportSkippedPaths(Console& console) const {
    constexpr std::size_t kNamed = 20;
    for (std::size_t i = 0; i < passed_over_.size() && i < kNamed; ++i) console.Warning(passed_over_[i]);
    if (passed_over_.size() > kNamed) {
      console.Warning(Grouped(passed_over_.size() - kNamed) + " more files and links are ignored");
    }
  }

  [[nodiscard]] std::optional<Error> ReadWorkers() {
    batch_.workers = std::clamp(std::thread::hardware_concurrency(), 1U, kMostWorkers);
    if (!jobs_text_) return std::nullopt;
    const char* end = jobs_text_->data() + jobs_text_->size();
    const auto [rest, code] = std::from_chars(jobs_text_->data(), end, batch_.workers);
    if (code == std::errc() && rest == end && batch_.workers >= 1 && batch_.workers <= kMostWorkers) {
      return std::nullopt;
    }
    return Error{"--jobs is '" + *jobs_text_ + "' but must be a number from 1 to " + std::to_string(kMostWorkers)};
  }

  /// "reports/", on Windows also with the other separator.
  static bool EndsAsFolder(std::string_view path) {
    return path.ends_with('/') || path.ends_with(static_cast<char>(fs::path::preferred_separator));
  }

  /// "-o html=DIR": a page for each capture, and an index of them.
  void TakePagesFromOutputs() {
    constexpr std::string_view kHtml = "html=";
    for (std::string& output : output_.outputs) {
      if (!output.starts_with(kHtml) || output == "html=-") continue;
      batch_.pages = output.substr(kHtml.size());
      output += (EndsAsFolder(batch_.pages) ? "" : "/") + std::string("index.html");
    }
  }

  /// "-o DIR/" and "-o DIR" with a folder that exists can only mean the folder of the reports.
  void TakeFolderFromOutputs() {
    for (auto output = output_.outputs.begin(); output != output_.outputs.end() && !folder_; ++output) {
      if (!EndsAsFolder(*output) && !system::IsFolder(*output)) continue;
      folder_ = *output;
      output_.outputs.erase(output);
      // What stays on standard output is the summary, as if --output-dir had been typed.
      return;
    }
  }

  /// Settings for one configuration file, made once.
  struct Prepared {
    std::shared_ptr<const Settings> settings;
    std::string key;
    std::string problem;  ///< why there are none; empty: there are
  };

  /// True when the command line would be right without the configuration file that was found beside the capture.
  [[nodiscard]] bool IsOfConfigAlone(const std::string& path, const std::string& config) {
    if (config.empty() || options_.config) return false;
    options_.no_config = true;
    const bool right = ResolveSettings(options_, gate_, path) && !baselines_.Load(gate_.baseline.value_or(""));
    options_.no_config = false;
    return right;
  }

  void AddUnreadable(const std::string& path, const std::string& why) {
    BatchJob job;
    job.path = path;
    job.report = (fs::path(*folder_) / ReportName(path)).string();
    job.problem = why;
    jobs_.push_back(std::move(job));
  }

  [[nodiscard]] std::optional<Error> AddJob(std::vector<std::string> files) {
    const std::string& path = files.front();
    const std::string config = options_.config ? *options_.config : FindConfig(path).value_or("");
    auto prepared = prepared_.find(config);
    if (prepared == prepared_.end()) {
      Result<Settings> settings = ResolveSettings(options_, gate_, path);
      std::optional<Error> error = settings ? baselines_.Load(settings->baseline) : settings.error();
      if (error && !IsOfConfigAlone(path, config)) return error;
      if (error) {
        // One folder whose settings are wrong does not keep the others from being checked.
        prepared_.emplace(config, Prepared{nullptr, {}, error->message});
        AddUnreadable(files.front(), error->message);
        return std::nullopt;
      }
      AddFiles(*settings, files_);
      std::string key = SettingsKey(*settings);
      prepared =
          prepared_.emplace(config, Prepared{std::make_shared<const Settings>(std::move(*settings)), key, {}}).first;
    }
    if (!prepared->second.problem.empty()) {
      AddUnreadable(files.front(), prepared->second.problem);
      return std::nullopt;
    }
    BatchJob job;
    for (const std::string& file : files) job.path += (job.path.empty() ? "" : ", ") + file;
    job.report = (fs::path(*folder_) / ReportName(path)).string();
    job.settings = prepared->second.settings;
    job.baseline = baselines_.Find(job.settings->baseline);
    job.origin = OriginOf(files, prepared->second.key);
    job.files = std::move(files);
    jobs_.push_back(std::move(job));
    return std::nullopt;
  }

  [[nodiscard]] report::Digest Collect(std::vector<BatchResult>& results, Console& console) {
    report::Digest digest;
    digest.version = Version();
    digest.rules = RuleCatalogue();
    std::size_t lacking = 0;
    for (std::size_t i = 0; i < results.size(); ++i) {
      if (!results[i].digest) {
        ++digest.not_reached;
        continue;
      }
      const BatchResult& result = results[i];
      if (result.lacks_slave) ++lacking;
      if (result.lacks_slave) console.Warning(jobs_[i].path + " has none of the slaves of --slave");
      for (const std::string& notice : result.notices) console.Warning(notice);
      for (const std::string& slave : result.missing) console.Warning(jobs_[i].path + " has no slave " + slave);
      for (const std::string& slave : result.unmet) {
        console.Warning(jobs_[i].path + " has no slave " + slave +
                        ": the profile and the parameters given for it are not used");
      }
      digest.captures.push_back(std::move(*results[i].digest));
    }
    SortCaptures(digest);
    // An interrupted run does not know.
    lack_slaves_ = lacking > 0 && lacking == digest.captures.size() && digest.not_reached == 0;
    return digest;
  }

  void ReportOutcome(const std::vector<BatchResult>& results, const report::Digest& digest, Console& console) const {
    const auto done = static_cast<std::uint64_t>(std::ranges::count_if(results, &BatchResult::done_before));
    std::string text = Count(digest.captures.size(), "report") + " in " + *folder_;
    if (done > 0) text += ", " + Grouped(done) + " of them done before";
    if (digest.not_reached > 0) {
      text += "; interrupted, " + Grouped(digest.not_reached) + " not checked: go on with --skip-done";
    }
    console.Error(text);
  }

  CaptureOptions options_;
  GateOptions gate_;
  OutputOptions output_;
  BatchOptions batch_;
  std::optional<std::string> jobs_text_;
  std::optional<std::string> folder_;
  std::vector<std::string> paths_;
  std::vector<std::string> passed_over_;
  CommandFiles files_;
  std::map<std::string, Prepared> prepared_;  ///< by configuration file
  BaselineShelf baselines_;
  std::vector<BatchJob> jobs_;
  bool lack_slaves_ = false;
};

}  // namespace

std::unique_ptr<Command> MakeBatchCommand() {
  return std::make_unique<BatchCommand>();
}

}  // namespace ecaudit::cli
