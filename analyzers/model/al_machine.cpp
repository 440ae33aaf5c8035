#include "analyzers/model/al_machine.h"

#include <algorithm>

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
    case kInit: return 0;
    case kPreop:
    case kBoot: return 1;
    case kSafeop: return 2;
    case kOp: return 3;
    default: return -1;
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
/// When an acknowledged error stays for this many reads, it is a new one.
constexpr std::uint64_t kReadsUntilErrorIsNew = 8;

}  // namespace

bool AlMachine::LegalFrom(std::uint8_t from, std::uint8_t target) const {
  return family_->AllowsAl(static_cast<esc::AlState>(from), static_cast<esc::AlState>(target));
}

AlRequestRecord AlMachine::Judge(const track::AlRequest& request) const {
  AlRequestRecord record;
  record.control = request.control;
  record.frame = record.last = request.frame();
  record.from = possible_.single();
  record.assumed = request.acceptance == track::Acceptance::kAssumed;
  const std::uint8_t target = request.control.state();
  if (!esc::IsAlState(target)) {
    record.verdict = AlVerdict::kInvalid;
    return record;
  }
  if (record.from != 0) {
    record.transition = family_->al_transition(static_cast<esc::AlState>(record.from), static_cast<esc::AlState>(target));
  }
  if (error_ == Error::kYes && target != kInit && !request.control.bit4()) {
    record.verdict = AlVerdict::kNeedsAcknowledge;
    return record;
  }
  if (possible_.empty()) {
    record.verdict = target == kInit ? AlVerdict::kLegal : AlVerdict::kUnknown;
    return record;
  }
  record.verdict = AlVerdict::kIllegal;
  for (const std::uint8_t from : kStates) {
    if (possible_.contains(from) && LegalFrom(from, target)) record.verdict = AlVerdict::kLegal;
  }
  return record;
}

void AlMachine::OnRequestSent(const FrameRef& /*frame*/, esc::AlWord control) {
  if (esc::IsAlState(control.state())) sent_.Add(control.state());
}

void AlMachine::OnRequest(const track::AlRequest& request) {
  const std::uint8_t target = request.control.state();
  if (request.acceptance != track::Acceptance::kUnknown) sent_.Clear();
  if (request.acceptance == track::Acceptance::kRefused) return;  // the slave has not read the one before yet
  if (request.acceptance == track::Acceptance::kUnknown) {
    // Lost, or taken by some of the slaves: from here on the slave may have followed it.
    if (!esc::IsAlState(target)) return;
    sent_.Add(target);
    if (!possible_.empty()) {
      for (const std::uint8_t from : kStates) {
        if (possible_.contains(from)) possible_.Add(StatesBetween(from, target));
      }
      possible_.Add(target);
    }
    if (error_ == Error::kYes) error_ = Error::kUnknown;
    return;
  }

  const AlRequestRecord record = Judge(request);
  AlRequestJudged event;
  event.slave = slave_;
  event.request = record;
  event.from_since = last_seen_ != 0 ? last_seen_ : since_;
  event.error_since = error_since_;
  event.broadcast = request.broadcast;
  sink_.On(event);
  Open(record);
}

void AlMachine::Open(const AlRequestRecord& record) {
  const std::uint8_t target = record.control.state();
  if (record.verdict == AlVerdict::kNeedsAcknowledge) {
    sent_.Add(target);  // the slave should ignore it; where it does not, this explains the change
    return;
  }
  const bool repeats = open_ && open_->control.raw == record.control.raw && open_->verdict == record.verdict;
  if (repeats) {
    open_->last = record.frame;
    ++open_->repetitions;
  } else {
    if (open_) {
      if (earlier_count_ == earlier_.size()) {
        std::move(earlier_.begin() + 1, earlier_.end(), earlier_.begin());
        --earlier_count_;
      }
      earlier_[earlier_count_++] = *open_;
    }
    open_ = record;
    polls_ = 0;
    overdue_reported_ = false;
  }
  acknowledged_ = error_ == Error::kYes && (record.control.bit4() || target == kInit);
  if (acknowledged_) error_ = Error::kUnknown;

  if (record.verdict == AlVerdict::kLegal || record.verdict == AlVerdict::kUnknown) {
    if (!possible_.empty()) {
      for (const std::uint8_t from : kStates) {
        if (possible_.contains(from)) possible_.Add(StatesBetween(from, target));
      }
      possible_.Add(target);
    } else if (record.assumed || target == kInit) {
      // Outbound only: nobody will ever show the state, so the slave is taken to follow.
      if (record.assumed) possible_.Add(target);
    }
    if (record.assumed) {
      read_state_ = 0;
      since_ = record.frame.number;
    }
  }
}

bool AlMachine::Explains(std::uint8_t state) const {
  const auto leads_to = [&](const AlRequestRecord& r) {
    return r.control.state() == state || StatesBetween(read_state_, r.control.state()).contains(state);
  };
  if (sent_.contains(state)) return true;
  for (const std::uint8_t target : kStates) {
    if (sent_.contains(target) && StatesBetween(read_state_, target).contains(state)) return true;
  }
  if (open_ && leads_to(*open_)) return true;
  for (std::size_t i = 0; i < earlier_count_; ++i) {
    if (leads_to(earlier_[i])) return true;
  }
  return false;
}

bool AlMachine::IsEcho(const track::AlStatusRead& read) const {
  if (emulation_ && !*emulation_) return false;
  if (read.status_code && *read.status_code != 0 && !emulation_.value_or(false)) return false;
  // A slave without a processor copies AL Control into AL Status bit by bit, and keeps it there.
  if (echo_ && read.status.state() == read_state_) return true;
  return open_ && open_->control.bit4() && open_->control.state() == read.status.state();
}

void AlMachine::OnStatus(const track::AlStatusRead& read) {
  ++polls_;
  const std::uint8_t state = read.status.state();
  if (!esc::IsAlState(state)) return;
  if (!read.error_bit_known) {
    // A broadcast that some slave answered with the error bit: only the state counts.
    if (state != read_state_) {
      possible_ = StateSet::Of(state);
      since_ = read.frame.number;
      read_state_ = state;
      error_ = Error::kUnknown;
    }
    return;
  }
  if (read.status.bit4() && !IsEcho(read)) {
    echo_ = false;
    OnError(read);
  } else {
    echo_ = read.status.bit4();
    OnNoError(read);
  }
  if (read_state_ != state) since_ = read.frame.number;
  read_state_ = state;
  last_seen_ = read.frame.number;
  possible_ = StateSet::Of(state);
  possible_.Add(sent_);
  if (open_) {
    const std::uint8_t target = open_->control.state();
    if (open_->verdict == AlVerdict::kLegal || open_->verdict == AlVerdict::kUnknown) {
      possible_.Add(target);
      possible_.Add(StatesBetween(state, target));
    }
  } else {
    earlier_count_ = 0;
  }
}

void AlMachine::OnError(const track::AlStatusRead& read) {
  const std::uint8_t state = read.status.state();
  const bool was_set = error_ == Error::kYes;
  if (was_set && state == read_state_) {
    // An error known before. A request since then can only have been one that the slave ignores.
    if (error_reported_) {
      sink_.On(AlErrorRepeated{slave_, read.frame});
      if (read.status_code) ReportCode(read.frame, *read.status_code);
    }
    return;
  }
  if (open_) {
    if (acknowledged_ && state == read_state_ && polls_ <= kReadsUntilErrorIsNew) {
      // The slave may not have seen the acknowledge yet.
      return;
    }
    AlAnswered event;
    event.slave = slave_;
    event.outcome = AlAnswered::Outcome::kRefused;
    event.request = *open_;
    for (std::size_t i = 0; i < earlier_count_; ++i) {
      // Several requests without a read between them: the one the model expects to fail is the one that did.
      if (open_->verdict == AlVerdict::kLegal && earlier_[i].verdict != AlVerdict::kLegal) event.request = earlier_[i];
    }
    event.frame = read.frame;
    event.status = read.status;
    event.code = read.status_code;
    event.state_before_known = error_ == Error::kNo || open_->control.bit4() || open_->control.state() == kInit;
    error_ = Error::kYes;
    error_since_ = read.frame.number;
    error_reported_ = true;
    error_code_ = read.status_code;
    open_.reset();
    sink_.On(event);
    return;
  }
  const bool before_known = error_ == Error::kNo && read_state_ != 0;
  const bool request_under_way = !sent_.empty();
  // The first thing seen of a slave may be the echo of an acknowledge; only a status code makes it an error for sure.
  const bool certain = before_known || read.status_code.value_or(0) != 0;
  error_ = certain ? Error::kYes : Error::kUnknown;
  error_since_ = read.frame.number;
  if (before_known && !request_under_way) {
    AlChangedByItself event;
    event.slave = slave_;
    event.frame = read.frame;
    event.before = esc::AlWord{read_state_};
    event.status = read.status;
    event.before_since = last_seen_;
    event.code = read.status_code;
    error_reported_ = true;
    error_code_ = read.status_code;
    sink_.On(event);
  } else {
    error_reported_ = false;
    error_code_ = read.status_code;
  }
}

void AlMachine::OnNoError(const track::AlStatusRead& read) {
  const std::uint8_t state = read.status.state();
  if (error_ == Error::kYes || (error_ == Error::kUnknown && error_reported_)) {
    sink_.On(AlErrorCleared{slave_, read.frame});
  }
  error_reported_ = false;
  error_code_.reset();
  const bool before_known = read_state_ != 0 && error_ != Error::kUnknown;
  error_ = Error::kNo;
  if (open_ && open_->control.state() == state) {
    AlAnswered event;
    event.slave = slave_;
    event.outcome = open_->verdict == AlVerdict::kIllegal ? AlAnswered::Outcome::kAcceptedIllegal
                                                          : AlAnswered::Outcome::kReached;
    event.request = *open_;
    event.frame = read.frame;
    event.status = read.status;
    event.code = read.status_code;
    open_.reset();
    acknowledged_ = false;
    sink_.On(event);
    return;
  }
  if (open_) {
    if (state == read_state_ || Explains(state) || read_state_ == 0) {
      CheckOverdue(read);
      return;
    }
    // Another state than the one requested and none on the way there: not an answer to the request.
  }
  if (state != read_state_ && before_known && Height(state) < Height(read_state_) && !Explains(state)) {
    AlChangedByItself event;
    event.slave = slave_;
    event.frame = read.frame;
    event.before = esc::AlWord{read_state_};
    event.status = read.status;
    event.before_since = last_seen_;
    event.code = read.status_code;
    sink_.On(event);
  }
}

void AlMachine::CheckOverdue(const track::AlStatusRead& read) {
  if (overdue_reported_ || !read.frame.has_time || !open_->frame.has_time) return;
  const std::uint8_t target = open_->control.state();
  std::int64_t limit = timeouts_.to_safeop_or_op_ns;
  if (target == kPreop || target == kBoot) limit = timeouts_.to_preop_ns;
  if (read_state_ != 0 && Height(target) < Height(read_state_)) limit = timeouts_.downwards_ns;
  const std::int64_t waited = read.frame.time - open_->frame.time;
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
  sink_.On(event);
}

void AlMachine::ReportCode(const FrameRef& frame, std::uint16_t code) {
  if (error_ != Error::kYes || !error_reported_ || (error_code_ && *error_code_ == code)) return;
  if (code == 0 && error_code_) return;
  error_code_ = code;
  sink_.On(AlErrorCode{slave_, frame, code});
}

void AlMachine::OnStatusCode(const track::AlStatusCodeRead& read) { ReportCode(read.frame, read.code); }

void AlMachine::Forget(const FrameRef& frame) {
  possible_.Clear();
  read_state_ = 0;
  since_ = last_seen_ = frame.number;
  error_ = Error::kUnknown;
  error_reported_ = false;
  echo_ = false;
  open_.reset();
  earlier_count_ = 0;
  sent_.Clear();
}

}  // namespace ecaudit::model
