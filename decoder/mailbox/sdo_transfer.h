/// Reassembles the SDO transfers of one slave.
///
/// In:   MailboxMessage (CoE, SDO) of both directions in wire order, repeated ones left out.
/// Out:  SdoTransfer when it completes, is aborted or given up; SdoUnexpected for answers that belong to none.
/// Keeps: one open transfer (a slave handles one at a time), at most kMaxStoredBytes of its data; more is counted.
/// Unknown: a segment whose initiate was not captured yields a transfer with certainty unknown and no object. An answer
///   without a captured request yields one with certainty inferred when nothing is known to have come before. The
///   answer to a download may be missing because the capture misses a frame: if the master goes on to another object,
///   the outcome is kNotCaptured, as without answers.
/// Source: ETG.1000.6 5.6.2; esc-reference 8.4.
#pragma once

#include <cstdint>

#include "decoder/base/event_sink.h"
#include "decoder/mailbox/coe.h"
#include "decoder/mailbox/events.h"
#include "decoder/mailbox/message_bytes.h"
#include "decoder/mailbox/sdo.h"

namespace ecaudit::mailbox {

class SdoTransferTracker {
 public:
  static constexpr std::size_t kMaxStoredBytes = 1U << 20U;

  /// @param bytes what all slaves share for messages in the making; null: no common limit
  explicit SdoTransferTracker(SlaveId slave, Allowance* bytes = nullptr)
      : slave_(slave), data_(kMaxStoredBytes, bytes) {}

  /// @param message  CoE message with service SDO request or response
  void OnMessage(const MailboxMessage& message, EventSink& sink);
  /// The slave answered the outstanding request with a mailbox error reply.
  void OnMailboxError(std::uint16_t detail, const FrameRef& frame, EventSink& sink);
  /// A mailbox read sent in frame `sent` never returned: it may have taken the outstanding answer with it. Comes late.
  void OnReadLost(FrameNo sent);
  /// A mailbox read sent in this frame was overtaken: until it is known to be back it may have taken the answer with
  /// it.
  void OnReadDoubtful(FrameNo sent) { doubtful_read_ = sent; }
  void OnReadBack(FrameNo sent) {
    if (sent == doubtful_read_) doubtful_read_ = 0;
  }
  /// A request that is not in the capture seems to have reached the slave: the next answer may belong to it.
  void ForgetHistory() { history_known_ = false; }
  /// Ends an open transfer and forgets what came before.
  void End(TransferEnd why, EventSink& sink);

  [[nodiscard]] bool open() const { return state_ != State::kIdle; }
  /// The slave has to answer.
  [[nodiscard]] bool awaiting_answer() const { return state_ == State::kInitiated || state_ == State::kSegmentSent; }
  /// Of the open transfer.
  [[nodiscard]] const SdoTransfer& transfer() const { return transfer_; }

 private:
  enum class State : std::uint8_t {
    kIdle,
    kInitiated,    ///< initiate sent, answer outstanding
    kBetween,      ///< next segment request outstanding
    kSegmentSent,  ///< segment request sent, answer outstanding
  };

  void OnRequest(const MailboxMessage& message, const SdoMessage& sdo, EventSink& sink);
  void OnSegmentRequest(const MailboxMessage& message, const SdoMessage& sdo, EventSink& sink);
  void OnResponse(const MailboxMessage& message, const SdoMessage& sdo, EventSink& sink);
  void OnMatchedResponse(const MailboxMessage& message, const SdoMessage& sdo, EventSink& sink);
  void OnOrphanResponse(const MailboxMessage& message, const SdoMessage& sdo, EventSink& sink);
  void OnInitiateResponse(const SdoMessage& sdo, EventSink& sink);
  void OnSegmentResponse(const MailboxMessage& message, const SdoMessage& sdo, EventSink& sink);
  void OnAbort(const MailboxMessage& message, const SdoMessage& sdo, EventSink& sink);
  void CheckService(const MailboxMessage& message, const SdoMessage& sdo);
  [[nodiscard]] bool Answers(const SdoMessage& sdo) const;
  [[nodiscard]] bool GoesOnTo(const SdoMessage& next) const;
  [[nodiscard]] bool SameObject(const SdoMessage& sdo) const;
  void Unexpected(SdoUnexpected::Reason reason, const MailboxMessage& message, const SdoMessage& sdo, EventSink& sink);

  void Begin(SdoService service);
  [[nodiscard]] SdoOutcome Unfinished(SdoOutcome why) const;
  void Append(ByteSpan data);
  void ToggleError(const MailboxMessage& message);
  void Close(SdoOutcome outcome, EventSink& sink);

  SlaveId slave_;
  State state_ = State::kIdle;
  bool history_known_ = false;  ///< a request was seen, so that an answer without one is odd
  bool next_toggle_ = false;    ///< of the next segment request
  bool toggle_known_ = false;
  bool last_segment_sent_ = false;
  bool assumed_ = false;  ///< the open transfer's request is assumed: answers are not in the capture
  FrameNo doubtful_read_ = 0;
  SdoTransfer transfer_;
  MessageBytes data_;
};

}  // namespace ecaudit::mailbox
