#include "decoder/pipeline.h"

#include <array>
#include <numeric>

#include "decoder/base/other_processor.h"
#include "decoder/base/time.h"
#include "decoder/bus/ring_join.h"
#include "decoder/track/repeated_cycles.h"

namespace ecaudit {
namespace {

/// Smaller captures are read before a thread is at work.
constexpr std::uint64_t kWorthReadingAhead = std::uint64_t{4} << 20U;
/// What a packet takes in a file at least, besides its frame.
constexpr std::uint64_t kRecordBytes = 16;
constexpr std::uint64_t kProgressEvery = bus::TrafficReader::kNewsEvery;

/// Passes everything on to the network; frames are published first.
class Fork final : public bus::BusSink {
 public:
  Fork(track::RepeatedCycles& cycles, EventSink& events) : cycles_(cycles), events_(events), ends_(cycles) {}
  void OnFrame(const wire::FrameView& frame, bus::Direction direction) override {
    ends_.Pass(frame.ref().number);
    events_.Publish(FrameSeen{frame, direction});
  }
  void OnSent(const wire::FrameView& frame) override { cycles_.OnSent(frame); }
  void OnTransaction(const bus::BusTransaction& transaction) override { ends_.Push(transaction); }
  void OnDoubtful(const wire::FrameView& sent) override { cycles_.OnDoubtful(sent); }
  void OnLost(const wire::FrameView& sent, bus::Loss loss, bool followed_by_other) override {
    cycles_.OnLost(sent, loss, followed_by_other);
  }
  void OnDuplicate(const wire::FrameView& returned, FrameNo original) override {
    cycles_.OnDuplicate(returned, original);
  }
  void OnUnusable(const wire::FrameView& frame, bus::Unusable reason, bool own_master) override {
    cycles_.OnUnusable(frame, reason, own_master);
  }
  void Finish() {
    ends_.Flush();
    cycles_.Settle();
  }

 private:
  track::RepeatedCycles& cycles_;
  EventSink& events_;
  bus::RingJoin ends_;
};

}  // namespace

class Pipeline::Impl {
 public:
  explicit Impl(EventSink& events) : network_(events), cycles_(network_, events), fork_(cycles_, events) {}

  void Run(capture::FrameSource& source, const PipelineOptions& options) {
    const bool ahead = options.read_ahead && source.bytes_total() >= kWorthReadingAhead && OtherProcessorIsNear();
    bus::TrafficReader reader(source, options, options.stop, ahead ? bus::Ahead::kYes : bus::Ahead::kNo);
    std::uint64_t next_progress = kProgressEvery;
    std::array<wire::FrameView, 2> views;  // of the packet at hand and the one before
    while (const bus::Traffic* traffic = reader.Next()) {
      for (std::size_t i = 0; i < traffic->size() && !statistics_.overworked.seen(); ++i) {
        wire::FrameView& packet = views[i % 2];
        traffic->Restore(i, packet);
        at_ = {traffic, i};
        if (options.reached != nullptr) options.reached->store(packet.ref().number, std::memory_order_relaxed);
        if (packet.ref().seen()) Count(packet);
        traffic->Replay(i, packet, fork_, &views[(i + 1) % 2]);
        if (network_.overworked()) statistics_.overworked = statistics_.last;
      }
      (void)Pairing();  // before what it is read from goes away
      at_ = counted_ = {};
      cycles_.Keep();
      if (statistics_.overworked.seen()) break;
      if (options.progress && reader.packets_read() >= next_progress) {
        options.progress(reader.bytes_read(), reader.bytes_total(), reader.packets_read());
        next_progress = reader.packets_read() + kProgressEvery;
      }
    }
    statistics_.origin = reader.origin();
    // A source that waited for packets ends on request, too.
    statistics_.stopped = options.stop != nullptr && options.stop->load(std::memory_order_relaxed);
    fork_.Finish();
    network_.Finish();
  }

  track::Network network_;
  track::RepeatedCycles cycles_;
  Fork fork_;
  /// After the step at hand.
  const bus::PairingStatistics& Pairing() {
    if (at_.traffic != nullptr && (at_.traffic != counted_.traffic || at_.step != counted_.step)) {
      pairing_ = at_.traffic->StatisticsAfter(at_.step);
      counted_ = at_;
    }
    return pairing_;
  }
  PipelineStatistics statistics_;

 private:
  struct Place {
    const bus::Traffic* traffic = nullptr;
    std::size_t step = 0;
  };
  Place at_;       ///< of the packet at hand
  Place counted_;  ///< to which pairing_ belongs
  bus::PairingStatistics pairing_;

  void Count(const wire::FrameView& packet) {
    CountTime(packet.ref());
    statistics_.frame_bytes += kRecordBytes + packet.used_bytes();
    switch (packet.kind()) {
      case wire::FrameKind::kOther:
        ++statistics_.other_packets;
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
    if (packet.padding() > 0) ++statistics_.padded_frames;
    if (packet.esl().present) ++statistics_.esl_frames;
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
void Pipeline::SkipRepeatedCycles() {
  impl_->cycles_.Begin();
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
