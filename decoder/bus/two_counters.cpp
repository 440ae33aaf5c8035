#include "decoder/bus/two_counters.h"

#include <algorithm>

#include "decoder/bus/direction.h"
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

/// rows_.size(): neither of both.
std::size_t TwoCounters::RowOf(std::uint8_t index) const noexcept {
  const std::size_t other = 1 - current_;
  if (rows_[current_].frames > 0 && index == rows_[current_].first_index) return current_;  // sent again
  if (rows_[current_].GoesOn(index)) return current_;
  if (rows_[other].GoesOn(index)) return other;
  if (rows_[current_].Restarts(index)) return current_;
  return rows_[other].Restarts(index) ? other : rows_.size();
}

void TwoCounters::FollowSent(const wire::FrameView& frame) noexcept {
  if (frame.empty()) return;
  const std::uint8_t first = frame[0].index();
  sent_key_ = frame.key();
  const std::size_t row_number = RowOf(first);
  if (row_number == rows_.size()) {
    rows_[current_].unanswered = 0;
    current_ = 1 - current_;
    rows_[current_] = {};
    rows_[current_].began = frame.ref();
    rows_[current_].lowest_index = first;
    turns_ = 0;
  } else if (row_number != current_) {
    current_ = row_number;
    if (rows_[0].frames >= kProven && rows_[1].frames >= kProven) ++turns_;
  }
  Row& row = rows_[current_];
  ++row.frames;
  row.last = frame.ref();
  row.first_index = first;
  row.last_index = frame[frame.size() - 1].index();
  // What begins with process data sets nothing up.
  if (!wire::IsLogical(frame[0].command())) row.set_up_positions |= PositionsSetUp(frame);
}

void TwoCounters::FollowReturned(const wire::FrameView& frame) noexcept {
  Row& row = rows_[current_];
  const bool alone = rows_[1 - current_].frames == 0;
  if (alone && row.answered >= kProven) return;  // nearly always
  if (frame.empty() || frame.key() != sent_key_) return;
  if (AnyWorkingCounter(frame)) {
    ++row.answered;
  } else if (wire::IsNodeAddressed(frame[0].command())) {
    ++row.unanswered;
  }
}

bool TwoCounters::SetUpTwice() const {
  return BothAnswered() && (rows_[0].set_up_positions & rows_[1].set_up_positions) != 0;
}

bool TwoCounters::Collide() const {
  return BothAnswered() && std::max(rows_[0].unanswered, rows_[1].unanswered) >= kManyUnanswered;
}

}  // namespace ecaudit::bus
