#include "decoder/bus/index_sequence.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace ecaudit::bus {

/// Position counters change on the way: frames addressed by them are one kind. Process data make a frame cyclic
/// wherever they stand in it: some masters put the time in front of them, and that into one of several frames a cycle.
std::size_t IndexSequence::KindOf(const wire::FrameView& frame) noexcept {
  constexpr std::size_t kHalf = kKinds / 2;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const wire::DatagramView d = frame[i];
    if (!wire::IsLogical(d.command())) continue;
    const std::uint32_t address = d.logical_address();
    return (address ^ address >> 5U ^ address >> 11U ^ address >> 16U) % kHalf;
  }
  const wire::DatagramView d = frame[0];
  const wire::Command c = d.command();
  if (wire::IsBroadcast(c)) return kHalf;
  if (wire::IncrementsAdp(c)) return kHalf + 1;
  return kHalf + 2 + d.adp() % (kHalf - 2);
}

template <class Proven>
IndexSequence::Evidence IndexSequence::Ask(Counter& counter, std::uint8_t first, std::uint8_t last, Verdict& verdict,
                                           const Proven& proven) const noexcept {
  const bool regular = counter.indices.IsRegular();
  const bool regular_so_far = regular || counter.indices.IsRegularSoFar();
  const bool left_out_none = counter.indices.LeavesNoneOut();
  const bool excused = counter.break_ != break_;
  const IndexCounter::Step step = counter.indices.Follow(first, last);
  counter.break_ = break_;
  if (step == IndexCounter::Step::kFollows) {
    // Where frames of several slaves take turns under one counter, those of one slave have a stride: that is no counter
    // of its own, and does not show that the other one is whole.
    const bool only_stride = verdict.broken && counter.indices.stride() > 1;
    verdict.next = verdict.next || (regular && !only_stride);
    return Evidence::kFollows;
  }
  if (step == IndexCounter::Step::kUnknown || excused) return Evidence::kNothing;
  verdict.begins = verdict.begins || step == IndexCounter::Step::kBegins;
  if (!regular || !proven()) {
    const std::uint32_t left_out = counter.indices.skipped();
    verdict.few = verdict.few || (regular_so_far && left_out > 0 && left_out <= kFewNumbers);
    return Evidence::kOdd;
  }
  // Of all frames, if they share one; else of fewer.
  if (!verdict.broken) {
    verdict.skipped = counter.indices.skipped();
    verdict.left_out_none = left_out_none;
  }
  verdict.broken = true;
  return Evidence::kNothing;
}

/// Logical commands come last in a start-up. Where many others shared one counter until then, they do if they have done
/// so once, and in their first frame if it has not the index of a counter that only begins.
bool IndexSequence::SharesLikeOthers(std::size_t kind, std::uint8_t first) const noexcept {
  if (!IsLogical(kind) || std::popcount(share_all_[1]) < kProvenKinds) return false;
  return share_all_[0] != 0 || (!met_[0] && first % kRoundNumber > 1);
}

/// Two programs with a counter of their own each send in turn.
bool IndexSequence::GoesOnWhereLeft(std::uint8_t first) noexcept {
  if (!left_ || !left_->IsBefore(first)) return false;
  if (turns_ == kTurns) return true;
  // Once, and long after, it may be where the capture goes on after a gap.
  if (since_left_ > kShortTurn) return false;
  ++turns_;
  return true;
}

void IndexSequence::Prove(Evidence evidence, std::uint8_t& proven) noexcept {
  if (evidence == Evidence::kFollows && proven < kProven) ++proven;
  if (evidence == Evidence::kOdd) proven = 0;
}

std::optional<IndexSequence::Jump> IndexSequence::FollowJump(Evidence by_all, bool left_out_none,
                                                             std::size_t kind) noexcept {
  const bool logical = IsLogical(kind);
  if (by_all == Evidence::kOdd && left_out_none) {
    jump_ = Jump{logical, all_.indices.skipped()};
    return std::nullopt;
  }
  if (!jump_ || jump_->logical == logical) return std::nullopt;
  const std::optional<Jump> jump = std::exchange(jump_, std::nullopt);
  const bool shared = by_all == Evidence::kFollows && kinds_[kind].in_all >= kProven;
  return shared ? jump : std::nullopt;
}

IndexSequence::Step IndexSequence::Follow(const wire::FrameView& frame, bool repeats) noexcept {
  if (frame.empty()) {
    Skip();
    return Step::kUnknown;
  }
  const auto [first, last] = NumbersOf(frame);
  loose_ = continued_ = false;
  const bool same = any_ && first == last_.first;
  repeats_ = same;
  if (repeats && same) return Step::kUnknown;
  was_next_ = false;
  const bool any = std::exchange(any_, true);
  const FrameNumbers before = std::exchange(last_, FrameNumbers{first, last});
  const std::size_t number = KindOf(frame);
  Kind& kind = kinds_[number];
  Counter& half = halves_[IsLogical(number) ? 0 : 1];
  std::uint32_t& share_all = share_all_[IsLogical(number) ? 0 : 1];
  Verdict verdict;
  const bool left_out_none = all_.indices.LeavesNoneOut();
  const Evidence by_all = Ask(all_, first, last, verdict, [&, first = first] {
    return kind.in_all >= kProven || std::popcount(share_all) >= kProvenKinds || SharesLikeOthers(number, first);
  });
  const std::optional<Jump> jump = FollowJump(by_all, left_out_none, number);
  Prove(by_all, kind.in_all);
  met_[IsLogical(number) ? 0 : 1] = true;
  if (by_all == Evidence::kFollows) share_all |= 1U << number;
  if (by_all == Evidence::kOdd) share_all = 0;
  span_ = all_.indices.round();
  const bool same_in_half = std::exchange(half.last, first) == first;
  const bool same_of_kind = std::exchange(kind.own.last, first) == first;
  if (since_left_ <= kShortTurn) ++since_left_;
  broke_earlier_ = jump.has_value();
  if (jump) {
    ++break_;
    skipped_ = jump->skipped;
    left_out_none_ = continued_ = true;
    all_.break_ = half.break_ = kind.own.break_ = break_;
    (void)half.indices.Follow(first, last);
    (void)kind.own.indices.Follow(first, last);
    return Step::kBroken;
  }
  if (verdict.next) {
    continued_ = was_next_ = true;
    // Nearly always. What the others make of it does not matter.
    (void)half.indices.Follow(first, last);
    half.break_ = kind.own.break_ = break_;
    (void)kind.own.indices.Follow(first, last);
    return Step::kNext;
  }
  const bool goes_on = !same && GoesOnWhereLeft(first);
  if (!same && by_all != Evidence::kFollows) {
    left_ = before;
    since_left_ = 0;
  }
  const Evidence by_half = Ask(half, first, last, verdict, [&] { return kind.in_half >= kProven; });
  Prove(by_half, kind.in_half);
  if (verdict.next) span_ = half.indices.round();
  const bool next_in_half = verdict.next;
  // Until the master also sent frames of the other half, one counter was that of all.
  if (next_in_half && verdict.broken) {
    kind.in_all = 0;
    share_all = 0;
  }
  // A kind that has the counter of its half is near that of all by coincidence.
  if (kind.in_half >= kProven && by_half != Evidence::kOdd) verdict.few = false;
  const Evidence by_own = Ask(kind.own, first, last, verdict, [] { return true; });
  continued_ = by_all == Evidence::kFollows || by_half == Evidence::kFollows || by_own == Evidence::kFollows;
  loose_ = any && !same && !same_in_half && !same_of_kind && !continued_;
  if (verdict.next) {
    was_next_ = true;
    if (!next_in_half) span_ = kind.own.indices.round();
    return Step::kNext;
  }
  was_next_ = goes_on;
  if (goes_on) return Step::kNext;
  if (!verdict.broken) return verdict.few ? Step::kFew : Step::kUnknown;
  ++break_;
  skipped_ = verdict.skipped;
  left_out_none_ = verdict.left_out_none;
  all_.break_ = half.break_ = kind.own.break_ = break_;
  // Who begins from the lowest with a command to all slaves sets up the bus.
  return verdict.begins && wire::IsBroadcast(frame[0].command()) ? Step::kUnknown : Step::kBroken;
}

bool IndexSequence::restarts() const noexcept {
  return any_ && (all_.indices.IsBegin(last_.first) ||
                  std::ranges::any_of(halves_, [&](const Counter& half) { return half.indices.IsBegin(last_.first); }));
}

bool IndexSequence::IsNext(const wire::FrameView& frame) const noexcept {
  if (frame.empty()) return false;
  const std::uint8_t first = NumbersOf(frame).first;
  const std::size_t number = KindOf(frame);
  const auto continues = [&](const Counter& counter) {
    return counter.break_ == break_ && counter.indices.IsRegular() && counter.indices.IsNext(first);
  };
  return continues(all_) || continues(halves_[IsLogical(number) ? 0 : 1]) || continues(kinds_[number].own);
}

bool IndexSequence::IsNumbered(const wire::FrameView& frame) const noexcept {
  if (frame.empty()) return false;
  const std::size_t number = KindOf(frame);
  return all_.indices.IsRegular() || halves_[IsLogical(number) ? 0 : 1].indices.IsRegular() ||
         kinds_[number].own.indices.IsRegular();
}

bool IndexSequence::NumbersAny() const noexcept {
  const auto regular = [](const Kind& kind) { return kind.own.indices.IsRegular(); };
  return all_.indices.IsRegular() || halves_[0].indices.IsRegular() || halves_[1].indices.IsRegular() ||
         std::any_of(kinds_.begin(), kinds_.end(), regular);
}

bool IndexSequence::IsAfter(const wire::FrameView& frame, std::uint64_t count) const noexcept {
  return any_ && !frame.empty() && all_.indices.IsAfter(NumbersOf(frame).first, count);
}

}  // namespace ecaudit::bus
