/// in: a FrameSource.  out: the same packets, read by a thread of their own while the caller works on earlier ones.
///
/// Reading and decompressing go on while the analysis is at work. Memory: kBatches batches, each of kBatchBytes of
/// packets and one packet more, and of at most twice kBatchBytes for what is known of them besides.
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

#include "decoder/capture/frame_source.h"

namespace ecaudit::capture {

class ReadAhead final : public FrameSource {
 public:
  static constexpr std::size_t kBatches = 3;
  static constexpr std::size_t kBatchBytes = std::size_t{512} << 10U;  ///< large: a thread that wakes costs

  /// @param source must outlive this, and must be read by nobody else meanwhile. It shall not wait for packets that may
  ///   never come (a pipe): the destructor waits until the packet being read is there.
  explicit ReadAhead(FrameSource& source);
  ~ReadAhead() override;

  /// Where no thread can be had, reads `source` itself.
  [[nodiscard]] ReadStatus Next(CapturedFrame& frame) noexcept override {
    if (next_ < in_hand_->entries.size()) {
      const Entry& entry = in_hand_->entries[next_++];
      Prefetch();
      frame = entry.frame;
      frame.bytes = ByteSpan(in_hand_->bytes).subspan(entry.offset, entry.length);
      return ReadStatus::kFrame;
    }
    return NextBatch(frame);
  }
  /// Complete when Next() has returned something else than kFrame; to be asked for only then.
  [[nodiscard]] const CaptureInfo& info() const noexcept override { return source_.info(); }
  /// Up to the packets that Next() hands out now.
  [[nodiscard]] std::uint64_t bytes_read() const noexcept override { return in_hand_->bytes_read; }
  [[nodiscard]] std::uint64_t bytes_total() const noexcept override { return bytes_total_; }

 private:
  struct Entry {
    CapturedFrame frame;
    std::size_t offset = 0;  ///< of its bytes in those of the batch, which move while it is filled
    std::size_t length = 0;
  };
  struct Batch {
    std::vector<Entry> entries;
    std::vector<std::uint8_t> bytes;
    std::uint64_t bytes_read = 0;
    ReadStatus end = ReadStatus::kFrame;  ///< what came behind the last packet
  };

  /// The packets lie in the cache of the other thread's processor: they are asked for while the ones before are at
  /// work.
  void Prefetch() const {
    constexpr std::size_t kAhead = 3;
    constexpr std::size_t kLine = 64;
    if (next_ + kAhead >= in_hand_->entries.size()) return;
    const Entry& later = in_hand_->entries[next_ + kAhead];
    __builtin_prefetch(&later + kAhead);
    const std::uint8_t* bytes = in_hand_->bytes.data() + later.offset;
    for (std::size_t at = 0; at < later.length && at < 8 * kLine; at += kLine) __builtin_prefetch(bytes + at);
  }
  [[nodiscard]] ReadStatus NextBatch(CapturedFrame& frame) noexcept;
  void Read() noexcept;
  void Fill(Batch& batch) noexcept;

  FrameSource& source_;
  const std::uint64_t bytes_total_;
  std::array<Batch, kBatches> batches_;
  Batch nothing_;
  Batch* in_hand_ = &nothing_;  ///< of the caller
  std::size_t next_ = 0;        ///< entry in it
  bool threaded_ = false;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t filled_ = 0;  ///< batches ever filled; the caller has taken `taken_` of them and given back all but one
  std::uint64_t taken_ = 0;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace ecaudit::capture
