#include "decoder/bus/direction.h"

#include <algorithm>
#include <utility>

#include "decoder/base/time.h"
#include "decoder/base/wrapping.h"
#include "decoder/bus/thresholds.h"

namespace ecaudit::bus {
namespace {

bool IsExchanged(const wire::FrameView& frame) {
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (wire::IsLogical(frame[i].command()) && frame[i].wkc() > 0) return true;
  }
  return false;
}

/// Where a packet was captured: port of the probe and capture interface.
std::uint32_t PortOf(const wire::FrameView& frame) {
  return static_cast<std::uint32_t>(frame.interface_index()) << 8U | (frame.esl().present ? frame.esl().port + 1U : 0U);
}

}  // namespace

std::uint64_t WhatIsAsked(const wire::FrameView& frame) noexcept {
  constexpr std::uint64_t kIndex = 0xFF00;
  std::uint64_t hash = frame.size();
  for (std::size_t i = 0; i < frame.size(); ++i) {
    hash = WrappingProduct(hash ^ (frame[i].KeptHeader() & ~kIndex), std::uint64_t{0x9E3779B97F4A7C15});
    hash ^= hash >> 32U;
  }
  return hash;
}

Progress ProgressOf(const wire::FrameView& frame) noexcept {
  Progress progress;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    progress.counted += frame[i].wkc();
    if (wire::IncrementsAdp(frame[i].command())) {
      progress.positions = static_cast<std::uint16_t>(progress.positions + frame[i].adp());
    }
  }
  return progress;
}

bool IsAccepted(const wire::FrameView& frame) noexcept {
  bool any = false;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const wire::Command c = frame[i].command();
    if (!wire::IsNodeAddressed(c) || c == wire::Command::FRMW) continue;  // FRMW all the others take
    if (frame[i].wkc() == 0) return false;
    any = true;
  }
  return any;
}

bool AnyWorkingCounter(const wire::FrameView& frame) noexcept {
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (frame[i].wkc() != 0) return true;
  }
  return false;
}

DirectionLearner::Sender* DirectionLearner::Find(std::uint64_t mac) noexcept {
  return const_cast<Sender*>(static_cast<const DirectionLearner*>(this)->Find(mac));
}

const DirectionLearner::Sender* DirectionLearner::Find(std::uint64_t mac) const noexcept {
  for (std::size_t i = 0; i < count_; ++i) {
    if (senders_[i].mac == mac) return &senders_[i];
  }
  return nullptr;
}

void DirectionLearner::Learn(const wire::FrameView& frame) noexcept {
  if (frame.kind() != wire::FrameKind::kEtherCat && frame.kind() != wire::FrameKind::kCut) return;
  Sender* sender = Find(SenderOf(frame));
  if (sender == nullptr) {
    if (count_ == kMaxMasters) return;
    sender = &senders_[count_++];
    sender->mac = SenderOf(frame);
  }
  if (frame.flag() == capture::PacketFlag::kInbound) ++sender->flag_in;
  if (frame.flag() == capture::PacketFlag::kOutbound) ++sender->flag_out;
  ++(frame.mac_bit() ? sender->bit_set : sender->bit_clear);
  if (AnyWorkingCounter(frame)) ++sender->counted;
  if (IsExchanged(frame)) ++sender->exchanged;
  if (frame.empty()) return;
  LearnTurn(*sender, frame);
  LearnPair(*sender, frame);
  LearnRepetition(*sender, frame);
}

void DirectionLearner::LearnTurn(Sender& sender, const wire::FrameView& frame) noexcept {
  if (std::exchange(last_, &sender) != &sender) ++sender.turns;
  const bool copy = LearnCopy(sender, frame);
  // At the other end of a redundant line some masters send one broadcast under
  // the index of each frame.
  const auto only_broadcast = [](std::size_t datagrams, wire::Command first) {
    return datagrams == 1 && wire::IsBroadcast(first);
  };
  for (std::size_t i = 0; i < count_; ++i) {
    Sender& other = senders_[i];
    if (&other == &sender || !other.last.seen()) continue;
    const bool dummy = frame[0].index() == other.last_index &&
                       (only_broadcast(frame.size(), frame[0].command()) || other.last_only_broadcast);
    if (!copy && !dummy) continue;
    ++sender.twins;
    ++other.twins;
  }
  sender.last_only_broadcast = only_broadcast(frame.size(), frame[0].command());
  if (sender.last_only_broadcast && IsUnderIndexOfAnother(sender, frame)) ++sender.dummies;
}

/// True when the last frame of another sender has that index, and is no older
/// than a round trip.
bool DirectionLearner::IsUnderIndexOfAnother(const Sender& sender, const wire::FrameView& frame) const noexcept {
  return std::any_of(senders_.begin(), senders_.begin() + static_cast<std::ptrdiff_t>(count_), [&](const Sender& s) {
    if (&s == &sender || !s.last.has_time || !frame.ref().has_time || s.last_index != frame[0].index()) return false;
    const std::int64_t apart = Elapsed(s.last.time, frame.ref().time);
    return apart >= 0 && apart <= threshold::kEchoNs;
  });
}

/// @return true when another sender has just asked for the same
bool DirectionLearner::LearnCopy(Sender& sender, const wire::FrameView& frame) noexcept {
  const Asked asked{.what = WhatIsAsked(frame),
                    .key = frame.key(),
                    .frame = frame.ref(),
                    .index = frame[0].index(),
                    .dummy = frame.size() == 1 && wire::IsBroadcast(frame[0].command()),
                    .taken = IsAccepted(frame)};
  bool alike = false;
  bool copy = false;
  bool taken = false;
  for (std::size_t i = 0; i < count_; ++i) {
    if (&senders_[i] == &sender) continue;
    for (const Asked& other : senders_[i].asked) {
      if (!other.frame.seen() || other.what != asked.what) continue;
      alike = true;
      taken = taken || (asked.taken && other.taken);
      if (!other.frame.has_time || !asked.frame.has_time) continue;
      const std::int64_t apart = Elapsed(other.frame.time, asked.frame.time);
      copy = copy || (apart >= -threshold::kAtOnceNs && apart <= threshold::kAtOnceNs);
    }
  }
  LearnEcho(sender, asked);
  if (alike) ++sender.alike;
  if (copy) ++sender.copies;
  if (taken) ++sender.both_accepted;
  sender.asked[sender.asked_next] = asked;
  sender.asked_next = static_cast<std::uint8_t>((sender.asked_next + 1U) % sender.asked.size());
  return copy;
}

/// The same under the same index, or one broadcast under the index of the frame
/// before, within a round trip.
void DirectionLearner::LearnEcho(Sender& sender, const Asked& asked) noexcept {
  bool echo = false;
  for (std::size_t i = 0; i < count_; ++i) {
    Sender& other = senders_[i];
    if (&other == &sender) continue;
    const bool found = std::any_of(other.asked.begin(), other.asked.end(), [&](const Asked& before) {
      if (!before.frame.has_time || !asked.frame.has_time) return false;
      const bool same = before.key == asked.key || (before.index == asked.index && (before.dummy || asked.dummy));
      return same && Elapsed(before.frame.time, asked.frame.time) <= threshold::kEchoNs;
    });
    if (!found) continue;
    echo = true;
    ++other.echoes;
  }
  if (echo) ++sender.echoes;
}

/// If no frame returns to any sender: frames that have passed slaves came to
/// this port from the main end, and this port is the other end. Else the first
/// sender is at this port, and what arrives here untouched is the other end's.
void DirectionLearner::EvaluateOnePort() noexcept {
  Sender* main = nullptr;
  for (std::size_t i = 0; i < count_; ++i) {
    Sender& s = senders_[i];
    if (s.answered) return;
    if (s.NearlyAll(s.echoes) && (main == nullptr || (main->counted == 0 && s.counted > 0))) main = &s;
  }
  if (main == nullptr) return;
  for (std::size_t i = 0; i < count_; ++i) {
    Sender& s = senders_[i];
    if (&s == main || s.frames() < threshold::kEndFrames || s.counted > 0 || s.bit_set > 0 || !s.NearlyAll(s.echoes))
      continue;
    s.other_end = redundant_ = true;
    main->one_port = one_port_ = main->counted == 0 && main->bit_set == 0;
  }
}

/// The main end is the first sender, else the one with most accepted frames. A
/// sender with the same frames is its other end, unless both are answered by
/// the slaves that they name, or exchange process data and are not at it at
/// once: then two segments with equal programs were captured.
void DirectionLearner::AssessCopies() noexcept {
  const Sender* main = nullptr;
  bool main_copies = false;
  for (std::size_t i = 0; i < count_; ++i) {
    const Sender& s = senders_[i];
    if (!s.answered || s.counted == 0) continue;
    const bool copies = s.NearlyAll(s.copies);
    const bool better =
        main == nullptr || (main_copies && !copies) || (main_copies == copies && s.counted > main->counted);
    if (!better) continue;
    main = &s;
    main_copies = copies;
  }
  if (main == nullptr) return;
  for (std::size_t i = 0; i < count_; ++i) {
    Sender& s = senders_[i];
    if (&s == main || s.frames() < threshold::kEndFrames) continue;
    const bool as_many =
        s.frames() >= main->frames() || (main->frames() - s.frames()) * threshold::kNoCopyOneIn <= s.frames();
    Facts<CopyFact> facts{};
    facts.Set(CopyFact::kInStep, s.answered && s.counted > 0 && as_many && s.NearlyAll(s.alike));
    facts.Set(CopyFact::kCopies, s.NearlyAll(s.copies));
    facts.Set(CopyFact::kSomeAccepted, s.both_accepted > 0);
    facts.Set(CopyFact::kManyAccepted, s.both_accepted >= threshold::kTurns);
    facts.Set(CopyFact::kBothExchange, s.Exchanges() && main->Exchanges());
    facts.Set(CopyFact::kPassesNoSlave, s.answered && s.counted == 0 && !s.moved && s.passed_no_slave > 0);
    facts.Set(CopyFact::kSendsDummies, s.counted == 0 && s.NearlyAll(s.dummies));
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
  for (std::size_t i = 0; i < count_; ++i) {
    const Sender& s = senders_[i];
    if (s.answered && (main == nullptr || s.frames() > main->frames())) main = &s;
  }
  for (std::size_t i = 0; i < count_; ++i) {
    Sender& s = senders_[i];
    if (!s.answered || s.other_end || &s == main) continue;
    Facts<TurnFact> facts{};
    facts.Set(TurnFact::kTurns, s.turns >= threshold::kTurns);
    facts.Set(TurnFact::kTwins, s.twins * threshold::kTwinsOneIn >= s.frames());
    facts.Set(TurnFact::kBothExchange, s.Exchanges() && main->Exchanges());
    facts.Set(TurnFact::kOtherSlaves, s.slaves && main->slaves && *s.slaves != *main->slaves);
    if (Decide(kRoleByTurns, facts) == Role::kOtherBus) s.reading = Reading::kForeign;
  }
}

/// Process data may be the same in every cycle; what else a master sends again
/// and again is meant to be answered.
void DirectionLearner::LearnRepetition(Sender& sender, const wire::FrameView& frame) noexcept {
  const std::uint8_t index = frame[0].index();
  std::uint64_t content = frame.key();
  for (const std::uint8_t byte : frame.payload()) {
    content = WrappingProduct(content ^ byte, std::uint64_t{0x100000001B3});
  }
  const FrameRef last = std::exchange(sender.last, frame.ref());
  const bool first = !last.seen();
  const bool pause =
      !last.has_time || !frame.ref().has_time || Elapsed(last.time, frame.ref().time) >= threshold::kPauseNs;
  if (!first && index != sender.last_index) ++sender.index_changes;
  if (!first && pause && content == sender.last_content && !wire::IsLogical(frame[0].command())) ++sender.repeated;
  sender.last_index = index;
  sender.last_content = content;
}

/// @return true when the frame is the outbound copy of a return that was
/// stamped before it
bool DirectionLearner::LearnBackFirst(Sender& sender, const wire::FrameView& frame) noexcept {
  if (frame.mac_bit() || !frame.ref().has_time) return false;
  const Progress progress = ProgressOf(frame);
  const std::uint32_t port = PortOf(frame);
  const auto back = std::find_if(sender.open.begin(), sender.open.end(), [&](const Open& o) {
    if (!o.used || !o.mac_bit || o.key != frame.key() || o.port == port || !Further(o.progress, progress)) return false;
    const std::int64_t apart = Elapsed(o.frame.time, frame.ref().time);
    return apart > 0 && apart <= threshold::kSkewNs;
  });
  if (back == sender.open.end()) return false;
  back->used = false;
  ++sender.back_first;
  return true;
}

void DirectionLearner::LearnPair(Sender& sender, const wire::FrameView& frame) noexcept {
  if (LearnBackFirst(sender, frame)) return;
  const std::uint64_t key = frame.key();
  const Progress progress = ProgressOf(frame);
  const std::uint32_t port = PortOf(frame);
  if (frame.mac_bit() && wire::IncrementsAdp(frame[0].command()) && frame[0].adp() == 0 && progress.counted == 0) {
    ++sender.passed_no_slave;
  }
  const auto open = std::find_if(sender.open.begin(), sender.open.end(), [&](const Open& o) {
    if (!o.used || o.key != key) return false;
    // A mailbox poll that no slave answered comes back as it was sent.
    const bool untouched =
        progress.counted == 0 && o.progress.counted == 0 && progress.positions == o.progress.positions;
    return untouched || Further(progress, o.progress);
  });
  if (open == sender.open.end()) {
    sender.open[sender.open_next] = {true, key, progress, port, frame.ref(), frame.mac_bit()};
    sender.open_next = static_cast<std::uint8_t>((sender.open_next + 1U) % sender.open.size());
    return;
  }
  if (Further(progress, open->progress)) {
    if (sender.pairs == 0) {
      sender.port_out = open->port;
      sender.port_back = port;
    }
    ++sender.pairs;
    sender.moved = true;
    if (frame.size() == 1 && wire::IncrementsAdp(frame[0].command())) {
      sender.slaves = static_cast<std::uint16_t>(progress.positions - open->progress.positions);
    }
    if (open->port == sender.port_out && port == sender.port_back) ++sender.pairs_by_port;
    if (open->progress.counted != 0) ++sender.pairs_counted;
  }
  open->used = false;
}

void DirectionLearner::Finish() noexcept {
  master_proven_ = ReadBothCopies();
  const auto with_bit = [](const Sender& s) { return s.answered && s.bit_set > 0; };
  const auto end = senders_.begin() + static_cast<std::ptrdiff_t>(count_);
  bit_is_no_evidence_ = master_proven_ && std::none_of(senders_.begin(), end, with_bit);
  AssessCopies();
  EvaluateOnePort();
  IgnoreOtherBuses();
  ReadOneCopies();
}

/// @return true when both copies of the frames of some sender are there
bool DirectionLearner::ReadBothCopies() noexcept {
  bool any = false;
  for (std::size_t i = 0; i < count_; ++i) {
    Sender& s = senders_[i];
    Facts<BothCopiesFact> facts{};
    facts.Set(BothCopiesFact::kBothBits, s.bit_clear > 0 && s.bit_set > 0);
    facts.Set(BothCopiesFact::kPairs, s.frames() > 1 && s.pairs * threshold::kPairsOneIn >= s.frames());
    facts.Set(BothCopiesFact::kPorts,
              s.port_out != s.port_back && (s.pairs - s.pairs_by_port) * threshold::kOtherPortOneIn <= s.pairs);
    facts.Set(BothCopiesFact::kFlags, s.flag_in > 0 && s.flag_out > 0);
    s.reading = Decide(kReadBothCopies, facts);
    if (s.reading == Reading::kUnknown) continue;
    any = s.answered = true;
    // Where one index serves for all, the outbound copy after a return may be
    // the next frame's.
    const bool numbered = s.index_changes * threshold::kNumberedOneIn >= s.frames();
    if (s.back_first >= threshold::kBackFirstFrames && numbered) returns_stamped_first_ = true;
  }
  return any;
}

void DirectionLearner::ReadOneCopies() noexcept {
  bool any_outbound = master_proven_;
  bool any_returned = master_proven_;
  for (std::size_t i = 0; i < count_; ++i) {
    Sender& s = senders_[i];
    if (s.answered) continue;
    Facts<OneCopyFact> facts{};
    facts.Set(OneCopyFact::kOthersHaveBoth, master_proven_);
    facts.Set(OneCopyFact::kEndOfOnePort, s.other_end && one_port_);
    facts.Set(OneCopyFact::kCounted, s.counted * threshold::kReturnedOneIn >= s.frames());
    facts.Set(OneCopyFact::kTimeOuts, s.counted == 0 && s.repeated >= threshold::kRepeatedFrames &&
                                          s.repeated * threshold::kRepeatedOneIn >= s.frames() &&
                                          s.index_changes >= threshold::kIndexChanges);
    facts.Set(OneCopyFact::kBitClear, s.bit_clear > 0);
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
  const Sender* sender = Find(SenderOf(frame));
  if (sender == nullptr) {
    // A sender that shows up later: without the bit it is a master, with it
    // only pairing can decide.
    return frame.mac_bit() || bit_is_no_evidence_ ? Direction::kByPair : Direction::kOutbound;
  }
  const Direction by_bit = frame.mac_bit() ? Direction::kReturned : Direction::kOutbound;
  // In the window all frames of this sender had the same bit. One that differs
  // is a copy from another place.
  const bool bit_differs = frame.mac_bit() != (sender->bit_set > 0);
  switch (sender->reading) {
    case Reading::kMacBit:
      return by_bit;
    case Reading::kByPort:
      if (bit_differs) return by_bit;
      if (PortOf(frame) == sender->port_out) return Direction::kOutbound;
      return PortOf(frame) == sender->port_back ? Direction::kReturned : Direction::kByPair;
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
  return master_proven_ && Find(SenderOf(frame)) == nullptr;
}

bool DirectionLearner::IsForeignSender(const wire::FrameView& frame) const noexcept {
  return count_ > 0 && count_ < kMaxMasters && Find(SenderOf(frame)) == nullptr;
}

bool DirectionLearner::Unanswered(const wire::FrameView& frame) const noexcept {
  const Sender* sender = Find(SenderOf(frame));
  return sender != nullptr && !sender->answered && !sender->unanswered;
}

bool DirectionLearner::IsTappedAfterSlaves(const wire::FrameView& frame) const noexcept {
  const Sender* sender = Find(SenderOf(frame));
  // With a single slave in front most of what others are asked passes it
  // uncounted.
  return sender != nullptr && sender->pairs_counted >= threshold::kCountedFrames &&
         sender->pairs_counted * threshold::kCountedOneIn >= sender->pairs;
}

bool DirectionLearner::IsOnePort(const wire::FrameView& frame) const noexcept {
  const Sender* sender = one_port_ ? Find(SenderOf(frame)) : nullptr;
  return sender != nullptr && sender->one_port;
}

bool DirectionLearner::IsOtherEnd(const wire::FrameView& frame) const noexcept {
  const Sender* sender = redundant_ ? Find(SenderOf(frame)) : nullptr;
  return sender != nullptr && sender->other_end;
}

}  // namespace ecaudit::bus
