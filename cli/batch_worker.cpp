#include "cli/batch_worker.h"

#include <array>
#include <exception>
#include <utility>

#include "cli/crash.h"
#include "cli/exit_status.h"
#include "cli/interrupt.h"
#include "decoder/base/system/signals.h"

namespace ecaudit::cli {
namespace {

constexpr std::size_t kPieceHeaderBytes = 5;

}  // namespace

std::optional<Error> BatchWorker::Start(const std::string& task, const Work& work) {
  const auto serve = [&work](system::ParentLink& parent) { Serve(parent, work); };
  if (auto reason = process_.Start(sizeof(WorkerProgress), task, serve))
    return Error{"cannot start a worker: " + *reason};
  busy_ = false;
  unread_.clear();
  pieces_.clear();
  return std::nullopt;
}

void BatchWorker::Serve(system::ParentLink& parent, const Work& work) {
  constexpr auto kFailed = static_cast<int>(ExitStatus::kInternal);
  ListenForStop(parent);
  LeaveCrashesAlone();
  auto& progress = *static_cast<WorkerProgress*>(parent.shared());
  const Send send = [&parent](WorkerPiece::Kind kind, const std::string& text) {
    std::string piece(1, static_cast<char>(kind));
    for (unsigned shift = 0; shift < 32; shift += 8) piece += static_cast<char>(text.size() >> shift & 0xFFU);
    piece += text;
    if (!parent.Write(piece)) system::EndAtOnce(kFailed);
  };
  std::uint64_t job = 0;
  while (parent.Read({reinterpret_cast<char*>(&job), sizeof(job)})) {
    progress.reached = 0;
    try {
      work(static_cast<std::size_t>(job), progress, send);
    } catch (const std::exception& e) {
      send(WorkerPiece::Kind::kInternal, e.what());
    }
    progress.frames = 0;
    progress.bytes = 0;
    send(WorkerPiece::Kind::kDone, "");
  }
  // What the parent has not written yet is the parent's.
  system::EndAtOnce(static_cast<int>(ExitStatus::kClean));
}

void BatchWorker::Give(std::size_t job) {
  busy_ = true;
  job_ = job;
  pieces_.clear();
  const std::uint64_t number = job;
  // If the worker has ended in the meantime, Read() reports it.
  (void)process_.Write({reinterpret_cast<const char*>(&number), sizeof(number)});
}

BatchWorker::Got BatchWorker::Read() {
  std::array<char, 4096> bytes{};
  const std::optional<std::size_t> got = process_.Read(bytes);
  if (!got) return Got::kEnded;
  unread_.append(bytes.data(), *got);
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

system::Ending BatchWorker::TakeEnding() {
  busy_ = false;
  return process_.End();
}

}  // namespace ecaudit::cli
