#include "decoder/track/pending_requests.h"

#include <algorithm>

#include "decoder/base/time.h"
#include "decoder/mailbox/eoe.h"
#include "decoder/mailbox/error_reply.h"
#include "decoder/mailbox/foe.h"
#include "decoder/mailbox/sdo.h"

namespace ecaudit::track {
namespace {

using mailbox::MailboxMessage;
using mailbox::MailboxUnanswered;
using mailbox::Protocol;
using mailbox::RequestSummary;
using mailbox::TransferEnd;

MailboxUnanswered::End UnansweredEnd(TransferEnd why) {
  switch (why) {
    case TransferEnd::kCaptureEnd:
      return MailboxUnanswered::End::kCaptureEnd;
    case TransferEnd::kReset:
      return MailboxUnanswered::End::kReset;
    case TransferEnd::kGap:
      break;
  }
  return MailboxUnanswered::End::kGap;
}

RequestSummary Summarise(const MailboxMessage& message) {
  RequestSummary request;
  request.frame = message.frame();
  request.protocol = message.header.protocol;
  request.counter = message.header.counter;
  const ByteSpan payload = message.payload;
  switch (message.header.protocol) {
    case Protocol::kCoE: {
      const mailbox::CoeService service = mailbox::ParseCoeHeader(payload).service;
      request.operation = static_cast<std::uint8_t>(service);
      request.command = LittleEndian<std::uint8_t>(payload, mailbox::kCoeHeaderBytes);
      if (service != mailbox::CoeService::kSdoRequest && service != mailbox::CoeService::kSdoResponse) break;
      const mailbox::SdoMessage sdo = mailbox::ParseSdo(Slice(payload, mailbox::kCoeHeaderBytes), message.direction);
      if (sdo.has_object && !sdo.too_short) {
        request.index = sdo.index;
        request.subindex = sdo.subindex;
      }
      break;
    }
    case Protocol::kEoE:
      request.operation = static_cast<std::uint8_t>(mailbox::ParseEoe(payload).type);
      break;
    case Protocol::kFoE:
      request.operation = static_cast<std::uint8_t>(mailbox::ParseFoe(payload).operation);
      break;
    case Protocol::kSoE: {
      const mailbox::SoeHeader soe = mailbox::ParseSoe(payload);
      request.operation = static_cast<std::uint8_t>(soe.operation);
      if (!soe.incomplete && !soe.too_short) request.index = soe.idn_or_fragments_left;
      break;
    }
    case Protocol::kAoE:
      request.operation = static_cast<std::uint8_t>(mailbox::ParseAms(payload).command);
      break;
    case Protocol::kError:
    case Protocol::kVoE:
      break;
  }
  return request;
}

}  // namespace

void PendingRequests::Wrote(const MailboxMessage& message) {
  last_ = Summarise(message);
  last_answerable_ = true;
}

void PendingRequests::Filled() {
  ReportStuck(false);
  filled_ = true;
}

void PendingRequests::Await(MailboxChannel channel, const MailboxMessage& message) {
  Request& r = Of(channel);
  if (r.active) Unanswered(r, MailboxUnanswered::End::kNextRequest, message.frame());
  r = Request();
  if (message.assumed) return;  // answers are not in the capture
  r.active = true;
  r.certainty = message.certainty;
  r.request = Summarise(message);
  r.since = r.request.frame;
}

void PendingRequests::Unanswered(Request& r, MailboxUnanswered::End end, const FrameRef& frame) {
  r.active = false;
  ++counters_.unanswered;
  MailboxUnanswered event;
  event.slave = slave_;
  event.request = r.request;
  event.end = end;
  event.ended = frame;
  event.polls = r.polls;
  event.first_poll = r.first_poll;
  event.last_poll = r.last_poll;
  event.parts = r.parts;
  event.last_part = r.last_part;
  event.since = r.since;
  const bool looked = out_full_since_ > r.request.frame.number;
  event.not_accepted = looked && out_full_;
  event.taken = (looked && !out_full_) || end == MailboxUnanswered::End::kNextRequest;
  event.read_lost = r.read_lost;
  event.certainty = r.certainty;
  sink_.Publish(event);
}

const PendingRequests::Request* PendingRequests::Latest() const {
  const Request* latest = nullptr;
  for (const Request& r : requests_) {
    if (r.active && (latest == nullptr || r.request.frame.number > latest->request.frame.number)) latest = &r;
  }
  return latest;
}

std::uint8_t PendingRequests::LatestCounter() const {
  const Request* latest = Latest();
  return latest != nullptr ? latest->request.counter : last_.counter;
}

void PendingRequests::Answered(MailboxChannel channel, const FrameRef& by) {
  Request& r = Of(channel);
  if (r.active && r.request.frame.number == last_.frame.number) last_answerable_ = false;
  if (r.active && by.seen()) {
    sink_.Publish(mailbox::MailboxAnswered{slave_, r.request, by, r.polls, r.last_poll, r.read_lost, r.since});
  }
  r.active = false;
}

void PendingRequests::AnsweredInPart(MailboxChannel channel, const FrameRef& part) {
  Request& r = Of(channel);
  if (!r.active) return;
  ++r.parts;
  r.last_part = r.since = part;
  r.polls = 0;
  r.first_poll = r.last_poll = {};
}

void PendingRequests::SawOutMailbox(bool full, bool mailbox, const FrameRef& frame) {
  out_full_ = full;
  out_full_since_ = frame.number;
  if (!full) {
    ReportStuck(false);
    filled_ = false;
  } else if (mailbox && !filled_) {
    if (stuck_.looks++ == 0) {
      stuck_.first = frame;
      stuck_.gap = gap_;
    }
    stuck_.last = frame;
  }
}

void PendingRequests::ReportStuck(bool reset) {
  gap_ = {};
  if (stuck_.looks == 0) return;
  stuck_.slave = slave_;
  stuck_.reset = reset;
  sink_.Publish(stuck_);
  stuck_ = {};
}

PendingRequests::ErrorAnswer PendingRequests::OnErrorReply(std::uint8_t counter, std::uint16_t detail) {
  // Slaves number their answers themselves or repeat the number of the request; the latter settles it. Else the latest
  // one is answered, be it one that waits or another message.
  ErrorAnswer answer;
  bool settled = false;
  const auto consider = [&](const RequestSummary& request, MailboxChannel channel) {
    const bool spoken = (answered_ >> static_cast<unsigned>(request.protocol) & 1U) != 0;
    if (detail == mailbox::kUnsupportedProtocol && spoken) return;
    const bool echoed = request.counter != 0 && request.counter == counter;
    if (settled && !echoed) return;
    const bool later = request.frame.number > answer.request.frame.number;
    if (echoed == settled && !later) return;
    answer = {request, channel};
    settled = echoed;
  };
  if (last_answerable_) consider(last_, MailboxChannel::kCount);
  for (const Request& r : requests_) {
    if (!r.active) continue;
    if (answer.request.frame.seen() && r.request.frame.number == answer.request.frame.number) {
      answer.channel = static_cast<MailboxChannel>(&r - requests_.data());  // the last message is what waits
    } else {
      consider(r.request, static_cast<MailboxChannel>(&r - requests_.data()));
    }
  }
  last_answerable_ = false;
  if (answer.channel != MailboxChannel::kCount) Answered(answer.channel);
  return answer;
}

void PendingRequests::Poll(const FrameRef& frame) {
  for (Request& r : requests_) {
    if (!r.active || frame.number <= r.request.frame.number) continue;
    FollowClock(r.since, r.last_poll.seen() ? r.last_poll : r.since, frame);
    if (r.polls++ == 0) r.first_poll = frame;
    r.last_poll = frame;
  }
}

RequestSummary PendingRequests::OnLostRead(FrameNo sent) {
  const Request* affected = nullptr;
  for (Request& r : requests_) {
    if (!r.active || r.request.frame.number > sent) continue;
    r.read_lost = true;
    if (affected == nullptr || r.request.frame.number > affected->request.frame.number) affected = &r;
  }
  return affected != nullptr ? affected->request : RequestSummary{};
}

void PendingRequests::Arrived(FrameNo frame, Certainty certainty) {
  for (Request& r : requests_) {
    if (r.active && r.request.frame.number == frame) r.certainty = std::max(r.certainty, certainty);
  }
}

void PendingRequests::End(TransferEnd why, const FrameRef& frame) {
  for (Request& r : requests_) {
    if (r.active) Unanswered(r, UnansweredEnd(why), frame);
  }
  const FrameRef gap = gap_;
  ReportStuck(why == TransferEnd::kReset);
  if (why == TransferEnd::kGap) gap_ = gap;
  filled_ = false;
  last_answerable_ = false;
}

}  // namespace ecaudit::track
