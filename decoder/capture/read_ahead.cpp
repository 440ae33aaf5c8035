#include "decoder/capture/read_ahead.h"

#include <system_error>

namespace ecaudit::capture {

ReadAhead::ReadAhead(FrameSource& source) : source_(source), bytes_total_(source.bytes_total()) {
  try {
    thread_ = std::thread([this] { Read(); });
    threaded_ = true;
  } catch (const std::system_error&) {
    // As many threads as the system allows are at work: Next() reads itself.
  }
}

ReadAhead::~ReadAhead() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

ReadStatus ReadAhead::NextBatch(CapturedFrame& frame) noexcept {
  if (!threaded_) {
    const ReadStatus status = source_.Next(frame);
    nothing_.bytes_read = source_.bytes_read();
    return status;
  }
  if (in_hand_->end != ReadStatus::kFrame) return in_hand_->end;
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return filled_ > taken_; });
    in_hand_ = &batches_[taken_++ % kBatches];
  }
  changed_.notify_all();
  next_ = 0;
  if (in_hand_->entries.empty()) return in_hand_->end;
  return Next(frame);
}

void ReadAhead::Read() noexcept {
  for (std::uint64_t n = 0;; ++n) {
    {
      // The batch in the caller's hand is not given back yet.
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return stop_ || n + 1 < taken_ + kBatches; });
      if (stop_) return;
    }
    Batch& batch = batches_[n % kBatches];
    Fill(batch);
    {
      const std::lock_guard lock(mutex_);
      filled_ = n + 1;
    }
    changed_.notify_all();
    if (batch.end != ReadStatus::kFrame) return;
  }
}

void ReadAhead::Fill(Batch& batch) noexcept {
  batch.entries.clear();
  batch.bytes.clear();
  CapturedFrame frame;
  while (batch.bytes.size() < kBatchBytes && !stop_.load(std::memory_order_relaxed)) {
    batch.end = source_.Next(frame);
    if (batch.end != ReadStatus::kFrame) break;
    batch.entries.push_back({frame, batch.bytes.size(), frame.bytes.size()});
    batch.bytes.insert(batch.bytes.end(), frame.bytes.begin(), frame.bytes.end());
    if (batch.entries.size() * sizeof(Entry) >= 2 * kBatchBytes) break;  // packets without bytes
  }
  batch.bytes_read = source_.bytes_read();
}

}  // namespace ecaudit::capture
