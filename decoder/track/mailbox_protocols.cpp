#include "decoder/track/mailbox_protocols.h"

#include "decoder/mailbox/error_reply.h"
#include "decoder/mailbox/sdo.h"
#include "decoder/mailbox/voe.h"

namespace ecaudit::track {
namespace {

using mailbox::Direction;
using mailbox::MailboxMessage;
using mailbox::Protocol;

}  // namespace

MailboxProtocols::MailboxProtocols(SlaveId slave, MailboxCounters& counters, EventSink& sink, Allowance* bytes)
    : slave_(slave),
      counters_(counters),
      sink_(sink),
      pending_(slave, counters, sink),
      sdo_(slave, bytes),
      sdo_info_(slave, bytes),
      foe_(slave),
      eoe_out_(bytes),
      eoe_in_(bytes),
      soe_out_(bytes),
      soe_in_(bytes) {}

void MailboxProtocols::OnMessage(const MailboxMessage& message) {
  if (message.direction == Direction::kOut) {
    OnRequest(message);
  } else {
    OnAnswer(message);
  }
}

void MailboxProtocols::OnRequest(const MailboxMessage& message) {
  pending_.Wrote(message);
  switch (message.header.protocol) {
    case Protocol::kCoE:
      OnCoeRequest(message);
      break;
    case Protocol::kEoE: {
      const mailbox::EoeType type = mailbox::ParseEoe(message.payload).type;
      if (type == mailbox::EoeType::kSetIpRequest || type == mailbox::EoeType::kSetFilterRequest ||
          type == mailbox::EoeType::kGetIpRequest || type == mailbox::EoeType::kGetFilterRequest) {
        pending_.Await(MailboxChannel::kEoE, message);
      }
      eoe_out_.OnMessage(message, {}, sink_);
      break;
    }
    case Protocol::kFoE: {
      foe_.OnMessage(message, sink_);
      if (foe_.open()) {
        pending_.Await(MailboxChannel::kFoE, message);
      } else {
        pending_.Answered(MailboxChannel::kFoE);  // the master ended it with an error, or acknowledged the last packet
      }
      break;
    }
    case Protocol::kSoE: {
      const mailbox::SoeHeader soe = mailbox::ParseSoe(message.payload);
      const bool request =
          soe.operation == mailbox::SoeOperation::kReadRequest || soe.operation == mailbox::SoeOperation::kWriteRequest;
      if (request && !soe.incomplete) pending_.Await(MailboxChannel::kSoE, message);
      soe_out_.OnMessage(message, {}, sink_);
      break;
    }
    case Protocol::kAoE: {
      const mailbox::AmsHeader ams = mailbox::ParseAms(message.payload);
      if (!ams.too_short && !ams.response() && ams.command != mailbox::AdsCommand::kNotification) {
        pending_.Await(MailboxChannel::kAoE, message);
      }
      OnAoe(message, {});
      break;
    }
    case Protocol::kVoE:
      OnVoe(message);
      break;
    case Protocol::kError:
      break;
  }
}

void MailboxProtocols::OnCoeRequest(const MailboxMessage& message) {
  const mailbox::CoeHeader coe = mailbox::ParseCoeHeader(message.payload);
  switch (coe.service) {
    case mailbox::CoeService::kSdoRequest:
    case mailbox::CoeService::kSdoResponse:
      if (message.payload.size() <= mailbox::kCoeHeaderBytes) return;
      if (mailbox::ParseSdo(Slice(message.payload, mailbox::kCoeHeaderBytes), Direction::kOut).kind ==
          mailbox::SdoKind::kAbort) {
        ++counters_.sdo_aborts;
      }
      sdo_.OnMessage(message, sink_);
      if (sdo_.awaiting_answer()) {
        pending_.Await(MailboxChannel::kSdo, message);
      } else {
        pending_.Answered(MailboxChannel::kSdo);
      }
      break;
    case mailbox::CoeService::kSdoInformation:
      sdo_info_.OnMessage(message, sink_);
      if (sdo_info_.open()) pending_.Await(MailboxChannel::kSdoInfo, message);
      break;
    case mailbox::CoeService::kTxPdo:
    case mailbox::CoeService::kRxPdo:
    case mailbox::CoeService::kTxPdoRequest:
    case mailbox::CoeService::kRxPdoRequest:
      sink_.Publish(mailbox::CoePdo{slave_, message.direction, message.frame(), coe.service, coe.number,
                                    Slice(message.payload, mailbox::kCoeHeaderBytes)});
      break;
    case mailbox::CoeService::kEmergency:
      break;
  }
}

void MailboxProtocols::OnAnswer(const MailboxMessage& message) {
  pending_.HasAnswered(message.header.protocol);
  switch (message.header.protocol) {
    case Protocol::kError:
      OnErrorReply(message);
      break;
    case Protocol::kCoE:
      OnCoeAnswer(message);
      break;
    case Protocol::kEoE: {
      const mailbox::EoeType type = mailbox::ParseEoe(message.payload).type;
      const bool response = type == mailbox::EoeType::kSetIpResponse || type == mailbox::EoeType::kSetFilterResponse ||
                            type == mailbox::EoeType::kGetIpResponse || type == mailbox::EoeType::kGetFilterResponse;
      eoe_in_.OnMessage(message, response ? pending_.Waiting(MailboxChannel::kEoE) : FrameRef{}, sink_);
      if (response) pending_.Answered(MailboxChannel::kEoE, message.frame());
      break;
    }
    case Protocol::kFoE:
      foe_.OnMessage(message, sink_);
      pending_.Answered(MailboxChannel::kFoE, message.frame());
      break;
    case Protocol::kSoE: {
      const mailbox::SoeHeader soe = mailbox::ParseSoe(message.payload);
      const bool response = soe.operation == mailbox::SoeOperation::kReadResponse ||
                            soe.operation == mailbox::SoeOperation::kWriteResponse;
      soe_in_.OnMessage(message, response ? pending_.Waiting(MailboxChannel::kSoE) : FrameRef{}, sink_);
      if (response && soe.incomplete) pending_.AnsweredInPart(MailboxChannel::kSoE, message.frame());
      if (response && !soe.incomplete) pending_.Answered(MailboxChannel::kSoE, message.frame());
      break;
    }
    case Protocol::kAoE: {
      const bool response = mailbox::ParseAms(message.payload).response();
      OnAoe(message, response ? pending_.Waiting(MailboxChannel::kAoE) : FrameRef{});
      if (response) pending_.Answered(MailboxChannel::kAoE, message.frame());
      break;
    }
    case Protocol::kVoE:
      OnVoe(message);
      break;
  }
}

void MailboxProtocols::OnCoeAnswer(const MailboxMessage& message) {
  const mailbox::CoeHeader coe = mailbox::ParseCoeHeader(message.payload);
  const ByteSpan service = Slice(message.payload, mailbox::kCoeHeaderBytes);
  switch (coe.service) {
    case mailbox::CoeService::kEmergency:
      ++counters_.emergencies;
      sink_.Publish(mailbox::Emergency{slave_, message.frame(), mailbox::ParseEmergency(service)});
      break;
    case mailbox::CoeService::kSdoRequest:
    case mailbox::CoeService::kSdoResponse:
      if (service.empty()) return;
      if (mailbox::ParseSdo(service, Direction::kIn).kind == mailbox::SdoKind::kAbort) ++counters_.sdo_aborts;
      sdo_.OnMessage(message, sink_);
      if (!sdo_.awaiting_answer()) pending_.Answered(MailboxChannel::kSdo, message.frame());
      break;
    case mailbox::CoeService::kSdoInformation:
      sdo_info_.OnMessage(message, sink_);
      if (sdo_info_.open()) {
        pending_.AnsweredInPart(MailboxChannel::kSdoInfo, message.frame());
      } else {
        pending_.Answered(MailboxChannel::kSdoInfo, message.frame());
      }
      break;
    case mailbox::CoeService::kTxPdo:
    case mailbox::CoeService::kRxPdo:
    case mailbox::CoeService::kTxPdoRequest:
    case mailbox::CoeService::kRxPdoRequest:
      sink_.Publish(mailbox::CoePdo{slave_, message.direction, message.frame(), coe.service, coe.number, service});
      break;
  }
}

void MailboxProtocols::OnAoe(const MailboxMessage& message, const FrameRef& request) {
  mailbox::AoeMessage event;
  event.slave = slave_;
  event.direction = message.direction;
  event.frame = message.frame();
  event.request = request;
  event.header = mailbox::ParseAms(message.payload);
  event.parameters = mailbox::ParseAds(event.header);
  sink_.Publish(event);
}

void MailboxProtocols::OnVoe(const MailboxMessage& message) {
  const mailbox::VoeHeader voe = mailbox::ParseVoe(message.payload);
  sink_.Publish(
      mailbox::VoeMessage{slave_, message.direction, message.frame(), voe.vendor_id, voe.vendor_type, voe.data});
}

void MailboxProtocols::OnErrorReply(const MailboxMessage& message) {
  ++counters_.error_replies;
  const mailbox::ErrorReply reply = mailbox::ParseErrorReply(message.payload);
  const PendingRequests::ErrorAnswer answered = pending_.OnErrorReply(message.header.counter, reply.detail);
  mailbox::MailboxErrorReply event;
  event.slave = slave_;
  event.frame = message.frame();
  event.type = reply.type;
  event.detail = reply.detail;
  event.request = answered.request;
  sink_.Publish(event);
  switch (answered.channel) {
    case MailboxChannel::kSdo:
      sdo_.OnMailboxError(reply.detail, event.frame, sink_);
      break;
    case MailboxChannel::kSdoInfo:
      sdo_info_.OnMailboxError(reply.detail, event.frame, sink_);
      break;
    case MailboxChannel::kFoE:
      foe_.OnMailboxError(reply.detail, event.frame, sink_);
      break;
    case MailboxChannel::kAoE:
    case MailboxChannel::kEoE:
    case MailboxChannel::kSoE:
    case MailboxChannel::kCount:
      break;
  }
}

void MailboxProtocols::End(mailbox::TransferEnd why, const FrameRef& frame) {
  pending_.End(why, frame);
  sdo_.End(why, sink_);
  sdo_info_.End(why, sink_);
  foe_.End(why, sink_);
  eoe_out_.End(sink_);
  eoe_in_.End(sink_);
  soe_out_.End(sink_);
  soe_in_.End(sink_);
}

}  // namespace ecaudit::track
