#include "cli/batch_run.h"

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <utility>

#include "analyzers/options/options.h"
#include "cli/batch_worker.h"
#include "cli/crash.h"
#include "cli/interrupt.h"
#include "cli/output_file.h"
#include "cli/progress.h"
#include "cli/report/html_writer.h"
#include "cli/report/json_writer.h"
#include "cli/report_folder.h"
#include "cli/version.h"
#include "decoder/base/system/files.h"

namespace ecaudit::cli {
namespace {

using PieceKind = WorkerPiece::Kind;

constexpr int kProgressStepMs = 100;

report::Report ReportOf(const BatchJob& job) {
  report::Report report;
  report.version = Version();
  report.origin = job.origin;
  return report;
}

std::optional<Error> WriteReport(const BatchJob& job, const report::Report& report) {
  // Whatever stands there under the name of a report, it leads nowhere else.
  if (auto error = CheckOutputPath(job.report, Links::kReplace)) return error;
  return WriteOutputPieces(
      job.report, [&](const report::TextSink& sink) { WriteJson(report, sink); }, Links::kReplace);
}

/// The page of a report is named as it; empty where none is wanted.
std::string PageOf(const BatchJob& job, const BatchOptions& options) {
  return options.pages.empty() ? std::string() : std::filesystem::path(job.report).stem().string() + ".html";
}

std::string PathOfPage(const BatchJob& job, const BatchOptions& options) {
  return (std::filesystem::path(options.pages) / PageOf(job, options)).string();
}

Result<CheckedCapture> Check(const BatchJob& job, const WantedExtras& wanted, WorkerProgress& progress) {
  if (!job.problem.empty()) return Error{job.problem};
  return CheckCapture(
      job.files, *job.settings, job.baseline, InterruptFlag(),
      [&progress](std::uint64_t done, std::uint64_t /*total*/, std::uint64_t frames) {
        progress.bytes = done;
        progress.frames = frames;
      },
      wanted, &progress.reached);
}

/// In the worker.
void DoJob(const BatchJob& job, const BatchOptions& options, WorkerProgress& progress, const BatchWorker::Send& send) {
  report::Report report = ReportOf(job);
  Result<CheckedCapture> capture = Check(job, options.wanted, progress);
  if (!capture && InterruptFlag()) return send(PieceKind::kInterrupted, "");
  if (!capture) {
    report.unreadable.push_back({job.path, capture.error().message});
  } else if (InterruptFlag() && !capture->report.result.capture.complete) {
    return send(PieceKind::kInterrupted, "");
  } else {
    send(PieceKind::kFrames, std::to_string(capture->report.result.capture.packets));
    if (capture->lacks_slave) send(PieceKind::kLacksSlave, "");
    for (const std::string& slave : capture->missing) send(PieceKind::kMissing, slave);
    for (const std::string& slave : capture->unmet) send(PieceKind::kUnmet, slave);
    for (const std::string& notice : capture->notices) send(PieceKind::kNotice, notice);
    report.captures.push_back(std::move(capture->report));
  }
  auto error = WriteReport(job, report);
  if (!error && !options.pages.empty() && !report.captures.empty()) {
    const std::string path = PathOfPage(job, options);
    error = CheckOutputPath(path, Links::kReplace);
    if (!error) error = WriteOutputFile(path, WriteHtml(report), Links::kReplace);
  }
  if (error) send(PieceKind::kCannotWrite, error->message);
}

BatchWorker::Work WorkOf(std::span<const BatchJob> jobs, const BatchOptions& options) {
  return [jobs, &options](std::size_t number, WorkerProgress& progress, const BatchWorker::Send& send) {
    DoJob(jobs[number], options, progress, send);
  };
}

// The jobs of a worker that runs the program once more: one line each, F (files) or P (path and problem), with a zero
// byte between the texts.

std::string WriteTask(std::span<const BatchJob> jobs) {
  std::string task;
  for (const BatchJob& job : jobs) {
    const bool known = job.problem.empty();
    task += known ? 'F' : 'P';
    for (const std::string& file : known ? job.files : std::vector{job.path, job.problem}) {
      task.append(file).push_back('\0');
    }
    task += '\n';
  }
  return task;
}

class Batch {
 public:
  Batch(std::span<const BatchJob> jobs, const BatchOptions& options, std::vector<BatchResult>& results)
      : jobs_(jobs), options_(options), results_(results), order_(jobs.size()) {
    results_.assign(jobs.size(), {});
    // The longest first, so that no worker is left alone with one at the end.
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::ranges::stable_sort(
        order_, [&jobs](std::size_t a, std::size_t b) { return jobs[a].origin.bytes > jobs[b].origin.bytes; });
    for (const BatchJob& job : jobs) bytes_to_do_ += job.origin.bytes;
    workers_.reserve(options.workers);
    for (std::size_t i = 0; i < std::min<std::size_t>(options.workers, jobs.size()); ++i) workers_.emplace_back();
  }

  std::optional<Error> Run(const Console& console) {
    Progress progress(console, "");
    for (;;) {
      for (BatchWorker& worker : workers_) {
        if (!worker.busy()) GiveNext(worker);
      }
      if (std::ranges::none_of(workers_, [](const BatchWorker& worker) { return worker.busy(); })) break;
      WaitAndRead();
      Show(progress);
    }
    return error_;
  }

 private:
  [[nodiscard]] bool stopped() const { return error_.has_value() || InterruptFlag(); }

  void GiveNext(BatchWorker& worker) {
    while (!stopped() && next_ < order_.size()) {
      const std::size_t job = order_[next_++];
      if (TakeDone(job)) {
        ++finished_;
        continue;
      }
      if (!worker.running()) {
        error_ = worker.Start(WriteTask(jobs_), WorkOf(jobs_, options_));
        if (error_) return;
      }
      worker.Give(job);
      return;
    }
  }

  /// True when the job is done, by its report.
  bool TakeDone(std::size_t index) {
    const BatchJob& job = jobs_[index];
    if (!options_.skip_done || !job.problem.empty()) return false;
    std::optional<report::CaptureDigest> done = ReadDoneReport(job.report, job.path, job.origin);
    if (!done || LacksPage(job)) return false;
    BatchResult& result = results_[index];
    result.digest = std::move(*done);
    result.digest->report = std::filesystem::path(job.report).filename().string();
    NamePage(job, *result.digest);
    result.done_before = true;
    result.lacks_slave =
        !job.settings->slaves.empty() && result.digest->slaves == 0 && !result.digest->without_ethercat;
    bytes_to_do_ -= job.origin.bytes;
    return true;
  }

  void WaitAndRead() {
    system::WorkerWait waiting;
    std::vector<BatchWorker*> busy;
    for (BatchWorker& worker : workers_) {
      if (!worker.busy()) continue;
      waiting.Add(worker.process());
      busy.push_back(&worker);
    }
    const bool ready = waiting.Wait(kProgressStepMs);
    if (InterruptFlag() && !std::exchange(stop_sent_, true)) {
      for (BatchWorker* worker : busy) worker->Interrupt();
    }
    for (std::size_t i = 0; ready && i < busy.size(); ++i) {
      if (!waiting.Has(i)) continue;
      BatchWorker& worker = *busy[i];
      const BatchWorker::Got got = worker.Read();
      if (got == BatchWorker::Got::kNothing) continue;
      if (got == BatchWorker::Got::kJobDone) {
        Take(worker.job(), worker.pieces());
      } else {
        const std::size_t job = worker.job();
        const FrameNo reached = worker.progress()->reached;
        const system::Ending ending = worker.TakeEnding();
        // A second signal ends everything.
        if (!InterruptFlag()) Crashed(job, HowItEnded(ending, reached));
      }
      bytes_done_ += jobs_[worker.job()].origin.bytes;
      ++finished_;
    }
  }

  static std::string HowItEnded(const system::Ending& ending, FrameNo reached) {
    if (ending.crashed) return DescribeCrash(ending.number, reached);
    return "ecaudit " + std::string(Version()) + " ended with status " + std::to_string(ending.number);
  }

  /// Messages of the worker about a job, and its report.
  void Take(std::size_t index, std::vector<WorkerPiece>& pieces) {
    BatchResult& result = results_[index];
    for (WorkerPiece& piece : pieces) {
      switch (piece.kind) {
        case PieceKind::kLacksSlave:
          result.lacks_slave = true;
          break;
        case PieceKind::kMissing:
          result.missing.push_back(std::move(piece.text));
          break;
        case PieceKind::kUnmet:
          result.unmet.push_back(std::move(piece.text));
          break;
        case PieceKind::kNotice:
          result.notices.push_back(std::move(piece.text));
          break;
        case PieceKind::kFrames:
          frames_done_ += std::stoull(piece.text);
          break;
        case PieceKind::kCannotWrite:
          if (!error_) error_ = Error{piece.text};
          return;
        case PieceKind::kInternal:
          return Crashed(index, piece.text);
        case PieceKind::kInterrupted:
        case PieceKind::kDone:
          return;
      }
    }
    TakeReport(index);
  }

  void TakeReport(std::size_t index) {
    const BatchJob& job = jobs_[index];
    Result<report::CaptureDigest> digest = ReadOwnReport(job.report);
    if (!digest) return Crashed(index, "its report is not whole: " + digest.error().message);
    digest->report = std::filesystem::path(job.report).filename().string();
    if (digest->unreadable.empty()) NamePage(job, *digest);
    results_[index].digest = std::move(*digest);
  }

  /// The capture has ended its worker: that is what its report states.
  void Crashed(std::size_t index, const std::string& how) {
    const BatchJob& job = jobs_[index];
    results_[index].crashed = true;
    report::Report report = ReportOf(job);
    report.unreadable.push_back({job.path, job.path + ": internal error: " + how + "; " + kPleaseReport});
    if (auto error = WriteReport(job, report)) {
      if (!error_) error_ = error;
      return;
    }
    if (Result<report::CaptureDigest> digest = ReadOwnReport(job.report)) {
      digest->report = std::filesystem::path(job.report).filename().string();
      results_[index].digest = std::move(*digest);
    }
  }

  [[nodiscard]] bool LacksPage(const BatchJob& job) const {
    return !options_.pages.empty() && !system::IsFile(PathOfPage(job, options_));
  }
  /// Its page belongs to a capture that was read.
  void NamePage(const BatchJob& job, report::CaptureDigest& digest) const {
    if (!LacksPage(job)) digest.page = PageOf(job, options_);
  }

  void Show(Progress& progress) const {
    std::uint64_t bytes = bytes_done_;
    std::uint64_t frames = frames_done_;
    for (const BatchWorker& worker : workers_) {
      if (!worker.busy()) continue;
      bytes += worker.progress()->bytes;
      frames += worker.progress()->frames;
    }
    progress.Relabel(std::to_string(finished_) + " of " + std::to_string(jobs_.size()) + " captures");
    progress.Update(bytes, bytes_to_do_, frames);
  }

  std::span<const BatchJob> jobs_;
  const BatchOptions& options_;
  std::vector<BatchResult>& results_;
  std::vector<std::size_t> order_;  ///< in which jobs are begun
  std::vector<BatchWorker> workers_;
  std::size_t next_ = 0;
  std::size_t finished_ = 0;
  bool stop_sent_ = false;
  std::uint64_t bytes_to_do_ = 0;  ///< of all captures that are not done already
  std::uint64_t bytes_done_ = 0;
  std::uint64_t frames_done_ = 0;
  std::optional<Error> error_;
};

}  // namespace

std::optional<Error> RunBatch(std::span<const BatchJob> jobs, const BatchOptions& options,
                              std::vector<BatchResult>& results, const Console& console) {
  return Batch(jobs, options, results).Run(console);
}

std::vector<BatchTask> ReadTask(std::string_view text) {
  std::vector<BatchTask> tasks;
  while (!text.empty()) {
    const std::size_t line = std::min(text.find('\n'), text.size());
    BatchTask& task = tasks.emplace_back();
    task.is_problem = text.front() == 'P';
    for (std::size_t at = 1; at < line;) {
      const std::size_t end = std::min(text.find('\0', at), line);
      task.texts.emplace_back(text.substr(at, end - at));
      at = end + 1;
    }
    text.remove_prefix(std::min(line + 1, text.size()));
  }
  return tasks;
}

void ServeBatch(std::span<const BatchJob> jobs, const BatchOptions& options) {
  const std::unique_ptr<system::ParentLink> parent = system::TakeParentLink();
  BatchWorker::Serve(*parent, WorkOf(jobs, options));
}

}  // namespace ecaudit::cli
