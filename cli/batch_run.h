/// Checks many captures with several workers. The results do not depend on their number.
///
/// Each worker is a process: a capture that ends one of them, by a bug or for lack of memory, is a capture that failed,
/// and the others are checked nevertheless.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cli/capture_check.h"
#include "cli/capture_options.h"
#include "cli/console.h"
#include "cli/report/digest.h"

namespace ecaudit::cli {

/// One capture of a batch.
struct BatchJob {
  std::vector<std::string> files;            ///< the capture, or the files of one ring buffer
  std::string path;                          ///< as reports name it
  std::string report;                        ///< file for the whole report
  std::shared_ptr<const Settings> settings;  ///< null when there is a problem
  const Baseline* baseline = nullptr;
  report::Origin origin;
  std::string problem;  ///< why it cannot be read, when that is known before
};

struct BatchResult {
  std::optional<report::CaptureDigest> digest;  ///< nothing: not reached
  bool done_before = false;                     ///< taken from its report
  bool lacks_slave = false;
  bool crashed = false;  ///< a bug in ecaudit: the digest states that it could not be read, and why
  std::vector<std::string> missing, unmet, notices;  ///< as in CheckedCapture
};

struct BatchOptions {
  unsigned workers = 1;
  bool skip_done = false;
  WantedExtras wanted;
  std::string pages;  ///< folder for a page (HTML) of each capture; empty: none
};

/// Writes the report of each job and keeps its digest. Ends early when interrupted (interrupt.h), and after a report
/// that cannot be written. A capture that is being read then is not reached: no report covers it in part. To be called
/// while the program has one thread.
///
/// @param results  one for each job, in their order
/// @return why a report could not be written
[[nodiscard]] std::optional<Error> RunBatch(std::span<const BatchJob> jobs, const BatchOptions& options,
                                            std::vector<BatchResult>& results, const Console& console);

// Where a worker is no copy of its parent but the program run once more (system::WorkerTask()).

/// Of what a job is to be made.
struct BatchTask {
  bool is_problem = false;         ///< the texts are a path, and why it cannot be read
  std::vector<std::string> texts;  ///< else the files
};
[[nodiscard]] std::vector<BatchTask> ReadTask(std::string_view text);
/// Does those of the jobs that the parent names.
[[noreturn]] void ServeBatch(std::span<const BatchJob> jobs, const BatchOptions& options);

}  // namespace ecaudit::cli
