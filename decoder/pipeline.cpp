#include "decoder/pipeline.h"

#include <numeric>

#include "decoder/base/time.h"
#include "decoder/bus/ring_join.h"

namespace ecaudit {
namespace {

/// What a packet takes in a file at least, besides its frame.
constexpr std::uint64_t kRecordBytes = 16;
constexpr std::uint64_t kProgressEvery = 65536;

/// Passes everything on to the network; frames are published first.
class Fork final : public bus::BusSink {
 public:
  Fork(track::Network& network, EventSink& events) : network_(network), events_(events), ends_(network) {}
  void OnFrame(const wire::FrameView& frame, bus::Direction direction) override {
    ends_.Pass(frame.ref().number);
    events_.Publish(FrameSeen{frame, direction});
  }
  void OnOther(const wire::FrameView& packet, wire::BridgeFrame bridge) {
    events_.Publish(OtherPacket{packet, bridge});
  }
  void OnSent(const wire::FrameView& frame) override { network_.OnSent(frame); }
  void OnTransaction(const bus::BusTransaction& transaction) override { ends_.Push(transaction); }
  void OnDoubtful(const wire::FrameView& sent) override { network_.OnDoubtful(sent); }
  void OnLost(const wire::FrameView& sent, bus::Loss loss, bool followed_by_other) override {
    network_.OnLost(sent, loss, followed_by_other);
  }
  void OnDuplicate(const wire::FrameView& returned, FrameNo original) override {
    network_.OnDuplicate(returned, original);
  }
  void OnRepeated(const bus::RepeatedFrame& repeated) override { network_.OnRepeated(repeated); }
  void OnUnusable(const wire::FrameView& frame, bus::Unusable reason, bool own_master) override {
    network_.OnUnusable(frame, reason, own_master);
  }
  void Finish() { ends_.Flush(); }

 private:
  track::Network& network_;
  EventSink& events_;
  bus::RingJoin ends_;
};

}  // namespace

class Pipeline::Impl {
 public:
  explicit Impl(EventSink& events) : network_(events), events_(events), fork_(network_, events) {}

  void Run(capture::FrameSource& source, const PipelineOptions& options) {
    using Got = bus::TrafficReader::Got;
    bus::TrafficReader reader(source, options, options.stop, fork_);
    reader_ = &reader;
    std::uint64_t next_progress = kProgressEvery;
    for (Got got = reader.Next(); got != Got::kEnd && !statistics_.overworked.seen(); got = reader.Next()) {
      if (got == Got::kPacket) Take(reader, options);
      if (options.progress && reader.packets_read() >= next_progress) {
        options.progress(source.bytes_read(), source.bytes_total(), reader.packets_read());
        next_progress = reader.packets_read() + kProgressEvery;
      }
    }
    if (!statistics_.overworked.seen()) reader.Finish();
    statistics_.origin = reader.origin();
    // A source that waited for packets ends on request, too.
    statistics_.stopped = options.stop != nullptr && options.stop->load(std::memory_order_relaxed);
    fork_.Finish();
    network_.Finish();
    pairing_ = reader.statistics();
    reader_ = nullptr;
  }

  [[nodiscard]] const bus::PairingStatistics& Pairing() const {
    return reader_ != nullptr ? reader_->statistics() : pairing_;
  }

  track::Network network_;
  PipelineStatistics statistics_;

 private:
  EventSink& events_;
  Fork fork_;
  const bus::TrafficReader* reader_ = nullptr;  ///< while reading
  bus::PairingStatistics pairing_;              ///< after that

  void Take(bus::TrafficReader& reader, const PipelineOptions& options) {
    const wire::FrameView& packet = reader.packet();
    if (options.reached != nullptr) options.reached->store(packet.ref().number, std::memory_order_relaxed);
    Count(packet);
    reader.Pair();
    if (network_.overworked()) statistics_.overworked = statistics_.last;
  }

  void Count(const wire::FrameView& packet) {
    CountTime(packet.ref());
    statistics_.frame_bytes += kRecordBytes + packet.used_bytes();
    switch (packet.kind()) {
      case wire::FrameKind::kOther:
        ++statistics_.other_packets;
        if (const wire::BridgeFrame bridge = wire::BridgeFrameOf(packet.bytes()); bridge != wire::BridgeFrame::kNone) {
          fork_.OnOther(packet, bridge);
        }
        if (packet.cut_before_type()) ++statistics_.cut_before_type;
        if (packet.other_link() && statistics_.other_link++ == 0) {
          statistics_.first_other_link = packet.ref();
          statistics_.other_link_interface = packet.interface_index();
        }
        return;
      case wire::FrameKind::kMalformed:
        ++statistics_.malformed_frames;
        break;
      case wire::FrameKind::kCut:
        ++statistics_.cut_frames;
        if (!statistics_.first_cut.seen()) statistics_.first_cut = packet.ref();
        statistics_.last_cut = packet.ref();
        break;
      case wire::FrameKind::kDamagedOnWire:
        if (statistics_.crc_error_frames++ == 0) statistics_.first_crc_error = packet.ref();
        break;
      case wire::FrameKind::kEtherCat:
        break;
    }
    if (statistics_.ethercat_frames == 0) {
      statistics_.ethercat_interface = packet.interface_index();
      statistics_.ethercat_sender = packet.sender();
    }
    if (packet.padding() > 0) ++statistics_.padded_frames;
    if (packet.esl().has_time) ++statistics_.esl_frames;
    ++statistics_.ethercat_frames;
    statistics_.datagrams += packet.size();
  }

  void CountTime(const FrameRef& frame) {
    ++statistics_.packets;
    if (!statistics_.first.seen()) statistics_.first = frame;
    if (!frame.has_time) {
      ++statistics_.without_time;
      statistics_.last = frame;
      return;
    }
    if (!statistics_.first.has_time) statistics_.first = frame;
    if (statistics_.last.has_time) {
      if (frame.time < statistics_.last.time) ++statistics_.backwards;
      if (ClockJumps(statistics_.last.time, frame.time)) {
        ++statistics_.clock_jumps;
        events_.Publish(ClockSet{frame, Elapsed(statistics_.last.time, frame.time)});
      } else {
        statistics_.elapsed_ns += frame.time - statistics_.last.time;
      }
    }
    // A step of 1 divides everything: spares a division a frame.
    if (statistics_.time_step_ns == 0 ||
        (statistics_.time_step_ns != 1 && frame.time % statistics_.time_step_ns != 0)) {
      statistics_.time_step_ns = std::gcd(statistics_.time_step_ns, frame.time % 1'000'000'000);
    }
    statistics_.last = frame;
  }
};

Pipeline::Pipeline(EventSink& events) : impl_(std::make_unique<Impl>(events)) {}
Pipeline::~Pipeline() = default;
void Pipeline::Run(capture::FrameSource& source, const PipelineOptions& options) {
  impl_->Run(source, options);
}
void Pipeline::Presume(std::optional<SlavePos> position, std::optional<StationAddress> station) {
  impl_->network_.Presume(position, station);
}
const PipelineStatistics& Pipeline::statistics() const {
  return impl_->statistics_;
}
const bus::PairingStatistics& Pipeline::pairing() const {
  return impl_->Pairing();
}
const track::Network& Pipeline::network() const {
  return impl_->network_;
}

}  // namespace ecaudit
