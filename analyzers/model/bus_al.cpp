#include "analyzers/model/bus_al.h"

#include <algorithm>
#include <bit>

#include "decoder/base/time.h"

namespace ecaudit::model {
namespace {

constexpr std::uint8_t kStateBits = 0x0F;
constexpr std::uint8_t kAnyError = 0x10;
constexpr auto kInInit = static_cast<std::uint8_t>(esc::AlState::INIT);

std::uint8_t BitsOf(esc::AlWord status) {
  return static_cast<std::uint8_t>(status.raw & (kStateBits | kAnyError));
}

/// A change is compared with what was shown this number of times; a single read may lie between a request before the
/// capture and its answer.
constexpr std::uint64_t kEnoughPolls = 3;
/// Slaves have answered a request by then.
constexpr TimeNs kSettled = 10'000'000'000;

/// The highest state in an OR of states; 0: none.
std::uint8_t Highest(std::uint8_t bits) {
  return std::bit_floor(static_cast<std::uint8_t>(bits & kStateBits));
}

/// Those bits of `now` that no slave that rose can have set.
std::uint8_t Fallen(std::uint8_t before, std::uint8_t now) {
  const auto states = static_cast<std::uint8_t>(before & kStateBits);
  const auto lowest = static_cast<std::uint8_t>(states & -states);
  auto fallen = static_cast<std::uint8_t>(now & ((lowest - 1) | kAnyError) & ~before);
  // Who was highest has joined those who were lower.
  if (Highest(now) < Highest(before)) fallen = static_cast<std::uint8_t>(fallen | Highest(now));
  return lowest == 0 ? std::uint8_t{0} : fallen;
}

}  // namespace

void BusAlUnit::OnRequest(esc::AlWord control, track::Acceptance acceptance, const FrameRef& frame, bool of_all) {
  if (acceptance == track::Acceptance::kRefused) return;
  ReportRefusal(true);
  Close();
  // What was asked for before, and all agree on, is over.
  if (shown_ && Settled()) requested_ = 0;
  const std::uint16_t* count = network_.slave_count().if_known();
  if (requested_ == 0 || (count != nullptr && NoSlaveHadError(*count, requested_at_.number))) acknowledging_ = false;
  // What all took is what all copy.
  acknowledging_ = control.bit4() || (acknowledging_ && !(of_all && acceptance == track::Acceptance::kAccepted));
  control_ = control;
  if (of_all) asked_of_all_ = control.state();
  requested_ = static_cast<std::uint8_t>(requested_ | (control.state() & kStateBits));
  requested_at_ = frame;
}

void BusAlUnit::OnAsked(SlaveId slave, esc::AlWord control, track::Acceptance acceptance) {
  if (acceptance == track::Acceptance::kRefused) return;
  if (slave >= asked_.size()) asked_.resize(std::size_t{slave} + 1, 0);
  Await(slave, control.state());
}

/// @param state 0: nothing any more
void BusAlUnit::Await(SlaveId slave, std::uint8_t state) {
  const auto waits = [this](std::uint8_t asked) -> std::size_t& { return asked == kInInit ? waits_for_init_ : waits_; };
  if (asked_[slave] != 0) --waits(asked_[slave]);
  if (state != 0) ++waits(state);
  asked_[slave] = state;
}

/// It is where it was to go, or shows that it does not go there.
void BusAlUnit::NoteAnswer(const track::AlStatusRead& read) {
  if (read.slave >= asked_.size() || asked_[read.slave] == 0) return;
  if (read.status.state() == asked_[read.slave] || (read.status.bit4() && read.error_bit_known)) Await(read.slave, 0);
}

/// All slaves need not agree on a state, one may be left in INIT: each has shown by itself what it was asked for. Who
/// shows nothing by itself was asked for INIT only, which no slave refuses, and a slave that is none of the others is
/// in INIT.
bool BusAlUnit::AllFollowed() const {
  if (!shown_ || waits_ > 0 || shown_->last.number <= requested_at_.number) return false;
  const bool all_met = network_.slaves().size() >= shown_->slaves;
  if (all_met && waits_for_init_ == 0) return true;
  if (!all_met && asked_of_all_ != 0 && asked_of_all_ != kInInit) return false;
  return (shown_->status.state() & ~ShownBySlaves()) == kInInit;
}

std::optional<BusAlUnit::Common> BusAlUnit::common() const {
  const std::uint16_t* count = network_.slave_count().if_known();
  if (!shown_ || requested_ != 0 || count == nullptr || shown_->slaves != *count) return std::nullopt;
  const auto of = [](esc::AlWord status, const FrameRef& frame) -> std::optional<Common> {
    const auto state = static_cast<std::uint8_t>(status.raw & kStateBits);
    if (!std::has_single_bit(state)) return std::nullopt;
    return Common{frame, state, status.bit4()};
  };
  // A slave left it since, and no read has shown yet which one.
  return open_ ? of(open_->before, before_open_) : of(shown_->status, shown_->last);
}

/// All agree on what was requested, or have had time for it.
bool BusAlUnit::Settled() const {
  if (requested_ == 0 || AllFollowed()) return true;
  // An error bit beside may be the echo of an acknowledge.
  const auto states = static_cast<std::uint8_t>(shown_->status.raw & kStateBits);
  if (std::has_single_bit(states) && (states & requested_) != 0) return true;
  const FrameRef& since = requested_at_.number > shown_->first.number ? requested_at_ : shown_->first;
  return since.has_time && shown_->last.has_time && Elapsed(since.time, shown_->last.time) > kSettled;
}

/// The lowest of all rose, or one rose above all, and no state was requested since they agreed on a state.
void BusAlUnit::NoteRise(const track::AlStatusOfAll& read) {
  const auto states = [](esc::AlWord status) { return static_cast<std::uint8_t>(status.raw & kStateBits); };
  const std::uint8_t before = states(shown_->status);
  const std::uint8_t now = states(read.status);
  if (before == 0 || now == 0) return;
  const bool asked = requested_ != 0 && !(std::has_single_bit(before) && before == requested_);
  // The one that is highest, or the last that joins it.
  const bool rose =
      Highest(now) > Highest(before) || (unasked_.Proof(0) == 0 && std::countr_zero(now) > std::countr_zero(before));
  if (rose && !asked) unasked_.Add(read.frame.number);
}

void BusAlUnit::Change(const track::AlStatusOfAll& read) {
  const std::uint8_t now = BitsOf(read.status);
  std::uint8_t fallen = 0;
  if (shown_ && shown_->slaves == read.slaves) {
    NoteRise(read);
    if (Settled()) requested_ = 0;
    fallen = Fallen(BitsOf(shown_->status), now);
    // A slave that is asked for a state may refuse it.
    if (requested_ != 0) fallen = static_cast<std::uint8_t>(fallen & ~(requested_ | kAnyError));
    fallen = static_cast<std::uint8_t>(fallen & ~ShownBySlaves());
    if (shown_->polls < kEnoughPolls && !open_) fallen = 0;
  } else {
    Close();
  }
  if (fallen != 0) Open(read, fallen);
  if (open_) {
    open_->status = esc::AlWord{static_cast<std::uint16_t>(open_->status.raw | now)};
    if ((now & unexplained_) == 0) Close();
  }
  shown_ = Shown{esc::AlWord{now}, read.frame, read.frame, 1, read.slaves};
}

void BusAlUnit::Open(const track::AlStatusOfAll& read, std::uint8_t fallen) {
  unexplained_ = static_cast<std::uint8_t>(unexplained_ | fallen);
  if (open_) return;
  open_.emplace();
  open_->frame = read.frame;
  open_->before = shown_->status;
  open_->before_since = shown_->last.number;
  before_open_ = shown_->last;
  open_->slaves = read.slaves;
  open_->after_pause = paused_;
  excluded_.clear();
}

/// A slave that shows it by itself is reported by itself; one that shows nothing of it can be excluded.
void BusAlUnit::Compare(const track::AlStatusRead& read) {
  const std::uint8_t shown = BitsOf(read.status);
  if ((shown & unexplained_) != 0) {
    open_.reset();
    unexplained_ = 0;
    return;
  }
  if (read.error_bit_known && std::find(excluded_.begin(), excluded_.end(), read.slave) == excluded_.end()) {
    excluded_.push_back(read.slave);
  }
}

void BusAlUnit::Close() {
  if (!open_) return;
  BusAlChanged event = *open_;
  open_.reset();
  event.unexplained = esc::AlWord{unexplained_};
  event.rose_unasked = unasked_.Proof(event.unexplained.state());
  unexplained_ = 0;
  event.last = shown_->last.number > event.frame.number ? shown_->last : event.frame;
  event.excluded = excluded_;
  events_.Publish(event);
}

/// By what the last broadcast showed, else by what each slave showed; read after that frame.
bool BusAlUnit::NoSlaveHadError(std::uint16_t slaves, FrameNo since) const {
  if (shown_) return shown_->slaves == slaves && !shown_->status.bit4() && shown_->last.number >= since;
  if (network_.slaves().size() != slaves) return false;
  for (std::size_t s = 0; s < network_.slaves().size(); ++s) {
    const Known<esc::AlWord>& status = network_.state(static_cast<SlaveId>(s)).al_status;
    if (status.if_known() == nullptr || status.if_known()->bit4() || status.since() < since) return false;
  }
  return true;
}

/// Since the request all were in that state: who shows an error now has followed it before.
bool BusAlUnit::Agreed() const {
  if (!shown_ || shown_->last.number <= requested_at_.number) return false;
  return (shown_->status.raw & kStateBits) == control_.state();
}

/// Some slave showed an error by itself since a broadcast showed none: it is reported by itself, refusal or not.
bool BusAlUnit::SomeoneShowsError() const {
  const FrameNo since = shown_ ? shown_->last.number : 0;
  for (std::size_t s = 0; s < network_.slaves().size(); ++s) {
    const Known<esc::AlWord>& status = network_.state(static_cast<SlaveId>(s)).al_status;
    if (status.if_known() != nullptr && status.if_known()->bit4() && status.since() > since) return true;
  }
  return false;
}

void BusAlUnit::NoteRefusal(const track::AlStatusOfAll& read) {
  if (acknowledging_ || !read.status.bit4()) return;
  if (!refused_) {
    if ((shown_ && shown_->status.bit4()) || !NoSlaveHadError(read.slaves, 0)) return;
    if (Agreed() || SomeoneShowsError()) return;
    refused_ = BusAlRefused{read.frame, read.frame, requested_at_, control_, read.status, read.slaves, 0};
  }
  refused_->last = read.frame;
  refused_->status = read.status;
  ++refused_->reads;
}

/// @param over  the master reacts with another request, or the capture ends: no further read can show it. No request
///              had the acknowledge bit and no slave had an error before, so one read is enough then
void BusAlUnit::ReportRefusal(bool over) {
  if (refused_ && (over || refused_->reads >= kEnoughPolls)) events_.Publish(*refused_);
  refused_.reset();
}

void BusAlUnit::Forget() {
  ReportRefusal(false);
  Close();
  shown_.reset();
  requested_ = asked_of_all_ = 0;
  asked_.clear();
  waits_ = waits_for_init_ = 0;
}

std::uint8_t BusAlUnit::ShownBySlaves() const {
  std::uint8_t bits = 0;
  for (std::size_t s = 0; s < network_.slaves().size(); ++s) {
    const esc::AlWord* status = network_.state(static_cast<SlaveId>(s)).al_status.if_known();
    if (status != nullptr) bits = static_cast<std::uint8_t>(bits | BitsOf(*status));
  }
  return bits;
}

}  // namespace ecaudit::model
