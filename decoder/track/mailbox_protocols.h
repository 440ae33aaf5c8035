/// in: MailboxMessage of one slave, repetitions left out.  out: events of the protocols in them (mailbox/events.h).
///
/// keeps: the transfers that are open, one tracker a protocol, and which requests wait for an answer.
#pragma once

#include "decoder/base/event_sink.h"
#include "decoder/mailbox/eoe.h"
#include "decoder/mailbox/events.h"
#include "decoder/mailbox/foe.h"
#include "decoder/mailbox/sdo_info.h"
#include "decoder/mailbox/sdo_transfer.h"
#include "decoder/mailbox/soe_reassembler.h"
#include "decoder/track/mailbox_counters.h"
#include "decoder/track/pending_requests.h"

namespace ecaudit::track {

class MailboxProtocols {
 public:
  /// @param bytes see MailboxTracker; all must outlive this
  MailboxProtocols(SlaveId slave, MailboxCounters& counters, EventSink& sink, Allowance* bytes);

  /// What the master wrote, and what it read.
  void OnMessage(const mailbox::MailboxMessage& message);
  /// How long messages can be, 0 where that is not known.
  void SetMailboxLengths(std::uint16_t out, std::uint16_t in) { foe_.SetMailboxLengths(out, in); }
  /// A read sent in this frame never returned.
  void OnReadLost(FrameNo sent) {
    sdo_.OnReadLost(sent);
    foe_.OnReadLost(sent);
  }
  /// It was overtaken, and may return still; and it did.
  void OnReadDoubtful(FrameNo sent) {
    sdo_.OnReadDoubtful(sent);
    foe_.OnReadDoubtful(sent);
  }
  void OnReadBack(FrameNo sent) {
    sdo_.OnReadBack(sent);
    foe_.OnReadBack(sent);
  }
  /// The out mailbox is full, and not of anything that is known to be written.
  void OnUnknownRequest() { sdo_.ForgetHistory(); }
  /// What is open ends.
  void End(mailbox::TransferEnd why, const FrameRef& frame);

  [[nodiscard]] PendingRequests& pending() { return pending_; }
  [[nodiscard]] const PendingRequests& pending() const { return pending_; }

 private:
  void OnRequest(const mailbox::MailboxMessage& message);
  void OnAnswer(const mailbox::MailboxMessage& message);
  void OnCoeRequest(const mailbox::MailboxMessage& message);
  void OnCoeAnswer(const mailbox::MailboxMessage& message);
  void OnAoe(const mailbox::MailboxMessage& message, const FrameRef& request);
  void OnVoe(const mailbox::MailboxMessage& message);
  void OnErrorReply(const mailbox::MailboxMessage& message);

  SlaveId slave_;
  MailboxCounters& counters_;
  EventSink& sink_;
  PendingRequests pending_;
  mailbox::SdoTransferTracker sdo_;
  mailbox::SdoInfoTracker sdo_info_;
  mailbox::FoeTracker foe_;
  mailbox::EoeReassembler eoe_out_;
  mailbox::EoeReassembler eoe_in_;
  mailbox::SoeReassembler soe_out_;
  mailbox::SoeReassembler soe_in_;
};

}  // namespace ecaudit::track
