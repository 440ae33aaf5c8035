#include "decoder/bus/traffic_reader.h"

#include <limits>
#include <system_error>

#include "decoder/base/time.h"

namespace ecaudit::bus {
namespace {

/// How much is read before the directions are fixed.
constexpr std::size_t kLookAheadFrames = 256;
constexpr std::size_t kLookAheadPackets = 4096;
constexpr std::size_t kLookAheadBytes = std::size_t{4} << 20U;
/// Packets of a batch without thread: pairing some and then working on them keeps the code of either in the cache.
constexpr std::size_t kFewPackets = 64;

}  // namespace

TrafficReader::TrafficReader(capture::FrameSource& source, const PacketRange& range, const std::atomic<bool>* stop,
                             Ahead ahead)
    : source_(source), range_(range), stop_(stop), bytes_total_(source.bytes_total()) {
  if (ahead == Ahead::kNo) return;
  try {
    thread_ = std::thread([this] { ReadAll(); });
    threaded_ = true;
  } catch (const std::system_error&) {
    // As many threads as the system allows are at work: Next() reads itself.
  }
}

TrafficReader::~TrafficReader() {
  {
    const std::lock_guard lock(mutex_);
    abandoned_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

const Traffic* TrafficReader::Next() noexcept {
  if (in_hand_ != nullptr && in_hand_->last) return nullptr;
  if (threaded_) {
    bool room = false;
    {
      std::unique_lock lock(mutex_);
      if (filled_ == taken_) {
        changed_.wait(lock, [&] { return all_filled_ || filled_ >= taken_ + kWakeAfter; });
      }
      in_hand_ = &batches_[taken_++ % kBatches];
      room = filled_ + kWakeAfter < taken_ + kBatches;
    }
    if (room) changed_.notify_all();
  } else {
    in_hand_ = &batches_[0];
    Fill(*in_hand_, bytes_total_ > 0 ? kFewPackets : 1);
  }
  return &in_hand_->traffic;
}

void TrafficReader::ReadAll() noexcept {
  for (std::uint64_t n = 0;; ++n) {
    {
      // The batch in the caller's hand is not given back yet.
      std::unique_lock lock(mutex_);
      if (n + 1 >= taken_ + kBatches) {
        changed_.wait(lock, [&] { return abandoned_ || n + kWakeAfter < taken_ + kBatches; });
      }
      if (abandoned_) return;
    }
    Batch& batch = batches_[n % kBatches];
    Fill(batch, std::numeric_limits<std::size_t>::max());
    bool enough = false;
    {
      const std::lock_guard lock(mutex_);
      filled_ = n + 1;
      all_filled_ = batch.last;
      enough = all_filled_ || filled_ >= taken_ + kWakeAfter;
    }
    if (enough) changed_.notify_all();
    if (batch.last) return;
  }
}

void TrafficReader::Fill(Batch& batch, std::size_t most_packets) noexcept {
  batch.traffic.Clear();
  recorder_.SetTarget(batch.traffic);
  const std::uint64_t until = read_ + kNewsEvery;
  bool ready = pairing_.has_value();
  if (!ready && LearnDirections(until)) {
    ready = true;
    FixDirections();
    pairing_.emplace(directions_, recorder_);
    for (const Early& early : early_) {
      wire::FrameView view;
      view.Rebase(early.view, early.bytes);
      Push(view);
    }
    early_ = {};
  }
  capture::CapturedFrame packet;
  while (ready && !ended_ && read_ < until && batch.traffic.size() < most_packets &&
         batch.traffic.bytes() < kBatchBytes && !abandoned_.load(std::memory_order_relaxed)) {
    if (Read(packet) == Got::kPacket) Push(parser_.Parse(packet));
  }
  if (ready && ended_) {
    recorder_.BeginStep({});
    pairing_->Finish();
    recorder_.EndStep(pairing_->statistics(), pairing_->incidents());
    batch.last = true;
  }
  batch.packets_read = read_;
  batch.bytes_read = source_.bytes_read();
  batch.origin = origin_;
}

/// @return false: more packets have to be examined, but `until` packets are read
bool TrafficReader::LearnDirections(std::uint64_t until) noexcept {
  capture::CapturedFrame packet;
  while (early_ethercat_ < kLookAheadFrames && early_.size() < kLookAheadPackets && early_bytes_ < kLookAheadBytes) {
    if (read_ == until) return false;
    const Got got = Read(packet);
    if (got == Got::kEnd) return true;
    if (got == Got::kOutside) continue;
    const wire::FrameView& view = parser_.Parse(packet);
    if (view.kind() != wire::FrameKind::kOther) ++early_ethercat_;
    early_.push_back({view, {view.bytes().begin(), view.bytes().end()}});
    early_bytes_ += view.bytes().size();
  }
  return true;
}

void TrafficReader::FixDirections() noexcept {
  const auto each = [&](auto&& look) {
    for (const Early& early : early_) {
      wire::FrameView view;
      view.Rebase(early.view, early.bytes);
      look(view);
    }
  };
  if (source_.info().interfaces.size() > 1) {
    groups_.emplace();
    each([&](const wire::FrameView& view) {
      if (!IsOfLaterSection(view)) groups_->Learn(view);
    });
    groups_->Finish(source_.info().interfaces.size());
  }
  const auto each_of_bus = [&](auto&& look) {
    each([&](const wire::FrameView& view) {
      if (!groups_ || IsOfLaterSection(view) || !groups_->IsOther(view)) look(view);
    });
  };
  each_of_bus([&](const wire::FrameView& view) { doubled_.Learn(view); });
  doubled_.Finish();
  DoubledPackets doubled = doubled_;
  each_of_bus([&](const wire::FrameView& view) {
    if (!doubled.IsSecond(view)) directions_.Learn(view);
  });
  directions_.Finish();
}

/// Recordings put one after the other describe their interfaces again: that one is new does not show that it is at
/// another bus.
bool TrafficReader::IsOfLaterSection(const wire::FrameView& packet) const noexcept {
  const std::vector<capture::Interface>& interfaces = source_.info().interfaces;
  return packet.interface_index() < interfaces.size() &&
         interfaces[packet.interface_index()].section > interfaces.front().section;
}

TrafficReader::Got TrafficReader::Read(capture::CapturedFrame& packet) noexcept {
  const bool stopped = stop_ != nullptr && stop_->load(std::memory_order_relaxed);
  ended_ = ended_ || stopped || source_.Next(packet) != capture::ReadStatus::kFrame;
  if (ended_) return Got::kEnd;
  ++read_;
  if (packet.has_time && !origin_.has_time) origin_ = packet.ref();
  if (range_.from_frame && packet.number < *range_.from_frame) return Got::kOutside;
  if (range_.to_frame && packet.number > *range_.to_frame) {
    ended_ = true;
    return Got::kEnd;
  }
  if (!range_.from_s && !range_.to_s) return Got::kPacket;
  const double seconds = packet.has_time ? static_cast<double>(Elapsed(origin_.time, packet.time)) / 1e9 : 0.0;
  // Stamps may go backwards: what is past the end may be followed by what is not.
  const bool outside = (range_.from_s && seconds < *range_.from_s) || (range_.to_s && seconds > *range_.to_s);
  return outside ? Got::kOutside : Got::kPacket;
}

void TrafficReader::Push(const wire::FrameView& packet) noexcept {
  recorder_.BeginStep(packet);
  if (groups_ && packet.kind() != wire::FrameKind::kOther && !IsOfLaterSection(packet) && groups_->IsOther(packet)) {
    pairing_->PushOtherBus(packet);
  } else if (doubled_.IsSecond(packet)) {
    pairing_->PushOnceMore(packet);
  } else {
    pairing_->Push(packet);
  }
  recorder_.EndStep(pairing_->statistics(), pairing_->incidents());
}

}  // namespace ecaudit::bus
