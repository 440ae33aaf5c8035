#include "decoder/bus/traffic_reader.h"

#include "decoder/base/time.h"

namespace ecaudit::bus {
namespace {

/// How much is read before the directions are fixed.
constexpr std::size_t kLookAheadFrames = 256;
constexpr std::size_t kLookAheadPackets = 4096;
constexpr std::size_t kLookAheadBytes = std::size_t{4} << 20U;

}  // namespace

TrafficReader::Got TrafficReader::Next() noexcept {
  if (!pairing_) {
    if (const Got got = LookAhead(); got == Got::kNothing) return got;
    Begin();
  }
  if (!early_.empty() && NextEarly()) return Got::kPacket;
  const Got got = Read();
  if (got == Got::kPacket) packet_ = &parser_.Parse(read_packet_);
  return got;
}

/// @return false: all of them were handed over
bool TrafficReader::NextEarly() noexcept {
  if (next_early_ == early_.size()) {
    early_ = {};
    return false;
  }
  const Early& early = early_[next_early_++];
  early_view_.Rebase(early.view, early.bytes);
  packet_ = &early_view_;
  return true;
}

/// The directions can be fixed.
void TrafficReader::Begin() noexcept {
  AcceptLengths();
  FixDirections();
  pairing_.emplace(directions_, sink_);
}

/// @return kNothing: more packets have to be looked at
TrafficReader::Got TrafficReader::LookAhead() noexcept {
  const Got got = Read();
  if (got != Got::kPacket) return got;
  const wire::FrameView& view = parser_.Parse(read_packet_);
  if (view.kind() != wire::FrameKind::kOther) ++early_ethercat_;
  early_.push_back({view, {view.bytes().begin(), view.bytes().end()}});
  early_bytes_ += view.bytes().size();
  const bool more =
      early_ethercat_ < kLookAheadFrames && early_.size() < kLookAheadPackets && early_bytes_ < kLookAheadBytes;
  return more ? Got::kNothing : Got::kPacket;
}

/// A master whose frames have a wrong EtherCAT length is understood if it sends such frames and slaves take part in
/// them, or if it sends no others: what no slave reads is not sent for long. A frame that was damaged on its way back
/// was not sent like that.
void TrafficReader::AcceptLengths() noexcept {
  constexpr std::size_t kMany = 8;
  std::size_t wrong = 0, right = 0, answered = 0;
  for (const Early& early : early_) {
    wire::FrameView view;
    view.Rebase(early.view, early.bytes);
    if (view.kind() == wire::FrameKind::kEtherCat) ++right;
    if (!view.IsWholeButForLength()) continue;
    ++wrong;
    if (AnyWorkingCounter(view)) ++answered;
  }
  const bool both_ways = answered > 0 && answered < wrong;
  // Where only returned frames were captured, all are wrong.
  const bool no_others = right == 0 && (wrong >= kMany || answered > 1);
  if (!both_ways && !no_others) return;
  for (Early& early : early_) early.view.AcceptLength();
  parser_.AcceptLengths();
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

TrafficReader::Got TrafficReader::Read() noexcept {
  capture::CapturedFrame& packet = read_packet_;
  const bool stopped = stop_ != nullptr && stop_->load(std::memory_order_relaxed);
  ended_ = ended_ || stopped || source_.Next(packet) != capture::ReadStatus::kFrame;
  if (ended_) return Got::kEnd;
  ++read_;
  if (packet.has_time && !origin_.has_time) origin_ = packet.ref();
  if (range_.to_frame && packet.number > *range_.to_frame) {
    ended_ = true;
    return Got::kEnd;
  }
  return IsInRange(packet) ? Got::kPacket : Got::kNothing;
}

bool TrafficReader::IsInRange(const capture::CapturedFrame& packet) const noexcept {
  if (range_.from_frame && packet.number < *range_.from_frame) return false;
  if (!range_.from_s && !range_.to_s) return true;
  const double seconds = packet.has_time ? static_cast<double>(Elapsed(origin_.time, packet.time)) / 1e9 : 0.0;
  // Stamps may go backwards: what is past the end may be followed by what is not.
  return (!range_.from_s || seconds >= *range_.from_s) && (!range_.to_s || seconds <= *range_.to_s);
}

void TrafficReader::Pair() noexcept {
  const wire::FrameView& packet = *packet_;
  if (groups_ && packet.kind() != wire::FrameKind::kOther && !IsOfLaterSection(packet) && groups_->IsOther(packet)) {
    pairing_->PushOtherBus(packet);
  } else if (doubled_.IsSecond(packet)) {
    pairing_->PushOnceMore(packet);
  } else {
    pairing_->Push(packet);
  }
}

void TrafficReader::Finish() noexcept {
  if (pairing_) pairing_->Finish();
}

}  // namespace ecaudit::bus
