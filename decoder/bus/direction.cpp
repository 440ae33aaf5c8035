#include "decoder/bus/direction.h"

#include <algorithm>
#include <utility>

#include "decoder/base/time.h"
#include "decoder/bus/thresholds.h"

namespace ecaudit::bus {

/// @return the next free one where none has it
std::size_t DirectionLearner::PlaceOf(std::uint64_t mac) const noexcept {
  std::size_t place = 0;
  while (place < count_ && senders_[place].mac != mac) ++place;
  return place;
}

void DirectionLearner::Learn(const wire::FrameView& frame) noexcept {
  if (frame.kind() != wire::FrameKind::kEtherCat && frame.kind() != wire::FrameKind::kCut) return;
  const std::size_t place = PlaceOf(frame.sender());
  if (place == kMaxMasters) return;
  Sender& sender = senders_[place];
  if (place == count_) senders_[count_++].mac = frame.sender();
  sender.signs.Add(frame);
  if (frame.empty()) return;
  LearnLikeness(sender, frame);
  sender.pairs.Add(frame);
  sender.repetitions.Add(frame);
}

void DirectionLearner::LearnLikeness(Sender& sender, const wire::FrameView& frame) noexcept {
  if (std::exchange(last_, &sender) != &sender) ++sender.likeness.turns;
  const Likeness::Asked asked = Likeness::AskedBy(frame);
  Likeness::Match match;
  for (Sender& other : senders()) {
    if (&other != &sender) other.likeness.Compare(asked, match);
  }
  sender.likeness.Add(asked, match);
  // At the other end of a redundant line some masters send one broadcast under
  // the index of each frame.
  bool under_index = false;
  for (Sender& other : senders()) {
    const Repetitions& before = other.repetitions;
    if (&other == &sender || !before.last.seen()) continue;
    const bool same_index = asked.index == before.index;
    if (same_index && before.last.has_time && asked.frame.has_time) {
      const std::int64_t apart = Elapsed(before.last.time, asked.frame.time);
      under_index = under_index || (apart >= 0 && apart <= threshold::kEchoNs);
    }
    if (!match.copy && !(same_index && (asked.dummy || before.was_only_broadcast))) continue;
    ++sender.likeness.twins;
    ++other.likeness.twins;
  }
  if (asked.dummy && under_index) ++sender.likeness.dummies;
}

/// If no frame returns to any sender: frames that have passed slaves came to
/// this port from the main end, and this port is the other end. Else the first
/// sender is at this port, and what arrives here untouched is the other end's.
void DirectionLearner::EvaluateOnePort() noexcept {
  Sender* main = nullptr;
  for (Sender& s : senders()) {
    if (s.answered) return;
    const bool better = main == nullptr || (main->signs.counted == 0 && s.signs.counted > 0);
    if (better && s.signs.NearlyAll(s.likeness.echoes)) main = &s;
  }
  if (main == nullptr) return;
  const auto untouched = [](const Sender& s) { return s.signs.counted == 0 && s.signs.bit_set == 0; };
  for (Sender& s : senders()) {
    if (&s == main || s.frames() < threshold::kEndFrames || !untouched(s) || !s.signs.NearlyAll(s.likeness.echoes)) {
      continue;
    }
    s.other_end = redundant_ = true;
    main->one_port = one_port_ = untouched(*main);
  }
}

/// The main end is the first sender, else the one with most accepted frames.
const DirectionLearner::Sender* DirectionLearner::MainOfCopies() noexcept {
  const Sender* main = nullptr;
  bool main_copies = false;
  for (const Sender& s : senders()) {
    if (!s.answered || s.signs.counted == 0) continue;
    const bool copies = s.signs.NearlyAll(s.likeness.copies);
    const bool better =
        main == nullptr || (main_copies && !copies) || (main_copies == copies && s.signs.counted > main->signs.counted);
    if (!better) continue;
    main = &s;
    main_copies = copies;
  }
  return main;
}

/// A sender with the same frames as the main one is its other end, unless both
/// are answered by the slaves that they name, or exchange process data and are
/// not at it at once: then two segments with equal programs were captured.
void DirectionLearner::AssessCopies() noexcept {
  const Sender* main = MainOfCopies();
  if (main == nullptr) return;
  for (Sender& s : senders()) {
    if (&s == main || s.frames() < threshold::kEndFrames) continue;
    const FrameSigns& signs = s.signs;
    const Likeness& like = s.likeness;
    const bool as_many =
        s.frames() >= main->frames() || (main->frames() - s.frames()) * threshold::kNoCopyOneIn <= s.frames();
    Facts<CopyFact> facts{};
    facts.Set(CopyFact::kInStep, s.answered && signs.counted > 0 && as_many && signs.NearlyAll(like.alike));
    facts.Set(CopyFact::kCopies, signs.NearlyAll(like.copies));
    facts.Set(CopyFact::kSomeAccepted, like.both_accepted > 0);
    facts.Set(CopyFact::kManyAccepted, like.both_accepted >= threshold::kTurns);
    facts.Set(CopyFact::kBothExchange, signs.Exchanges() && main->signs.Exchanges());
    facts.Set(CopyFact::kPassesNoSlave,
              s.answered && signs.counted == 0 && s.pairs.pairs == 0 && s.pairs.passed_no_slave > 0);
    facts.Set(CopyFact::kSendsDummies, signs.counted == 0 && signs.NearlyAll(like.dummies));
    const Role role = Decide(kRoleByCopies, facts);
    if (role == Role::kOtherBus) s.reading = Reading::kForeign;
    if (role != Role::kOtherEnd) continue;
    s.other_end = redundant_ = true;
    if (s.answered) continue;
    // On their way back slaves hand frames on without setting the bit.
    s.answered = true;
    s.reading = Reading::kByPair;
  }
}

/// The bus is that of the master that is seen most.
void DirectionLearner::IgnoreOtherBuses() noexcept {
  const Sender* main = nullptr;
  for (const Sender& s : senders()) {
    if (s.answered && (main == nullptr || s.frames() > main->frames())) main = &s;
  }
  for (Sender& s : senders()) {
    if (!s.answered || s.other_end || &s == main) continue;
    const auto slaves = s.pairs.slaves;
    Facts<TurnFact> facts{};
    facts.Set(TurnFact::kTurns, s.likeness.turns >= threshold::kTurns);
    facts.Set(TurnFact::kTwins, s.likeness.twins * threshold::kTwinsOneIn >= s.frames());
    facts.Set(TurnFact::kBothExchange, s.signs.Exchanges() && main->signs.Exchanges());
    facts.Set(TurnFact::kOtherSlaves, slaves && main->pairs.slaves && *slaves != *main->pairs.slaves);
    if (Decide(kRoleByTurns, facts) == Role::kOtherBus) s.reading = Reading::kForeign;
  }
}

void DirectionLearner::Finish() noexcept {
  master_proven_ = ReadBothCopies();
  bit_is_no_evidence_ = master_proven_ && std::ranges::none_of(senders(), [](const Sender& s) {
                          return s.answered && s.signs.bit_set > 0;
                        });
  AssessCopies();
  EvaluateOnePort();
  IgnoreOtherBuses();
  ReadOneCopies();
}

/// @return true when both copies of the frames of some sender are there
bool DirectionLearner::ReadBothCopies() noexcept {
  bool any = false;
  for (Sender& s : senders()) {
    Facts<BothCopiesFact> facts{};
    facts.Set(BothCopiesFact::kBothBits, s.signs.bit_clear > 0 && s.signs.bit_set > 0);
    facts.Set(BothCopiesFact::kPairs, s.pairs.AreEnough(s.frames()));
    facts.Set(BothCopiesFact::kPorts, s.pairs.RunFromPortToPort());
    facts.Set(BothCopiesFact::kFlags, s.signs.flag_in > 0 && s.signs.flag_out > 0);
    s.reading = Decide(kReadBothCopies, facts);
    if (s.reading == Reading::kUnknown) continue;
    any = s.answered = true;
    // Where one index serves for all, the outbound copy after a return may be
    // the next frame's.
    if (s.pairs.back_first >= threshold::kBackFirstFrames && s.repetitions.AreNumbered(s.frames())) {
      returns_stamped_first_ = true;
    }
  }
  return any;
}

void DirectionLearner::ReadOneCopies() noexcept {
  bool any_outbound = master_proven_;
  bool any_returned = master_proven_;
  for (Sender& s : senders()) {
    if (s.answered) continue;
    Facts<OneCopyFact> facts{};
    facts.Set(OneCopyFact::kOthersHaveBoth, master_proven_);
    facts.Set(OneCopyFact::kEndOfOnePort, s.other_end && one_port_);
    facts.Set(OneCopyFact::kCounted, s.signs.counted * threshold::kReturnedOneIn >= s.frames());
    facts.Set(OneCopyFact::kTimeOuts, s.signs.counted == 0 && s.repetitions.AreTimeOuts(s.frames()));
    facts.Set(OneCopyFact::kBitClear, s.signs.bit_clear > 0);
    const OneCopyVerdict verdict = Decide(kReadOneCopy, facts);
    s.reading = verdict.reading;
    any_returned = any_returned || verdict.shows == Shows::kReturns;
    any_outbound = any_outbound || verdict.shows == Shows::kOutbound;
    if (verdict.shows == Shows::kNoAnswers) s.unanswered = no_answers_ = true;
  }
  no_answers_ = no_answers_ && !any_outbound && !any_returned;
  outbound_only_ = any_outbound && !any_returned;
  returned_only_ = any_returned && !any_outbound;
}

Direction DirectionLearner::Classify(const wire::FrameView& frame) const noexcept {
  const Sender* sender = Find(frame);
  if (sender == nullptr) {
    // A sender that shows up later: without the bit it is a master, with it
    // only pairing can decide.
    return frame.mac_bit() || bit_is_no_evidence_ ? Direction::kByPair : Direction::kOutbound;
  }
  const Direction by_bit = frame.mac_bit() ? Direction::kReturned : Direction::kOutbound;
  // In the window all frames of this sender had the same bit. One that differs
  // is a copy from another place.
  const bool bit_differs = frame.mac_bit() != (sender->signs.bit_set > 0);
  switch (sender->reading) {
    case Reading::kMacBit:
      return by_bit;
    case Reading::kByPort:
      if (bit_differs) return by_bit;
      if (PortOf(frame) == sender->pairs.port_out) return Direction::kOutbound;
      return PortOf(frame) == sender->pairs.port_back ? Direction::kReturned : Direction::kByPair;
    case Reading::kByFlag:
      if (bit_differs) return by_bit;
      if (frame.flag() == capture::PacketFlag::kOutbound) return Direction::kOutbound;
      return frame.flag() == capture::PacketFlag::kInbound ? Direction::kReturned : Direction::kByPair;
    case Reading::kByPair:
      return bit_differs ? by_bit : Direction::kByPair;
    case Reading::kAllReturned:
      return bit_differs ? by_bit : Direction::kReturned;
    case Reading::kAllOutbound:
      if (bit_differs) return by_bit;
      // Slaves that were plugged in since then count.
      return AnyWorkingCounter(frame) ? Direction::kByPair : Direction::kOutbound;
    case Reading::kUnknown:
    case Reading::kForeign:
      return Direction::kForeign;
  }
  return Direction::kForeign;
}

bool DirectionLearner::JoinedLate(const wire::FrameView& frame) const noexcept {
  return master_proven_ && Find(frame) == nullptr;
}

bool DirectionLearner::IsForeignSender(const wire::FrameView& frame) const noexcept {
  return count_ > 0 && count_ < kMaxMasters && Find(frame) == nullptr;
}

bool DirectionLearner::Unanswered(const wire::FrameView& frame) const noexcept {
  const Sender* sender = Find(frame);
  return sender != nullptr && !sender->answered && !sender->unanswered;
}

bool DirectionLearner::IsTappedAfterSlaves(const wire::FrameView& frame) const noexcept {
  const Sender* sender = Find(frame);
  return sender != nullptr && sender->pairs.ComeFromSlaves();
}

bool DirectionLearner::IsOnePort(const wire::FrameView& frame) const noexcept {
  const Sender* sender = one_port_ ? Find(frame) : nullptr;
  return sender != nullptr && sender->one_port;
}

bool DirectionLearner::IsOtherEnd(const wire::FrameView& frame) const noexcept {
  const Sender* sender = redundant_ ? Find(frame) : nullptr;
  return sender != nullptr && sender->other_end;
}

}  // namespace ecaudit::bus
