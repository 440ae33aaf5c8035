#include "decoder/pipeline.h"

#include <numeric>
#include <vector>

#include "decoder/base/time.h"

namespace ecaudit {
namespace {

/// How much is read before the directions are fixed.
constexpr std::size_t kLookAheadFrames = 256;
constexpr std::size_t kLookAheadPackets = 4096;
constexpr std::size_t kLookAheadBytes = std::size_t{4} << 20U;
constexpr std::uint64_t kProgressEvery = 65536;

/// A packet kept during the look-ahead.
struct KeptFrame {
  capture::CapturedFrame frame;
  std::vector<std::uint8_t> bytes;
};

/// Passes everything on to the network, frames to the observer first.
class Fork final : public bus::BusSink {
 public:
  Fork(track::Network& network, FrameObserver* observer) : network_(network), observer_(observer) {}
  void OnFrame(const wire::FrameView& frame, bus::Direction direction) override {
    if (observer_ != nullptr) observer_->OnFrame(frame, direction);
  }
  void OnSent(const wire::FrameView& frame) override { network_.OnSent(frame); }
  void OnTransaction(const bus::BusTransaction& transaction) override { network_.OnTransaction(transaction); }
  void OnDoubtful(const wire::FrameView& sent) override { network_.OnDoubtful(sent); }
  void OnLost(const wire::FrameView& sent, bus::Loss loss, bool followed_by_other) override {
    network_.OnLost(sent, loss, followed_by_other);
  }
  void OnDuplicate(const wire::FrameView& returned, FrameNo original) override {
    network_.OnDuplicate(returned, original);
  }
  void OnUnusable(const wire::FrameView& frame, bus::Unusable reason, bool own_master) override {
    network_.OnUnusable(frame, reason, own_master);
  }

 private:
  track::Network& network_;
  FrameObserver* observer_;
};

}  // namespace

class Pipeline::Impl {
 public:
  Impl(track::EventSink& events, FrameObserver* observer) : network_(events), fork_(network_, observer) {}

  void Run(capture::FrameSource& source, const PipelineOptions& options) {
    std::vector<KeptFrame> kept;
    std::size_t kept_bytes = 0;
    std::size_t ethercat = 0;
    capture::CapturedFrame frame;
    bool ended = false;
    while (ethercat < kLookAheadFrames && kept.size() < kLookAheadPackets && kept_bytes < kLookAheadBytes) {
      if (!Next(source, options, frame)) {
        ended = true;
        break;
      }
      const wire::FrameView view = wire::FrameView::Parse(frame);
      directions_.Learn(view);
      if (view.kind() != wire::FrameKind::kOther) ++ethercat;
      kept.push_back({frame, {frame.bytes.begin(), frame.bytes.end()}});
      kept_bytes += frame.bytes.size();
    }
    directions_.Finish();
    pairing_.emplace(directions_, fork_);
    for (KeptFrame& k : kept) {
      k.frame.bytes = k.bytes;
      Push(k.frame);
    }
    kept = {};
    while (!ended && Next(source, options, frame)) Push(frame);
    // A source that waited for packets ends on request, too.
    if (options.stop != nullptr && options.stop->load(std::memory_order_relaxed)) statistics_.stopped = true;
    pairing_->Finish();
    network_.Finish();
  }

  track::Network network_;
  Fork fork_;
  bus::DirectionLearner directions_;
  std::optional<bus::Pairing> pairing_;
  bus::PairingStatistics no_pairing_;
  PipelineStatistics statistics_;

 private:
  /// The next packet of the selected range; false at the end.
  bool Next(capture::FrameSource& source, const PipelineOptions& options, capture::CapturedFrame& frame) {
    while (true) {
      if (options.stop != nullptr && options.stop->load(std::memory_order_relaxed)) {
        statistics_.stopped = true;
        return false;
      }
      if (source.Next(frame) != capture::ReadStatus::kFrame) return false;
      if (++read_ % kProgressEvery == 0 && options.progress) {
        options.progress(source.bytes_read(), source.bytes_total(), read_);
      }
      if (frame.has_time && !origin_) origin_ = frame.time;
      if (options.from_frame && frame.number < *options.from_frame) continue;
      if (options.to_frame && frame.number > *options.to_frame) return false;
      if (!options.from_s && !options.to_s) return true;
      const double seconds = frame.has_time ? static_cast<double>(Elapsed(*origin_, frame.time)) / 1e9 : 0.0;
      if (options.from_s && seconds < *options.from_s) continue;
      if (options.to_s && seconds > *options.to_s) continue;  // stamps may go backwards: look on
      return true;
    }
  }

  void Push(const capture::CapturedFrame& frame) {
    Count(frame);
    const wire::FrameView view = wire::FrameView::Parse(frame);
    switch (view.kind()) {
      case wire::FrameKind::kOther:
        ++statistics_.other_packets;
        pairing_->Push(view);
        return;
      case wire::FrameKind::kMalformed:
        ++statistics_.malformed_frames;
        break;
      case wire::FrameKind::kCut:
        ++statistics_.cut_frames;
        if (!statistics_.first_cut.seen()) statistics_.first_cut = view.ref();
        statistics_.last_cut = view.ref();
        break;
      case wire::FrameKind::kDamagedOnWire:
        ++statistics_.crc_error_frames;
        break;
      case wire::FrameKind::kEtherCat:
        break;
    }
    if (view.esl().present) ++statistics_.esl_frames;
    ++statistics_.ethercat_frames;
    statistics_.datagrams += view.size();
    pairing_->Push(view);
  }

  void Count(const capture::CapturedFrame& frame) {
    ++statistics_.packets;
    if (!statistics_.first.seen()) statistics_.first = frame.ref();
    if (!frame.has_time) {
      ++statistics_.without_time;
      statistics_.last = frame.ref();
      return;
    }
    if (!statistics_.first.has_time) statistics_.first = frame.ref();
    if (statistics_.last.has_time && frame.time < statistics_.last.time) ++statistics_.backwards;
    // A step of 1 divides everything: spares a division a frame.
    if (statistics_.time_step_ns == 0 ||
        (statistics_.time_step_ns != 1 && frame.time % statistics_.time_step_ns != 0)) {
      statistics_.time_step_ns = std::gcd(statistics_.time_step_ns, frame.time % 1'000'000'000);
    }
    statistics_.last = frame.ref();
  }

  std::uint64_t read_ = 0;
  std::optional<TimeNs> origin_;
};

Pipeline::Pipeline(track::EventSink& events, FrameObserver* frames) : impl_(std::make_unique<Impl>(events, frames)) {}
Pipeline::~Pipeline() = default;
void Pipeline::Run(capture::FrameSource& source, const PipelineOptions& options) {
  impl_->Run(source, options);
}
const PipelineStatistics& Pipeline::statistics() const {
  return impl_->statistics_;
}
const bus::PairingStatistics& Pipeline::pairing() const {
  return impl_->pairing_ ? impl_->pairing_->statistics() : impl_->no_pairing_;
}
const bus::DirectionLearner& Pipeline::directions() const {
  return impl_->directions_;
}
const track::Network& Pipeline::network() const {
  return impl_->network_;
}

}  // namespace ecaudit
