#include "decoder/mailbox/foe.h"

#include <algorithm>
#include <iterator>

#include "decoder/base/names.h"

namespace ecaudit::mailbox {

std::string Name(FoeOperation operation) {
  static constexpr Named<FoeOperation> kNames[] = {
      {FoeOperation::kReadRequest, "read request"},
      {FoeOperation::kWriteRequest, "write request"},
      {FoeOperation::kData, "data"},
      {FoeOperation::kAcknowledge, "acknowledge"},
      {FoeOperation::kError, "error"},
      {FoeOperation::kBusy, "busy"},
  };
  const std::string_view name = NameIn(kNames, operation);
  return !name.empty() ? std::string(name) : "operation " + std::to_string(static_cast<unsigned>(operation));
}

std::string_view FoeErrorText(std::uint32_t code) {
  constexpr std::string_view kTexts[] = {"not defined",
                                         "file not found",
                                         "access to the file denied",
                                         "disk full",
                                         "illegal operation",
                                         "packet number wrong",
                                         "file exists already",
                                         "no user",
                                         "only allowed in BOOT",
                                         "file not allowed in BOOT",
                                         "no rights, password wrong",
                                         "program error",
                                         "checksum wrong",
                                         "firmware does not fit the hardware",
                                         "",
                                         "no file to read",
                                         "file header missing or wrong",
                                         "flash cannot be accessed",
                                         "file incompatible"};
  const std::uint32_t number = code & ~std::uint32_t{0x8000};
  return number < std::size(kTexts) ? kTexts[number] : std::string_view();
}

void FoeTracker::OnMessage(const MailboxMessage& message, EventSink& sink) {
  const FoeMessage foe = ParseFoe(message.payload);
  switch (foe.operation) {
    case FoeOperation::kReadRequest:
    case FoeOperation::kWriteRequest:
      if (message.direction == Direction::kOut) Begin(message, foe, sink);
      return;
    default:
      break;
  }
  if (!open_) {
    // The request was not captured: what follows shows the direction at least.
    if (foe.operation != FoeOperation::kData && foe.operation != FoeOperation::kAcknowledge) return;
    transfer_ = FoeTransfer();
    transfer_.slave = slave_;
    transfer_.write = (foe.operation == FoeOperation::kData) == (message.direction == Direction::kOut);
    transfer_.certainty = Certainty::kUnknown;
    name_.clear();
    error_text_.clear();
    open_ = true;
    assumed_ = message.assumed;
    answered_ = false;
    last_packet_ = may_be_last_ = may_be_whole_ = false;
    longest_ = 0;
    packet_ = foe.parameter == 0 ? 0 : foe.parameter - (foe.operation == FoeOperation::kData ? 1U : 0U);
  }
  transfer_.last = message.frame();
  answer_lost_ = false;
  if (message.direction == Direction::kIn) answered_ = true;
  switch (foe.operation) {
    case FoeOperation::kData:
      OnData(message, foe);
      break;
    case FoeOperation::kAcknowledge:
      OnAcknowledge(message, foe, sink);
      break;
    case FoeOperation::kBusy:
      ++transfer_.busy;
      break;
    case FoeOperation::kError:
      transfer_.error_code = foe.parameter;
      transfer_.error_by = message.direction;
      error_text_.assign(foe.data.begin(),
                         foe.data.begin() + static_cast<std::ptrdiff_t>(std::min(foe.data.size(), kMaxNameBytes)));
      Close(FoeTransfer::Outcome::kError, sink);
      break;
    case FoeOperation::kReadRequest:
    case FoeOperation::kWriteRequest:
      break;
  }
}

void FoeTracker::Begin(const MailboxMessage& message, const FoeMessage& foe, EventSink& sink) {
  if (open_) Close(FoeTransfer::Outcome::kSuperseded, sink);
  transfer_ = FoeTransfer();
  transfer_.slave = slave_;
  transfer_.write = foe.operation == FoeOperation::kWriteRequest;
  transfer_.password = foe.parameter;
  transfer_.request = message.frame();
  transfer_.last = message.frame();
  transfer_.certainty = message.certainty;
  const std::size_t bytes = std::min(foe.data.size(), kMaxNameBytes);
  name_.assign(foe.data.begin(), foe.data.begin() + static_cast<std::ptrdiff_t>(bytes));
  name_.resize(std::min(name_.find('\0'), name_.size()));
  error_text_.clear();
  open_ = true;
  assumed_ = message.assumed;
  answered_ = false;
  last_packet_ = may_be_last_ = may_be_whole_ = false;
  packet_ = 0;
  longest_ = 0;
  answer_lost_ = false;
}

void FoeTracker::OnData(const MailboxMessage& message, const FoeMessage& foe) {
  if ((message.direction == Direction::kOut) != transfer_.write) return;  // data in the wrong direction show nothing
  if (foe.parameter == packet_ && packet_ != 0) {
    ++transfer_.repeated_packets;  // after busy, or because the acknowledge got lost
    return;
  }
  const bool next = foe.parameter != 0 && foe.parameter - 1 == packet_;  // the last number there is has no next one
  if (!next) {
    if (transfer_.packet_errors++ == 0) transfer_.packet_error = message.frame();
  }
  packet_ = foe.parameter;
  ++transfer_.packets;
  transfer_.bytes += foe.data.size();
  const auto length = static_cast<std::uint32_t>(foe.data.size());
  last_packet_ = !FillsMailbox(message, foe.data.size());
  may_be_last_ = !last_packet_ && longest_ == 0 && LengthOf(message.direction) == 0;
  may_be_whole_ = false;
  longest_ = std::max(longest_, length);
}

void FoeTracker::OnAcknowledge(const MailboxMessage& message, const FoeMessage& foe, EventSink& sink) {
  if ((message.direction == Direction::kIn) != transfer_.write) return;
  if (assumed_) {  // the packets it acknowledges are not in the capture
    packet_ = foe.parameter;
    return;
  }
  if (foe.parameter != packet_) {
    if (transfer_.packet_errors++ == 0) transfer_.packet_error = message.frame();
    return;
  }
  if (last_packet_) Close(FoeTransfer::Outcome::kCompleted, sink);
  may_be_whole_ = open_ && may_be_last_;
}

bool FoeTracker::FillsMailbox(const MailboxMessage& message, std::size_t data_bytes) const {
  const std::uint16_t mailbox = LengthOf(message.direction);
  if (data_bytes == 0) return false;
  if (mailbox != 0) return data_bytes + kFoeHeaderBytes + kHeaderBytes >= mailbox;
  return longest_ == 0 || data_bytes >= longest_;
}

void FoeTracker::OnMailboxError(std::uint16_t detail, const FrameRef& frame, EventSink& sink) {
  if (!open_) return;
  transfer_.mailbox_error = detail;
  transfer_.last = frame;
  answered_ = true;
  Close(FoeTransfer::Outcome::kMailboxError, sink);
}

void FoeTracker::End(TransferEnd why, EventSink& sink) {
  if (!open_) return;
  Close(assumed_                          ? FoeTransfer::Outcome::kNotCaptured
        : why == TransferEnd::kCaptureEnd ? FoeTransfer::Outcome::kCaptureEnd
        : why == TransferEnd::kReset      ? FoeTransfer::Outcome::kReset
                                          : FoeTransfer::Outcome::kGap,
        sink);
}

void FoeTracker::Close(FoeTransfer::Outcome outcome, EventSink& sink) {
  OnReadLost(doubtful_read_);
  open_ = false;
  transfer_.answer_lost = answer_lost_;
  transfer_.outcome = assumed_ ? FoeTransfer::Outcome::kNotCaptured : outcome;
  // One packet that was acknowledged, and nothing followed: it was the last one.
  const bool cut_off = outcome != FoeTransfer::Outcome::kError && outcome != FoeTransfer::Outcome::kMailboxError;
  if (!assumed_ && may_be_whole_ && cut_off) transfer_.outcome = FoeTransfer::Outcome::kCompleted;
  transfer_.answered = answered_;
  transfer_.file_name = name_;
  transfer_.error_text = error_text_;
  if (transfer_.request.seen()) {
    transfer_.certainty =
        answered_ || transfer_.certainty == Certainty::kObserved ? Certainty::kObserved : Certainty::kInferred;
  }
  if (transfer_.request.has_time && transfer_.last.has_time) {
    transfer_.duration = transfer_.last.time - transfer_.request.time;
  }
  sink.Publish(transfer_);
  transfer_.file_name = {};
  transfer_.error_text = {};
}

}  // namespace ecaudit::mailbox
