#include "analyzers/model/bus_al_wait.h"

#include <algorithm>
#include <bit>

#include "decoder/base/time.h"

namespace ecaudit::model {
namespace {

constexpr std::uint8_t kStatesOfAll = 0x0F;
/// Looks at the least: who looks once or twice does not wait.
constexpr std::uint64_t kLeastPolls = 3;
/// No status was read, or the clock was set: the wait counts from the next read on.
constexpr TimeNs kNobodyLooked = 3'000'000'000;

}  // namespace

void BusAlWait::OnRequest(esc::AlWord control, track::Acceptance acceptance, const FrameRef& frame, SlaveId slave) {
  if (acceptance == track::Acceptance::kRefused) return;
  const std::uint8_t state = control.state();
  if (!wait_ || wait_->late.control.state() != state) {
    if (wait_ && state < wait_->late.control.state() && Concerns(slave)) GiveUp(frame);
    Close();
    of_all_ = false;
    asked_.clear();
    // BOOT has the bits of two states.
    if (!std::has_single_bit(state)) return;
    wait_ = Wait{};
    read_singly_ = false;
    wait_->late.request = frame;
    wait_->looked = frame;
  }
  // A request that is repeated does not start the clock again.
  const bool again = of_all_ || std::find(asked_.begin(), asked_.end(), slave) != asked_.end();
  if (!again && !wait_->is_late) wait_->late.request = frame;
  wait_->late.control = control;
  if (slave == kNoSlave) {
    of_all_ = true;
  } else if (!again) {
    asked_.push_back(slave);
  }
}

std::int64_t BusAlWait::LimitTo(std::uint8_t target, std::uint8_t from) const {
  return timeouts_.To(target, target < std::bit_floor(from));
}

void BusAlWait::On(const track::AlStatusOfAll& read) {
  if (!wait_) return;
  BusAlOverdue& late = wait_->late;
  const std::uint8_t target = late.control.state();
  const auto shown = static_cast<std::uint8_t>(read.status.raw & kStatesOfAll);
  const bool someone_came_or_went = late.polls > 0 && late.slaves != read.slaves;
  const bool all_asked = AllAsked(read.slaves);
  const bool reached = all_asked ? shown == target : (shown & target) != 0;
  if (reached || someone_came_or_went || shown == 0 || !read.frame.has_time || !late.request.has_time) {
    Close();
    return;
  }
  const std::int64_t unseen = Elapsed(wait_->looked.time, read.frame.time);
  wait_->looked = read.frame;
  if (unseen < 0 || unseen > kNobodyLooked) {
    if (wait_->is_late)
      Close();
    else
      wait_.reset();
    return;
  }
  ++late.polls;
  late.slaves = read.slaves;
  late.status = read.status;
  late.last = read.frame;
  late.all_asked = all_asked;
  if (wait_->is_late) return;
  late.limit_ns = LimitTo(target, static_cast<std::uint8_t>(shown & ~target));
  late.waited_ns = Elapsed(late.request.time, read.frame.time);
  late.frame = read.frame;
  wait_->is_late = late.waited_ns > late.limit_ns;
}

void BusAlWait::On(const track::AlStatusRead& read) {
  if (read.status.bit4() && read.error_bit_known) Refused();
  if (!wait_ || read.status.state() == wait_->late.control.state()) return;
  if (!of_all_ && std::find(asked_.begin(), asked_.end(), read.slave) == asked_.end()) return;
  const BusAlOverdue& late = wait_->late;
  const bool timed = read.frame.has_time && late.request.has_time;
  const std::int64_t limit = LimitTo(late.control.state(), read.status.state());
  if (timed && Elapsed(late.request.time, read.frame.time) > limit) {
    wait_.reset();
  } else if (read.frame.number != wait_->looked.number) {
    read_singly_ = true;  // no broadcast
  }
}

/// That slave, or all, are waited for.
bool BusAlWait::Concerns(SlaveId slave) const {
  return slave == kNoSlave || (!of_all_ && asked_.size() == 1 && asked_.front() == slave);
}

void BusAlWait::GiveUp(const FrameRef& frame) {
  if (!wait_) return;
  BusAlOverdue& late = wait_->late;
  if (read_singly_ || !frame.has_time) return;
  if (wait_->is_late || late.polls < kGivenUpPolls || !late.last.has_time || !late.request.has_time) return;
  late.waited_ns = Elapsed(late.request.time, late.last.time);
  // Since the last look they may have got there.
  if (late.waited_ns < kGivenUpNs || Elapsed(late.last.time, frame.time) > late.waited_ns / 4) return;
  late.frame = late.last;
  late.given_up = wait_->is_late = true;
}

void BusAlWait::Close() {
  if (wait_ && wait_->is_late && wait_->late.polls >= kLeastPolls) events_.Publish(wait_->late);
  wait_.reset();
}

}  // namespace ecaudit::model
