#include "cli/batch_worker.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>
#include <fcntl.h>
#include <new>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "cli/crash.h"
#include "cli/exit_status.h"
#include "cli/interrupt.h"

namespace ecaudit::cli {
namespace {

constexpr std::size_t kPieceHeaderBytes = 5;

bool WriteAll(int fd, const char* bytes, std::size_t count) {
  while (count > 0) {
    const ssize_t written = ::send(fd, bytes, count, MSG_NOSIGNAL);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes += written;
    count -= static_cast<std::size_t>(written);
  }
  return true;
}

bool ReadAll(int fd, char* bytes, std::size_t count) {
  while (count > 0) {
    const ssize_t got = ::read(fd, bytes, count);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    bytes += got;
    count -= static_cast<std::size_t>(got);
  }
  return true;
}

}  // namespace

BatchWorker::BatchWorker(BatchWorker&& other) noexcept
    : pid_(std::exchange(other.pid_, 0)),
      fd_(std::exchange(other.fd_, -1)),
      busy_(other.busy_),
      job_(other.job_),
      progress_(std::exchange(other.progress_, nullptr)),
      unread_(std::move(other.unread_)),
      pieces_(std::move(other.pieces_)) {}

BatchWorker::~BatchWorker() {
  if (pid_ > 0) (void)TakeStatus();
  if (progress_ != nullptr) ::munmap(progress_, sizeof(WorkerProgress));
}

std::optional<Error> BatchWorker::Start(const Work& work) {
  const auto failed = [](int reason) { return Error{"cannot start a worker: " + std::string(std::strerror(reason))}; };
  if (progress_ == nullptr) {
    void* shared = ::mmap(nullptr, sizeof(WorkerProgress), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED) return failed(errno);
    progress_ = new (shared) WorkerProgress;
  }
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) return failed(errno);
  const pid_t parent = ::getpid();
  // A stop signal that arrives before the worker can receive it would be lost, so it waits until then.
  sigset_t leave{};
  sigset_t before{};
  sigemptyset(&leave);
  sigaddset(&leave, SIGINT);
  sigaddset(&leave, SIGTERM);
  ::pthread_sigmask(SIG_BLOCK, &leave, &before);
  pid_ = ::fork();
  if (pid_ != 0) ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  if (pid_ < 0) {
    const int reason = errno;
    pid_ = 0;
    ::close(ends[0]);
    ::close(ends[1]);
    return failed(reason);
  }
  if (pid_ == 0) {
    ::close(ends[0]);
    // If the parent ends in any way, no worker may continue unnoticed.
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(static_cast<int>(ExitStatus::kInternal));
    // Ctrl-C reaches all processes of a terminal; the parent forwards it if it is meant.
    ListenForInterrupt();
    std::signal(SIGINT, SIG_IGN);
    ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
    Serve(ends[1], work);
  }
  ::close(ends[1]);
  fd_ = ends[0];
  busy_ = false;
  unread_.clear();
  pieces_.clear();
  return std::nullopt;
}

void BatchWorker::Serve(int fd, const Work& work) {
  LeaveCrashesAlone();
  const Send send = [fd](WorkerPiece::Kind kind, const std::string& text) {
    std::string piece(1, static_cast<char>(kind));
    for (unsigned shift = 0; shift < 32; shift += 8) piece += static_cast<char>(text.size() >> shift & 0xFFU);
    piece += text;
    if (!WriteAll(fd, piece.data(), piece.size())) ::_exit(static_cast<int>(ExitStatus::kInternal));
  };
  std::uint64_t job = 0;
  while (ReadAll(fd, reinterpret_cast<char*>(&job), sizeof(job))) {
    progress_->reached = 0;
    try {
      work(static_cast<std::size_t>(job), *progress_, send);
    } catch (const std::exception& e) {
      send(WorkerPiece::Kind::kInternal, e.what());
    }
    progress_->frames = 0;
    progress_->bytes = 0;
    send(WorkerPiece::Kind::kDone, "");
  }
  // What the parent has not written yet is the parent's.
  ::_exit(static_cast<int>(ExitStatus::kClean));
}

void BatchWorker::Give(std::size_t job) {
  busy_ = true;
  job_ = job;
  pieces_.clear();
  const std::uint64_t number = job;
  // If the worker has ended in the meantime, Read() reports it.
  (void)WriteAll(fd_, reinterpret_cast<const char*>(&number), sizeof(number));
}

void BatchWorker::Interrupt() {
  if (pid_ > 0) ::kill(pid_, SIGTERM);
}

BatchWorker::Got BatchWorker::Read() {
  std::array<char, 4096> bytes{};
  const ssize_t got = ::recv(fd_, bytes.data(), bytes.size(), 0);
  if (got < 0 && errno == EINTR) return Got::kNothing;
  if (got <= 0) return Got::kEnded;
  unread_.append(bytes.data(), static_cast<std::size_t>(got));
  while (unread_.size() >= kPieceHeaderBytes) {
    std::size_t length = 0;
    for (std::size_t i = 4; i > 0; --i) length = length << 8U | static_cast<unsigned char>(unread_[i]);
    if (unread_.size() - kPieceHeaderBytes < length) break;
    WorkerPiece piece{static_cast<WorkerPiece::Kind>(unread_[0]), unread_.substr(kPieceHeaderBytes, length)};
    unread_.erase(0, kPieceHeaderBytes + length);
    if (piece.kind == WorkerPiece::Kind::kDone) {
      busy_ = false;
      return Got::kJobDone;
    }
    pieces_.push_back(std::move(piece));
  }
  return Got::kNothing;
}

int BatchWorker::TakeStatus() {
  if (fd_ >= 0) {
    // Workers that were started later hold this end, too: closing it alone would reach no reader.
    ::shutdown(fd_, SHUT_RDWR);
    ::close(std::exchange(fd_, -1));
  }
  int status = 0;
  while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = 0;
  busy_ = false;
  return status;
}

}  // namespace ecaudit::cli
