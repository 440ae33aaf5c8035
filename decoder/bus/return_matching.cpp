#include "decoder/bus/return_matching.h"

#include <algorithm>

#include "decoder/bus/retransmissions.h"

namespace ecaudit::bus {

bool ReturnMatching::MayAnswer(const SentFrame& sent, const wire::FrameView& frame, Owner owner,
                               bool other_end) const noexcept {
  return sent.key == frame.key() && sent.other_end == other_end && owner.MayBe(sent.sender) &&
         Answers(sent.view, frame);
}

SentFrame* ReturnMatching::FindOpen(const wire::FrameView& frame) noexcept {
  SentFrame* oldest = nullptr;
  SentFrame* newest = nullptr;
  const bool other_end = context_.directions.IsOtherEnd(frame);
  const Owner owner = context_.senders.OwnerOf(frame);
  context_.sent.EachOpen(context_.sent.end(), [&](SentFrame& sent) {
    if (!MayAnswer(sent, frame, owner, other_end)) return;
    if (sent.overtaken > 0 && (PassedOthers(sent, frame) || IsTooOld(sent, frame))) return;
    // A frame that was overtaken is nearly always lost; it only answers when no other candidate exists.
    if (oldest == nullptr || (oldest->overtaken > 0 && sent.overtaken == 0)) oldest = &sent;
    if (!sent.may_be_copy() || newest == nullptr) newest = &sent;
  });
  if (oldest == nullptr && context_.any_cut) return FindCut(frame);
  if (oldest == newest || oldest->overtaken > 0) return oldest;
  return WeighTwo(oldest->ref(), newest->ref(), frame.ref()) == OfTwo::kFirst ? oldest : newest;
}

OfTwo ReturnMatching::WeighTwo(const FrameRef& first, const FrameRef& second, const FrameRef& returned) const noexcept {
  const RoundTrip& trip = context_.trip;
  const bool timed = AreTimed(first, second) && returned.has_time;
  const std::int64_t age_first = timed ? Elapsed(first, returned) : 0;
  const std::int64_t age_second = timed ? Elapsed(second, returned) : 0;
  Facts<OfTwoFact> facts{};
  facts.Set(OfTwoFact::kTimed, timed);
  facts.Set(OfTwoFact::kTripKnown, trip.known());
  facts.Set(OfTwoFact::kFirstLong,
            age_first > threshold::kSilentNs && age_first / threshold::kLateOfTwoTimes > age_second);
  facts.Set(OfTwoFact::kFirstLate, trip.IsLateOfTwo(age_first));
  facts.Set(OfTwoFact::kSecondHadTime, age_second > trip.typical_ns() / 2);
  facts.Set(OfTwoFact::kSecondLate, trip.IsLateOfTwo(age_second));
  return Decide(kOfTwo, facts);
}

SentFrame* ReturnMatching::FindLessFar(const wire::FrameView& frame) noexcept {
  const Progress progress = ProgressOf(frame);
  const bool may_be_unanswered = progress.counted == 0 || context_.directions.IsTappedAfterSlaves(frame);
  const bool other_end = context_.directions.IsOtherEnd(frame);
  const Owner owner = context_.senders.OwnerOf(frame);
  SentFrame* further = nullptr;
  SentFrame* untouched = nullptr;
  context_.sent.EachOpen(context_.sent.end(), [&](SentFrame& sent) {
    if (!MayAnswer(sent, frame, owner, other_end)) return;
    const Progress before = ProgressOf(sent.view);
    if (Further(progress, before)) {
      if (further == nullptr || (further->overtaken > 0 && sent.overtaken == 0)) further = &sent;
    } else if (progress == before && may_be_unanswered && context_.trip.IsSoon(sent.ref(), frame.ref())) {
      // A poll that no slave answered; later it is the master's repetition. What was overtaken is nearly always lost:
      // then this is the next one like it.
      if (untouched == nullptr && sent.overtaken == 0) untouched = &sent;
    }
  });
  return further != nullptr ? further : untouched;
}

/// True when the frame would have passed another number of slaves than the one before: positions are no part of what
/// slaves never change, so frames to two of them look alike.
bool ReturnMatching::PassedOthers(const SentFrame& sent, const wire::FrameView& frame) const noexcept {
  if (passed_ == kNotCounted) return false;
  const int passed = Passed(sent.view, frame);
  return passed != kNotCounted && passed != passed_;
}

void ReturnMatching::LearnPassed(const SentFrame& sent, const wire::FrameView& returned) noexcept {
  if (const int passed = Passed(sent.view, returned); passed != kNotCounted) passed_ = passed;
}

/// Where returns may be stamped first, the frame that this one answers may come yet: what was sent long before is lost.
bool ReturnMatching::IsTooOld(const SentFrame& sent, const wire::FrameView& frame) const noexcept {
  return context_.directions.returns_stamped_first() && AreTimed(sent.ref(), frame.ref()) &&
         Elapsed(sent.ref(), frame.ref()) > threshold::kSkewNs;
}

/// Where one of the copies was cut by the snap length, the datagrams that both still hold must agree. A cut in the
/// first datagram leaves the order.
SentFrame* ReturnMatching::FindCut(const wire::FrameView& frame) noexcept {
  const Owner owner = context_.senders.OwnerOf(frame);
  SentFrame* found = nullptr;
  context_.sent.EachOpen(context_.sent.end(), [&](SentFrame& sent) {
    if (found != nullptr || sent.overtaken > 0 || !owner.MayBe(sent.sender)) return;
    if (sent.view.kind() != wire::FrameKind::kCut && frame.kind() != wire::FrameKind::kCut) return;
    if (Answers(sent.view, frame, std::min(sent.view.size(), frame.size()))) found = &sent;
  });
  // A guess: none of those in flight can be called lost any more.
  const bool guess = found != nullptr && (found->view.empty() || frame.empty());
  if (guess) context_.DoubtAll(Undecided::kUnreadableReturn);
  return found;
}

SentFrame* ReturnMatching::FindAlike(const wire::FrameView& frame) noexcept {
  if (frame.empty()) return nullptr;
  SentFrame* kept = nullptr;
  SentFrame* flipped = nullptr;
  const Owner owner = context_.senders.OwnerOf(frame);
  context_.sent.EachOpen(context_.sent.end(), [&](SentFrame& sent) {
    if (kept != nullptr || sent.view.empty() || sent.overtaken >= threshold::kStaleFrames) return;
    if (!owner.MayBe(sent.sender)) return;
    if (IndexAndMoreKept(sent.view, frame)) kept = &sent;
    if (flipped == nullptr && sent.overtaken == 0 && OnlyIndexFlipped(sent.view, frame)) flipped = &sent;
  });
  return kept != nullptr ? kept : flipped;
}

SentFrame* ReturnMatching::FindAltered(const wire::FrameView& frame) noexcept {
  const bool expected = context_.directions.returned_only() || context_.directions.returns_stamped_first();
  SentFrame* alike = expected ? nullptr : FindAlike(frame);
  if (alike == nullptr) return nullptr;
  const auto was_sent = [&](const auto& like) {
    return context_.sent.NewestRecent(context_.sent.end(), [&](const SentFrame& sent) {
      return sent.sender == alike->sender && !sent.view.empty() && like(sent);
    }) != nullptr;
  };
  const IndexSequence& indices = context_.IndicesOf(*alike);
  Facts<AlteredFact> facts{AlteredFact::kAlike};
  facts.Set(AlteredFact::kFrameBefore, indices.IsAfter(frame, 1) && !was_sent([&](const SentFrame& sent) {
                                         return SameFirstIndex(sent.view, frame);
                                       }));
  facts.Set(AlteredFact::kFrameAfter, indices.IsNext(frame));
  facts.Set(AlteredFact::kLate, context_.trip.IsFine() && AreTimed(alike->ref(), frame.ref()) &&
                                    context_.trip.IsLate(Elapsed(alike->ref(), frame.ref())));
  facts.Set(AlteredFact::kOneIndex, indices.repeats() && !indices.IsNumbered(frame));
  facts.Set(AlteredFact::kFewBits, FewBitsFlipped(alike->view, frame));
  facts.Set(AlteredFact::kSentBefore, was_sent([&](const SentFrame& sent) { return sent.key == frame.key(); }));
  return Decide(kAltered, facts) ? alike : nullptr;
}

const SentFrame* ReturnMatching::FindOriginal(const wire::FrameView& frame) noexcept {
  if (frame.kind() == wire::FrameKind::kCut) return nullptr;  // what is after the cut may differ
  const ByteSpan datagrams = frame.payload();
  const SentFrame* original = context_.sent.NewestRecent(context_.sent.end(), [&](const SentFrame& sent) {
    return sent.is_answered() && sent.key == frame.key() && !sent.returned_bytes.empty() && sent.Returned(datagrams);
  });
  return original != nullptr && context_.trip.IsSoon(original->returned, frame.ref()) ? original : nullptr;
}

ReturnVerdict ReturnMatching::WeighAll(const wire::FrameView& frame, const SendingRhythm& rhythm, const SentFrame* sent,
                                       const SentFrame*& original) noexcept {
  const DirectionLearner& directions = context_.directions;
  original = FindOriginal(frame);
  Facts<ReturnFact> facts{};
  facts.Set(ReturnFact::kFits, sent != nullptr);
  facts.Set(ReturnFact::kOvertaken, sent != nullptr && sent->overtaken > 0);
  facts.Set(ReturnFact::kMayBeCopy, sent != nullptr && sent->may_be_copy());
  facts.Set(ReturnFact::kNext, rhythm.indices.IsNext(frame));
  facts.Set(ReturnFact::kFromOtherEnd,
            directions.HasOnePort() && directions.IsOtherEnd(frame) && !AnyWorkingCounter(frame));
  if (original != nullptr) {
    const FrameRef& before = original->returned;
    const bool had_time =
        AreTimed(before, frame.ref()) && rhythm.mean_ns() > 0 && Elapsed(before, frame.ref()) >= rhythm.mean_ns() / 2;
    facts.Set(ReturnFact::kOriginal, true);
    const bool later = sent != nullptr && original->sequence > sent->sequence;
    facts.Set(ReturnFact::kOriginalLater, later);
    facts.Set(ReturnFact::kWaitedFor, later && WasWaitedFor(context_, *sent, *original));
    facts.Set(ReturnFact::kOtherPort, original->returned_interface != frame.interface_index());
    facts.Set(ReturnFact::kMayBeNext, had_time && !rhythm.indices.IsNumbered(frame));
  }
  return Decide(kReturns, facts);
}

bool ReturnMatching::MayBeOfLater(const SentFrame& sent) noexcept {
  return context_.sent.AnyOpen([&](const SentFrame& other) {
    return other.sequence > sent.sequence && other.sender == sent.sender && SameButForIndex(sent.view, other.view);
  });
}

/// One with the same index was sent since, or before, not much farther away, or the numbers may have come round. Where
/// packets are missing, so are some of the frames between.
bool ReturnMatching::MayBeOfMissing(const SentFrame& sent) noexcept {
  SentFrames& all = context_.sent;
  const std::uint64_t since = (all.end() - sent.sequence) * threshold::kMissingTimes;
  const IndexSequence& indices = context_.IndicesOf(sent);
  if (indices.IsNumbered(sent.view) && since > indices.span()) return true;
  const std::uint64_t oldest = sent.sequence - std::min(sent.sequence, since);
  const std::uint64_t kept = all.end() - std::min(all.end(), std::uint64_t{SentFrames::kSlots});
  for (std::uint64_t s = std::max(oldest, kept); s != all.end(); ++s) {
    const SentFrame& other = all[s];
    if (s != sent.sequence && other.sender == sent.sender && SameFirstIndex(other.view, sent.view)) return true;
  }
  return false;
}

bool ReturnMatching::MayAnswerLater(const SentFrame& sent, const wire::FrameView& returned) noexcept {
  if (!AreTimed(sent.ref(), returned.ref()) || !context_.trip.IsFine()) return false;
  const std::int64_t way = Elapsed(sent.ref(), returned.ref());
  if (!context_.trip.IsLate(way)) return false;
  const IndexSequence& indices = context_.IndicesOf(sent);
  const bool numbered = indices.IsNumbered(sent.view);
  if (!numbered && sent.overtaken > 0) return true;  // nearly always lost
  return way > threshold::kRecentNs && (!numbered || indices.span() < threshold::kNoCoincidenceIndices);
}

}  // namespace ecaudit::bus
