/// A process that checks captures one after the other for `batch`, and its messages about each.
///
///   parent -> worker: number of a job, 8 bytes; end of file: no more
///   worker -> parent: for each job some pieces, | kind 1 | length 4 | text |, the last of kind kDone
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "decoder/base/ids.h"
#include "decoder/base/result.h"
#include "decoder/base/system/process.h"

namespace ecaudit::cli {

/// Lies in memory that parent and worker share: how far the worker is.
struct WorkerProgress {
  std::atomic<std::uint64_t> bytes = 0;
  std::atomic<std::uint64_t> frames = 0;
  std::atomic<FrameNo> reached = 0;
};

struct WorkerPiece {
  enum class Kind : std::uint8_t {
    kLacksSlave,  ///< as in CheckedCapture, and so are these three
    kMissing,
    kUnmet,
    kNotice,
    kFrames,       ///< packets of the capture, in decimal
    kCannotWrite,  ///< why its report cannot be written
    kInternal,     ///< an exception: its message
    kInterrupted,  ///< it was not checked
    kDone,         ///< all is reported
  };
  Kind kind = Kind::kDone;
  std::string text;
};

class BatchWorker {
 public:
  using Send = std::function<void(WorkerPiece::Kind, const std::string&)>;
  using Work = std::function<void(std::size_t job, WorkerProgress& progress, const Send& send)>;

  /// Starts a process that calls `work` for each job it is given.
  /// @param task  from which the process finds the jobs where it is no copy of this one (system::WorkerTask())
  [[nodiscard]] std::optional<Error> Start(const std::string& task, const Work& work);
  /// In a worker: does the jobs that its parent gives it.
  [[noreturn]] static void Serve(system::ParentLink& parent, const Work& work);
  [[nodiscard]] bool running() const { return process_.running(); }
  [[nodiscard]] bool busy() const { return busy_; }
  [[nodiscard]] std::size_t job() const { return job_; }
  /// To be waited for while busy().
  [[nodiscard]] const system::Worker& process() const { return process_; }
  [[nodiscard]] const WorkerProgress* progress() const { return static_cast<const WorkerProgress*>(process_.shared()); }

  void Give(std::size_t job);
  /// Asks it to leave the capture at hand. Once is enough.
  void Interrupt() { process_.RequestStop(); }

  enum class Got : std::uint8_t { kNothing, kJobDone, kEnded };
  /// Takes what it has reported so far; to be called when process() has input. Afterwards pieces() is all that was
  /// reported of job().
  [[nodiscard]] Got Read();
  [[nodiscard]] std::vector<WorkerPiece>& pieces() { return pieces_; }
  /// After Got::kEnded: how it ended; the worker can be started again.
  [[nodiscard]] system::Ending TakeEnding();

 private:
  system::Worker process_;
  bool busy_ = false;
  std::size_t job_ = 0;
  std::string unread_;
  std::vector<WorkerPiece> pieces_;
};

}  // namespace ecaudit::cli
