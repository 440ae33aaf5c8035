#include "decoder/mailbox/sdo_transfer.h"

#include "decoder/base/names.h"

namespace ecaudit::mailbox {
namespace {

SdoService ServiceOf(SdoKind kind) {
  switch (kind) {
    case SdoKind::kDownloadInitiate:
    case SdoKind::kDownloadSegment:
      return SdoService::kDownload;
    case SdoKind::kUploadInitiate:
    case SdoKind::kUploadSegment:
      return SdoService::kUpload;
    case SdoKind::kAbort:
    case SdoKind::kReserved:
      break;
  }
  return SdoService::kUnknown;
}

bool IsSegment(SdoKind kind) {
  return kind == SdoKind::kDownloadSegment || kind == SdoKind::kUploadSegment;
}

}  // namespace

std::string_view Name(SdoService service) {
  static constexpr Named<SdoService> kNames[] = {
      {SdoService::kUnknown, "unknown"},
      {SdoService::kDownload, "download"},
      {SdoService::kUpload, "upload"},
  };
  static_assert(NamesAll(kNames, SdoService::kUpload));
  return NameIn(kNames, service);
}

std::string_view Name(SdoTransferKind kind) {
  static constexpr Named<SdoTransferKind> kNames[] = {
      {SdoTransferKind::kUnknown, "unknown"},
      {SdoTransferKind::kExpedited, "expedited"},
      {SdoTransferKind::kNormal, "normal"},
      {SdoTransferKind::kSegmented, "segmented"},
  };
  static_assert(NamesAll(kNames, SdoTransferKind::kSegmented));
  return NameIn(kNames, kind);
}

std::string_view Name(SdoOutcome outcome) {
  static constexpr Named<SdoOutcome> kNames[] = {
      {SdoOutcome::kCompleted, "completed"},
      {SdoOutcome::kAborted, "aborted"},
      {SdoOutcome::kMailboxError, "mailbox error"},
      {SdoOutcome::kSuperseded, "superseded"},
      {SdoOutcome::kCaptureEnd, "unfinished at the end of the capture"},
      {SdoOutcome::kReset, "unfinished when the mailbox was reset"},
      {SdoOutcome::kNotCaptured, "answer not captured"},
      {SdoOutcome::kGap, "frames missing from the capture"},
  };
  static_assert(NamesAll(kNames, SdoOutcome::kGap));
  return NameIn(kNames, outcome);
}

std::string_view Describe(SdoUnexpected::Reason reason) {
  static constexpr Named<SdoUnexpected::Reason> kNames[] = {
      {SdoUnexpected::Reason::kNoRequest, "no request is outstanding"},
      {SdoUnexpected::Reason::kWrongCommand, "its command does not answer the outstanding request"},
      {SdoUnexpected::Reason::kWrongObject, "it names another object than the outstanding request"},
  };
  static_assert(NamesAll(kNames, SdoUnexpected::Reason::kWrongObject));
  return NameIn(kNames, reason);
}

void SdoTransferTracker::OnMessage(const MailboxMessage& message, EventSink& sink) {
  const SdoMessage sdo = ParseSdo(Slice(message.payload, kCoeHeaderBytes), message.direction);
  if (message.direction == Direction::kOut) {
    OnRequest(message, sdo, sink);
    history_known_ = true;
  } else {
    OnResponse(message, sdo, sink);
  }
}

void SdoTransferTracker::OnRequest(const MailboxMessage& message, const SdoMessage& sdo, EventSink& sink) {
  if (IsSegment(sdo.kind)) {
    OnSegmentRequest(message, sdo, sink);
    return;
  }
  if (sdo.kind == SdoKind::kAbort && open()) {
    OnAbort(message, sdo, sink);
    return;
  }
  if (open()) Close(GoesOnTo(sdo) ? SdoOutcome::kNotCaptured : Unfinished(SdoOutcome::kSuperseded), sink);
  Begin(ServiceOf(sdo.kind));
  assumed_ = message.assumed;
  transfer_.certainty = message.certainty;
  transfer_.request = message.frame();
  transfer_.last = transfer_.request;
  transfer_.has_object = sdo.has_object && !sdo.too_short;
  transfer_.index = sdo.index;
  transfer_.subindex = sdo.subindex;
  transfer_.complete_access = sdo.complete_access;
  CheckService(message, sdo);
  if (sdo.kind == SdoKind::kAbort) {
    OnAbort(message, sdo, sink);
    return;
  }
  if (sdo.kind != SdoKind::kDownloadInitiate) return;
  transfer_.declared_size = sdo.size;
  transfer_.excess = sdo.excess;
  Append(sdo.data);
  const bool whole = !sdo.size || transfer_.size >= *sdo.size;
  transfer_.kind = sdo.expedited ? SdoTransferKind::kExpedited
                   : whole       ? SdoTransferKind::kNormal
                                 : SdoTransferKind::kSegmented;
  // Without answers in the capture nothing more will be learnt; later events may depend on the order.
  if (assumed_ && whole) Close(SdoOutcome::kNotCaptured, sink);
}

/// The answer may have been in a frame whose return is not in the capture, and the master goes on to another object as
/// it does after a download that the slave accepted.
bool SdoTransferTracker::GoesOnTo(const SdoMessage& next) const {
  const bool download = transfer_.service == SdoService::kDownload && transfer_.has_object;
  const bool whole = !transfer_.declared_size || transfer_.size >= *transfer_.declared_size;
  if (!download || !whole || state_ != State::kInitiated) return false;
  if (!transfer_.answer_lost && doubtful_read_ <= transfer_.last.number) return false;
  return next.has_object && (next.index != transfer_.index || next.subindex != transfer_.subindex);
}

void SdoTransferTracker::OnSegmentRequest(const MailboxMessage& message, const SdoMessage& sdo, EventSink& sink) {
  const SdoService service = ServiceOf(sdo.kind);
  if (open() && transfer_.service != service) Close(Unfinished(SdoOutcome::kSuperseded), sink);
  if (!open()) {
    Begin(service);
    transfer_.data_gap = true;
    toggle_known_ = false;
  }
  assumed_ = assumed_ || message.assumed;
  CheckService(message, sdo);
  transfer_.kind = SdoTransferKind::kSegmented;
  transfer_.last = message.frame();
  const bool answer_missing = state_ == State::kInitiated || state_ == State::kSegmentSent;
  // With the answer missing the master either goes on or repeats itself; both toggles are right.
  const bool again = answer_missing && state_ == State::kSegmentSent && toggle_known_ && sdo.toggle != next_toggle_;
  if (!answer_missing && toggle_known_ && sdo.toggle != next_toggle_) ToggleError(message);
  if (service == SdoService::kUpload) {
    if (answer_missing && !again) transfer_.data_gap = true;
  } else {
    if (!again) Append(sdo.data);
    last_segment_sent_ = sdo.last;
  }
  ++transfer_.segments;
  next_toggle_ = !sdo.toggle;
  toggle_known_ = true;
  state_ = State::kSegmentSent;
  if (assumed_ && service == SdoService::kDownload && sdo.last) Close(SdoOutcome::kNotCaptured, sink);
}

void SdoTransferTracker::OnResponse(const MailboxMessage& message, const SdoMessage& sdo, EventSink& sink) {
  if (!open()) {
    if (history_known_) {
      Unexpected(SdoUnexpected::Reason::kNoRequest, message, sdo, sink);
    } else {
      OnOrphanResponse(message, sdo, sink);
    }
    return;
  }
  if (state_ == State::kBetween && sdo.kind != SdoKind::kAbort) {
    Unexpected(SdoUnexpected::Reason::kNoRequest, message, sdo, sink);
  } else if (!Answers(sdo)) {
    Unexpected(SdoUnexpected::Reason::kWrongCommand, message, sdo, sink);
  } else if (!SameObject(sdo)) {
    Unexpected(SdoUnexpected::Reason::kWrongObject, message, sdo, sink);
  } else {
    OnMatchedResponse(message, sdo, sink);
  }
}

void SdoTransferTracker::OnMatchedResponse(const MailboxMessage& message, const SdoMessage& sdo, EventSink& sink) {
  CheckService(message, sdo);
  transfer_.answered = true;
  transfer_.answer_lost = false;
  transfer_.response = message.frame();
  transfer_.last = transfer_.response;
  if (sdo.kind == SdoKind::kAbort) {
    OnAbort(message, sdo, sink);
  } else if (IsSegment(sdo.kind)) {
    OnSegmentResponse(message, sdo, sink);
  } else {
    OnInitiateResponse(sdo, sink);
  }
}

/// The first thing seen of this slave is an answer: the capture starts between request and answer.
void SdoTransferTracker::OnOrphanResponse(const MailboxMessage& message, const SdoMessage& sdo, EventSink& sink) {
  if (sdo.kind == SdoKind::kReserved || sdo.kind == SdoKind::kDownloadSegment) return;  // shows nothing
  Begin(ServiceOf(sdo.kind));
  transfer_.certainty = Certainty::kInferred;
  transfer_.has_object = sdo.has_object && !sdo.too_short;
  transfer_.index = sdo.index;
  transfer_.subindex = sdo.subindex;
  transfer_.complete_access = sdo.complete_access;
  toggle_known_ = false;
  transfer_.data_gap = sdo.kind != SdoKind::kUploadInitiate;
  if (IsSegment(sdo.kind)) state_ = State::kSegmentSent;
  OnMatchedResponse(message, sdo, sink);
}

void SdoTransferTracker::OnInitiateResponse(const SdoMessage& sdo, EventSink& sink) {
  next_toggle_ = false;
  toggle_known_ = true;
  state_ = State::kBetween;
  if (transfer_.service == SdoService::kDownload) {
    const bool whole = !transfer_.declared_size || transfer_.size >= *transfer_.declared_size;
    if (whole) Close(SdoOutcome::kCompleted, sink);
    return;
  }
  transfer_.declared_size = sdo.size;
  transfer_.excess = sdo.excess;
  Append(sdo.data);
  if (sdo.expedited) {
    transfer_.kind = SdoTransferKind::kExpedited;
    Close(SdoOutcome::kCompleted, sink);
    return;
  }
  // Without an announced size only the next request shows whether segments follow.
  const bool whole = sdo.size && transfer_.size >= *sdo.size;
  transfer_.kind = whole || !sdo.size ? SdoTransferKind::kNormal : SdoTransferKind::kSegmented;
  if (whole) Close(SdoOutcome::kCompleted, sink);
}

void SdoTransferTracker::OnSegmentResponse(const MailboxMessage& message, const SdoMessage& sdo, EventSink& sink) {
  transfer_.kind = SdoTransferKind::kSegmented;
  if (toggle_known_ && sdo.toggle == next_toggle_) ToggleError(message);
  if (!toggle_known_) {
    next_toggle_ = !sdo.toggle;
    toggle_known_ = true;
  }
  state_ = State::kBetween;
  bool last = last_segment_sent_;
  if (transfer_.service == SdoService::kUpload) {
    Append(sdo.data);
    last = sdo.last;
  }
  if (last) Close(SdoOutcome::kCompleted, sink);
}

void SdoTransferTracker::OnAbort(const MailboxMessage& message, const SdoMessage& sdo, EventSink& sink) {
  transfer_.abort_code = sdo.abort_code;
  transfer_.displaced_abort_code = sdo.displaced_abort_code;
  transfer_.aborted_by = message.direction;
  transfer_.last = message.frame();
  Close(SdoOutcome::kAborted, sink);
}

void SdoTransferTracker::OnMailboxError(std::uint16_t detail, const FrameRef& frame, EventSink& sink) {
  if (!open()) return;
  transfer_.mailbox_error = detail;
  transfer_.answered = true;
  transfer_.answer_lost = false;
  transfer_.response = frame;
  transfer_.last = frame;
  Close(SdoOutcome::kMailboxError, sink);
}

void SdoTransferTracker::OnReadLost(FrameNo sent) {
  if (awaiting_answer() && sent > transfer_.last.number) transfer_.answer_lost = true;
}

void SdoTransferTracker::End(TransferEnd why, EventSink& sink) {
  if (open()) {
    Close(Unfinished(why == TransferEnd::kCaptureEnd ? SdoOutcome::kCaptureEnd
                     : why == TransferEnd::kReset    ? SdoOutcome::kReset
                                                     : SdoOutcome::kGap),
          sink);
  }
  history_known_ = false;
}

void SdoTransferTracker::CheckService(const MailboxMessage& message, const SdoMessage& sdo) {
  const CoeService service = ParseCoeHeader(message.payload).service;
  const bool out = message.direction == Direction::kOut;
  // Aborts come under either service from real slaves; the manuals' printed answer has 2 where 3 belongs.
  if (sdo.kind == SdoKind::kAbort || (service == CoeService::kSdoRequest) == out) return;
  (out ? transfer_.request_service_mismatch : transfer_.response_service_mismatch) = true;
  if (!transfer_.service_mismatch.seen()) transfer_.service_mismatch = message.frame();
}

bool SdoTransferTracker::Answers(const SdoMessage& sdo) const {
  if (sdo.kind == SdoKind::kAbort) return true;
  if (ServiceOf(sdo.kind) != transfer_.service || transfer_.service == SdoService::kUnknown) return false;
  return IsSegment(sdo.kind) == (state_ == State::kSegmentSent);
}

bool SdoTransferTracker::SameObject(const SdoMessage& sdo) const {
  if (!sdo.has_object || !transfer_.has_object) return true;
  if (sdo.kind == SdoKind::kAbort && sdo.index == 0 && sdo.subindex == 0) return true;  // names no object
  return sdo.index == transfer_.index && (sdo.subindex == transfer_.subindex || transfer_.complete_access);
}

void SdoTransferTracker::Unexpected(SdoUnexpected::Reason reason, const MailboxMessage& message, const SdoMessage& sdo,
                                    EventSink& sink) {
  SdoUnexpected event;
  event.slave = slave_;
  event.reason = reason;
  event.response = message.frame();
  event.command = sdo.command;
  event.has_object = sdo.has_object;
  event.index = sdo.index;
  event.subindex = sdo.subindex;
  event.abort = sdo.kind == SdoKind::kAbort;
  event.abort_code = sdo.abort_code;
  if (open()) {
    ++transfer_.unexpected_responses;
    event.request = transfer_.request;
    event.expected_index = transfer_.index;
    event.expected_subindex = transfer_.subindex;
  }
  sink.Publish(event);
}

void SdoTransferTracker::Begin(SdoService service) {
  transfer_ = SdoTransfer();
  transfer_.slave = slave_;
  transfer_.service = service;
  data_.Clear();
  state_ = State::kInitiated;
  next_toggle_ = false;
  toggle_known_ = true;
  last_segment_sent_ = false;
  assumed_ = false;
}

SdoOutcome SdoTransferTracker::Unfinished(SdoOutcome why) const {
  if (assumed_) return SdoOutcome::kNotCaptured;
  const bool open_ended = state_ == State::kBetween && transfer_.service == SdoService::kUpload &&
                          !transfer_.declared_size && transfer_.segments == 0;
  return open_ended && why != SdoOutcome::kGap ? SdoOutcome::kCompleted : why;
}

void SdoTransferTracker::Append(ByteSpan data) {
  transfer_.size += data.size();
  data_.Append(data);
}

void SdoTransferTracker::ToggleError(const MailboxMessage& message) {
  if (transfer_.toggle_errors++ != 0) return;
  transfer_.toggle_error = message.frame();
  transfer_.toggle_error_by = message.direction;
}

void SdoTransferTracker::Close(SdoOutcome outcome, EventSink& sink) {
  OnReadLost(doubtful_read_);
  state_ = State::kIdle;
  transfer_.outcome = outcome;
  transfer_.data = data_;
  transfer_.size_mismatch = outcome == SdoOutcome::kCompleted && transfer_.declared_size && !transfer_.data_gap &&
                            transfer_.size != *transfer_.declared_size;
  if (transfer_.request.has_time && transfer_.response.has_time) {
    transfer_.duration = transfer_.response.time - transfer_.request.time;
  }
  if (!transfer_.has_object) {
    transfer_.certainty = Certainty::kUnknown;
  } else if (!transfer_.request.seen() || assumed_) {
    transfer_.certainty = Certainty::kInferred;
  } else {
    // An answer proves that a request whose frame never returned has arrived.
    transfer_.certainty =
        transfer_.answered || transfer_.certainty == Certainty::kObserved ? Certainty::kObserved : Certainty::kInferred;
  }
  sink.Publish(transfer_);
  transfer_.data = {};
  data_.Clear();
}

}  // namespace ecaudit::mailbox
