#include "decoder/bus/two_index_sequences.h"

#include <algorithm>

#include "decoder/bus/direction.h"
#include "decoder/bus/frame_numbers.h"
#include "decoder/esc/register_addresses.h"

namespace ecaudit::bus {
namespace {

/// Positions that the frame gives station addresses to, modulo 64.
std::uint64_t PositionsSetUp(const wire::FrameView& frame) noexcept {
  std::uint64_t positions = 0;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const wire::DatagramView d = frame[i];
    if (d.command() == wire::Command::APWR && d.ado() == esc::kStationAddress) {
      positions |= std::uint64_t{1} << (d.adp() % 64U);
    }
  }
  return positions;
}

}  // namespace

/// sequences_.size(): neither of both.
std::size_t TwoIndexSequences::SequenceOf(std::uint8_t index) const noexcept {
  const std::size_t other = 1 - current_;
  if (sequences_[current_].frames > 0 && index == sequences_[current_].first_index) return current_;  // sent again
  if (sequences_[current_].GoesOn(index)) return current_;
  if (sequences_[other].GoesOn(index)) return other;
  if (sequences_[current_].Restarts(index)) return current_;
  return sequences_[other].Restarts(index) ? other : sequences_.size();
}

void TwoIndexSequences::FollowSent(const wire::FrameView& frame) noexcept {
  if (frame.empty()) return;
  const auto [first, last] = NumbersOf(frame);
  sent_key_ = frame.key();
  const std::size_t number = SequenceOf(first);
  if (number == sequences_.size()) {
    sequences_[current_].unanswered = 0;
    sequences_[current_].cleared = false;
    current_ = 1 - current_;
    sequences_[current_] = {};
    sequences_[current_].began = frame.ref();
    sequences_[current_].lowest_index = first;
    turns_ = 0;
  } else if (number != current_) {
    current_ = number;
    if (sequences_[0].frames >= kProven && sequences_[1].frames >= kProven) ++turns_;
  }
  Sequence& own = sequences_[current_];
  ++own.frames;
  own.last = frame.ref();
  own.first_index = first;
  own.last_index = last;
  // What begins with process data sets nothing up.
  if (!wire::IsLogical(frame[0].command())) own.set_up_positions |= PositionsSetUp(frame);
}

void TwoIndexSequences::FollowReturned(const wire::FrameView& frame) noexcept {
  Sequence& own = sequences_[current_];
  Sequence& other = sequences_[1 - current_];
  if (frame.empty() || frame.key() != sent_key_) return;
  const wire::DatagramView first = frame[0];
  const bool known = own.answered >= kProven && (own.reached >= kProven || !wire::IsNodeAddressed(first.command()));
  if (other.frames == 0 && known) return;  // nearly always
  if (AnyWorkingCounter(frame)) {
    ++own.answered;
    if (wire::IsNodeAddressed(first.command())) {
      if (own.reached < kProven) ++own.reached;
      own.unanswered = 0;
    }
    if (other.frames > 0 && first.command() == wire::Command::BWR && first.ado() == esc::kStationAddress) {
      other.cleared = true;
      other.unanswered = 0;
    }
  } else if (own.cleared && wire::IsNodeAddressed(first.command())) {
    ++own.unanswered;
  }
}

bool TwoIndexSequences::SetUpTwice() const {
  return BothAnswered() && (sequences_[0].set_up_positions & sequences_[1].set_up_positions) != 0;
}

bool TwoIndexSequences::IsCutOff(const Sequence& sequence) {
  return sequence.set_up_positions != 0 && sequence.reached >= kProven && sequence.unanswered >= kManyUnanswered;
}

bool TwoIndexSequences::Collide() const {
  return BothAnswered() && (IsCutOff(sequences_[0]) || IsCutOff(sequences_[1]));
}

std::uint64_t TwoIndexSequences::unanswered() const {
  return std::max(sequences_[0].unanswered, sequences_[1].unanswered);
}

}  // namespace ecaudit::bus
