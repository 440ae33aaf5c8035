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
#include <span>
#include <string>
#include <sys/types.h>
#include <utility>
#include <vector>

#include "decoder/base/ids.h"
#include "decoder/base/result.h"

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

  BatchWorker() = default;
  BatchWorker(BatchWorker&& other) noexcept;
  BatchWorker& operator=(BatchWorker&&) = delete;
  /// Ends the process, if there is one, and waits for it.
  ~BatchWorker();

  /// Starts a process that calls `work` for each job it is given.
  [[nodiscard]] std::optional<Error> Start(const Work& work);
  [[nodiscard]] bool running() const { return pid_ > 0; }
  [[nodiscard]] bool busy() const { return busy_; }
  [[nodiscard]] std::size_t job() const { return job_; }
  /// To be polled for input while busy().
  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] const WorkerProgress* progress() const { return progress_; }

  void Give(std::size_t job);
  /// Asks it to leave the capture at hand. Once is enough.
  void Interrupt();

  enum class Got : std::uint8_t { kNothing, kJobDone, kEnded };
  /// Takes what it has reported so far; to be called when fd() has input. Afterwards pieces() is all that was reported
  /// of job().
  [[nodiscard]] Got Read();
  [[nodiscard]] std::vector<WorkerPiece>& pieces() { return pieces_; }
  /// After Got::kEnded: how it ended, as waitpid() shows; the worker can be started again.
  [[nodiscard]] int TakeStatus();

 private:
  [[noreturn]] void Serve(int fd, const Work& work);

  pid_t pid_ = 0;
  int fd_ = -1;
  bool busy_ = false;
  std::size_t job_ = 0;
  WorkerProgress* progress_ = nullptr;
  std::string unread_;
  std::vector<WorkerPiece> pieces_;
};

}  // namespace ecaudit::cli
