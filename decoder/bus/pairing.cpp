#include "decoder/bus/pairing.h"

#include <algorithm>

#include "decoder/bus/frame_likeness.h"
#include "decoder/bus/retransmissions.h"

namespace ecaudit::bus {

Pairing::Pairing(const DirectionLearner& directions, BusSink& sink)
    : context_(directions, sink), gaps_(context_), losses_(context_), matching_(context_) {
  context_.statistics.no_answers = directions.no_answers();
  context_.statistics.one_port = directions.HasOnePort();
}

void Pairing::Push(const wire::FrameView& frame) noexcept {
  if (frame.ref().has_time) {
    // Where a capture was appended to another one, the returns of what was in flight are missing.
    if (last_.has_time && ClockJumps(last_.time, frame.ref().time)) context_.DoubtAll(Undecided::kSecondCapture);
    last_ = frame.ref();
  }
  if (frame.kind() == wire::FrameKind::kOther) {
    PushOther(frame);
    return;
  }
  const Direction direction = context_.directions.Classify(frame);
  const bool readable = frame.kind() != wire::FrameKind::kMalformed && frame.kind() != wire::FrameKind::kDamagedOnWire;
  // A sender without any frame that a slave can read is no master of this bus, whatever its address.
  const bool nonsense = !readable && context_.directions.IsForeignSender(frame) &&
                        context_.senders.OwnerOf(frame).sender == Owner::kAnybody;
  if (direction == Direction::kForeign || nonsense) {
    PushForeign(frame);
    return;
  }
  if (readable && direction == Direction::kByPair) {
    context_.any_cut = context_.any_cut || frame.kind() == wire::FrameKind::kCut;
    PushByPair(frame);
    return;
  }
  context_.sink.OnFrame(frame, direction);
  if (!readable) {
    PushUnreadable(frame, direction);
    return;
  }
  context_.any_cut = context_.any_cut || frame.kind() == wire::FrameKind::kCut;
  if (direction == Direction::kOutbound) {
    PushOutbound(frame, false);
  } else {
    PushReturned(frame, matching_.FindOpen(frame));
  }
}

void Pairing::PushOther(const wire::FrameView& packet) noexcept {
  if (!context_.sent.empty()) {
    SentFrame& last = context_.sent.last();
    if (last.ref().number + 1 == packet.ref().number) last.followed_by_other = true;
  }
  if (!packet.cut_before_type()) return;
  context_.unreadable = true;
  context_.DoubtAll(Undecided::kUnreadableReturn);
  for (Sender& sender : context_.senders) sender.rhythm.indices.Skip();
}

void Pairing::PushOtherBus(const wire::FrameView& frame) noexcept {
  PairingStatistics& statistics = context_.statistics;
  if (statistics.other_bus++ == 0) statistics.other_bus_interface = frame.interface_index();
  PushForeign(frame);
}

void Pairing::PushForeign(const wire::FrameView& frame) noexcept {
  PairingStatistics& statistics = context_.statistics;
  context_.sink.OnFrame(frame, Direction::kForeign);
  if (statistics.foreign++ == 0) statistics.first_foreign = frame.ref().number;
  if (AnyWorkingCounter(frame)) ++statistics.foreign_answered;
  if (frame.kind() != wire::FrameKind::kMalformed) return;
  ++statistics.foreign_unreadable;
  context_.sink.OnUnusable(frame, Unusable::kMalformed, false);
}

void Pairing::PushUnreadable(const wire::FrameView& frame, Direction direction) noexcept {
  context_.unreadable = true;
  if (direction == Direction::kOutbound) {
    ++context_.statistics.outbound;
    context_.statistics.Count(Undecided::kUnreadable);
    context_.senders[NumberOf(frame)].rhythm.indices.Skip();
    context_.sink.OnUnusable(frame, Unusable::kMalformed, true);
    return;
  }
  ++context_.statistics.returned;
  context_.statistics.no_answers = false;
  context_.sink.OnUnusable(frame, Unusable::kMalformed, true);
  // It did return, so the frame it answers is damaged but not lost.
  if (SentFrame* alike = matching_.FindAlike(frame); alike != nullptr) {
    AnswerDamaged(*alike, frame, false);
  } else {
    context_.DoubtAll(Undecided::kUnreadableReturn);
  }
}

void Pairing::PushByPair(const wire::FrameView& frame) noexcept {
  SentFrame* sent = matching_.FindLessFar(frame);
  if (sent == nullptr && context_.directions.JoinedLate(frame) && !context_.directions.bit_is_no_evidence()) {
    PushForeign(frame);
    return;
  }
  // Masters send working counters of 0; downstream of slaves the outbound copy has some, too.
  const bool returned =
      sent != nullptr || (ProgressOf(frame).counted > 0 && !context_.directions.IsTappedAfterSlaves(frame));
  context_.sink.OnFrame(frame, returned ? Direction::kReturned : Direction::kOutbound);
  if (returned) {
    PushReturned(frame, sent);
  } else {
    // Before the first pair it is unknown whether a frame is on its way out or back.
    PushOutbound(frame, !context_.senders[NumberOf(frame)].answered());
  }
}

void Pairing::PushOutbound(const wire::FrameView& frame, bool before_first_return) noexcept {
  PairingStatistics& statistics = context_.statistics;
  ++statistics.outbound;
  const std::uint8_t number = NumberOf(frame);
  if (context_.senders[number].returns == Returns::kNotCaptured) {
    statistics.Count(Undecided::kNoReturns);
    const GapBefore gap = gaps_.Follow(number, frame, Repeats::kNo);
    // The other end of a redundant line sends what the main end sends: that counts.
    if (!context_.directions.IsOtherEnd(frame)) context_.sink.OnTransaction({&frame, nullptr, true, gap});
    return;
  }
  const bool clocks_differ = context_.directions.returns_stamped_first();
  const EarlyReturns::Return early = early_.Take(frame, clocks_differ);
  if (!early.ref.seen()) {
    PushSent(frame, number, before_first_return);
    return;
  }
  context_.returns_early = true;
  ++statistics.paired;
  --statistics.unmatched_returned;
  if (early.counted_as_missed) --statistics.missed_outbound;
  if (Elapsed(frame.ref(), early.ref) < 0) ++statistics.stamped_first;
  if (!clocks_differ) return;
  losses_.Overtake(number, context_.sent.end());
  losses_.Report(context_.sent.end());
}

void Pairing::PushSent(const wire::FrameView& frame, std::uint8_t number, bool before_first_return) noexcept {
  Sender& sender = context_.senders[number];
  if (context_.sent.IsFull()) losses_.GiveUpOldest();
  // Without what follows the datagrams, so that huge packets do not stay in memory.
  const ByteSpan kept = frame.bytes().first(frame.used_bytes());
  SentAs sent_as = SentAs::kCopy;
  std::uint32_t round = 0;
  if (!MayBeCopy(context_, frame, kept)) {
    const Repeats repeats = RepeatsLast(context_, number, frame, kept);
    sent_as = repeats == Repeats::kAll ? SentAs::kAgainInFlight : SentAs::kAnother;
    if (repeats == Repeats::kAnswered) {
      if (context_.sent[sender.newest - 1].slaves_counted) sent_as = SentAs::kAgainAnswered;
      round = sender.rhythm.IndicesThatMayBeMissing(Elapsed(sender.rhythm.last, frame.ref()));
    }
    gaps_.FollowSent(number, frame, repeats);
  }
  SentFrame& sent = context_.sent.Add(frame, kept);
  sender.newest = context_.sent.end();
  ++context_.statistics.in_flight;
  sent.sender = number;
  sent.sent_as = sent_as;
  sent.round = round;
  sent.key = frame.key();
  sent.sent_before = context_.statistics.outbound;
  sent.other_end = context_.directions.IsOtherEnd(frame);
  sent.doubt.reset();
  if (before_first_return) sent.doubt = Undecided::kBeforeFirstReturn;
  if (!sent.other_end && Instructs(sent.view)) context_.sink.OnSent(sent.view);
}

void Pairing::PushReturned(const wire::FrameView& frame, SentFrame* sent) noexcept {
  ++context_.statistics.returned;
  context_.statistics.no_answers = false;
  Sender& sender = context_.senders[NumberOf(frame)];
  sender.Saw(Returns::kNoneYet);
  const SentFrame* original = nullptr;
  switch (matching_.Weigh(frame, sender.rhythm, sent, original)) {
    case ReturnVerdict::kAnswers:
      AnswerInFlight(*sent, frame);
      return;
    case ReturnVerdict::kAnswersBoth:
      AnswerBoth(*sent, *original, frame);
      return;
    case ReturnVerdict::kReachedOtherEnd:
      PushFromOtherEnd(frame);
      return;
    case ReturnVerdict::kCopyOfAnswer:
      PushCopyOfAnswer(*sent);
      return;
    case ReturnVerdict::kCapturedTwice:
      ++context_.statistics.captured_twice;
      return;
    case ReturnVerdict::kDuplicate:
      ++context_.statistics.duplicated;
      context_.sink.OnDuplicate(frame, original->returned.number);
      return;
    case ReturnVerdict::kUnmatched:
      break;
  }
  if (SentFrame* altered = matching_.FindAltered(frame); altered != nullptr) {
    PushAltered(*altered, frame);
  } else {
    PushOrphan(frame, sender);
  }
}

/// At the only port that was captured: the line is whole, and what this port sent has reached the other one.
void Pairing::PushFromOtherEnd(const wire::FrameView& frame) noexcept {
  ++context_.statistics.unmatched_returned;
  ++context_.statistics.other_end;
  const bool dummy = frame.size() == 1 && wire::IsBroadcast(frame[0].command());
  SentFrame* sent = nullptr;  // the newest
  context_.sent.EachOpen(context_.sent.end(), [&](SentFrame& other) {
    const bool same = other.key == frame.key() || (dummy && SameFirstIndex(other.view, frame));
    if (same && context_.directions.IsOnePort(other.view)) sent = &other;
  });
  if (sent == nullptr) return;
  sent->CloseWithoutAnswer();
  --context_.statistics.in_flight;
  context_.statistics.Count(Undecided::kNoReturns);
  context_.sent.EachOpenOf(sent->sender, sent->sequence, [](SentFrame& other) { other.Doubt(Undecided::kNoReturns); });
  losses_.Overtake(sent->sender, sent->sequence);
  losses_.Report(sent->sequence);
  context_.sink.OnTransaction({&sent->view, nullptr, true, gaps_.Take(sent->sequence)});
  context_.sent.DropClosed();
}

/// Both copies of a packet that was captured twice returned, and so did those of its return.
void Pairing::PushCopyOfAnswer(SentFrame& sent) noexcept {
  sent.CloseWithoutAnswer();
  --context_.statistics.in_flight;
  context_.statistics.CountSentTwice();
  context_.sent.DropClosed();
}

void Pairing::PushAltered(SentFrame& sent, const wire::FrameView& frame) noexcept {
  PairingStatistics& statistics = context_.statistics;
  ++statistics.altered;
  if (sent.overtaken == 0 && FewBitsFlipped(sent.view, frame) && statistics.flipped++ == 0) {
    statistics.first_flipped = frame.ref().number;
  }
  AnswerDamaged(sent, frame, true);
}

/// Its outbound copy is not in the capture.
void Pairing::PushOrphan(const wire::FrameView& frame, Sender& sender) noexcept {
  ++context_.statistics.unmatched_returned;
  // Frames do not overtake each other: what was sent before the capture began returns before all others.
  const bool missed = context_.statistics.paired > 0;
  if (missed) {
    ++context_.statistics.missed_outbound;
    losses_.MissOutbound(frame.ref());
  }
  early_.Add(frame, missed);
  const GapBefore late = gaps_.AppearsLate(sender, nullptr, frame.ref());
  sender.Saw(Returns::kSome);
  HandOver({nullptr, &frame, false, std::max(late, gaps_.Before(frame))});
}

void Pairing::AnswerInFlight(SentFrame& sent, const wire::FrameView& frame) noexcept {
  losses_.DoubtOvertakenBy(sent);
  const bool again = IsRepeatedSince(context_, sent);
  const bool other = !again && matching_.MayAnswerLater(sent, frame);
  if (sent.sent_as != SentAs::kAnother) ReportRepetition(context_, sent, frame);
  if (AreTimed(sent.ref(), frame.ref())) {
    const std::int64_t round_trip = Elapsed(sent.ref(), frame.ref());
    if (round_trip == 0) ++context_.statistics.identical_stamps;
    if (round_trip > 0 && sent.overtaken == 0 && !other && !again) context_.trip.Add(round_trip);
  }
  const GapBefore late = gaps_.AppearsLate(context_.SenderOfSent(sent), &sent.view, sent.ref());
  GapBefore gap = std::max(gaps_.Take(sent.sequence), late);
  const bool gap_at_return = gap == GapBefore::kNone && other;
  if (gap_at_return) gap = GapBefore::kPossible;
  matching_.LearnPassed(sent, frame);
  Answer(sent, frame, frame.payload());
  HandOver({.sent = &sent.view, .returned = &frame, .gap = gap, .gap_at_return = gap_at_return});
  Settle(sent.sequence);
}

/// What comes back last is handed over for the frame that was sent first: the bytes of both are the same.
void Pairing::AnswerBoth(SentFrame& sent, const SentFrame& again, const wire::FrameView& frame) noexcept {
  sent.overtaken = 0;
  Answer(sent, frame, frame.payload());
  ReportWaitedFor(context_, sent, again);
  HandOver({&sent.view, &frame, false, gaps_.Take(sent.sequence)});
  Settle(sent.sequence);
}

/// What returned damaged is no answer; but the frame is not lost.
void Pairing::AnswerDamaged(SentFrame& sent, const wire::FrameView& frame, bool readable) noexcept {
  losses_.DoubtOvertakenBy(sent);
  context_.sink.OnDoubtful(sent.view);
  Answer(sent, frame, readable ? frame.payload() : ByteSpan{});
  if (readable) context_.sink.OnUnusable(frame, Unusable::kAltered, true);
  Settle(sent.sequence);
}

/// All that is counted is counted before the sink gets the frame: statistics() then shows the frame that returned as
/// returned, and those that it overtook for the last time as lost.
void Pairing::Answer(SentFrame& sent, const wire::FrameView& returned, ByteSpan datagrams) noexcept {
  sent.state = SentFrame::State::kAnswered;
  sent.returned = returned.ref();
  sent.slaves_counted = AnyWorkingCounter(returned);
  if (sent.overtaken > 0) CountOrder(sent, returned.ref());
  sent.returned_interface = returned.interface_index();
  TakeBytes(sent.returned_bytes, datagrams);
  ++context_.statistics.paired;
  --context_.statistics.in_flight;
  Sender& sender = context_.SenderOfSent(sent);
  sender.own_return_port = returned.interface_index() != sent.view.interface_index();
  if (!sender.answered()) {
    losses_.DoubtSentWithoutAnswer(sent);
    // Captures of two interfaces do not begin at the same moment: what was sent before may have returned unseen.
    if (sender.own_return_port) {
      context_.sent.EachOpenOf(sent.sender, sent.sequence,
                               [](SentFrame& other) { other.Doubt(Undecided::kBeforeFirstReturn); });
    }
  }
  sender.Saw(Returns::kPairs);
  context_.unreadable = false;
  losses_.Overtake(sent.sender, sent.sequence);
}

void Pairing::CountOrder(const SentFrame& sent, const FrameRef& returned) noexcept {
  const std::uint32_t overtaken = sent.overtaken - (sent.before_gap ? 1U : 0U);
  if (overtaken == 0) return;
  PairingStatistics& statistics = context_.statistics;
  // Only a number distinguishes a late frame from one whose outbound copy is not in the capture.
  const IndexSequence& indices = context_.IndicesOf(sent);
  if (indices.IsNumbered(sent.view) && !indices.IsNext(sent.view)) losses_.LearnLatest(overtaken);
  if (matching_.MayBeOfMissing(sent)) {
    if (!statistics.first_in_doubt.seen()) statistics.first_in_doubt = returned;
  } else if (!matching_.MayBeOfLater(sent)) {
    if (statistics.reordered++ == 0) statistics.first_reordered = returned;
    statistics.last_reordered = returned;
  }
}

/// At the other end of a redundant line that is whole the frames meet no slave: what was not taken there is no refusal.
void Pairing::HandOver(BusTransaction transaction) noexcept {
  transaction.other_end = context_.directions.IsOtherEnd(*transaction.returned);
  if (transaction.other_end && !AnyWorkingCounter(*transaction.returned)) {
    ++context_.statistics.other_end;
  } else {
    context_.sink.OnTransaction(transaction);
  }
}

/// After a return: what it overtook for the last time is lost.
void Pairing::Settle(std::uint64_t sequence) noexcept {
  losses_.Report(sequence);
  context_.sent.DropClosed();
}

void Pairing::Finish() noexcept {
  losses_.Finish(last_);
}

}  // namespace ecaudit::bus
