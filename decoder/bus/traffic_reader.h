/// in: a FrameSource.  out: Traffic: its packets, cut into datagrams, their direction known, both copies paired.
///
/// With Ahead::kYes all that is the work of a thread of its own, while the caller is at work on earlier packets. Memory
/// then: kBatches times kBatchBytes, and what one packet can add.
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "decoder/bus/direction.h"
#include "decoder/bus/doubled_packets.h"
#include "decoder/bus/interface_groups.h"
#include "decoder/bus/pairing.h"
#include "decoder/bus/traffic.h"
#include "decoder/capture/frame_source.h"
#include "decoder/wire/frame_parser.h"

namespace ecaudit::bus {

/// Which packets are looked at.
struct PacketRange {
  std::optional<double> from_s, to_s;           ///< seconds from the first packet
  std::optional<FrameNo> from_frame, to_frame;  ///< inclusive
};

enum class Ahead : std::uint8_t { kNo, kYes };

class TrafficReader {
 public:
  static constexpr std::size_t kBatches = 6;
  static constexpr std::size_t kBatchBytes = std::size_t{1} << 19U;
  /// A thread that wakes costs as much as some hundred packets: one that has to wait does so for several batches.
  static constexpr std::size_t kWakeAfter = kBatches / 2;
  /// Maximum of packets that are read before the caller learns of it, also where none is in the range.
  static constexpr std::uint64_t kNewsEvery = 65536;

  /// @param source, range must outlive this; no other code may use the source until Next() returns null.
  /// @param stop  null: never; set from outside, reading ends as if the capture did
  /// @param ahead  kYes is for sources that do not wait for packets that may never come (a pipe): the destructor waits
  ///   until the packet being read is there. Where no thread can be had, it is as kNo.
  TrafficReader(capture::FrameSource& source, const PacketRange& range, const std::atomic<bool>* stop, Ahead ahead);
  ~TrafficReader();
  TrafficReader(const TrafficReader&) = delete;
  TrafficReader& operator=(const TrafficReader&) = delete;

  /// The next packets, none or more, valid until the next call; null at the end, again and again. With Ahead::kNo and a
  /// source whose size is not known (a pipe), a packet is handed over before the next one is read, once the directions
  /// are known.
  [[nodiscard]] const Traffic* Next() noexcept;
  /// Up to what Next() handed over: packets read and bytes of the file, and its size (0: not known).
  [[nodiscard]] std::uint64_t packets_read() const { return in_hand_ == nullptr ? 0 : in_hand_->packets_read; }
  [[nodiscard]] std::uint64_t bytes_read() const { return in_hand_ == nullptr ? 0 : in_hand_->bytes_read; }
  [[nodiscard]] std::uint64_t bytes_total() const { return bytes_total_; }
  /// First packet of the source with a time stamp, also where it lies before the range; seconds count from there.
  [[nodiscard]] FrameRef origin() const { return in_hand_ == nullptr ? FrameRef{} : in_hand_->origin; }

 private:
  /// Both threads write into theirs all the time: one has no part in the other's cache lines.
  struct alignas(128) Batch {
    Traffic traffic;
    std::uint64_t packets_read = 0;
    std::uint64_t bytes_read = 0;
    FrameRef origin;
    bool last = false;
  };
  /// A packet kept until the directions are known.
  struct Early {
    wire::FrameView view;
    std::vector<std::uint8_t> bytes;
  };
  enum class Got : std::uint8_t { kPacket, kOutside, kEnd };

  void ReadAll() noexcept;
  void Fill(Batch& batch, std::size_t most_packets) noexcept;
  bool LearnDirections(std::uint64_t until) noexcept;
  void FixDirections() noexcept;
  [[nodiscard]] bool IsOfLaterSection(const wire::FrameView& packet) const noexcept;
  [[nodiscard]] Got Read(capture::CapturedFrame& packet) noexcept;
  void Push(const wire::FrameView& packet) noexcept;

  capture::FrameSource& source_;
  const PacketRange& range_;
  const std::atomic<bool>* stop_;
  const std::uint64_t bytes_total_;

  // Of the thread that reads.
  std::uint64_t read_ = 0;
  FrameRef origin_;
  bool ended_ = false;
  std::vector<Early> early_;
  std::size_t early_bytes_ = 0;
  std::size_t early_ethercat_ = 0;
  wire::FrameParser parser_;
  std::optional<InterfaceGroups> groups_;  ///< of a capture with several interfaces
  DoubledPackets doubled_;
  DirectionLearner directions_;
  TrafficRecorder recorder_;
  std::optional<Pairing> pairing_;

  std::array<Batch, kBatches> batches_;
  Batch* in_hand_ = nullptr;  ///< of the caller

  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t filled_ = 0;  ///< batches ever filled; the caller has taken `taken_` of them and given back all but one
  std::uint64_t taken_ = 0;
  bool all_filled_ = false;  ///< there will be no more
  std::atomic<bool> abandoned_ = false;
  bool threaded_ = false;
  std::thread thread_;
};

}  // namespace ecaudit::bus
