#include "analyzers/model/al_machine.h"

#include <algorithm>
#include <utility>

#include "decoder/base/time.h"

namespace ecaudit::model {
namespace {

constexpr std::uint8_t kInit = static_cast<std::uint8_t>(esc::AlState::INIT);
constexpr std::uint8_t kPreop = static_cast<std::uint8_t>(esc::AlState::PREOP);
constexpr std::uint8_t kBoot = static_cast<std::uint8_t>(esc::AlState::BOOT);
constexpr std::uint8_t kSafeop = static_cast<std::uint8_t>(esc::AlState::SAFEOP);
constexpr std::uint8_t kOp = static_cast<std::uint8_t>(esc::AlState::OP);

/// Height in the order INIT < PREOP < SAFEOP < OP; BOOT stands beside PREOP.
int Height(std::uint8_t state) {
  switch (state) {
    case kInit:
      return 0;
    case kPreop:
    case kBoot:
      return 1;
    case kSafeop:
      return 2;
    case kOp:
      return 3;
    default:
      return -1;
  }
}

/// States that a slave passes on its way down from `from` to `to` (a drive may show them for a moment).
StateSet StatesBetween(std::uint8_t from, std::uint8_t to) {
  StateSet set;
  if (Height(to) >= Height(from)) return set;
  for (const std::uint8_t state : {kPreop, kSafeop}) {
    if (Height(state) < Height(from) && Height(state) > Height(to)) set.Add(state);
  }
  return set;
}

constexpr std::array<std::uint8_t, 5> kStates{kInit, kPreop, kBoot, kSafeop, kOp};
constexpr std::uint16_t kErrorBit = 0x10;
/// An acknowledged error that stays this long is a new answer: slave stacks give up a state change after 200 ms unless
/// shown otherwise (esc-reference 5.7). They go down as fast. Without time stamps reads are counted instead.
constexpr std::int64_t kAcknowledgeNs = 200'000'000;
constexpr std::uint64_t kAcknowledgeReads = 200;
/// A slave that took the acknowledge has cleared its error long before the master has read it as often as this.
constexpr std::uint64_t kIgnoredReads = 8;
/// Masters that wait for a state look for it more often.
constexpr std::int64_t kLongPauseNs = 1'000'000'000;
/// A request that was lost on its way does not explain what happens this much later.
constexpr std::int64_t kPendingNs = 10'000'000'000;

}  // namespace

bool AlMachine::LegalFrom(std::uint8_t from, std::uint8_t target) const {
  return family_->AllowsAl(static_cast<esc::AlState>(from), static_cast<esc::AlState>(target));
}

AlRequestRecord AlMachine::Assess(const track::AlRequest& request) const {
  AlRequestRecord record;
  record.control = request.control;
  record.frame = record.last = request.frame();
  const StateSet possible = PossibleBefore(record.frame.number);
  record.possible = possible;
  record.from = possible.single();
  record.assumed = request.acceptance == track::Acceptance::kAssumed;
  const std::uint8_t target = request.control.state();
  if (!esc::IsAlState(target)) {
    record.verdict = AlVerdict::kInvalid;
    return record;
  }
  if (record.from != 0) {
    record.transition =
        family_->al_transition(static_cast<esc::AlState>(record.from), static_cast<esc::AlState>(target));
  }
  if (error_ == Error::kYes && target != kInit && !request.control.bit4() &&
      !MayHaveBeenAcknowledged(record.frame.number)) {
    record.verdict = AlVerdict::kNeedsAcknowledge;
    return record;
  }
  if (possible.empty()) {
    record.verdict = target == kInit ? AlVerdict::kLegal : AlVerdict::kUnknown;
    return record;
  }
  record.verdict = AlVerdict::kIllegal;
  for (const std::uint8_t from : kStates) {
    if (possible.contains(from) && LegalFrom(from, target)) record.verdict = AlVerdict::kLegal;
  }
  // After a pause that may be a capture gap, it is unknown which state was requested in it.
  if (record.verdict == AlVerdict::kIllegal && paused_) record.verdict = AlVerdict::kUnknown;
  return record;
}

void AlMachine::AddPending(esc::AlWord control, const FrameRef& sent) {
  if (pending_.size() == kMaxPending) pending_.erase(pending_.begin());
  pending_.push_back({control, sent});
}

void AlMachine::RemovePending(FrameNo sent) {
  std::erase_if(pending_, [&](const Pending& p) { return p.sent.number == sent; });
}

void AlMachine::DropOldPending(const FrameRef& frame) {
  std::erase_if(pending_, [&](const Pending& p) {
    return frame.has_time && p.sent.has_time && frame.time - p.sent.time > kPendingNs;
  });
}

/// The slave shows what a request sent before frame `before` asked for: it, and those before it, explain nothing more.
void AlMachine::DropPendingReached(std::uint8_t state, FrameNo before) {
  const auto last = std::find_if(pending_.rbegin(), pending_.rend(), [&](const Pending& p) {
    return p.control.state() == state && p.sent.number < before;
  });
  pending_.erase(pending_.begin(), last.base());
}

/// The slave has answered the request of that frame: those before it are over.
void AlMachine::DropPendingBefore(FrameNo request) {
  std::erase_if(pending_, [&](const Pending& p) { return p.sent.number < request; });
}

/// True when a request without a known fate, sent since the error was last seen, acknowledges it.
bool AlMachine::MayHaveBeenAcknowledged(FrameNo before) const {
  for (const Pending& p : pending_) {
    if (p.sent.number >= before || p.sent.number < last_asked_) continue;
    if (p.control.bit4() || p.control.state() == kInit) return true;
  }
  return false;
}

/// States the slave may be in when it takes the request of that frame: frames do not overtake each other, so requests
/// sent before whose return is missing were lost or taken.
StateSet AlMachine::PossibleBefore(FrameNo request) const {
  StateSet possible = possible_;
  if (possible.empty()) return possible;
  for (const Pending& p : pending_) {
    const std::uint8_t target = p.control.state();
    // What is no state leads nowhere, and explains an error only.
    if (p.sent.number >= request || !esc::IsAlState(target)) continue;
    for (const std::uint8_t from : kStates) {
      if (possible.contains(from)) possible.Add(StatesBetween(from, target));
    }
    possible.Add(target);
  }
  return possible;
}

void AlMachine::OnRequestSent(const FrameRef& frame, esc::AlWord control) {
  if (interrupted_ && interrupted_->request.control.raw != control.raw) interrupted_.reset();
  quiet_ = false;
  asked_ = true;
  AddPending(control, frame);
}

void AlMachine::OnRequest(const track::AlRequest& request) {
  if (interrupted_ && interrupted_->request.control.raw != request.control.raw) interrupted_.reset();
  quiet_ = false;
  asked_ = true;
  const FrameNo number = request.frame().number;
  if (request.acceptance == track::Acceptance::kUnknown) {
    // Lost (which shows late), or taken by some of the slaves: the slave may have followed it, from when it was sent.
    if (control_since_ < number) control_.reset();
    const bool known =
        std::any_of(pending_.begin(), pending_.end(), [&](const Pending& p) { return p.sent.number == number; });
    if (!known && request.returned.seen()) AddPending(request.control, request.frame());
    return;
  }
  RemovePending(number);
  if (request.acceptance == track::Acceptance::kRefused) return;  // the slave has not read the one before yet

  ++requests_;
  const std::optional<esc::AlWord> before = control_;
  control_ = request.control;
  control_since_ = number;
  AlRequestRecord record = Assess(request);
  record.before = before;
  AlRequestJudged event;
  event.slave = slave_;
  event.request = record;
  event.from_since = last_seen_ != 0 ? last_seen_ : since_;
  event.error_since = error_since_;
  event.broadcast = request.broadcast;
  sink_.Publish(event);
  Open(record);
}

void AlMachine::Open(const AlRequestRecord& record) {
  const std::uint8_t target = record.control.state();
  if (record.verdict == AlVerdict::kNeedsAcknowledge) {
    AddPending(record.control, record.frame);
    return;
  }
  const bool repeats = open_ && open_->control.raw == record.control.raw && open_->verdict == record.verdict;
  if (repeats) {
    open_->last = record.frame;
    ++open_->repetitions;
  } else {
    if (open_) {
      ReportGivenUp(record);
      if (earlier_.size() == kMaxEarlier) earlier_.erase(earlier_.begin());
      earlier_.push_back(*open_);
    }
    open_ = record;
    waiting_since_ = last_poll_ = record.frame;
    polls_ = 0;
    overdue_reported_ = false;
  }
  if (error_ != Error::kNo && (record.control.bit4() || target == kInit)) {
    acknowledged_ = true;
    error_ = Error::kUnknown;
  }

  if (record.verdict != AlVerdict::kLegal && record.verdict != AlVerdict::kUnknown) return;
  if (record.assumed) {
    // Outbound only: nothing will ever show the state, so the slave is taken to follow.
    possible_ = StateSet::Of(target);
    read_state_ = 0;
    since_ = record.frame.number;
  } else if (!possible_.empty()) {
    for (const std::uint8_t from : kStates) {
      if (possible_.contains(from)) possible_.Add(StatesBetween(from, target));
    }
    possible_.Add(target);
  }
}

void AlMachine::ReportGivenUp(const AlRequestRecord& next) const {
  const bool legal = open_->verdict == AlVerdict::kLegal || open_->verdict == AlVerdict::kUnknown;
  if (!legal || overdue_reported_ || read_state_ == 0 || polls_ < kGivenUpPolls) return;
  if (Height(next.control.state()) >= Height(open_->control.state())) return;
  if (!last_poll_.has_time || !waiting_since_.has_time) return;
  const std::int64_t waited = Elapsed(waiting_since_.time, last_poll_.time);
  // Since the last look it may have got there.
  const bool looked = next.frame.has_time && Elapsed(last_poll_.time, next.frame.time) <= waited / 4;
  if (waited < kGivenUpNs || !looked) return;
  sink_.Publish(AlGivenUp{slave_, *open_, last_poll_, next.frame, read_state_, waited, polls_});
}

/// True when no request was in flight when that read was sent: a later request does not affect what the read shows.
bool AlMachine::NonePendingFor(const track::AlStatusRead& read) const {
  return std::none_of(pending_.begin(), pending_.end(),
                      [&](const Pending& p) { return p.sent.number <= read.asked(); });
}

bool AlMachine::Explains(const track::AlStatusRead& read) const {
  const std::uint8_t state = read.status.state();
  const auto leads_to = [&](const AlRequestRecord& r) {
    return r.control.state() == state || StatesBetween(read_state_, r.control.state()).contains(state);
  };
  for (const Pending& p : pending_) {
    const std::uint8_t target = p.control.state();
    if (p.sent.number > read.asked() || !esc::IsAlState(target)) continue;
    if (target == state || StatesBetween(read_state_, target).contains(state)) return true;
  }
  if (open_ && leads_to(*open_)) return true;
  return std::any_of(earlier_.begin(), earlier_.end(), leads_to);
}

/// A slave without a processor copies AL Control into AL Status bit by bit; its status code is always 0.
void AlMachine::LearnEmulation(const track::AlStatusRead& read) {
  if (own_status_ || emulation_.value_or(false)) return;
  if (read.status.bit4() && read.status_code.value_or(0) != 0) own_status_ = true;
  // Only a read that was sent after the slave took its last request is evidence, and only if none is in flight.
  if (!control_ || !NonePendingFor(read) || read.asked() <= control_since_) return;
  const bool same_state = read.status.state() == control_->state();
  if (read.status.bit4() && !(same_state && control_->bit4())) own_status_ = true;
  if (!read.status.bit4() && same_state && control_->bit4()) own_status_ = true;
}

bool AlMachine::IsEcho(const track::AlStatusRead& read) const {
  if (emulation_) {
    if (!*emulation_) return false;
    // Its status is AL Control, copied: some request had the bit, be it one that the capture misses.
    if (read.status_code.value_or(0) == 0) return true;
  } else if (own_status_) {
    // A copy all the same: the requested state, and no error. What was learned may rest on a frame that was missing.
    return read.status_code == std::uint16_t{0} && control_ && control_->raw == read.status.raw;
  }
  // A copy stays what it is until AL Control is written again.
  if (echo_ && read.status.state() == read_state_) return true;
  for (const Pending& p : pending_) {
    const bool before = p.sent.number <= read.asked();
    if (before && p.control.bit4() && p.control.state() == read.status.state()) return true;
  }
  return control_ && control_->bit4() && control_->state() == read.status.state();
}

/// True when the error bit may still be the one that the open request acknowledges: the slave takes its time.
bool AlMachine::MayBeAcknowledgedError(const track::AlStatusRead& read) const {
  if (!acknowledged_ || (read_state_ != 0 && read.status.state() != read_state_)) return false;
  const std::uint16_t code = read.status_code.value_or(0);
  if (code != 0 && error_code_ && code != *error_code_) return false;
  if (read.frame.has_time && open_->frame.has_time) return read.frame.time - open_->frame.time < kAcknowledgeNs;
  return polls_ <= kAcknowledgeReads;
}

void AlMachine::OnStatus(const track::AlStatusRead& read) {
  if (Repeats(read)) {
    Repeat(read.frame.number);
    return;
  }
  const std::uint8_t state = read.status.state();
  if (!esc::IsAlState(state)) return OnNoState(read);
  no_state_ = {};
  ++polls_;
  ++status_reads_;
  if (requests_ > 0) ++reads_after_request_;
  quiet_ = false;
  if (interrupted_) Resume(read);
  DropOldPending(read.frame);
  if (!watched_since_.seen()) {
    watched_since_ = read.frame;
    reads_since_ = status_reads_;
  }
  NoteRise(read);
  if (!read.error_bit_known) {
    OnStateOnly(read);
    paused_ = false;
    return;
  }
  LearnEmulation(read);
  if (read.status.bit4() && !IsEcho(read)) {
    echo_ = false;
    OnError(read);
  } else {
    echo_ = read.status.bit4();
    OnNoError(read);
    DropPendingReached(state, read.asked());
  }
  if (read_state_ != state) since_ = read.frame.number;
  operated_ = operated_ || state == kSafeop || state == kOp;
  read_state_ = state;
  last_seen_ = read.frame.number;
  last_asked_ = read.asked();
  paused_ = false;
  MayBeIn(state);
  quiet_ = !read.status.bit4() && IsQuiet(state);
}

/// A value that is none of the five states. One read may have been disturbed; two in a row are what the slave shows.
void AlMachine::OnNoState(const track::AlStatusRead& read) {
  if (!read.error_bit_known) return;
  ++polls_;
  ++status_reads_;
  if (requests_ > 0) ++reads_after_request_;
  quiet_ = false;
  if (!no_state_.seen()) {
    no_state_ = read.frame;
    return;
  }
  if (open_) {
    if (!read.status.bit4()) CheckOverdue(read);
  } else if (read_state_ != 0 && NonePendingFor(read)) {
    track::AlStatusRead first = read;
    first.frame = no_state_;
    sink_.Publish(ChangedByItself(first, Before()));
  }
  possible_.Clear();
  error_ = Error::kUnknown;
  error_reported_ = false;
  echo_ = false;
  read_state_ = 0;
  since_ = last_seen_ = read.frame.number;
  paused_ = false;
}

/// Nothing is waited for, nothing is left to learn: a master polls thousands of times a second, and all of these reads
/// show the same.
bool AlMachine::IsQuiet(std::uint8_t state) const {
  return SettledIn(static_cast<esc::AlState>(state)) && earlier_.empty() && !error_code_ && !error_reported_ &&
         !acknowledged_ && !echo_ && (own_status_ || emulation_.value_or(false) || !control_ || !control_->bit4());
}

/// The slave was seen in `state`; the request that is open may have led it elsewhere since. What those on their way may
/// do is asked for when it matters: of one, nothing that it led to itself counts.
void AlMachine::MayBeIn(std::uint8_t state) {
  possible_ = StateSet::Of(state);
  if (!open_) {
    earlier_.clear();
    return;
  }
  const std::uint8_t target = open_->control.state();
  if (open_->verdict == AlVerdict::kLegal || open_->verdict == AlVerdict::kUnknown) {
    possible_.Add(target);
    possible_.Add(StatesBetween(state, target));
  }
}

AlChangedByItself AlMachine::ChangedByItself(const track::AlStatusRead& read, esc::AlWord before) const {
  AlChangedByItself event;
  event.slave = slave_;
  event.frame = read.frame;
  event.before = before;
  event.status = read.status;
  event.before_since = last_seen_;
  event.before_first = since_;
  event.code = read.status_code;
  event.after_pause = paused_;
  event.rose_unasked = unasked_.Proof(read.status.state());
  event.may_be_asked = MayPrecede(read);
  return event;
}

/// True when a request that would explain this read may lie before the capture, or where the slave was out of sight: if
/// the error bit appears in the same state, one that it refuses as long as a request may take, else one on the way
/// down.
bool AlMachine::MayPrecede(const track::AlStatusRead& read) const {
  const std::uint8_t state = read.status.state();
  if (asked_ || !esc::IsAlState(state)) return false;
  const bool refusal = read.status.bit4() && state == read_state_ && state != kOp;
  const bool way_down = !read.status.bit4() && Height(state) < Height(read_state_);
  if (!refusal && !way_down) return false;
  if (!read.frame.has_time || !watched_since_.has_time) return status_reads_ - reads_since_ <= kAcknowledgeReads;
  const std::int64_t limit = way_down ? kAcknowledgeNs : timeouts_.To(state == kInit ? kPreop : kSafeop, false);
  return Elapsed(watched_since_.time, read.frame.time) <= limit;
}

void AlMachine::NoteRise(const track::AlStatusRead& read) {
  if (read_state_ == 0 || paused_ || open_ || !NonePendingFor(read)) return;
  const std::uint8_t state = read.status.state();
  if (Height(state) > Height(read_state_) && !Explains(read)) unasked_.Add(read.frame.number);
}

/// A broadcast that some slave answered with the error bit: the state is certain, whose error it is, is not.
void AlMachine::OnStateOnly(const track::AlStatusRead& read) {
  const std::uint8_t state = read.status.state();
  if (state == read_state_) return;
  const bool fell =
      read_state_ != 0 && error_ != Error::kUnknown && Height(state) < Height(read_state_) && !Explains(read);
  if (fell) {
    AlChangedByItself event = ChangedByItself(read, Before());
    event.error_of_some = true;
    event.may_be_asked = false;
    open_.reset();
    error_code_.reset();
    sink_.Publish(event);
  }
  began_ = began_ || fell;
  error_reported_ = fell;  // the error bit, when a read of this slave shows it, belongs to this
  error_ = Error::kUnknown;
  MayBeIn(state);
  since_ = last_seen_ = read.frame.number;
  read_state_ = state;
}

esc::AlWord AlMachine::Before() const {
  return esc::AlWord{static_cast<std::uint16_t>(read_state_ | (error_ == Error::kYes ? kErrorBit : 0U))};
}

void AlMachine::OnError(const track::AlStatusRead& read) {
  const std::uint8_t state = read.status.state();
  const bool same_state = state == read_state_;
  // A broadcast showed the state, and that some slave has an error: it is this one.
  if (error_ == Error::kUnknown && error_reported_ && same_state && !acknowledged_) error_ = Error::kYes;
  if (error_ == Error::kYes && same_state) {
    // An error known before. A request since then can only have been one that the slave ignores.
    if (error_reported_) {
      sink_.Publish(AlErrorRepeated{slave_, read.frame, read.status});
      if (read.status_code) ReportCode(read.frame, *read.status_code);
    }
    return;
  }
  if (open_ && !FellBefore(read)) {
    if (MayBeAcknowledgedError(read)) {
      if (read_state_ == 0) {
        sink_.Publish(AlAnswerUnclear{slave_, read.frame});
        unclear_ = RefusedBy(read, *open_);
      } else if (WentOnUnacknowledged()) {
        earlier_.clear();
        PublishRefusal(*unclear_, unclear_->code ? unclear_->code : read.status_code);
      }
      return;
    }
    AlAnswered event = RefusedBy(read, *open_);
    for (const AlRequestRecord& earlier : earlier_) {
      // Several requests without a read between them: the one the model expects to fail is the one that did.
      if (open_->verdict == AlVerdict::kLegal && earlier.verdict != AlVerdict::kLegal) event.request = earlier;
    }
    DropPendingBefore(open_->frame.number);
    PublishRefusal(event, read.status_code);
    return;
  }
  // An error that was there before only counts again when the state falls further.
  const bool before_known =
      read_state_ != 0 &&
      (error_ == Error::kNo || ((error_ == Error::kUnknown || error_reported_) && Height(state) < Height(read_state_)));
  const esc::AlWord before = Before();
  // The first thing seen of a slave may be the echo of an acknowledge; only a status code makes it an error for sure.
  const bool certain = before_known || error_ == Error::kYes || read.status_code.value_or(0) != 0;
  error_ = certain ? Error::kYes : Error::kUnknown;
  error_since_ = read.frame.number;
  error_code_ = read.status_code;
  error_reported_ = before_known && NonePendingFor(read);
  if (!error_reported_) {
    ReportStanding(read, certain);
    return;
  }
  began_ = true;
  AlChangedByItself event = ChangedByItself(read, before);
  if (const AlRequestRecord* unread = open_ ? HighestUnread() : nullptr; unread != nullptr) {
    event.before = esc::AlWord{unread->control.state()};
    event.before_since = event.before_first = unread->frame.number;
    event.before_requested = true;
  }
  sink_.Publish(event);
}

AlAnswered AlMachine::RefusedBy(const track::AlStatusRead& read, const AlRequestRecord& request) const {
  AlAnswered event;
  event.slave = slave_;
  event.outcome = AlAnswered::Outcome::kRefused;
  event.request = request;
  event.frame = read.frame;
  event.status = read.status;
  event.code = read.status_code;
  event.state_before_known = error_ == Error::kNo || (acknowledged_ && read_state_ != 0);
  return event;
}

/// The request that is open, if it is another one, asks for what a slave with this error ignores.
void AlMachine::PublishRefusal(const AlAnswered& event, std::optional<std::uint16_t> code) {
  const AlAnswered published = event;  // it may be unclear_
  error_ = Error::kYes;
  error_since_ = published.frame.number;
  error_reported_ = true;
  error_code_ = code;
  acknowledged_ = false;
  standing_ = Standing::kNo;
  began_ = true;
  unclear_.reset();
  open_.reset();
  sink_.Publish(published);
}

/// The master requested the next state, without another acknowledge, and the slave still shows the error.
bool AlMachine::WentOnUnacknowledged() const {
  if (!unclear_ || open_->frame.number <= unclear_->request.last.number || polls_ < kIgnoredReads) return false;
  return !open_->control.bit4() && open_->control.state() != kInit;
}

/// A slave that shows the code of a watchdog or of lost synchronisation below its last state, while it was asked to go
/// down, had fallen by itself, because the master stopped its process data first, and goes on from there.
bool AlMachine::FellBefore(const track::AlStatusRead& read) const {
  const std::uint16_t code = read.status_code.value_or(0);
  const bool runs_out = code == esc::al_code::kWatchdog || esc::SpeaksOfSynchronisation(code);
  if (open_->verdict == AlVerdict::kIllegal || !runs_out) return false;
  const bool before_known = read_state_ != 0 && error_ == Error::kNo;
  int highest = Height(read_state_);
  // A master may request OP and never read whether the slave follows. The watchdog runs in OP only.
  if (const AlRequestRecord* unread = HighestUnread(); unread != nullptr && code == esc::al_code::kWatchdog) {
    highest = std::max(highest, Height(unread->control.state()));
  }
  return before_known && Height(read.status.state()) < highest && Height(open_->control.state()) < highest;
}

/// The request of the highest state that was accepted before the open one and whose result the master never read; null:
/// none is higher than the state read last.
const AlRequestRecord* AlMachine::HighestUnread() const {
  const AlRequestRecord* highest = nullptr;
  for (const AlRequestRecord& earlier : earlier_) {
    const int height = Height(earlier.control.state());
    if (height <= Height(highest != nullptr ? highest->control.state() : read_state_)) continue;
    highest = &earlier;
  }
  return highest;
}

void AlMachine::ReportStanding(const track::AlStatusRead& read, bool certain) {
  const Standing now = certain ? Standing::kYes : Standing::kMaybe;
  if (began_ || standing_ >= now) return;
  standing_ = now;
  sink_.Publish(AlErrorStands{slave_, read.frame, read.status, read.status_code, certain, well_until_});
}

void AlMachine::OnNoError(const track::AlStatusRead& read) {
  const std::uint8_t state = read.status.state();
  if (error_ == Error::kYes || (error_ == Error::kUnknown && error_reported_) || standing_ != Standing::kNo) {
    sink_.Publish(AlErrorCleared{slave_, read.frame, read.status.bit4()});
  }
  standing_ = Standing::kNo;
  began_ = true;
  unclear_.reset();
  const bool before_known = read_state_ != 0 && error_ != Error::kUnknown;
  const esc::AlWord before = Before();
  error_reported_ = false;
  error_code_.reset();
  acknowledged_ = false;
  error_ = Error::kNo;
  if (open_ && open_->control.state() == state) {
    AlAnswered event;
    event.slave = slave_;
    event.outcome =
        open_->verdict == AlVerdict::kIllegal ? AlAnswered::Outcome::kAcceptedIllegal : AlAnswered::Outcome::kReached;
    event.request = *open_;
    event.frame = read.frame;
    event.status = read.status;
    event.code = read.status_code;
    DropPendingBefore(open_->frame.number);
    open_.reset();
    sink_.Publish(event);
    return;
  }
  if (open_) {
    if (state == read_state_ || Explains(read) || read_state_ == 0) {
      CheckOverdue(read);
      return;
    }
    // Another state than the one requested and none on the way there: not an answer to the request.
  }
  if (state != read_state_ && before_known && Height(state) < Height(read_state_) && !Explains(read)) {
    open_.reset();  // what it asked for is not what is waited for any more
    sink_.Publish(ChangedByItself(read, before));
  }
}

void AlMachine::CheckOverdue(const track::AlStatusRead& read) {
  const FrameRef before = std::exchange(last_poll_, read.frame);
  if (overdue_reported_ || !read.frame.has_time || !waiting_since_.has_time) return;
  const std::uint8_t target = open_->control.state();
  const std::int64_t limit = timeouts_.To(target, Height(target) < Height(read.status.state()));
  // The master did not read it: the capture has a gap there.
  if (paused_ && before.has_time && Elapsed(before.time, read.frame.time) > kLongPauseNs) waiting_since_ = read.frame;
  FollowClock(waiting_since_, before, read.frame);
  const std::int64_t waited = Elapsed(waiting_since_.time, read.frame.time);
  if (waited <= limit) return;
  overdue_reported_ = true;
  AlOverdue event;
  event.slave = slave_;
  event.request = *open_;
  event.frame = read.frame;
  event.status = read.status;
  event.waited_ns = waited;
  event.limit_ns = limit;
  event.polls = polls_;
  sink_.Publish(event);
}

void AlMachine::OnGap(const track::CaptureGap& gap) {
  OnPause();
  interrupted_.reset();
  const bool waits = open_ && read_state_ != 0 && error_ == Error::kNo && !overdue_reported_;
  const bool legal = waits && (open_->verdict == AlVerdict::kLegal || open_->verdict == AlVerdict::kUnknown);
  if (legal && gap.is_short()) interrupted_ = {*open_, read_state_, waiting_since_, last_poll_, gap.frame.number};
}

/// The first read after a short capture gap. If the slave still shows the state before, hardly any request came in
/// between: the wait goes on, and an error is the answer to the request.
void AlMachine::Resume(const track::AlStatusRead& read) {
  const Interrupted before = *std::exchange(interrupted_, std::nullopt);
  if (!read.error_bit_known || read.status.state() != before.state) return;
  const std::optional<AlRequestRecord> again = std::exchange(open_, before.request);
  if (again) {
    open_->last = again->last;
    open_->repetitions += 1 + again->repetitions;
  }
  open_->over_gap = true;
  waiting_since_ = before.since;
  last_poll_ = before.last_poll;
  overdue_reported_ = false;
  read_state_ = before.state;
  error_ = Error::kNo;
  paused_ = false;
}

void AlMachine::ReportCode(const FrameRef& frame, std::uint16_t code) {
  if (error_ != Error::kYes || !error_reported_ || (error_code_ && *error_code_ == code)) return;
  if (code == 0 && error_code_) return;
  error_code_ = code;
  sink_.Publish(AlErrorCode{slave_, frame, code});
}

void AlMachine::OnStatusCode(const track::AlStatusCodeRead& read) {
  ReportCode(read.frame, read.code);
}

void AlMachine::Forget(const FrameRef& frame) {
  if (interrupted_ && interrupted_->gap != frame.number) interrupted_.reset();
  quiet_ = false;
  if (read_state_ != 0 && error_ == Error::kNo) {
    // An error that it shows when it is seen again is news.
    began_ = false;
    well_until_ = last_seen_;
  }
  possible_.Clear();
  read_state_ = 0;
  since_ = last_seen_ = frame.number;
  error_ = Error::kUnknown;
  error_reported_ = false;
  echo_ = false;
  acknowledged_ = false;
  unclear_.reset();
  watched_since_ = {};
  asked_ = false;
  open_.reset();
  earlier_.clear();
  pending_.clear();
}

}  // namespace ecaudit::model
