/// Joins the stages of the decoder: FrameSource -> FrameView -> Pairing (TrafficReader has these) -> Network -> Event.
/// One thread: what a packet leads to is published before the next one is read.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "decoder/base/event_sink.h"
#include "decoder/bus/traffic_reader.h"
#include "decoder/capture/frame_source.h"
#include "decoder/track/network.h"
#include "decoder/wire/bridge_frame.h"

namespace ecaudit {

/// Counted while reading; final when Run() has returned.
struct PipelineStatistics {
  std::uint64_t packets = 0;          ///< in the selected range
  std::uint64_t ethercat_frames = 0;  ///< EtherCAT type 1, readable at least in part
  std::uint64_t datagrams = 0;
  std::uint64_t other_packets = 0;
  std::uint64_t malformed_frames = 0;
  std::uint64_t padded_frames = 0;  ///< their EtherCAT length covers more than their datagrams
  std::uint64_t cut_frames = 0;
  FrameRef first_cut;  ///< first and last of the cut frames
  FrameRef last_cut;
  std::uint64_t crc_error_frames = 0;
  FrameRef first_crc_error;
  std::uint64_t cut_before_type = 0;  ///< packets cut so early that it is unknown whether they were EtherCAT
  std::uint64_t other_link = 0;       ///< packets with what looks like EtherCAT, of a link type that is not read
  FrameRef first_other_link;
  std::uint16_t other_link_interface = 0;  ///< the interface of the first of them
  std::uint64_t esl_frames = 0;            ///< frames with a probe's record
  /// Of the first EtherCAT frame: its capture interface, and its sender without the bit that slaves set.
  std::uint16_t ethercat_interface = 0;
  std::uint64_t ethercat_sender = 0;
  FrameRef origin;  ///< first packet of the file with a time stamp, also where it lies before the range
  FrameRef first;   ///< first packet, with a time stamp where there is one
  FrameRef last;
  std::uint64_t without_time = 0;
  std::uint64_t backwards = 0;    ///< packets stamped earlier than their predecessor
  std::uint64_t clock_jumps = 0;  ///< packets before which the clock jumped: another recording, or it was set
  std::int64_t elapsed_ns = 0;    ///< from the first stamp to the last, without what the clock jumped
  std::int64_t time_step_ns = 0;  ///< greatest common divisor of the stamps: the step the clock really makes
  bool stopped = false;           ///< ended early on request
  std::uint64_t frame_bytes = 0;  ///< of EtherCAT frames, and a little for each packet
  /// Reading ended after this packet: handing each broadcast to every slave costs too much (slave_work.h).
  FrameRef overworked;
};

struct PipelineOptions : bus::PacketRange {
  const std::atomic<bool>* stop = nullptr;
  /// Holds the number of the packet at hand, to show where the program ended; null: not wanted.
  std::atomic<FrameNo>* reached = nullptr;
  /// Called about every 65,536 packets: bytes done, bytes in total (0: unknown), packets.
  std::function<void(std::uint64_t, std::uint64_t, std::uint64_t)> progress;
};

/// The clock of the capture was set before this packet, or another recording begins with it: the time between it and
/// the packet before shows nothing. Precedes all else from this packet.
struct ClockSet {
  FrameRef packet;
  TimeNs by = 0;  ///< from the packet before to this one
};

/// Every frame with its direction; precedes the events that follow from it.
struct FrameSeen {
  const wire::FrameView& frame;
  bus::Direction direction = bus::Direction::kForeign;
};

/// A packet of another protocol that switches send; precedes the events of the frames after it.
struct OtherPacket {
  const wire::FrameView& packet;
  wire::BridgeFrame bridge = wire::BridgeFrame::kNone;
};

class Pipeline {
 public:
  /// @param events receives what happens; must outlive the pipeline
  explicit Pipeline(EventSink& events);
  ~Pipeline();
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  /// Reads `source` to its end, its damage or options.stop. Memory does not grow with the length of the capture.
  void Run(capture::FrameSource& source, const PipelineOptions& options = {});

  /// Network::Presume().
  void Presume(std::optional<SlavePos> position, std::optional<StationAddress> station);

  /// Up to the packet at hand.
  [[nodiscard]] const PipelineStatistics& statistics() const;
  [[nodiscard]] const bus::PairingStatistics& pairing() const;
  /// What is known of the slaves; valid during and after Run().
  [[nodiscard]] const track::Network& network() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ecaudit
