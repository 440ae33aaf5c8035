#include "decoder/bus/frame_losses.h"

#include <algorithm>
#include <array>

namespace ecaudit::bus {

void FrameLosses::Overtake(std::uint8_t sender, std::uint64_t sequence) noexcept {
  context_.sent.EachOpenOf(sender, sequence, [&](SentFrame& sent) {
    if (++sent.overtaken >= threshold::kOvertakenFrames + 2 * latest_) Lose(sent, Loss::kOvertaken);
  });
}

void FrameLosses::GiveUpOldest() noexcept {
  const std::uint64_t sequence = context_.sent.begin();
  SentFrame& oldest = context_.sent[sequence];
  if (oldest.is_open()) {
    Lose(oldest, oldest.overtaken > 0 ? Loss::kOvertaken : Loss::kSilence);
    Report(sequence + 1);
  }
  context_.sent.DropOldest();
  context_.sent.DropClosed();
}

/// Counts it; Report() hands it to the sink.
void FrameLosses::Lose(SentFrame& sent, Loss loss) noexcept {
  PairingStatistics& statistics = context_.statistics;
  Facts<GivenUpFact> facts{};
  facts.Set(GivenUpFact::kMayBeCopy, sent.may_be_copy());
  facts.Set(GivenUpFact::kDoubted, sent.doubt.has_value());
  facts.Set(GivenUpFact::kAnswered, context_.SenderOfSent(sent).answered());
  facts.Set(GivenUpFact::kNoAnswers, statistics.no_answers);
  const Fate fate = Decide(kFates, facts);
  sent.state = fate == Fate::kCapturedTwice ? SentFrame::State::kFree : SentFrame::State::kLost;
  sent.loss = fate == Fate::kLost ? loss : Loss::kUndecided;
  --statistics.in_flight;
  switch (fate) {
    case Fate::kLost:
      ++statistics.lost;
      drops_.MissReturn(sent.ref().number, sent.sent_before);
      break;
    case Fate::kCapturedTwice:
      statistics.CountSentTwice();
      break;
    case Fate::kDoubted:
      statistics.Count(*sent.doubt);
      break;
    case Fate::kNoAnswers:
      statistics.Count(Undecided::kNoAnswers);
      break;
    case Fate::kNoReturns:
      statistics.Count(Undecided::kNoReturns);
      break;
  }
}

void FrameLosses::Report(std::uint64_t sequence) noexcept {
  for (std::uint64_t s = context_.sent.begin(); s != sequence; ++s) {
    SentFrame& sent = context_.sent[s];
    if (sent.state != SentFrame::State::kLost) continue;
    sent.state = SentFrame::State::kFree;
    context_.sink.OnLost(sent.view, sent.loss, sent.followed_by_other);
  }
}

void FrameLosses::DoubtSentWithoutAnswer(const SentFrame& first_answered) noexcept {
  std::uint32_t unanswered = 0;
  FrameRef first;
  context_.sent.EachOpenOf(first_answered.sender, first_answered.sequence, [&](const SentFrame& sent) {
    if (unanswered++ == 0) first = sent.ref();
  });
  if (unanswered < threshold::kSilentFrames || !AreTimed(first, first_answered.ref())) return;
  if (Elapsed(first, first_answered.ref()) <= threshold::kSilentNs) return;
  context_.sent.EachOpenOf(first_answered.sender, first_answered.sequence,
                           [](SentFrame& sent) { sent.Doubt(Undecided::kNoAnswers); });
}

void FrameLosses::DoubtOvertakenBy(const SentFrame& sent) noexcept {
  context_.sent.EachOpenOf(sent.sender, sent.sequence, [&](const SentFrame& other) {
    if (other.overtaken == 0 && !other.may_be_copy()) context_.sink.OnDoubtful(other.view);
  });
}

void FrameLosses::Finish(const FrameRef& last) noexcept {
  SentFrames& all = context_.sent;
  std::array<AtEnd, SentFrames::kSlots> fates{};
  std::array<std::uint32_t, 2 * DirectionLearner::kMaxMasters> sent_later{};
  for (std::uint64_t s = all.end(); s != all.begin(); --s) {
    const SentFrame& sent = all[s - 1];
    if (!sent.is_open()) continue;
    const std::uint32_t later = sent_later[sent.sender]++;
    const bool timed = AreTimed(sent.ref(), last);
    Facts<AtEndFact> facts{};
    facts.Set(AtEndFact::kOvertaken, sent.overtaken > 0);
    facts.Set(AtEndFact::kOtherPort, context_.SenderOfSent(sent).own_return_port);
    facts.Set(AtEndFact::kTimed, timed);
    facts.Set(AtEndFact::kSomeSentLater, later >= threshold::kSilentFrames);
    facts.Set(AtEndFact::kManySentLater, later >= threshold::kSilentFramesUntimed);
    facts.Set(AtEndFact::kOverdue, timed && context_.trip.IsOverFor(Elapsed(sent.ref(), last)));
    fates[(s - 1) % SentFrames::kSlots] = Decide(kFatesAtEnd, facts);
  }
  all.EachOpen(all.end(), [&](SentFrame& sent) {
    const AtEnd fate = fates[sent.sequence % SentFrames::kSlots];
    if (fate != AtEnd::kInFlight) Lose(sent, fate == AtEnd::kOvertaken ? Loss::kOvertaken : Loss::kSilence);
  });
  PairingStatistics& statistics = context_.statistics;
  statistics.numbered = std::any_of(context_.senders.begin(), context_.senders.end(),
                                    [](const Sender& s) { return s.rhythm.indices.NumbersAny(); });
  drops_.Finish();
  statistics.dropped_every = drops_.distance();
  const std::uint64_t left_out = std::min(drops_.returns(), statistics.lost);
  statistics.lost -= left_out;
  statistics.undecided[static_cast<std::size_t>(Undecided::kRecorder)] += left_out;
  Report(all.end());
  all.DropAll();
}

}  // namespace ecaudit::bus
