/// in: a FrameSource.  out: its packets in the order of the file; a BusSink gets what Pairing finds in them.
///
/// keeps: the first packets, until they show in which direction each sender's frames run.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "decoder/bus/direction.h"
#include "decoder/bus/doubled_packets.h"
#include "decoder/bus/interface_groups.h"
#include "decoder/bus/pairing.h"
#include "decoder/capture/frame_source.h"
#include "decoder/wire/frame_parser.h"

namespace ecaudit::bus {

/// Which packets are looked at.
struct PacketRange {
  std::optional<double> from_s, to_s;           ///< seconds from the first packet
  std::optional<FrameNo> from_frame, to_frame;  ///< inclusive
};

class TrafficReader {
 public:
  /// @param source, range, sink must outlive this
  /// @param stop  null: never; set from outside, reading ends as if the capture did
  TrafficReader(capture::FrameSource& source, const PacketRange& range, const std::atomic<bool>* stop, BusSink& sink)
      : source_(source), range_(range), stop_(stop), sink_(sink) {}
  TrafficReader(const TrafficReader&) = delete;
  TrafficReader& operator=(const TrafficReader&) = delete;

  enum class Got : std::uint8_t {
    kPacket,   ///< packet() is the next one
    kNothing,  ///< one was read that is not in the range, or is kept until the directions are known
    kEnd,      ///< again and again
  };
  /// Reads at most one packet.
  [[nodiscard]] Got Next() noexcept;
  /// Valid until Next().
  [[nodiscard]] const wire::FrameView& packet() const { return *packet_; }
  /// Pairs packet(): the sink gets what follows from it.
  void Pair() noexcept;
  /// The capture has ended, or the caller wants no more: the sink gets what follows from that.
  void Finish() noexcept;

  /// Of packet() and all before it, once it is paired.
  [[nodiscard]] const PairingStatistics& statistics() const { return pairing_ ? pairing_->statistics() : none_; }
  [[nodiscard]] std::uint64_t packets_read() const { return read_; }
  /// First packet of the source with a time stamp, also where it lies before the range; seconds count from there.
  [[nodiscard]] const FrameRef& origin() const { return origin_; }

 private:
  /// A packet kept until the directions are known.
  struct Early {
    wire::FrameView view;
    std::vector<std::uint8_t> bytes;
  };

  [[nodiscard]] Got Read() noexcept;
  [[nodiscard]] bool IsInRange(const capture::CapturedFrame& packet) const noexcept;
  // While the capture begins.
  [[nodiscard, gnu::noinline]] Got LookAhead() noexcept;
  [[gnu::noinline]] void Begin() noexcept;
  [[nodiscard, gnu::noinline]] bool NextEarly() noexcept;
  void AcceptLengths() noexcept;
  void FixDirections() noexcept;
  [[nodiscard]] bool IsOfLaterSection(const wire::FrameView& packet) const noexcept;

  capture::FrameSource& source_;
  const PacketRange& range_;
  const std::atomic<bool>* stop_;
  BusSink& sink_;

  std::uint64_t read_ = 0;
  FrameRef origin_;
  bool ended_ = false;
  capture::CapturedFrame read_packet_;       ///< as the source gave it last
  const wire::FrameView* packet_ = nullptr;  ///< the one that was handed over last
  wire::FrameParser parser_;
  std::vector<Early> early_;  ///< those before next_early_ were handed over
  std::size_t next_early_ = 0;
  std::size_t early_bytes_ = 0;
  std::size_t early_ethercat_ = 0;
  wire::FrameView early_view_;
  std::optional<InterfaceGroups> groups_;  ///< of a capture with several interfaces
  DoubledPackets doubled_;
  DirectionLearner directions_;
  std::optional<Pairing> pairing_;  ///< once the directions are known
  PairingStatistics none_;          ///< before
};

}  // namespace ecaudit::bus
