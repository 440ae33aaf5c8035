/// Processes that work for this one: a bug that ends one of them ends nothing else.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace ecaudit::system {

/// The worker's way to its parent. If the parent ends in any way, the worker is ended, too.
class ParentLink {
 public:
  struct Parts;
  explicit ParentLink(std::unique_ptr<Parts> parts);
  ~ParentLink();
  ParentLink(const ParentLink&) = delete;
  ParentLink& operator=(const ParentLink&) = delete;

  /// Fills `out`; false when the parent sends no more.
  [[nodiscard]] bool Read(std::span<char> out);
  [[nodiscard]] bool Write(std::string_view bytes);
  /// Memory that parent and worker share; no other process sees it.
  [[nodiscard]] void* shared() const;
  /// From now on Worker::RequestStop() calls `handler`, also one that came before; Ctrl-C does not: it is the parent's.
  void ListenForStop(void (*handler)());

 private:
  std::unique_ptr<Parts> parts_;
};

/// Where workers run the program once more: the text that the parent gave to Worker::Start(). Nothing in a parent, and
/// where workers are copies of their parent.
[[nodiscard]] const std::optional<std::string>& WorkerTask();
/// The way to the parent of a process that has a WorkerTask(); to be called once.
[[nodiscard]] std::unique_ptr<ParentLink> TakeParentLink();

struct Ending {
  bool crashed = false;
  unsigned number = 0;  ///< of the crash (signals.h), else the exit status
};

class Worker {
 public:
  struct Parts;
  Worker();
  Worker(Worker&& other) noexcept;
  Worker& operator=(Worker&&) = delete;
  /// Ends the process, if there is one, and waits for it.
  ~Worker();

  /// Starts a process. To be called while the program has one thread. Where the system copies processes, the copy calls
  /// `serve`, which must not return; elsewhere the program runs once more with the same arguments, and finds `task` as
  /// WorkerTask().
  /// @param shared  bytes of memory that both see, zero at first; kept when a worker is started again
  /// @return why there is no process
  [[nodiscard]] std::optional<std::string> Start(std::size_t shared, const std::string& task,
                                                 const std::function<void(ParentLink&)>& serve);
  [[nodiscard]] bool running() const;
  [[nodiscard]] void* shared() const;
  [[nodiscard]] bool Write(std::string_view bytes);
  /// What has come so far; nothing once the worker has ended.
  [[nodiscard]] std::optional<std::size_t> Read(std::span<char> out);
  void RequestStop();
  /// Ends it if it still runs.
  Ending End();

 private:
  friend class WorkerWait;
  std::unique_ptr<Parts> parts_;
};

/// Waits for messages of several workers.
class WorkerWait {
 public:
  void Add(const Worker& worker);
  /// @return whether any has one, or has ended, within `ms`; false also when a signal came
  [[nodiscard]] bool Wait(int ms);
  /// By the order of Add().
  [[nodiscard]] bool Has(std::size_t index) const;

  struct Parts;
  WorkerWait();
  ~WorkerWait();
  WorkerWait(const WorkerWait&) = delete;
  WorkerWait& operator=(const WorkerWait&) = delete;

 private:
  std::unique_ptr<Parts> parts_;
};

}  // namespace ecaudit::system
