#include "decoder/bus/traffic.h"

#include <algorithm>
#include <cassert>

namespace ecaudit::bus {

using wire::FrameView;

void Traffic::Clear() {
  steps_.clear();
  calls_.clear();
  kept_.clear();
  bytes_.clear();
  offsets_.clear();
  incidents_.clear();
}

Traffic::Place Traffic::Keep(const FrameView& frame, ByteSpan bytes) {
  kept_.emplace_back(frame.fields(), bytes_.size(), bytes.size(), offsets_.size());
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  for (const std::uint16_t offset : frame.offsets()) offsets_.push_back(offset);
  return static_cast<Place>(kept_.size() - 1);
}

PairingStatistics Traffic::StatisticsAfter(std::size_t i) const {
  const Step& step = steps_[i];
  return {step.progress, incidents_[step.incidents]};
}

void Traffic::Replay(std::size_t i, const FrameView& packet, BusSink& sink, const FrameView* before) const {
  const Place own = steps_[i].kept;
  const Place place_before = i > 0 && before != nullptr ? steps_[i - 1].kept : kNone;
  if (steps_[i].direction) sink.OnFrame(packet, *steps_[i].direction);
  const Call* const end = calls_.data() + steps_[i].calls_end;
  for (const Call* call = calls_.data() + (i == 0 ? 0 : steps_[i - 1].calls_end); call != end; ++call) {
    if (call->first == own) {
      Deliver(*call, &packet, packet, sink);
    } else if (call->first == kNone) {
      Deliver(*call, nullptr, packet, sink);
    } else if (call->first == place_before) {
      Deliver(*call, before, packet, sink);
    } else {
      DeliverEarlier(*call, packet, sink);
    }
  }
}

/// Of a frame that came before this packet, and not as the last one: seldom.
void Traffic::DeliverEarlier(const Call& call, const FrameView& packet, BusSink& sink) const {
  FrameView earlier;
  Restore(kept_[call.first], earlier);
  Deliver(call, &earlier, packet, sink);
}

/// @param first  the frame of `call.first`; null: there is none
void Traffic::Deliver(const Call& call, const FrameView* first, const FrameView& packet, BusSink& sink) {
  switch (call.kind) {
    case Kind::kTransaction:
      // What came back is always the packet at hand.
      sink.OnTransaction({first, call.second == kNone ? nullptr : &packet, call.flag, static_cast<GapBefore>(call.what),
                          call.other_end});
      break;
    case Kind::kSent:
      sink.OnSent(*first);
      break;
    case Kind::kDoubtful:
      sink.OnDoubtful(*first);
      break;
    case Kind::kLost:
      sink.OnLost(*first, static_cast<Loss>(call.what), call.flag);
      break;
    case Kind::kDuplicate:
      sink.OnDuplicate(*first, call.original);
      break;
    case Kind::kUnusable:
      sink.OnUnusable(*first, static_cast<Unusable>(call.what), call.flag);
      break;
  }
}

void TrafficRecorder::BeginStep(const FrameView& packet) {
  const bool ethercat = packet.kind() != wire::FrameKind::kOther;
  const Traffic::Place kept = to_->Keep(packet, ethercat ? packet.bytes() : ByteSpan());
  to_->steps_.emplace_back().kept = kept;
}

void TrafficRecorder::EndStep(const PairingStatistics& statistics, std::uint64_t incidents) {
  assert(incidents != incidents_ || to_->incidents_.empty() || to_->incidents_.back() == statistics);
  if (to_->incidents_.empty() || incidents != incidents_) to_->incidents_.push_back(statistics);
  incidents_ = incidents;
  Traffic::Step& step = to_->steps_.back();
  step.incidents = static_cast<Traffic::Place>(to_->incidents_.size() - 1);
  step.calls_end = to_->calls_.size();
  step.progress = statistics;
}

Traffic::Place TrafficRecorder::PlaceOf(const FrameView& frame) {
  // Most frames come back at once: the outbound copy is one of the last packets.
  constexpr std::size_t kRecent = 8;
  const std::vector<Traffic::Kept>& kept = to_->kept_;
  const Traffic::Kept* const first = kept.data();
  const Traffic::Kept* const oldest = first + (kept.size() - std::min(kept.size(), kRecent));
  for (const Traffic::Kept* k = first + kept.size(); k != oldest; --k) {
    if (k[-1].fields.ref_.number == frame.ref().number) return static_cast<Traffic::Place>(k - 1 - first);
  }
  return to_->Keep(frame, frame.bytes());
}

Traffic::Call& TrafficRecorder::AddCall(Traffic::Kind kind, const FrameView* first) {
  const Traffic::Place place = first != nullptr ? PlaceOf(*first) : Traffic::kNone;
  Traffic::Call& call = to_->calls_.emplace_back();
  call.kind = kind;
  call.first = place;
  return call;
}

void TrafficRecorder::OnFrame(const FrameView& /*the packet of this step*/, Direction direction) {
  to_->steps_.back().direction = direction;
}
void TrafficRecorder::OnSent(const FrameView& frame) {
  AddCall(Traffic::Kind::kSent, &frame);
}
void TrafficRecorder::OnTransaction(const BusTransaction& transaction) {
  Traffic::Call& call = AddCall(Traffic::Kind::kTransaction, transaction.sent);
  call.what = static_cast<std::uint8_t>(transaction.gap);
  call.flag = transaction.assumed;
  call.other_end = transaction.other_end;
  if (transaction.returned != nullptr) call.second = PlaceOf(*transaction.returned);
}
void TrafficRecorder::OnDoubtful(const FrameView& sent) {
  AddCall(Traffic::Kind::kDoubtful, &sent);
}
void TrafficRecorder::OnLost(const FrameView& sent, Loss loss, bool followed_by_other) {
  Traffic::Call& call = AddCall(Traffic::Kind::kLost, &sent);
  call.what = static_cast<std::uint8_t>(loss);
  call.flag = followed_by_other;
}
void TrafficRecorder::OnDuplicate(const FrameView& returned, FrameNo original) {
  AddCall(Traffic::Kind::kDuplicate, &returned).original = original;
}
void TrafficRecorder::OnUnusable(const FrameView& frame, Unusable reason, bool own_master) {
  Traffic::Call& call = AddCall(Traffic::Kind::kUnusable, &frame);
  call.what = static_cast<std::uint8_t>(reason);
  call.flag = own_master;
}

}  // namespace ecaudit::bus
