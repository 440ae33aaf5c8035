#include "cli/batch_run.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <filesystem>
#include <mutex>
#include <numeric>
#include <thread>
#include <utility>

#include "analyzers/options/options.h"
#include "cli/interrupt.h"
#include "cli/output_file.h"
#include "cli/progress.h"
#include "cli/report/html_writer.h"
#include "cli/report/json_writer.h"
#include "cli/report_folder.h"
#include "cli/version.h"

namespace ecaudit::cli {
namespace {

constexpr auto kProgressStep = std::chrono::milliseconds(100);

class Batch {
 public:
  Batch(std::span<const BatchJob> jobs, const BatchOptions& options, std::vector<BatchResult>& results)
      : jobs_(jobs), options_(options), results_(results), order_(jobs.size()), workers_(options.workers) {
    results_.assign(jobs.size(), {});
    // The longest first, so that no worker is left alone with one at the end.
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::stable_sort(order_.begin(), order_.end(),
                     [&jobs](std::size_t a, std::size_t b) { return jobs[a].origin.bytes > jobs[b].origin.bytes; });
    for (const BatchJob& job : jobs) bytes_to_do_ += job.origin.bytes;
  }

  std::optional<Error> Run(const Console& console) {
    std::vector<std::thread> threads;
    threads.reserve(workers_.size());
    for (WorkerState& state : workers_) threads.emplace_back([this, &state] { Work(state); });
    ShowProgress(console);
    for (std::thread& thread : threads) thread.join();
    if (exception_) std::rethrow_exception(exception_);
    return error_;
  }

 private:
  /// What one worker tells of the capture it reads.
  struct WorkerState {
    std::atomic<std::uint64_t> bytes = 0;
    std::atomic<std::uint64_t> frames = 0;
  };

  [[nodiscard]] bool stopped() const { return stop_ || InterruptFlag(); }

  void Work(WorkerState& state) {
    try {
      while (!stopped()) {
        const std::size_t next = next_++;
        if (next >= order_.size()) break;
        DoJob(order_[next], state);
        ++finished_;
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!exception_) exception_ = std::current_exception();
      stop_ = true;
    }
    const std::lock_guard lock(mutex_);
    ++workers_ended_;
    ended_.notify_all();
  }

  void DoJob(std::size_t index, WorkerState& state) {
    const BatchJob& job = jobs_[index];
    BatchResult& result = results_[index];
    if (options_.skip_done && job.problem.empty()) {
      std::optional<report::CaptureDigest> done = ReadDoneReport(job.report, job.path, job.origin);
      if (done && LacksPage(job)) done.reset();
      if (done) {
        result.digest = std::move(*done);
        result.digest->report = std::filesystem::path(job.report).filename().string();
        result.digest->page = PageOf(job);
        result.done_before = true;
        result.lacks_slave =
            !job.settings->slaves.empty() && result.digest->slaves == 0 && !result.digest->without_ethercat;
        bytes_to_do_ -= job.origin.bytes;
        return;
      }
    }
    report::Report report;
    report.version = Version();
    report.origin = job.origin;
    Result<CheckedCapture> capture = Check(job, options_.wanted, state);
    bytes_done_ += job.origin.bytes;
    if (capture) frames_done_ += capture->report.result.capture.packets;
    state.frames = 0;
    state.bytes = 0;
    if (!capture && InterruptFlag()) {
      return;
    } else if (!capture) {
      report.unreadable.push_back({job.path, capture.error().message});
    } else if (InterruptFlag() && !capture->report.result.capture.complete) {
      return;
    } else {
      result.lacks_slave = capture->lacks_slave;
      result.missing = std::move(capture->missing);
      result.unmet = std::move(capture->unmet);
      report.captures.push_back(std::move(capture->report));
    }
    std::optional<Error> error = CheckOutputPath(job.report);
    if (!error) error = WriteOutputFile(job.report, WriteJson(report));
    const bool page = !error && !options_.pages.empty() && !report.captures.empty();
    if (page) {
      const std::string path = (std::filesystem::path(options_.pages) / PageOf(job)).string();
      error = CheckOutputPath(path);
      if (!error) error = WriteOutputFile(path, WriteHtml(report));
    }
    if (error) {
      const std::lock_guard lock(mutex_);
      if (!error_) error_ = error;
      stop_ = true;
      return;
    }
    result.digest = std::move(DigestOf(report).captures.front());
    if (page) result.digest->page = PageOf(job);
    result.digest->report = std::filesystem::path(job.report).filename().string();
  }

  /// Named as the report is; empty where none is wanted.
  [[nodiscard]] std::string PageOf(const BatchJob& job) const {
    return options_.pages.empty() ? std::string() : std::filesystem::path(job.report).stem().string() + ".html";
  }
  [[nodiscard]] bool LacksPage(const BatchJob& job) const {
    std::error_code ignored;
    return !options_.pages.empty() &&
           !std::filesystem::is_regular_file(std::filesystem::path(options_.pages) / PageOf(job), ignored);
  }

  [[nodiscard]] static Result<CheckedCapture> Check(const BatchJob& job, const WantedExtras& wanted,
                                                    WorkerState& state) {
    if (!job.problem.empty()) return Error{job.problem};
    return CheckCapture(
        job.files, *job.settings, job.baseline, InterruptFlag(),
        [&state](std::uint64_t done, std::uint64_t /*total*/, std::uint64_t frames) {
          state.bytes = done;
          state.frames = frames;
        },
        wanted);
  }

  void ShowProgress(const Console& console) {
    Progress progress(console, "");
    std::unique_lock lock(mutex_);
    while (!ended_.wait_for(lock, kProgressStep, [this] { return workers_ended_ == workers_.size(); })) {
      std::uint64_t bytes = bytes_done_;
      std::uint64_t frames = frames_done_;
      for (const WorkerState& state : workers_) {
        bytes += state.bytes;
        frames += state.frames;
      }
      progress.Relabel(std::to_string(finished_) + " of " + std::to_string(jobs_.size()) + " captures");
      progress.Update(bytes, bytes_to_do_, frames);
    }
  }

  std::span<const BatchJob> jobs_;
  const BatchOptions& options_;
  std::vector<BatchResult>& results_;
  std::vector<std::size_t> order_;  ///< in which jobs are begun
  std::vector<WorkerState> workers_;
  std::atomic<std::size_t> next_ = 0;
  std::atomic<std::size_t> finished_ = 0;
  std::atomic<bool> stop_ = false;
  std::atomic<std::uint64_t> bytes_to_do_ = 0;  ///< of all captures that are not done already
  std::atomic<std::uint64_t> bytes_done_ = 0;
  std::atomic<std::uint64_t> frames_done_ = 0;

  std::mutex mutex_;
  std::condition_variable ended_;
  std::size_t workers_ended_ = 0;  ///< guarded by mutex_, as is all below
  std::exception_ptr exception_;
  std::optional<Error> error_;
};

}  // namespace

std::optional<Error> RunBatch(std::span<const BatchJob> jobs, const BatchOptions& options,
                              std::vector<BatchResult>& results, const Console& console) {
  return Batch(jobs, options, results).Run(console);
}

}  // namespace ecaudit::cli
