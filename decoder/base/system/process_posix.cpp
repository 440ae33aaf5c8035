#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>
#include <vector>

#include "decoder/base/system/process.h"
#include "decoder/base/system/signals.h"

namespace ecaudit::system {
namespace {

/// As a worker ends that must not go on.
constexpr int kAbandoned = 3;

bool SendAll(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

}  // namespace

struct ParentLink::Parts {
  int fd;
  void* shared;
  sigset_t before;  ///< signals that were blocked when the parent was copied
};

struct Worker::Parts {
  pid_t pid = 0;
  int fd = -1;
  void* shared = nullptr;
  std::size_t shared_bytes = 0;
};

struct WorkerWait::Parts {
  std::vector<pollfd> waiting;
  bool ready = false;
};

ParentLink::ParentLink(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
ParentLink::~ParentLink() = default;

bool ParentLink::Read(std::span<char> out) {
  while (!out.empty()) {
    const ssize_t got = ::read(parts_->fd, out.data(), out.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    out = out.subspan(static_cast<std::size_t>(got));
  }
  return true;
}

bool ParentLink::Write(std::string_view bytes) {
  return SendAll(parts_->fd, bytes);
}

void* ParentLink::shared() const {
  return parts_->shared;
}

void ParentLink::ListenForStop(void (*handler)()) {
  ListenForInterrupt(handler);
  // Ctrl-C reaches all processes of a terminal; the parent forwards it if it is meant.
  std::signal(SIGINT, SIG_IGN);
  ::pthread_sigmask(SIG_SETMASK, &parts_->before, nullptr);
}

const std::optional<std::string>& WorkerTask() {
  static const std::optional<std::string> none;
  return none;
}

std::unique_ptr<ParentLink> TakeParentLink() {
  return nullptr;
}

Worker::Worker() : parts_(std::make_unique<Parts>()) {}
Worker::Worker(Worker&& other) noexcept = default;

Worker::~Worker() {
  if (!parts_) return;
  if (running()) (void)End();
  if (parts_->shared != nullptr) ::munmap(parts_->shared, parts_->shared_bytes);
}

std::optional<std::string> Worker::Start(std::size_t shared, const std::string& /*task*/,
                                         const std::function<void(ParentLink&)>& serve) {
  if (parts_->shared == nullptr) {
    void* memory = ::mmap(nullptr, shared, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) return std::strerror(errno);
    parts_->shared = memory;
    parts_->shared_bytes = shared;
  }
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) return std::strerror(errno);
  const pid_t parent = ::getpid();
  // A stop signal that arrives before the worker can receive it would be lost, so it waits until then.
  sigset_t leave{};
  sigset_t before{};
  sigemptyset(&leave);
  sigaddset(&leave, SIGINT);
  sigaddset(&leave, SIGTERM);
  ::pthread_sigmask(SIG_BLOCK, &leave, &before);
  const pid_t pid = ::fork();
  if (pid != 0) ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  if (pid < 0) {
    const int reason = errno;
    ::close(ends[0]);
    ::close(ends[1]);
    return std::strerror(reason);
  }
  if (pid == 0) {
    ::close(ends[0]);
    // If the parent ends in any way, no worker may continue unnoticed.
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(kAbandoned);
    ParentLink link(std::make_unique<ParentLink::Parts>(ParentLink::Parts{ends[1], parts_->shared, before}));
    serve(link);
    ::_exit(kAbandoned);
  }
  ::close(ends[1]);
  parts_->pid = pid;
  parts_->fd = ends[0];
  return std::nullopt;
}

bool Worker::running() const {
  return parts_->pid > 0;
}

void* Worker::shared() const {
  return parts_->shared;
}

bool Worker::Write(std::string_view bytes) {
  return SendAll(parts_->fd, bytes);
}

std::optional<std::size_t> Worker::Read(std::span<char> out) {
  const ssize_t got = ::recv(parts_->fd, out.data(), out.size(), 0);
  if (got < 0 && errno == EINTR) return 0;
  if (got <= 0) return std::nullopt;
  return static_cast<std::size_t>(got);
}

void Worker::RequestStop() {
  if (running()) ::kill(parts_->pid, SIGTERM);
}

Ending Worker::End() {
  if (parts_->fd >= 0) {
    // Workers that were started later hold this end, too: closing it alone would reach no reader.
    ::shutdown(parts_->fd, SHUT_RDWR);
    ::close(std::exchange(parts_->fd, -1));
  }
  int status = 0;
  while (::waitpid(parts_->pid, &status, 0) < 0 && errno == EINTR) {
  }
  parts_->pid = 0;
  if (WIFSIGNALED(status)) return {true, static_cast<unsigned>(WTERMSIG(status))};
  return {false, static_cast<unsigned>(WEXITSTATUS(status))};
}

WorkerWait::WorkerWait() : parts_(std::make_unique<Parts>()) {}
WorkerWait::~WorkerWait() = default;

void WorkerWait::Add(const Worker& worker) {
  parts_->waiting.push_back({worker.parts_->fd, POLLIN, 0});
}

bool WorkerWait::Wait(int ms) {
  return parts_->ready = ::poll(parts_->waiting.data(), parts_->waiting.size(), ms) > 0;
}

bool WorkerWait::Has(std::size_t index) const {
  return parts_->ready && parts_->waiting[index].revents != 0;
}

}  // namespace ecaudit::system
