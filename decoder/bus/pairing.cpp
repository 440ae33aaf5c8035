#include "decoder/bus/pairing.h"

#include <algorithm>

namespace ecaudit::bus {
namespace {

std::uint64_t HashBytes(ByteSpan bytes) {
  std::uint64_t hash = 0xCBF29CE484222325ULL ^ bytes.size();
  std::size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    hash = (hash ^ LittleEndian<std::uint64_t>(bytes, i)) * 0x9FB21C651E98DF25ULL;
    hash ^= hash >> 32U;
  }
  for (; i < bytes.size(); ++i) hash = (hash ^ bytes[i]) * 0x100000001B3ULL;
  return hash;
}

/// Slaves never change what a pure write carries, so a returned write with other data answers another frame.
bool SameWrittenData(const wire::FrameView& sent, const wire::FrameView& returned) {
  for (std::size_t i = 0; i < sent.size(); ++i) {
    const wire::Command c = sent[i].command();
    if (wire::Reads(c) || !wire::Writes(c)) continue;
    const ByteSpan a = sent[i].data();
    const ByteSpan b = returned[i].data();
    if (!std::equal(a.begin(), a.end(), b.begin(), b.end())) return false;
  }
  return true;
}

}  // namespace

Pairing::Pairing(const DirectionLearner& directions, BusSink& sink)
    : directions_(directions), sink_(sink), outbound_only_(directions.outbound_only()) {
  for (Slot& slot : slots_) slot.bytes.reserve(1536);
}

void Pairing::Push(const wire::FrameView& frame) noexcept {
  if (frame.kind() == wire::FrameKind::kOther) {
    if (head_ != tail_ && At(head_ - 1).view.ref().number + 1 == frame.ref().number) {
      At(head_ - 1).followed_by_other = true;
    }
    return;
  }
  const Direction direction = directions_.Classify(frame);
  if (direction != Direction::kByPair) sink_.OnFrame(frame, direction);
  if (direction == Direction::kForeign) {
    ++statistics_.foreign;
    if (frame.kind() == wire::FrameKind::kMalformed) sink_.OnUnusable(frame, Unusable::kMalformed, false);
    return;
  }
  if (frame.kind() == wire::FrameKind::kMalformed || frame.kind() == wire::FrameKind::kDamagedOnWire) {
    if (direction == Direction::kByPair) sink_.OnFrame(frame, direction);
    if (direction == Direction::kOutbound) {
      ++statistics_.outbound;
      sink_.OnUnusable(frame, Unusable::kMalformed, true);
    } else {
      PushUnusable(frame);
    }
    return;
  }
  const std::uint64_t key = FrameKey(frame);
  switch (direction) {
    case Direction::kOutbound: PushOutbound(frame, key); break;
    case Direction::kReturned: PushReturned(frame, key); break;
    case Direction::kByPair: {
      // Only what got further than the open frame can be its return; a mailbox poll that nobody answered is equal.
      const Slot* open = FindOpen(frame, key);
      const std::uint32_t progress = FrameProgress(frame);
      const bool returned = open != nullptr && (progress > FrameProgress(open->view) ||
                                                (progress == FrameProgress(open->view) && !AnyWorkingCounter(frame)));
      sink_.OnFrame(frame, returned ? Direction::kReturned : Direction::kOutbound);
      if (returned) {
        PushReturned(frame, key);
      } else {
        PushOutbound(frame, key);
      }
      break;
    }
    case Direction::kForeign: break;
  }
}

void Pairing::PushOutbound(const wire::FrameView& frame, std::uint64_t key) noexcept {
  ++statistics_.outbound;
  if (outbound_only_) {
    sink_.OnTransaction({&frame, nullptr, true});
    return;
  }
  if (head_ - tail_ >= kSlots) {
    Slot& oldest = At(tail_);
    if (oldest.state == SlotState::kOpen) {
      Lose(oldest, oldest.overtaken > 0 ? Loss::kOvertaken : Loss::kSilence);
    }
    ++tail_;
    DropAnsweredTail();
  }
  Slot& slot = At(head_++);
  slot.state = SlotState::kOpen;
  slot.key = key;
  slot.overtaken = 0;
  slot.followed_by_other = false;
  slot.bytes.assign(frame.bytes().begin(), frame.bytes().end());
  slot.view = frame.Rebased(slot.bytes);
  sink_.OnSent(slot.view);
}

Pairing::Slot* Pairing::FindOpen(const wire::FrameView& frame, std::uint64_t key) noexcept {
  Slot* oldest = nullptr;
  Slot* newest = nullptr;
  for (std::uint64_t s = tail_; s != head_; ++s) {
    Slot& slot = At(s);
    if (slot.state != SlotState::kOpen || slot.key != key || !SameWrittenData(slot.view, frame)) continue;
    // A frame that was overtaken is nearly always lost; it only answers when no other candidate exists.
    if (oldest == nullptr || (oldest->overtaken > 0 && slot.overtaken == 0)) oldest = &slot;
    newest = &slot;
  }
  if (oldest == newest || oldest->overtaken > 0) return oldest;
  // The master repeated a frame: two equal ones are under way and one came back.
  const FrameRef& first = oldest->view.ref();
  const FrameRef& second = newest->view.ref();
  if (typical_round_trip_ns_ > 0 && first.has_time && second.has_time && frame.ref().has_time) {
    const std::int64_t age_first = frame.ref().time - first.time;
    const std::int64_t age_second = frame.ref().time - second.time;
    if (age_first > 8 * typical_round_trip_ns_ && age_second * 4 > typical_round_trip_ns_) return newest;
  }
  return oldest;
}

Pairing::Slot* Pairing::FindAlike(const wire::FrameView& frame) noexcept {
  if (frame.empty()) return nullptr;
  for (std::uint64_t s = tail_; s != head_; ++s) {
    Slot& slot = At(s);
    if (slot.state != SlotState::kOpen || slot.view.empty()) continue;
    const wire::DatagramView a = slot.view[0];
    const wire::DatagramView b = frame[0];
    // One flipped bit leaves at least two of these three intact.
    const int same = (a.index() == b.index() ? 1 : 0) + (a.command_byte() == b.command_byte() ? 1 : 0) +
                     (a.length() == b.length() ? 1 : 0);
    if (same >= 2 && a.index() == b.index()) return &slot;
    if (same >= 2 && slot.view.size() == frame.size()) return &slot;
  }
  return nullptr;
}

void Pairing::Answer(Slot& slot, FrameNo returned, std::uint64_t hash) noexcept {
  slot.state = SlotState::kAnswered;
  slot.returned = returned;
  slot.returned_hash = hash;
  ++statistics_.paired;
  // Everything sent before it and still open has been overtaken.
  for (std::uint64_t s = tail_; s != head_ && &At(s) != &slot; ++s) {
    Slot& other = At(s);
    if (other.state == SlotState::kOpen && ++other.overtaken >= kOvertakenLimit) Lose(other, Loss::kOvertaken);
  }
  DropAnsweredTail();
}

void Pairing::PushReturned(const wire::FrameView& frame, std::uint64_t key) noexcept {
  Slot* slot = FindOpen(frame, key);
  ++statistics_.returned;
  outbound_only_ = false;
  const std::uint64_t hash = HashBytes(frame.payload());
  if (slot != nullptr) {
    const FrameRef& sent = slot->view.ref();
    if (sent.has_time && frame.ref().has_time) {
      const std::int64_t round_trip = frame.ref().time - sent.time;
      if (round_trip == 0) ++statistics_.identical_stamps;
      if (round_trip > 0 && slot->overtaken == 0) {
        typical_round_trip_ns_ =
            typical_round_trip_ns_ == 0 ? round_trip : typical_round_trip_ns_ + (round_trip - typical_round_trip_ns_) / 16;
      }
    }
    sink_.OnTransaction({&slot->view, &frame, false});
    Answer(*slot, frame.ref().number, hash);
    return;
  }
  // Nothing under way fits: a second copy of something that already came back?
  const std::uint64_t oldest = head_ > kSlots ? head_ - kSlots : 0;
  for (std::uint64_t s = head_; s != oldest; --s) {
    const Slot& answered = At(s - 1);
    if (answered.state == SlotState::kAnswered && answered.key == key && answered.returned_hash == hash) {
      ++statistics_.duplicated;
      sink_.OnDuplicate(frame, answered.returned);
      return;
    }
  }
  // Or bits flipped in a field that slaves never change (the FCS is not in the capture).
  if (Slot* alike = FindAlike(frame); alike != nullptr && !directions_.returned_only()) {
    ++statistics_.altered;
    sink_.OnUnusable(frame, Unusable::kAltered, true);
    Answer(*alike, frame.ref().number, hash);
    return;
  }
  ++statistics_.unmatched_returned;
  sink_.OnTransaction({nullptr, &frame, false});
}

void Pairing::PushUnusable(const wire::FrameView& frame) noexcept {
  ++statistics_.returned;
  sink_.OnUnusable(frame, Unusable::kMalformed, true);
  // It did come back, so the frame it answers is damaged but not lost.
  if (Slot* alike = FindAlike(frame); alike != nullptr) Answer(*alike, frame.ref().number, 0);
}

void Pairing::Lose(Slot& slot, Loss loss) noexcept {
  slot.state = SlotState::kFree;
  ++statistics_.lost;
  sink_.OnLost(slot.view, loss, slot.followed_by_other);
}

void Pairing::DropAnsweredTail() noexcept {
  while (tail_ != head_ && At(tail_).state != SlotState::kOpen) ++tail_;
}

void Pairing::Finish() noexcept {
  for (std::uint64_t s = tail_; s != head_; ++s) {
    Slot& slot = At(s);
    if (slot.state != SlotState::kOpen) continue;
    if (slot.overtaken > 0) {
      Lose(slot, Loss::kOvertaken);
    } else {
      ++statistics_.under_way_at_end;
    }
  }
  tail_ = head_;
}

}  // namespace ecaudit::bus
