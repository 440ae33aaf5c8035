#include "decoder/bus/pairing.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <numeric>
#include <utility>

#include "decoder/base/time.h"

namespace ecaudit::bus {
namespace {

/// Longer ones are the steps of coarse stamps.
constexpr std::int64_t kMaxRoundTripNs = 500'000;

/// What was overtaken so often is lost: masters with few indices have begun to use its index again.
/// Numbers that continue after a silence although frames are missing there do so once in as many times.
constexpr std::uint32_t kNoCoincidence = 64;
constexpr std::uint32_t kStale = 8;

/// True when the first `count` datagrams of `returned` can be what became of those of `sent`. Slaves never change what
/// a pure write carries, so a returned write with other data answers another frame.
bool Answers(const wire::FrameView& sent, const wire::FrameView& returned, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const wire::DatagramView a = sent[i];
    const wire::DatagramView b = returned[i];
    if (a.KeptHeader() != b.KeptHeader()) return false;  // the key alone could be made to collide
    const wire::Command c = a.command();
    if (wire::Reads(c) || !wire::Writes(c)) continue;
    const ByteSpan x = a.data();
    const ByteSpan y = b.data();
    if (!std::equal(x.begin(), x.end(), y.begin(), y.end())) return false;
  }
  return true;
}

/// Writes to slaves, and more than process data or the time.
bool Instructs(const wire::FrameView& frame) {
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const wire::Command c = frame[i].command();
    if (wire::Writes(c) && !wire::IsLogical(c) && c != wire::Command::ARMW && c != wire::Command::FRMW) return true;
  }
  return false;
}

/// How many slaves the frame passed; Pairing::kNotCounted where no datagram counts them. A plain number: for each frame
/// an optional would be put together on the stack, and wait there for all that was written down before.
int Passed(const wire::FrameView& sent, const wire::FrameView& returned) {
  for (std::size_t i = 0; i < sent.size() && i < returned.size(); ++i) {
    if (!wire::IncrementsAdp(sent[i].command())) continue;
    return static_cast<std::uint16_t>(returned[i].adp() - sent[i].adp());
  }
  return Pairing::kNotCounted;
}

bool Answers(const wire::FrameView& sent, const wire::FrameView& returned) {
  return sent.size() == returned.size() && Answers(sent, returned, sent.size());
}

/// The same but for one bit of the index: what a flipped bit makes of a frame.
bool OnlyIndexFlipped(const wire::DatagramView& a, const wire::DatagramView& b) {
  const auto flipped = static_cast<std::uint8_t>(a.index() ^ b.index());
  return std::has_single_bit(flipped) && a.command_byte() == b.command_byte() && a.length() == b.length() &&
         a.ado() == b.ado() && (wire::IncrementsAdp(a.command()) || a.adp() == b.adp());
}

/// True when the frames differ, in what slaves never change, in so few bits that they flipped on the way. Another frame
/// of the same kind, whose own copy the capture misses, differs in more.
bool FewBitsFlipped(const wire::FrameView& sent, const wire::FrameView& returned) {
  constexpr int kFew = 2;
  if (sent.size() != returned.size()) return false;
  int flipped = 0;
  for (std::size_t i = 0; i < sent.size() && flipped <= kFew; ++i) {
    const wire::DatagramView a = sent[i];
    const wire::DatagramView b = returned[i];
    flipped += std::popcount(a.KeptHeader() ^ b.KeptHeader());
    const wire::Command c = a.command();
    if (wire::Reads(c) || !wire::Writes(c) || a.length() != b.length()) continue;
    for (std::size_t k = 0; k < a.data().size(); ++k) {
      flipped += std::popcount(static_cast<std::uint8_t>(a.data()[k] ^ b.data()[k]));
    }
  }
  return flipped > 0 && flipped <= kFew;
}

bool IsBroadcastOnly(const wire::FrameView& frame) {
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (!wire::IsBroadcast(frame[i].command())) return false;
  }
  return !frame.empty();
}

bool OnlyReads(const wire::FrameView& frame) {
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (wire::Writes(frame[i].command())) return false;
  }
  return true;
}

/// Most captures use few slots: a slot takes room for any frame of usual size when it is used first, and keeps it.
void TakeBytes(std::vector<std::uint8_t>& room, ByteSpan bytes) {
  constexpr std::size_t kUsualBytes = 1536;
  if (room.capacity() == 0) room.reserve(kUsualBytes);
  if (room.size() != bytes.size()) room.resize(bytes.size());  // seldom: frames of the same few sizes take turns
  if (!bytes.empty()) std::memcpy(room.data(), bytes.data(), bytes.size());
}

}  // namespace

Pairing::Pairing(const DirectionLearner& directions, BusSink& sink) : directions_(directions), sink_(sink) {
  statistics_.no_answers = directions.no_answers();
  statistics_.one_port = directions.HasOnePort();
  std::iota(place_.begin(), place_.end(), std::uint16_t{0});
}

void Pairing::Push(const wire::FrameView& frame) noexcept {
  if (frame.ref().has_time) {
    // Where a capture was appended to another one, the returns of what was in flight are missing.
    if (last_.has_time && ClockJumps(last_.time, frame.ref().time)) DoubtAll(Undecided::kSecondCapture);
    last_ = frame.ref();
  }
  if (frame.kind() == wire::FrameKind::kOther) {
    if (head_ != tail_ && At(head_ - 1).view.ref().number + 1 == frame.ref().number) {
      At(head_ - 1).followed_by_other = true;
    }
    if (frame.cut_before_type()) {
      unreadable_ = true;
      DoubtAll(Undecided::kUnreadableReturn);
      for (Sender& sender : senders_) sender.rhythm.indices.Skip();
    }
    return;
  }
  const Direction direction = directions_.Classify(frame);
  const bool readable = frame.kind() != wire::FrameKind::kMalformed && frame.kind() != wire::FrameKind::kDamagedOnWire;
  // A sender without any frame that a slave can read is no master of this bus, whatever its address.
  const bool nonsense = !readable && directions_.IsForeignSender(frame) && OwnerOf(frame).sender == Owner::kAnybody;
  if (direction == Direction::kForeign || nonsense) {
    PushForeign(frame);
    return;
  }
  if (!readable) {
    unreadable_ = true;
    sink_.OnFrame(frame, direction);
    if (direction == Direction::kOutbound) {
      ++statistics_.outbound;
      Count(Undecided::kUnreadable);
      senders_[SenderIndex(frame)].rhythm.indices.Skip();
      sink_.OnUnusable(frame, Unusable::kMalformed, true);
    } else {
      PushUnusable(frame);
    }
    return;
  }
  any_cut_ = any_cut_ || frame.kind() == wire::FrameKind::kCut;
  const std::uint64_t key = frame.key();
  switch (direction) {
    case Direction::kOutbound:
      sink_.OnFrame(frame, direction);
      PushOutbound(frame, key, false);
      break;
    case Direction::kReturned:
      sink_.OnFrame(frame, direction);
      PushReturned(frame, key, FindOpen(frame, key));
      break;
    case Direction::kByPair:
      PushByPair(frame, key);
      break;
    case Direction::kForeign:
      break;
  }
}

void Pairing::PushOtherBus(const wire::FrameView& frame) noexcept {
  if (statistics_.other_bus++ == 0) statistics_.other_bus_interface = frame.interface_index();
  PushForeign(frame);
}

void Pairing::PushForeign(const wire::FrameView& frame) noexcept {
  sink_.OnFrame(frame, Direction::kForeign);
  if (statistics_.foreign++ == 0) statistics_.first_foreign = frame.ref().number;
  if (AnyWorkingCounter(frame)) ++statistics_.foreign_answered;
  if (frame.kind() != wire::FrameKind::kMalformed) return;
  ++statistics_.foreign_unreadable;
  sink_.OnUnusable(frame, Unusable::kMalformed, false);
}

std::uint8_t Pairing::SenderIndex(const wire::FrameView& frame) noexcept {
  const std::uint64_t mac = SenderOf(frame);
  for (std::uint8_t i = 0; i < sender_count_; ++i) {
    if (senders_[i].mac == mac) return i;
  }
  // More senders than any bus has: they share the last place.
  if (sender_count_ == senders_.size()) return static_cast<std::uint8_t>(senders_.size() - 1);
  senders_[sender_count_].mac = mac;
  senders_[sender_count_].assumed = directions_.Unanswered(frame) && !directions_.IsOnePort(frame);
  return sender_count_++;
}

/// Whose frames may have come back with this address: a frame keeps its own. Where the address is none that sends, a
/// switch or a card has written another one, and it may belong to any sender.
Pairing::Owner Pairing::OwnerOf(const wire::FrameView& returned) const noexcept {
  const std::uint64_t mac = SenderOf(returned);
  for (std::uint8_t i = 0; i < sender_count_; ++i) {
    if (senders_[i].mac == mac && senders_[i].newest > 0) return {i};
  }
  return {};
}

/// Whether the capture misses frames of this sender between its last one and this. Then what is in flight may have come
/// back unseen.
GapBefore Pairing::Follow(std::uint8_t sender, const wire::FrameView& frame, Repeats repeats, Copy copy) noexcept {
  Rhythm& rhythm = senders_[sender].rhythm;
  // Masters that do not number their frames send the same again and again.
  const bool again = IsSentAgain(sender, frame, repeats);
  const bool repeated = again || repeats == Repeats::kIndex || repeats == Repeats::kAll;
  const IndexSequence::Step step = rhythm.indices.Follow(frame, repeated);
  if (rhythm.indices.loose()) statistics_.last_loose = frame.ref().number;
  const FrameRef last = std::exchange(rhythm.last, frame.ref());
  if (last.has_time && frame.ref().has_time) rhythm.CompareStamps(Elapsed(last.time, frame.ref().time));
  if (step == IndexSequence::Step::kBroken) {
    // What was not sent cannot be missing: another program has a counter of its own, or the master skips numbers.
    if (copy == Copy::kPlain && !AnyInFlight(sender) && !HasTimeFor(rhythm, last, frame.ref())) return GapBefore::kNone;
    if (statistics_.gaps++ == 0) statistics_.first_gap = frame.ref();
    OnGap(sender);
    return GapBefore::kCertain;
  }
  // Where no number shows that it is the next one, it is unknown how many are missing with its outbound copy.
  if (copy == Copy::kProvesGap && !rhythm.indices.continued() && !OnlyOneFits(rhythm, last, frame.ref())) {
    OnGap(sender);
    return GapBefore::kCertain;
  }
  if (!last.has_time || !frame.ref().has_time) return GapBefore::kNone;
  const bool goes_on = step == IndexSequence::Step::kNext;
  const std::int64_t apart = Elapsed(last.time, frame.ref().time);
  const bool waited = HasWaited(last, frame.ref());
  if (repeats == Repeats::kAll && waited) ++statistics_.repeated_unanswered;
  if (again && IndicesThatMayBeMissing(rhythm, apart) > 0) {
    DoubtInFlight(sender, Undecided::kCaptureGap);
    return GapBefore::kPossible;
  }
  if (again) return GapBefore::kNone;
  const bool cyclic = !frame.empty() && wire::IsLogical(frame[0].command());
  if (repeats == Repeats::kAll && waited && (rhythm.indices.IsNumbered(frame) || (apart <= kRetryNs && !cyclic))) {
    return GapBefore::kNone;
  }
  if (ClockJumps(last.time, frame.ref().time) && !goes_on) {
    DoubtInFlight(sender, Undecided::kSecondCapture);
    return GapBefore::kPossible;
  }
  if (apart < 0) return GapBefore::kNone;  // the numbers continue: only the clock was set
  const bool silent = IsSilence(rhythm, apart);
  // Enough frames may be missing for the indices to wrap around, by chance to the next one.
  // If a return is missing as well, the master may have sent at its normal rate all the time.
  const bool overdue = goes_on && rhythm.indices.span() < kNoCoincidence && AnyOverdue(sender, frame.ref());
  if (!silent && !overdue && copy != Copy::kProvesGap) return GapBefore::kNone;  // nearly always
  const bool fast = overdue || (silent && copy == Copy::kProvesGap);
  const std::int64_t distance = std::max<std::int64_t>(fast ? rhythm.shortest_ns : rhythm.mean_ns, 1);
  const bool round = apart / distance + 1 >= rhythm.indices.span();
  if (copy == Copy::kProvesGap && goes_on && round && rhythm.indices.span() < kNoCoincidence) {
    OnGap(sender);
    return GapBefore::kCertain;
  }
  if (!silent && !(overdue && round)) return GapBefore::kNone;
  if (goes_on && (!round || rhythm.indices.span() >= kNoCoincidence)) return GapBefore::kNone;
  // A master that waits for a frame until its time-out is silent, too.
  if (!goes_on || apart > kSilentNs) DoubtInFlight(sender, Undecided::kSilence);
  return GapBefore::kPossible;
}

/// True when a master may have waited for one frame before it sent the other: longer than frames take.
bool Pairing::HasWaited(const FrameRef& before, const FrameRef& now) const noexcept {
  if (!before.has_time || !now.has_time) return false;
  const std::int64_t apart = Elapsed(before.time, now.time);
  return apart > kCopyNs && apart / 2 > typical_round_trip_ns_;
}

void Pairing::Rhythm::CompareStamps(std::int64_t apart) noexcept {
  shared_score = apart > 0 ? std::max(shared_score - 1, 0) : std::min(shared_score + kShared, kManyShared);
}

/// True when the sender repeats its last frame after that one returned, within kLongestTimeOutNs. Masters that do not
/// number their frames do so all the time: false.
bool Pairing::IsSentAgain(std::uint8_t sender, const wire::FrameView& frame, Repeats repeats) const noexcept {
  const Rhythm& rhythm = senders_[sender].rhythm;
  return repeats == Repeats::kAnswered && rhythm.indices.was_next() && HasWaited(rhythm.last, frame.ref()) &&
         Elapsed(rhythm.last.time, frame.ref().time) <= kLongestTimeOutNs;
}

/// How many indices the master has, if it may have used all of them once between two frames with the same one.
/// @return 0: there was no time for that
std::uint32_t Pairing::IndicesThatMayBeMissing(const Rhythm& rhythm, std::int64_t apart) noexcept {
  const std::uint32_t span = rhythm.indices.span();
  const std::int64_t distance =
      rhythm.HasSharedStamps() ? kShortestFrameNs : std::max(rhythm.mean_ns / 2, kShortestFrameNs);
  return (std::int64_t{span} - 1) * distance <= apart ? std::max(span, 1U) : 0;
}

/// True when the frames whose indices are skipped could be sent from one frame to the other, as fast as the wire or the
/// master permits. Stamps that frames share, or that are too coarse for round trips, show nothing.
bool Pairing::HasTimeFor(const Rhythm& rhythm, const FrameRef& from, const FrameRef& to) const noexcept {
  if (!from.has_time || !to.has_time || typical_round_trip_ns_ == 0 || typical_round_trip_ns_ > kMaxRoundTripNs) {
    return true;
  }
  if (rhythm.HasSharedStamps() || ClockJumps(from.time, to.time)) return true;
  const bool known = rhythm.longest_before_ns > 0;
  const std::int64_t each = std::max(known ? rhythm.shortest_ns / 2 : 0, kShortestFrameNs);
  return rhythm.indices.skipped() * each <= 2 * Elapsed(from.time, to.time) + kStampsNs;
}

bool Pairing::AnyInFlight(std::uint8_t sender) noexcept {
  for (std::uint64_t s = tail_; s != head_; ++s) {
    const Slot& slot = At(s);
    if (slot.state == SlotState::kOpen && slot.sender == sender && !slot.copy) return true;
  }
  return false;
}

/// True when no more frames fit between one and the return of another than the one that came back.
bool Pairing::OnlyOneFits(const Rhythm& rhythm, const FrameRef& last, const FrameRef& returned) noexcept {
  if (!last.has_time || !returned.has_time || rhythm.shortest_ns == 0 || rhythm.HasSharedStamps()) return false;
  const std::int64_t apart = Elapsed(last.time, returned.time);
  return apart > 0 && apart / 2 < rhythm.shortest_ns;
}

/// True when a master that sends like this was silent for long.
bool Pairing::IsSilence(Rhythm& rhythm, std::int64_t apart) noexcept {
  const std::int64_t longest = std::max(rhythm.longest_ns, rhythm.longest_before_ns);
  const bool known = rhythm.longest_before_ns > 0 || rhythm.frames >= kLeast ||
                     (rhythm.frames >= kFew && rhythm.indices.loose() && apart / kSilentTimesOfFew > longest);
  const bool silent = known && apart / kSilentTimes > longest;
  const std::int64_t counted = silent ? longest : apart;
  rhythm.mean_ns = rhythm.mean_ns == 0 ? counted : rhythm.mean_ns + (counted - rhythm.mean_ns) / 16;
  rhythm.longest_ns = std::max(rhythm.longest_ns, apart);
  if (apart > 0 && (rhythm.shortest_ns == 0 || apart < rhythm.shortest_ns)) rhythm.shortest_ns = apart;
  if (++rhythm.frames >= kWindow) {
    rhythm.longest_before_ns = std::max<std::int64_t>(rhythm.longest_ns, 1);
    rhythm.longest_ns = 0;
    rhythm.frames = 0;
  }
  return silent;
}

/// What is in flight may have come back unseen. What was overtaken more than once before had its time (a frame without
/// number may stand between it and the one that shows the capture gap).
void Pairing::DoubtInFlight(std::uint8_t sender, Undecided reason) noexcept {
  for (std::uint64_t s = tail_; s != head_; ++s) {
    Slot& slot = At(s);
    if (slot.state == SlotState::kOpen && slot.sender == sender && slot.overtaken <= 1) Doubt(slot, reason);
  }
}

void Pairing::Doubt(Slot& slot, Undecided reason) noexcept {
  if (slot.undecided) return;
  slot.undecided = true;
  slot.reason = reason;
}

void Pairing::OnGap(std::uint8_t sender) noexcept {
  DoubtInFlight(sender, Undecided::kCaptureGap);
  for (std::uint64_t s = tail_; s != head_; ++s) {
    Slot& slot = At(s);
    if (slot.state != SlotState::kOpen || slot.sender != sender || slot.overtaken > 0 || slot.copy) continue;
    slot.overtaken = 1;  // a frame after the capture gap with the same index comes first
    slot.before_gap = true;
    sink_.OnDoubtful(slot.view);
  }
}

/// The capture gap to be reported with the frame of this number.
GapBefore Pairing::TakeGap(std::uint64_t sequence) noexcept {
  return gap_ == GapBefore::kNone || sequence < after_gap_ ? GapBefore::kNone : std::exchange(gap_, GapBefore::kNone);
}

/// A return without its outbound copy: whether the capture misses more than that copy.
GapBefore Pairing::FindGapBefore(const wire::FrameView& orphan) noexcept {
  const std::uint8_t sender = SenderIndex(orphan);
  std::uint64_t open = 0;
  for (std::uint64_t s = tail_; s != head_; ++s) {
    if (At(s).state == SlotState::kOpen && At(s).sender == sender) ++open;
  }
  // Frames sent later may be in flight already: then it only looks as if it came from before. The capture gap that one
  // of them showed lies before this one. Not where the frame that had its number is known.
  if (open > 0 && senders_[sender].rhythm.indices.IsAfter(orphan, open) && !WasSent(sender, orphan, Like::kIndex)) {
    return TakeGap(head_);
  }
  const Copy copy = ProvesGap(senders_[sender], orphan) ? Copy::kProvesGap : Copy::kPlain;
  const GapBefore gap = Follow(sender, orphan, Repeats::kNo, copy);
  return std::max(gap, TakeGap(head_));
}

/// True when one of the last frames has its number, or its key.
bool Pairing::WasSent(std::uint8_t sender, const wire::FrameView& frame, Like like) noexcept {
  const std::uint64_t oldest = head_ > kDuplicateFrames ? head_ - kDuplicateFrames : 0;
  for (std::uint64_t s = head_; s != oldest && !frame.empty(); --s) {
    const wire::FrameView& sent = At(s - 1).view;
    if (At(s - 1).sender != sender || sent.empty()) continue;
    if (like == Like::kKey ? At(s - 1).key == frame.key() : sent[0].index() == frame[0].index()) return true;
  }
  return false;
}

/// True when a frame has been in flight for much longer than others take.
bool Pairing::AnyOverdue(std::uint8_t sender, const FrameRef& now) noexcept {
  if (typical_round_trip_ns_ == 0 || !now.has_time) return false;
  for (std::uint64_t s = tail_; s != head_; ++s) {
    const Slot& slot = At(s);
    const FrameRef& sent = slot.view.ref();
    if (slot.state != SlotState::kOpen || slot.sender != sender || slot.overtaken > 0 || slot.copy) continue;
    if (sent.has_time && Elapsed(sent.time, now.time) / kDuplicateRoundTrips > typical_round_trip_ns_) return true;
  }
  return false;
}

/// What comes back was sent. Where both copies of what this master sends are captured, and in the order in which they
/// were on the wire, the capture misses the other one, and perhaps more with it.
bool Pairing::ProvesGap(const Sender& sender, const wire::FrameView& orphan) const noexcept {
  if (!sender.paired || sender.own_return_port || files_early_ || any_cut_ || unreadable_) return false;
  if (directions_.returns_stamped_first() || directions_.HasOnePort() || directions_.IsOtherEnd(orphan)) return false;
  for (std::size_t i = 0; i < orphan.size(); ++i) {
    if (orphan[i].circulating()) return false;
  }
  return true;
}

Pairing::Repeats Pairing::RepeatsLast(std::uint8_t sender, std::uint64_t key, ByteSpan kept) noexcept {
  const std::uint64_t newest = senders_[sender].newest;
  // Slots of answered frames are used again after that.
  if (newest == 0 || newest + kDuplicateFrames <= head_) return Repeats::kNo;
  const Slot& before = At(newest - 1);
  const bool answered = before.state == SlotState::kAnswered;
  if ((before.state != SlotState::kOpen && !answered) || before.key != key) return Repeats::kNo;
  const bool all = std::equal(before.bytes.begin(), before.bytes.end(), kept.begin(), kept.end());
  if (answered) return all ? Repeats::kAnswered : Repeats::kNo;
  return all ? Repeats::kAll : Repeats::kIndex;
}

void Pairing::PushOutbound(const wire::FrameView& frame, std::uint64_t key, bool before_first_return) noexcept {
  ++statistics_.outbound;
  const std::uint8_t sender = SenderIndex(frame);
  if (senders_[sender].assumed) {
    Count(Undecided::kNoReturns);
    const GapBefore gap = Follow(sender, frame, Repeats::kNo);
    // The other end of a redundant line sends what the main end sends: that counts.
    if (!directions_.IsOtherEnd(frame)) sink_.OnTransaction({&frame, nullptr, true, gap});
    return;
  }
  if (WasEarly(frame, key)) {
    files_early_ = true;
    ++statistics_.paired;
    --statistics_.unmatched_returned;
    if (directions_.returns_stamped_first()) {
      Overtake(sender, head_);
      ReportLost(head_);
    }
    return;
  }
  if (head_ - tail_ >= kSlots) {
    Slot& oldest = At(tail_);
    if (oldest.state == SlotState::kOpen) {
      Lose(oldest, oldest.overtaken > 0 ? Loss::kOvertaken : Loss::kSilence);
      ReportLost(tail_ + 1);
    }
    ++tail_;
    DropAnsweredTail();
  }
  // Without what follows the datagrams, so that huge packets do not stay in memory.
  const ByteSpan kept = frame.bytes().first(frame.used_bytes());
  const bool copy = MayBeCopy(frame, kept);
  bool again = false;
  bool answered_again = false;
  std::uint32_t round = 0;
  if (!copy) {
    const Repeats repeats = RepeatsLast(sender, key, kept);
    again = repeats == Repeats::kAll;
    if (IsSentAgain(sender, frame, repeats)) {
      const Rhythm& rhythm = senders_[sender].rhythm;
      answered_again = At(senders_[sender].newest - 1).slaves_counted;
      round = IndicesThatMayBeMissing(rhythm, Elapsed(rhythm.last.time, frame.ref().time));
    }
    if (const GapBefore gap = Follow(sender, frame, repeats); gap != GapBefore::kNone) {
      if (gap > gap_) gap_ = gap;
      after_gap_ = head_;
    }
  }
  TakeWarmSlot();
  Slot& slot = At(head_);
  slot.sequence = head_++;
  slot.sent_before = statistics_.outbound;
  senders_[sender].newest = head_;
  ++statistics_.in_flight;
  slot.state = SlotState::kOpen;
  slot.sender = sender;
  slot.followed_by_other = false;
  slot.other_end = directions_.IsOtherEnd(frame);
  slot.undecided = before_first_return;
  slot.reason = Undecided::kBeforeFirstReturn;
  slot.copy = copy;
  slot.again = again;
  slot.answered_again = answered_again;
  slot.round = round;
  slot.before_gap = false;
  slot.overtaken = 0;
  slot.key = key;
  TakeBytes(slot.bytes, kept);
  slot.view.Rebase(frame, slot.bytes);
  if (!slot.other_end && Instructs(slot.view)) sink_.OnSent(slot.view);
}

/// True when the very packet before this one holds the same bytes, and no master repeats a frame so soon.
bool Pairing::MayBeCopy(const wire::FrameView& frame, ByteSpan kept) noexcept {
  if (head_ == tail_) return false;
  const Slot& before = At(head_ - 1);
  const FrameRef& ref = before.view.ref();
  if (before.state != SlotState::kOpen || ref.number + 1 != frame.ref().number) return false;
  if (!ref.has_time || !frame.ref().has_time) return false;
  const std::int64_t apart = Elapsed(ref.time, frame.ref().time);
  if (apart < -kCopyNs || apart > kCopyNs) return false;
  // Equal stamps that are too coarse for round trips cannot distinguish a copy from a repetition.
  if (apart == 0 && (typical_round_trip_ns_ == 0 || typical_round_trip_ns_ > kMaxRoundTripNs)) return false;
  return std::equal(before.bytes.begin(), before.bytes.end(), kept.begin(), kept.end());
}

/// Frames come back at once nearly always: a slot that has just become free is used again, so that the same few stay in
/// the cache.
void Pairing::TakeWarmSlot() noexcept {
  const std::uint64_t asked_for = std::min(tail_, head_ > kDuplicateFrames ? head_ - kDuplicateFrames : 0);
  if (asked_for > 0) std::swap(place_[head_ % kSlots], place_[(asked_for - 1) % kSlots]);
}

/// Both copies of a sender's frames look alike: what has come further than a frame in flight is its return. Where the
/// tap has slaves on its way out, what they alone were asked comes back as it passed.
void Pairing::PushByPair(const wire::FrameView& frame, std::uint64_t key) noexcept {
  const Progress progress = ProgressOf(frame);
  Slot* further = nullptr;
  Slot* untouched = nullptr;
  const bool after_slaves = directions_.IsTappedAfterSlaves(frame);
  const bool other_end = directions_.IsOtherEnd(frame);
  const Owner owner = OwnerOf(frame);
  for (std::uint64_t s = tail_; s != head_; ++s) {
    Slot& slot = At(s);
    if (slot.state != SlotState::kOpen || slot.key != key || slot.other_end != other_end) continue;
    if (!owner.MayBe(slot.sender)) continue;
    if (!Answers(slot.view, frame)) continue;
    const Progress sent = ProgressOf(slot.view);
    if (Further(progress, sent)) {
      if (further == nullptr || (further->overtaken > 0 && slot.overtaken == 0)) further = &slot;
    } else if (progress == sent && (progress.counted == 0 || after_slaves) && IsSoon(slot.view.ref(), frame.ref())) {
      // A poll that no slave answered; later it is the master's repetition. What was overtaken is nearly always lost:
      // then this is the next one like it.
      if (untouched == nullptr && slot.overtaken == 0) untouched = &slot;
    }
  }
  Slot* slot = further != nullptr ? further : untouched;
  // Masters send working counters of 0; downstream of slaves the outbound copy has some, too.
  const bool counted = progress.counted > 0 && !after_slaves;
  if (slot == nullptr && directions_.JoinedLate(frame) && !directions_.bit_is_no_evidence()) {
    PushForeign(frame);
    return;
  }
  if (slot == nullptr && !counted) {
    sink_.OnFrame(frame, Direction::kOutbound);
    // Before the first pair it is unknown whether a frame is on its way out or back.
    PushOutbound(frame, key, !senders_[SenderIndex(frame)].answered);
    return;
  }
  sink_.OnFrame(frame, Direction::kReturned);
  PushReturned(frame, key, slot);
}

Pairing::Slot* Pairing::FindOpen(const wire::FrameView& frame, std::uint64_t key) noexcept {
  Slot* oldest = nullptr;
  Slot* newest = nullptr;
  const bool other_end = directions_.IsOtherEnd(frame);
  const Owner owner = OwnerOf(frame);
  for (std::uint64_t s = tail_; s != head_; ++s) {
    Slot& slot = At(s);
    if (slot.state != SlotState::kOpen || slot.key != key || slot.other_end != other_end) continue;
    if (!owner.MayBe(slot.sender)) continue;
    if (!Answers(slot.view, frame)) continue;
    if (slot.overtaken > 0 && (PassedOthers(slot, frame) || IsTooOld(slot, frame))) continue;
    // A frame that was overtaken is nearly always lost; it only answers when no other candidate exists.
    if (oldest == nullptr || (oldest->overtaken > 0 && slot.overtaken == 0)) oldest = &slot;
    if (!slot.copy || newest == nullptr) newest = &slot;
  }
  if (oldest == nullptr && any_cut_) return FindCut(frame);
  if (oldest == newest || oldest->overtaken > 0) return oldest;
  // The master repeated a frame: two equal ones are in flight and one came back.
  const FrameRef& first = oldest->view.ref();
  const FrameRef& second = newest->view.ref();
  if (first.has_time && second.has_time && frame.ref().has_time) {
    const std::int64_t age_first = Elapsed(first.time, frame.ref().time);
    const std::int64_t age_second = Elapsed(second.time, frame.ref().time);
    // Before the first pair nothing is known but that no frame is in flight for so long.
    if (typical_round_trip_ns_ == 0) return age_first > kSilentNs && age_first / 8 > age_second ? newest : oldest;
    // Where the answer of the last one is late as well, something held them all: then they come back in order.
    const bool late = age_second / 8 > typical_round_trip_ns_;
    if (age_first / 8 > typical_round_trip_ns_ && age_second > typical_round_trip_ns_ / 2 && !late) return newest;
  }
  return oldest;
}

/// True when the frame would have passed another number of slaves than the one before: positions are no part of what
/// slaves never change, so frames to two of them look alike.
bool Pairing::PassedOthers(const Slot& slot, const wire::FrameView& frame) const noexcept {
  if (passed_ == kNotCounted) return false;
  const int passed = Passed(slot.view, frame);
  return passed != kNotCounted && passed != passed_;
}

/// Where returns may be stamped first, the frame that this one answers may come yet: what was sent long before is lost.
bool Pairing::IsTooOld(const Slot& slot, const wire::FrameView& frame) const noexcept {
  const FrameRef& sent = slot.view.ref();
  return directions_.returns_stamped_first() && sent.has_time && frame.ref().has_time &&
         Elapsed(sent.time, frame.ref().time) > DirectionLearner::kSkewNs;
}

/// Where one of the copies was cut by the snap length, the datagrams that both still hold must agree. A cut in the
/// first datagram leaves the order.
Pairing::Slot* Pairing::FindCut(const wire::FrameView& frame) noexcept {
  const Owner owner = OwnerOf(frame);
  for (std::uint64_t s = tail_; s != head_; ++s) {
    Slot& slot = At(s);
    if (slot.state != SlotState::kOpen || slot.overtaken > 0 || !owner.MayBe(slot.sender)) continue;
    if (slot.view.kind() != wire::FrameKind::kCut && frame.kind() != wire::FrameKind::kCut) continue;
    const std::size_t common = std::min(slot.view.size(), frame.size());
    if (!Answers(slot.view, frame, common)) continue;
    if (common == 0)
      DoubtAll(Undecided::kUnreadableReturn);  // a guess: none of those in flight can be called lost any more
    return &slot;
  }
  return nullptr;
}

/// It is unknown what a packet was; it may have been the return of any frame in flight.
void Pairing::DoubtAll(Undecided reason) noexcept {
  for (std::uint64_t s = tail_; s != head_; ++s) Doubt(At(s), reason);
}

Pairing::Slot* Pairing::FindAlike(const wire::FrameView& frame) noexcept {
  if (frame.empty()) return nullptr;
  Slot* flipped = nullptr;
  const Owner owner = OwnerOf(frame);
  for (std::uint64_t s = tail_; s != head_; ++s) {
    Slot& slot = At(s);
    if (slot.state != SlotState::kOpen || slot.view.empty() || slot.overtaken >= kStale) continue;
    if (!owner.MayBe(slot.sender)) continue;
    const wire::DatagramView a = slot.view[0];
    const wire::DatagramView b = frame[0];
    // One flipped bit leaves at least two of these three intact, and nearly always the index.
    if (a.index() == b.index() && (a.command_byte() == b.command_byte() || a.length() == b.length())) return &slot;
    if (flipped == nullptr && slot.overtaken == 0 && OnlyIndexFlipped(a, b)) flipped = &slot;
  }
  return flipped;
}

/// True when a frame of the same commands, addresses and lengths that was sent later is still in flight: what comes
/// back may be that one's, where one before was lost and its sender numbers by what comes back.
bool Pairing::MayBeOfLater(const Slot& slot) noexcept {
  const auto same = [](const wire::DatagramView& a, const wire::DatagramView& b) {
    return a.command() == b.command() && a.ado() == b.ado() && a.length() == b.length() &&
           (wire::IncrementsAdp(a.command()) || a.adp() == b.adp());
  };
  bool later = false;
  for (std::uint64_t s = tail_; s != head_; ++s) {
    const Slot& other = At(s);
    if (&other == &slot) {
      later = true;
      continue;
    }
    if (!later || other.state != SlotState::kOpen || other.sender != slot.sender) continue;
    if (other.view.size() != slot.view.size()) continue;
    bool alike = true;
    for (std::size_t i = 0; alike && i < slot.view.size(); ++i) alike = same(slot.view[i], other.view[i]);
    if (alike) return true;
  }
  return false;
}

/// True when the master may have sent a frame like it once more since, whose outbound copy the capture misses: one with
/// the same index was sent since, or before, not much farther away, or the numbers may have come round. Where packets
/// are missing, so are some of the frames between.
bool Pairing::MayBeOfMissing(const Slot& slot) noexcept {
  constexpr std::uint64_t kMargin = 2;
  const std::uint64_t since = (head_ - slot.sequence) * kMargin;
  const IndexSequence& indices = senders_[slot.sender].rhythm.indices;
  if (indices.IsNumbered(slot.view) && since > indices.span()) return true;
  const std::uint64_t oldest = slot.sequence > since ? slot.sequence - since : 0;
  for (std::uint64_t s = std::max(oldest, head_ > kSlots ? head_ - kSlots : 0); s != head_ && !slot.view.empty(); ++s) {
    const wire::FrameView& other = At(s).view;
    if (s == slot.sequence || At(s).sender != slot.sender || other.empty()) continue;
    if (other[0].index() == slot.view[0].index()) return true;
  }
  return false;
}

/// All that is counted is counted before the sink gets the frame: statistics() then shows the frame that came back
/// as returned, and those that it overtook for the last time as lost.
void Pairing::Answer(Slot& slot, const wire::FrameView& returned, ByteSpan datagrams) noexcept {
  slot.state = SlotState::kAnswered;
  slot.returned = returned.ref();
  slot.slaves_counted = AnyWorkingCounter(returned);
  // Only a number distinguishes a late frame from one whose outbound copy is not in the capture.
  const IndexSequence& indices = senders_[slot.sender].rhythm.indices;
  const std::uint32_t overtaken = slot.overtaken - (slot.before_gap ? 1U : 0U);
  if (overtaken > latest_ && indices.IsNumbered(slot.view) && !indices.IsNext(slot.view)) latest_ = overtaken;
  if (overtaken > 0 && MayBeOfMissing(slot)) {
    if (!statistics_.first_in_doubt.seen()) statistics_.first_in_doubt = returned.ref();
  } else if (overtaken > 0 && !MayBeOfLater(slot)) {
    if (statistics_.reordered++ == 0) statistics_.first_reordered = returned.ref();
    statistics_.last_reordered = returned.ref();
  }
  slot.returned_interface = returned.interface_index();
  TakeBytes(slot.returned_bytes, datagrams);
  ++statistics_.paired;
  --statistics_.in_flight;
  Sender& sender = senders_[slot.sender];
  sender.own_return_port = returned.interface_index() != slot.view.interface_index();
  // Captures of two interfaces do not begin at the same moment: what was sent before may have come back unseen.
  const bool first_on_other_port = !sender.answered && sender.own_return_port;
  if (!sender.answered) DoubtSentWithoutAnswer(slot);
  sender.answered = sender.paired = true;
  unreadable_ = false;
  for (std::uint64_t s = tail_; first_on_other_port && s != head_ && &At(s) != &slot; ++s) {
    Slot& other = At(s);
    if (other.state == SlotState::kOpen && other.sender == slot.sender) Doubt(other, Undecided::kBeforeFirstReturn);
  }
  Overtake(slot.sender, slot.sequence);
}

/// Before the first frame that comes back to its sender: as many as no bus loses in a row, for longer than a frame is
/// in flight. No slave was there to answer.
void Pairing::DoubtSentWithoutAnswer(const Slot& first_answered) noexcept {
  std::uint32_t unanswered = 0;
  FrameRef first;
  for (std::uint64_t s = tail_; s != head_ && &At(s) != &first_answered; ++s) {
    const Slot& slot = At(s);
    if (slot.state != SlotState::kOpen || slot.sender != first_answered.sender) continue;
    if (unanswered++ == 0) first = slot.view.ref();
  }
  const FrameRef& answered = first_answered.view.ref();
  const bool timed = first.has_time && answered.has_time;
  if (unanswered < kSilentFramesWithTime || !timed || Elapsed(first.time, answered.time) <= kSilentNs) return;
  for (std::uint64_t s = tail_; s != head_ && &At(s) != &first_answered; ++s) {
    Slot& slot = At(s);
    if (slot.state == SlotState::kOpen && slot.sender == first_answered.sender) {
      Doubt(slot, Undecided::kNoAnswers);
    }
  }
}

/// What came back a moment ago with the same bytes. A master with few indices sends equal frames again and again, so
/// only what is close counts.
const Pairing::Slot* Pairing::FindOriginal(const wire::FrameView& frame, std::uint64_t key) noexcept {
  if (frame.kind() == wire::FrameKind::kCut) return nullptr;  // what is after the cut may differ
  const ByteSpan datagrams = frame.payload();
  const std::uint64_t oldest = head_ > kDuplicateFrames ? head_ - kDuplicateFrames : 0;
  for (std::uint64_t s = head_; s != oldest; --s) {
    const Slot& answered = At(s - 1);
    if (answered.state != SlotState::kAnswered || answered.key != key) continue;
    const std::vector<std::uint8_t>& bytes = answered.returned_bytes;
    if (bytes.empty() || !std::equal(bytes.begin(), bytes.end(), datagrams.begin(), datagrams.end())) continue;
    return IsSoon(answered.returned, frame.ref()) ? &answered : nullptr;
  }
  return nullptr;
}

/// Nothing takes much longer on its way than the others. With stamps too coarse for that, frames go by alone.
bool Pairing::IsSoon(const FrameRef& first, const FrameRef& second) const noexcept {
  if (!first.has_time || !second.has_time) return true;
  const bool fine = typical_round_trip_ns_ > 0 && typical_round_trip_ns_ <= kMaxRoundTripNs;
  const std::int64_t longest =
      fine ? std::min(kDuplicateNs, kDuplicateRoundTrips * typical_round_trip_ns_) : kDuplicateNs;
  return Elapsed(first.time, second.time) <= longest;
}

/// True when the returned copy of this outbound frame stands before it in the file: interfaces and receive queues, each
/// with a buffer of its own, are not always written in order. The time stamps have to show it, unless the clocks of the
/// interfaces differ.
bool Pairing::WasEarly(const wire::FrameView& frame, std::uint64_t key) noexcept {
  if (!any_early_) return false;
  for (Early& early : early_) {
    if (!early.used || early.key != key) continue;
    if (!frame.ref().has_time || !early.ref.has_time) continue;
    const std::int64_t round_trip = Elapsed(frame.ref().time, early.ref.time);
    // On one interface equal stamps show nothing: a later frame of a master that uses one index only looks the same.
    const bool one_interface = early.interface_index == frame.interface_index();
    const bool skewed = directions_.returns_stamped_first() && !one_interface;
    const std::int64_t least = one_interface ? 1 : skewed ? -DirectionLearner::kSkewNs : 0;
    if (round_trip < least || round_trip > kDuplicateNs) continue;
    if (round_trip < 0) ++statistics_.stamped_first;
    early.used = false;
    if (early.counted_as_missed) --statistics_.missed_outbound;
    return true;
  }
  return false;
}

/// A master whose first frame comes back when another one has long been at work. Who begins with a command to all
/// slaves when nothing is in flight sets the bus up: another program was started. Else another capture was appended.
GapBefore Pairing::AppearsLate(const Sender& master, const wire::FrameView* sent, const FrameRef& behind) noexcept {
  constexpr std::uint64_t kLong = 32;
  if (master.answered || statistics_.paired < kLong) return GapBefore::kNone;
  const bool begins = sent != nullptr && IsBroadcastOnly(*sent);
  if (begins && !IsWaitedForByOthers(master)) return GapBefore::kPossible;
  if (statistics_.gaps++ == 0) statistics_.first_gap = behind;
  for (std::uint8_t other = 0; other < sender_count_; ++other) {
    if (senders_[other].answered) DoubtInFlight(other, Undecided::kSecondCapture);
  }
  return GapBefore::kCertain;
}

/// True when a frame of another sender to which frames come back is in flight.
bool Pairing::IsWaitedForByOthers(const Sender& sender) noexcept {
  for (std::uint64_t s = tail_; s != head_; ++s) {
    const Slot& slot = At(s);
    const Sender& other = senders_[slot.sender];
    if (slot.state == SlotState::kOpen && &other != &sender && other.answered) return true;
  }
  return false;
}

void Pairing::PushReturned(const wire::FrameView& frame, std::uint64_t key, Slot* slot) noexcept {
  ++statistics_.returned;
  if (statistics_.no_answers) statistics_.no_answers = false;
  Sender& sender = senders_[SenderIndex(frame)];
  sender.assumed = false;
  if (slot == nullptr && directions_.HasOnePort() && directions_.IsOtherEnd(frame) && !AnyWorkingCounter(frame)) {
    PushFromOtherEnd(frame, key);
    return;
  }
  // A frame that was overtaken is nearly always lost. What looks like its return is another copy of a later frame that
  // came back a moment ago: with few indices equal frames are sent again soon.
  if (slot != nullptr && slot->overtaken > 0 && !slot->copy && !sender.rhythm.indices.IsNext(frame)) {
    const Slot* original = FindOriginal(frame, key);
    const bool later = original != nullptr && original->sequence > slot->sequence;
    if (later && WasWaitedFor(*slot, *original)) {
      AnswerWaitedFor(*slot, *original, frame);
      return;
    }
    if (later) slot = nullptr;
  }
  if (slot != nullptr && slot->copy && FindOriginal(frame, key) != nullptr) {
    // Both copies of a packet that was captured twice came back, and so did those of its return.
    slot->state = SlotState::kAnswered;
    slot->returned_bytes.clear();
    --statistics_.in_flight;
    Count(Undecided::kCapturedTwice);
    ++statistics_.captured_twice;
    ++statistics_.outbound_twice;
    DropAnsweredTail();
    return;
  }
  if (slot != nullptr) {
    AnswerInFlight(*slot, frame);
    return;
  }
  if (IsSecondCopy(sender, frame, key) || IsAltered(frame)) return;
  ++statistics_.unmatched_returned;
  // Frames do not overtake each other: what was sent before the capture began comes back before all others.
  const bool missed = statistics_.paired > 0;
  if (missed) {
    ++statistics_.missed_outbound;
    drops_.MissOutbound(frame.ref().number, statistics_.outbound);
  }
  any_early_ = true;
  early_[next_early_] = {key, frame.ref(), frame.interface_index(), true, missed};
  next_early_ = static_cast<std::uint8_t>((next_early_ + 1U) % early_.size());
  const GapBefore late = AppearsLate(sender, nullptr, frame.ref());
  sender.answered = true;
  HandOver({nullptr, &frame, false, std::max(late, FindGapBefore(frame))});
}

/// At the only port that was captured: the line is whole, and what this port sent has reached the other one.
void Pairing::PushFromOtherEnd(const wire::FrameView& frame, std::uint64_t key) noexcept {
  ++statistics_.unmatched_returned;
  ++statistics_.other_end;
  const bool dummy = frame.size() == 1 && wire::IsBroadcast(frame[0].command());
  for (std::uint64_t s = head_; s != tail_; --s) {
    Slot& slot = At(s - 1);
    if (slot.state != SlotState::kOpen || !directions_.IsOnePort(slot.view)) continue;
    const bool same_dummy = dummy && !slot.view.empty() && slot.view[0].index() == frame[0].index();
    if (slot.key != key && !same_dummy) continue;
    slot.state = SlotState::kAnswered;
    slot.returned_bytes.clear();
    --statistics_.in_flight;
    Count(Undecided::kNoReturns);
    for (std::uint64_t before = tail_; before != s - 1; ++before) {
      Slot& other = At(before);
      if (other.state == SlotState::kOpen && other.sender == slot.sender) Doubt(other, Undecided::kNoReturns);
    }
    Overtake(slot.sender, slot.sequence);
    ReportLost(slot.sequence);
    sink_.OnTransaction({&slot.view, nullptr, true, TakeGap(slot.sequence)});
    DropAnsweredTail();
    return;
  }
}

/// Everything that this sender sent before the frame of this number and that is still open has been overtaken.
void Pairing::Overtake(std::uint8_t sender, std::uint64_t sequence) noexcept {
  for (std::uint64_t s = tail_; s != sequence; ++s) {
    Slot& other = At(s);
    if (other.state != SlotState::kOpen || other.sender != sender) continue;
    if (++other.overtaken >= GivenUpAfter()) Lose(other, Loss::kOvertaken);
  }
}

/// At the other end of a redundant line that is whole the frames meet no slave: what was not taken there is no refusal.
void Pairing::HandOver(BusTransaction&& transaction) noexcept {
  transaction.other_end = directions_.IsOtherEnd(*transaction.returned);
  if (transaction.other_end && !AnyWorkingCounter(*transaction.returned)) {
    ++statistics_.other_end;
  } else {
    sink_.OnTransaction(transaction);
  }
}

void Pairing::AnswerInFlight(Slot& slot, const wire::FrameView& frame) noexcept {
  DoubtOvertakenBy(slot);
  const FrameRef& sent = slot.view.ref();
  const FrameRef again = RepeatedSince(slot);
  const bool other = !again.seen() && MayAnswerLater(slot, frame);
  if (slot.again) ReportLate(slot);
  if (slot.answered_again) ReportAnswered(slot, frame);
  if (sent.has_time && frame.ref().has_time) {
    const std::int64_t round_trip = Elapsed(sent.time, frame.ref().time);
    if (round_trip == 0) ++statistics_.identical_stamps;
    if (round_trip > 0 && slot.overtaken == 0 && !other && !again.seen()) {
      typical_round_trip_ns_ = typical_round_trip_ns_ == 0
                                   ? round_trip
                                   : typical_round_trip_ns_ + (round_trip - typical_round_trip_ns_) / 16;
    }
  }
  GapBefore gap = std::max(TakeGap(slot.sequence), AppearsLate(senders_[slot.sender], &slot.view, sent));
  if (gap == GapBefore::kNone && other) gap = GapBefore::kPossible;
  if (const int passed = Passed(slot.view, frame); passed != kNotCounted) passed_ = passed;
  Answer(slot, frame, frame.payload());
  HandOver({&slot.view, &frame, false, gap});
  ReportLost(slot.sequence);
  DropAnsweredTail();
}

/// The master sent nothing after the frame until it sent the same one again, and that is its rhythm no more: it had
/// waited. Both were sent and both came back, so none is lost and none came back twice.
bool Pairing::WasWaitedFor(const Slot& slot, const Slot& again) noexcept {
  if (slot.overtaken != 1 || again.sender != slot.sender || again.bytes != slot.bytes) return false;
  for (std::uint64_t s = slot.sequence + 1; s < again.sequence; ++s) {
    if (At(s).sender == slot.sender) return false;
  }
  return BrokeRhythm(slot, again) || (!HasRhythm(slot) && HasWaited(slot.view.ref(), again.view.ref()) &&
                                      Elapsed(slot.view.ref().time, again.view.ref().time) <= kLongestTimeOutNs);
}

/// Enough frames show how far apart the sender sends them.
bool Pairing::HasRhythm(const Slot& slot) const noexcept {
  const Rhythm& rhythm = senders_[slot.sender].rhythm;
  return rhythm.longest_before_ns > 0 || rhythm.frames >= kLeast;
}

/// True when the time between both is a time-out, and not the one between all frames.
bool Pairing::BrokeRhythm(const Slot& first, const Slot& second) const noexcept {
  if (!HasWaited(first.view.ref(), second.view.ref())) return false;
  const std::int64_t apart = Elapsed(first.view.ref().time, second.view.ref().time);
  return HasRhythm(first) && apart <= kLongestTimeOutNs && apart / 2 > senders_[first.sender].rhythm.mean_ns;
}

/// What comes back last is handed over for the frame that was sent first: the bytes of both are the same.
void Pairing::AnswerWaitedFor(Slot& slot, const Slot& again, const wire::FrameView& frame) noexcept {
  slot.overtaken = 0;
  Answer(slot, frame, frame.payload());
  if (BrokeRhythm(slot, again)) {
    sink_.OnRepeated({.frame = slot.view,
                      .before = slot.view.ref(),
                      .again = again.view.ref(),
                      .returned = again.returned,
                      .usual_ns = typical_round_trip_ns_});
  }
  HandOver({&slot.view, &frame, false, TakeGap(slot.sequence)});
  ReportLost(slot.sequence);
  DropAnsweredTail();
}

/// The frame is the one before once more. If that one came back after this one was sent, its answer was late: as both
/// came back, it is not that of this one.
void Pairing::ReportLate(const Slot& slot) noexcept {
  const bool numbered = senders_[slot.sender].rhythm.indices.was_next();
  const std::uint64_t oldest = head_ > kDuplicateFrames ? head_ - kDuplicateFrames : 0;
  for (std::uint64_t s = slot.sequence; s > oldest; --s) {
    const Slot& before = At(s - 1);
    if (before.sender != slot.sender) continue;
    if (!numbered && !BrokeRhythm(before, slot)) return;
    const bool late = before.state == SlotState::kAnswered && before.key == slot.key && before.bytes == slot.bytes &&
                      before.returned.number > slot.view.ref().number;
    if (late && HasWaited(before.view.ref(), slot.view.ref())) {
      sink_.OnRepeated({.frame = slot.view,
                        .before = before.view.ref(),
                        .again = slot.view.ref(),
                        .returned = before.returned,
                        .usual_ns = typical_round_trip_ns_});
    }
    return;
  }
}

/// Both copies came back. What only reads may be a poll, which brings other data in the end.
void Pairing::ReportAnswered(const Slot& slot, const wire::FrameView& returned) noexcept {
  const std::uint64_t oldest = head_ > kDuplicateFrames ? head_ - kDuplicateFrames : 0;
  for (std::uint64_t s = slot.sequence; s > oldest; --s) {
    const Slot& before = At(s - 1);
    if (before.sender != slot.sender) continue;
    if (before.state != SlotState::kAnswered || before.key != slot.key) return;
    const ByteSpan payload = returned.payload();
    const bool news = OnlyReads(returned) && !std::equal(before.returned_bytes.begin(), before.returned_bytes.end(),
                                                         payload.begin(), payload.end());
    sink_.OnRepeated({.frame = slot.view,
                      .before = before.view.ref(),
                      .again = slot.view.ref(),
                      .returned = before.returned,
                      .usual_ns = typical_round_trip_ns_,
                      .may_miss_round_of = slot.round,
                      .brought_news = news});
    return;
  }
}

/// When the master sent the same frame again, if it has sent nothing else since: it was waiting for this one. Not seen:
/// it was not.
FrameRef Pairing::RepeatedSince(const Slot& slot) noexcept {
  FrameRef again;
  for (std::uint64_t s = slot.sequence + 1; s < head_; ++s) {
    const Slot& later = At(s);
    if (later.sender != slot.sender) continue;
    if (later.key != slot.key || later.copy || later.bytes != slot.bytes) return {};
    if (!again.seen()) again = later.view.ref();
  }
  return again;
}

/// True when it comes back so late, and numbers show so little, that it may answer a frame like it which the capture
/// misses.
bool Pairing::MayAnswerLater(const Slot& slot, const wire::FrameView& returned) const noexcept {
  const FrameRef& sent = slot.view.ref();
  const IndexSequence& indices = senders_[slot.sender].rhythm.indices;
  if (!sent.has_time || !returned.ref().has_time || typical_round_trip_ns_ == 0 ||
      typical_round_trip_ns_ > kMaxRoundTripNs) {
    return false;
  }
  const std::int64_t way = Elapsed(sent.time, returned.ref().time);
  if (way <= kDuplicateNs || way / kDuplicateRoundTrips <= typical_round_trip_ns_) return false;
  return !indices.IsNumbered(slot.view) || indices.span() < kNoCoincidence;
}

/// Nothing in flight fits: a second copy of something that already came back? Not where it is what the master was to
/// send next, and not where frames have no number and the master may have sent the same once more since then.
bool Pairing::IsSecondCopy(const Sender& sender, const wire::FrameView& frame, std::uint64_t key) noexcept {
  const Rhythm& rhythm = sender.rhythm;
  const Slot* original = rhythm.indices.IsNext(frame) ? nullptr : FindOriginal(frame, key);
  if (original == nullptr) return false;
  const FrameRef& before = original->returned;
  if (original->returned_interface == frame.interface_index() && !rhythm.indices.IsNumbered(frame) && before.has_time &&
      frame.ref().has_time && rhythm.mean_ns > 0 && Elapsed(before.time, frame.ref().time) >= rhythm.mean_ns / 2) {
    return false;
  }
  if (original->returned_interface != frame.interface_index()) {
    // A bridge or mirror port, or the second port of a redundant master that sends on what it got.
    ++statistics_.captured_twice;
    return true;
  }
  ++statistics_.duplicated;
  sink_.OnDuplicate(frame, original->returned.number);
  return true;
}

/// Or bits flipped in a field that slaves never change (the FCS is not in the capture)?
bool Pairing::IsAltered(const wire::FrameView& frame) noexcept {
  const bool expected = directions_.returned_only() || directions_.returns_stamped_first();
  Slot* alike = expected ? nullptr : FindAlike(frame);
  if (alike == nullptr) return false;
  // The frame that was sent before it, whose own copy is missing.
  if (senders_[alike->sender].rhythm.indices.IsAfter(frame, 1) && !WasSent(alike->sender, frame, Like::kIndex)) {
    return false;
  }
  // With one index for all it shows nothing: then only what differs by no more than flipped bits is the same frame, and
  // what is like another frame that was sent just before is not.
  const IndexSequence& indices = senders_[alike->sender].rhythm.indices;
  if (indices.repeats() && !indices.IsNumbered(frame) &&
      (!FewBitsFlipped(alike->view, frame) || WasSent(alike->sender, frame, Like::kKey))) {
    return false;
  }
  ++statistics_.altered;
  if (alike->overtaken == 0 && FewBitsFlipped(alike->view, frame) && statistics_.flipped++ == 0) {
    statistics_.first_flipped = frame.ref().number;
  }
  DoubtOvertakenBy(*alike);
  sink_.OnDoubtful(alike->view);
  Answer(*alike, frame, frame.payload());
  sink_.OnUnusable(frame, Unusable::kAltered, true);
  ReportLost(alike->sequence);
  DropAnsweredTail();
  return true;
}

void Pairing::PushUnusable(const wire::FrameView& frame) noexcept {
  ++statistics_.returned;
  if (statistics_.no_answers) statistics_.no_answers = false;
  sink_.OnUnusable(frame, Unusable::kMalformed, true);
  // It did come back, so the frame it answers is damaged but not lost.
  if (Slot* alike = FindAlike(frame); alike != nullptr) {
    DoubtOvertakenBy(*alike);
    sink_.OnDoubtful(alike->view);
    Answer(*alike, frame, {});
    ReportLost(alike->sequence);
    DropAnsweredTail();
  } else {
    DoubtAll(Undecided::kUnreadableReturn);
  }
}

/// Before what came back is handed over: what it means may hang on frames that it overtook.
void Pairing::DoubtOvertakenBy(const Slot& slot) noexcept {
  for (std::uint64_t s = tail_; s != head_ && &At(s) != &slot; ++s) {
    const Slot& other = At(s);
    if (other.state != SlotState::kOpen || other.sender != slot.sender || other.overtaken > 0 || other.copy) continue;
    sink_.OnDoubtful(other.view);
  }
}

/// Counts it; ReportLost() reports it to the sink.
void Pairing::Lose(Slot& slot, Loss loss) noexcept {
  slot.state = SlotState::kLost;
  slot.loss = loss;
  --statistics_.in_flight;
  if (slot.copy) {
    slot.state = SlotState::kFree;
    Count(Undecided::kCapturedTwice);
    ++statistics_.captured_twice;
    ++statistics_.outbound_twice;
    return;
  }
  if (slot.undecided || !senders_[slot.sender].answered) {
    Count(slot.undecided ? slot.reason : statistics_.no_answers ? Undecided::kNoAnswers : Undecided::kNoReturns);
    slot.loss = Loss::kUndecided;
    return;
  }
  ++statistics_.lost;
  drops_.MissReturn(slot.view.ref().number, slot.sent_before);
}

/// Of the frames before the one of this number those that are lost since the last call.
void Pairing::ReportLost(std::uint64_t sequence) noexcept {
  for (std::uint64_t s = tail_; s != sequence; ++s) {
    Slot& slot = At(s);
    if (slot.state != SlotState::kLost) continue;
    slot.state = SlotState::kFree;
    sink_.OnLost(slot.view, slot.loss, slot.followed_by_other);
  }
}

void Pairing::DropAnsweredTail() noexcept {
  while (tail_ != head_ && At(tail_).state != SlotState::kOpen) ++tail_;
}

void Pairing::Finish() noexcept {
  std::array<bool, kSlots> silent{};
  std::array<std::uint32_t, 2 * DirectionLearner::kMaxMasters> sent_later{};
  for (std::uint64_t s = head_; s != tail_; --s) {
    const Slot& slot = At(s - 1);
    if (slot.state != SlotState::kOpen) continue;
    const std::uint32_t later = sent_later[slot.sender]++;
    // Where the returns have an interface of their own, that one may have stopped a moment earlier.
    if (slot.overtaken > 0 || senders_[slot.sender].own_return_port) continue;
    silent[(s - 1) % kSlots] = IsSilent(slot.view.ref(), later);
  }
  for (std::uint64_t s = tail_; s != head_; ++s) {
    Slot& slot = At(s);
    if (slot.state != SlotState::kOpen) continue;
    if (slot.overtaken > 0) {
      Lose(slot, Loss::kOvertaken);
    } else if (silent[s % kSlots]) {
      Lose(slot, Loss::kSilence);
    }
  }
  statistics_.numbered =
      std::any_of(senders_.begin(), senders_.end(), [](const Sender& s) { return s.rhythm.indices.NumbersAny(); });
  drops_.Finish();
  statistics_.dropped_every = drops_.distance();
  const std::uint64_t left_out = std::min(drops_.returns(), statistics_.lost);
  statistics_.lost -= left_out;
  statistics_.undecided[static_cast<std::size_t>(Undecided::kRecorder)] += left_out;
  ReportLost(head_);
  tail_ = head_;
}

/// @param later how many frames the same sender sent after this one, none of which came back either
bool Pairing::IsSilent(const FrameRef& sent, std::uint32_t later) const noexcept {
  if (!sent.has_time || !last_.has_time) return later >= kSilentFrames;
  const std::int64_t age = Elapsed(sent.time, last_.time);
  return later >= kSilentFramesWithTime && age > kSilentNs && age / kSilentRoundTrips > typical_round_trip_ns_;
}

}  // namespace ecaudit::bus
