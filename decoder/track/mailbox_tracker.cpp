#include "decoder/track/mailbox_tracker.h"

#include <algorithm>

#include "decoder/mailbox/error_reply.h"
#include "decoder/mailbox/sdo.h"
#include "decoder/mailbox/voe.h"

namespace ecaudit::track {
namespace {

using mailbox::CounterStep;
using mailbox::Direction;
using mailbox::MailboxMessage;
using mailbox::MailboxUnanswered;
using mailbox::Problem;
using mailbox::Protocol;
using mailbox::RequestSummary;
using mailbox::TransferEnd;

constexpr EscAddress kOutStatus = 0x0805;     // sync manager 0: bit 3, mailbox full
constexpr EscAddress kInConfig = 0x0808;      // sync manager 1
constexpr EscAddress kInStatus = 0x080D;      // bit 3 mailbox full, bit 0 written
constexpr EscAddress kInActivate = 0x080E;    // bit 1 repeat request, toggles
constexpr EscAddress kInPdiControl = 0x080F;  // bit 1 repeat acknowledge
constexpr EscAddress kFirstRam = 0x1000;
constexpr std::uint8_t kRepeatBit = 0x02;

/// Tells two messages apart; collisions only make a repetition out of a message that follows a repeat request.
std::uint64_t HashOf(ByteSpan bytes) {
  std::uint64_t hash = 0xCBF29CE484222325ULL;
  for (const std::uint8_t byte : bytes) hash = (hash ^ byte) * 0x100000001B3ULL;
  return hash;
}

/// The bytes of a message without what stands behind it in the mailbox.
ByteSpan Whole(ByteSpan bytes) {
  return Slice(bytes, 0, mailbox::kHeaderBytes + mailbox::ParseHeader(bytes).length);
}

/// First address behind the access.
std::uint32_t EndOf(const SlaveAccess& access) {
  return access.address +
         static_cast<std::uint32_t>(std::max<std::size_t>({access.written.size(), access.read.size(), 1}));
}

bool TouchesRegisters(const SlaveAccess& access) {
  return access.address < kInPdiControl + 1 && EndOf(access) > kOutStatus;
}

Certainty CertaintyOf(Acceptance acceptance) {
  switch (acceptance) {
    case Acceptance::kAccepted:
      return Certainty::kObserved;
    case Acceptance::kAssumed:
      return Certainty::kInferred;
    case Acceptance::kRefused:
    case Acceptance::kUnknown:
      break;
  }
  return Certainty::kUnknown;
}

MailboxUnanswered::End EndOf(TransferEnd why) {
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

struct Setting {
  EscAddress start = 0;
  std::uint16_t length = 0;
  MailboxUse use = MailboxUse::kUnknown;
};

Setting SettingOf(const std::optional<esc::SyncManager>& sm, esc::SmDirection direction) {
  if (!sm) return {};
  if (!sm->enabled() || sm->length == 0) return {0, 0, MailboxUse::kOff};
  if (!sm->mailbox() || sm->direction() != direction) return {0, 0, MailboxUse::kNone};
  return {sm->start, sm->length, MailboxUse::kOn};
}

}  // namespace

MailboxWindow MailboxWindowOf(const SlaveState& state) {
  const Setting out = SettingOf(state.sync_manager(0, Certainty::kInferred), esc::SmDirection::ECAT_WRITES);
  const Setting in = SettingOf(state.sync_manager(1, Certainty::kInferred), esc::SmDirection::ECAT_READS);
  return {out.start, out.length, in.start, in.length, out.use, in.use};
}

MailboxTracker::MailboxTracker(SlaveId slave, EventSink& sink, Allowance* bytes)
    : slave_(slave),
      sink_(sink),
      out_(bytes),
      in_(bytes),
      sdo_(slave, bytes),
      sdo_info_(slave, bytes),
      foe_(slave),
      eoe_out_(bytes),
      eoe_in_(bytes),
      soe_out_(bytes),
      soe_in_(bytes) {}

bool MailboxTracker::Configure(Box& box, EscAddress start, std::uint16_t length, MailboxUse use) {
  const bool was_on = box.use == MailboxUse::kOn;
  const bool changed = was_on && (use != MailboxUse::kOn || start != box.start || length != box.length);
  box.use = use;
  box.open = false;
  if (use == MailboxUse::kOn) {
    box.start = start;
    box.length = length;
  }
  return changed;
}

void MailboxTracker::SetWindow(const MailboxWindow& window, const FrameRef& frame) {
  if (window == window_) return;
  window_ = window;
  const bool out_changed = Configure(out_, window.out_start, window.out_length, window.out_use);
  const bool in_changed = Configure(in_, window.in_start, window.in_length, window.in_use);
  if (out_changed || in_changed) EndAll(TransferEnd::kReset, frame);
  foe_.SetMailboxLengths(window.out_length, window.in_length);
}

bool MailboxTracker::Concerns(const SlaveAccess& access) {
  return TouchesRegisters(access) || (EndOf(access) > kFirstRam && !access.broadcast);
}

void MailboxTracker::OnAccess(const SlaveAccess& access) {
  if (TouchesRegisters(access)) OnRegisters(access);
  if (EndOf(access) <= kFirstRam || access.broadcast) return;
  if (!access.written.empty()) OnWrite(access);
  if (access.written.empty() || !access.read.empty()) OnRead(access);
}

// ---------------------------------------------------------------------------------------------------------------------
// Accesses

void MailboxTracker::OnWrite(const SlaveAccess& access) {
  if (out_.use != MailboxUse::kOn) {
    OnUnconfiguredWrite(access);
    return;
  }
  const std::uint32_t address = access.address;
  if (address >= out_.end() || address + access.written.size() <= out_.start) return;
  const bool from_first = address <= out_.start;
  const ByteSpan bytes = from_first ? Slice(access.written, out_.start - address, out_.length) : ByteSpan{};
  if (access.acceptance == Acceptance::kRefused) {
    if (from_first) OnRefusedWrite(access, bytes);
    return;
  }
  if (access.acceptance == Acceptance::kUnknown && access.sent.number < out_.last_frame) {
    if (from_first) OnLateWrite(access, bytes);
    return;
  }
  Assemble(out_, Direction::kOut, access, access.written);
}

/// No configuration says where the mailbox is, or it is off.
void MailboxTracker::OnUnconfiguredWrite(const SlaveAccess& access) {
  if (out_.use == MailboxUse::kNone || access.address < kFirstRam || wire::IsLogical(access.command)) return;
  if (out_.inferred_start != 0 && access.address != out_.inferred_start) return;
  if (!mailbox::LooksLikeMessage(access.written, Direction::kOut)) return;
  if (out_.use == MailboxUse::kOff && out_.length != 0 && access.address != out_.start) return;
  out_.inferred_start = out_.use == MailboxUse::kUnknown ? access.address : EscAddress{0};
  if (access.acceptance == Acceptance::kRefused) {
    OnRefusedWrite(access, access.written);
    return;
  }
  if (access.acceptance == Acceptance::kUnknown && access.sent.number < out_.last_frame) {
    OnLateWrite(access, access.written);
    return;
  }
  out_.first = access.sent.seen() ? access.sent : access.returned;
  out_.acceptance = access.acceptance;
  Deliver(out_, Direction::kOut, access.written, access);
}

void MailboxTracker::OnRead(const SlaveAccess& access) {
  if (in_.use != MailboxUse::kOn) {
    OnUnconfiguredRead(access);
    return;
  }
  const std::uint32_t address = access.address;
  const std::size_t length = std::max<std::size_t>(access.read.size(), 1);
  if (address >= in_.end() || address + length <= in_.start) return;
  switch (access.acceptance) {
    case Acceptance::kAssumed:
      return;  // what came back is not in the capture
    case Acceptance::kUnknown:
      OnLostRead(access);
      return;
    case Acceptance::kRefused:
      if (address > in_.start) return;
      ++counters_.empty_reads;
      in_.open = false;
      Poll(access.frame());
      return;
    case Acceptance::kAccepted:
      break;
  }
  if (!access.read.empty()) Assemble(in_, Direction::kIn, access, access.read);
}

void MailboxTracker::OnUnconfiguredRead(const SlaveAccess& access) {
  if (in_.use != MailboxUse::kUnknown || access.address < kFirstRam || wire::IsLogical(access.command)) return;
  if (in_.inferred_start != 0 && access.address != in_.inferred_start) return;
  if (access.acceptance == Acceptance::kRefused && in_.inferred_start != 0) {
    ++counters_.empty_reads;
    Poll(access.frame());
  } else if (access.acceptance == Acceptance::kUnknown && in_.inferred_start != 0) {
    OnLostRead(access);
  }
  if (access.read.empty() || !mailbox::LooksLikeMessage(access.read, Direction::kIn)) return;
  in_.inferred_start = access.address;
  in_.first = access.frame();
  in_.acceptance = access.acceptance;
  Deliver(in_, Direction::kIn, access.read, access);
}

/// Adds an accepted access to the message in the making and delivers it when the last byte was accessed.
void MailboxTracker::Assemble(Box& box, Direction direction, const SlaveAccess& access, ByteSpan data) {
  const std::uint32_t address = access.address;
  const std::uint32_t end = address + static_cast<std::uint32_t>(data.size());
  const bool from_first = address <= box.start;
  const bool to_last = end >= box.end();
  if (from_first) {
    // A read from the first byte again only looks at the same message once more; a write begins another one.
    if (box.open && direction == Direction::kOut) DeliverIncomplete(access);
    box.open = true;
    box.bytes.Clear();
    box.first = direction == Direction::kOut && access.sent.seen() ? access.sent : access.frame();
    box.acceptance = access.acceptance;
  } else if (!box.open) {
    return;  // the beginning was refused or is not in the capture
  }
  if (access.acceptance != Acceptance::kAccepted) box.acceptance = access.acceptance;
  const std::size_t offset = from_first ? 0 : address - box.start;
  const ByteSpan inside =
      from_first ? Slice(data, box.start - address, box.length) : Slice(data, 0, box.end() - address);
  if (from_first && to_last) {
    box.open = false;
    Deliver(box, direction, inside, access);
    return;
  }
  // Bytes behind a hole do not belong to the message: masters skip from its end to the last byte of the mailbox.
  if (offset <= box.bytes.size() && offset + inside.size() > box.bytes.size()) {
    const ByteSpan fresh = inside.subspan(box.bytes.size() - offset);
    box.bytes.Append(fresh);
  }
  if (!to_last) return;
  box.open = false;
  Deliver(box, direction, box.bytes, access);
}

void MailboxTracker::OnRefusedWrite(const SlaveAccess& access, ByteSpan bytes) {
  ++counters_.refused_writes;
  mailbox::MailboxRefused event;
  event.slave = slave_;
  event.sent = access.sent;
  event.returned = access.returned;
  event.header = mailbox::ParseHeader(bytes);
  event.same_as_last = out_.has_last && HashOf(Whole(bytes)) == out_.last_hash;
  event.off = out_.use == MailboxUse::kOff;
  if (const Pending* latest = LatestPending()) {
    event.outstanding = latest->request;
  } else {
    sdo_.ForgetHistory();  // the mailbox is full, and not of anything that is known to be written
  }
  sink_.Publish(event);
  // The mailbox is full of the first copy, so that one has arrived although its frame never returned.
  if (event.same_as_last && !event.off) Arrived(Certainty::kObserved);
}

/// The latest request turns out to have reached the slave.
void MailboxTracker::Arrived(Certainty certainty) {
  for (Pending& p : pending_) {
    if (p.active && p.request.frame.number == out_.last_original) p.certainty = std::max(p.certainty, certainty);
  }
}

/// A write whose frame never returned becomes known after later ones: too late to matter, but on record.
void MailboxTracker::OnLateWrite(const SlaveAccess& access, ByteSpan bytes) {
  const mailbox::MessageView view =
      mailbox::ParseMessage(bytes, out_.use == MailboxUse::kOn ? out_.length : 0, Direction::kOut);
  if (view.problem == Problem::kNoHeader) return;
  MailboxMessage message;
  message.slave = slave_;
  message.sent = access.sent;
  message.first = access.sent;
  message.header = view.header;
  message.payload = view.payload;
  message.problem = view.problem;
  message.certainty = Certainty::kUnknown;
  message.window_inferred = out_.use == MailboxUse::kUnknown;
  message.late = true;
  message.repeated = out_.has_last && HashOf(Whole(bytes)) == out_.last_hash;
  if (message.repeated) ++counters_.repeated;
  sink_.Publish(message);
}

void MailboxTracker::OnLostRead(const SlaveAccess& access) {
  const FrameNo sent = access.sent.number;
  ++counters_.lost_reads;
  in_.open = false;
  in_.counter_known = false;
  mailbox::MailboxReadLost event;
  event.slave = slave_;
  event.frame = access.frame();
  const Pending* affected = nullptr;
  for (Pending& p : pending_) {
    if (!p.active || p.request.frame.number > sent) continue;
    p.read_lost = true;
    if (affected == nullptr || p.request.frame.number > affected->request.frame.number) affected = &p;
  }
  if (affected != nullptr) event.outstanding = affected->request;
  sink_.Publish(event);
  sdo_.OnReadLost(sent);
}

void MailboxTracker::OnRegisters(const SlaveAccess& access) {
  OnRepeatBit(access);
  if (access.broadcast) return;
  if (const ByteSpan status = access.Covered(access.read, kOutStatus, 1); !status.empty()) {
    out_full_ = (status[0] & 0x08U) != 0;
    out_full_since_ = access.frame().number;
  }
  if (const ByteSpan status = access.Covered(access.read, kInStatus, 1); !status.empty() && (status[0] & 0x09U) == 0) {
    Poll(access.frame());
  }
  const ByteSpan control = access.Covered(access.read, kInPdiControl, 1);
  if (control.empty() || !repeat_requested_ || repeat_acknowledged_) return;
  if (((control[0] & kRepeatBit) != 0) != repeat_bit_) return;
  repeat_acknowledged_ = true;
  sink_.Publish(
      mailbox::MailboxRepeatRequest{slave_, access.frame(), mailbox::MailboxRepeatRequest::Kind::kAcknowledged});
}

void MailboxTracker::OnRepeatBit(const SlaveAccess& access) {
  if (access.acceptance == Acceptance::kRefused) return;
  const ByteSpan activate = access.Covered(access.written, kInActivate, 1);
  if (activate.empty()) return;
  const bool bit = (activate[0] & kRepeatBit) != 0;
  const bool configuration = !access.Covered(access.written, kInConfig, 1).empty();
  const bool toggled = !configuration && (!repeat_bit_known_ || bit != repeat_bit_);
  repeat_bit_ = bit;
  repeat_bit_known_ = true;
  if (!toggled) return;
  repeat_requested_ = true;
  repeat_acknowledged_ = false;
  const FrameRef& frame = access.sent.seen() ? access.sent : access.returned;
  sink_.Publish(mailbox::MailboxRepeatRequest{slave_, frame, mailbox::MailboxRepeatRequest::Kind::kRequested});
}

/// The master looked for an answer and the mailbox was empty.
void MailboxTracker::Poll(const FrameRef& frame) {
  for (Pending& p : pending_) {
    if (!p.active || frame.number <= p.request.frame.number) continue;
    if (p.polls++ == 0) p.first_poll = frame;
    p.last_poll = frame;
  }
}

// ---------------------------------------------------------------------------------------------------------------------
// Messages

CounterStep MailboxTracker::StepOf(const Box& box, const mailbox::Header& header) const {
  if (!box.counter_known) return header.counter == 0 ? CounterStep::kUnused : CounterStep::kUnknown;
  if (header.counter == 0 || box.counter == 0) return CounterStep::kUnused;
  if (header.counter == box.counter) return CounterStep::kSame;
  return header.counter == mailbox::NextCounter(box.counter) ? CounterStep::kNext : CounterStep::kSkipped;
}

bool MailboxTracker::IsRepetition(const Box& box, Direction direction, const mailbox::Header& header,
                                  std::uint64_t hash) const {
  if (!box.has_last || hash != box.last_hash) return false;
  if (direction == Direction::kIn) return repeat_requested_;
  // A slave drops a message whose counter it has just seen. Some masters never count; where the first copy was answered
  // already, the second is a request of its own.
  if (box.last_acceptance == Acceptance::kUnknown) return true;
  return header.counter != 0 && LatestPending() != nullptr &&
         LatestPending()->request.frame.number == box.last_original;
}

void MailboxTracker::Deliver(Box& box, Direction direction, ByteSpan bytes, const SlaveAccess& access) {
  const bool on = box.use == MailboxUse::kOn;
  const mailbox::MessageView view = mailbox::ParseMessage(bytes, on ? box.length : 0, direction);
  const std::uint64_t hash = HashOf(Whole(bytes));
  MailboxMessage message;
  message.slave = slave_;
  message.direction = direction;
  message.sent = access.sent;
  message.returned = access.returned;
  message.first = box.first;
  message.header = view.header;
  message.payload = view.payload;
  message.behind = Slice(bytes, mailbox::kHeaderBytes + view.header.length);
  message.problem = view.problem;
  message.certainty = CertaintyOf(box.acceptance);
  message.assumed = box.acceptance == Acceptance::kAssumed;
  message.mailbox_off = box.use == MailboxUse::kOff;
  message.window_inferred = box.use == MailboxUse::kUnknown;
  if (message.window_inferred) message.certainty = std::min(message.certainty, Certainty::kInferred);
  message.counter_step = StepOf(box, view.header);
  message.repeated = IsRepetition(box, direction, view.header, hash);
  if (direction == Direction::kIn) {
    const Pending* latest = LatestPending();
    const std::uint8_t request_counter = latest != nullptr ? latest->request.counter : last_out_.counter;
    message.counter_echoes_request = request_counter != 0 && request_counter == view.header.counter;
    repeat_requested_ = false;
  }
  box.counter = view.header.counter;
  box.counter_known = view.problem != Problem::kNoHeader;
  box.has_last = true;
  box.last_hash = hash;
  box.last_frame = message.frame().number;
  if (message.repeated) {
    ++counters_.repeated;
  } else {
    ++(direction == Direction::kOut ? counters_.requests : counters_.responses);
  }
  if (message.problem != Problem::kNone) ++counters_.malformed;
  // A repetition that was accepted proves that the slave has the message, even if the first copy never returned.
  if (!message.repeated || box.acceptance != Acceptance::kUnknown) box.last_acceptance = box.acceptance;
  if (!message.repeated) box.last_original = box.last_frame;
  sink_.Publish(message);
  if (message.repeated) {
    if (direction == Direction::kOut) Arrived(message.certainty);
    return;
  }
  const bool readable = message.problem != Problem::kNoHeader && message.problem != Problem::kLengthZero;
  if (!readable || message.mailbox_off) return;
  if (direction == Direction::kOut) {
    DispatchOut(message);
  } else {
    DispatchIn(message);
  }
}

/// The first byte is written again although the last one never was: the slave has not seen the message before.
void MailboxTracker::DeliverIncomplete(const SlaveAccess& access) {
  const ByteSpan bytes = out_.bytes;
  mailbox::MessageView view = mailbox::ParseMessage(bytes, out_.length, Direction::kOut);
  if (view.problem == Problem::kNoHeader || view.problem == Problem::kLengthBeyondData) return;
  ++counters_.malformed;
  MailboxMessage message;
  message.slave = slave_;
  message.sent = out_.first;
  message.first = out_.first;
  message.header = view.header;
  message.payload = view.payload;
  message.problem = Problem::kNotCompleted;
  message.certainty = CertaintyOf(access.acceptance);
  sink_.Publish(message);
}

void MailboxTracker::DispatchOut(const MailboxMessage& message) {
  last_out_ = Summarise(message);
  last_out_answerable_ = true;
  switch (message.header.protocol) {
    case Protocol::kCoE:
      DispatchCoeOut(message);
      break;
    case Protocol::kEoE: {
      const mailbox::EoeType type = mailbox::ParseEoe(message.payload).type;
      if (type == mailbox::EoeType::kSetIpRequest || type == mailbox::EoeType::kSetFilterRequest ||
          type == mailbox::EoeType::kGetIpRequest || type == mailbox::EoeType::kGetFilterRequest) {
        Await(Channel::kEoE, message);
      }
      eoe_out_.OnMessage(message, {}, sink_);
      break;
    }
    case Protocol::kFoE: {
      foe_.OnMessage(message, sink_);
      if (foe_.open()) {
        Await(Channel::kFoE, message);
      } else {
        Answered(Channel::kFoE);  // the master ended it with an error, or acknowledged the last packet
      }
      break;
    }
    case Protocol::kSoE: {
      const mailbox::SoeHeader soe = mailbox::ParseSoe(message.payload);
      const bool request =
          soe.operation == mailbox::SoeOperation::kReadRequest || soe.operation == mailbox::SoeOperation::kWriteRequest;
      if (request && !soe.incomplete) Await(Channel::kSoE, message);
      soe_out_.OnMessage(message, {}, sink_);
      break;
    }
    case Protocol::kAoE: {
      const mailbox::AmsHeader ams = mailbox::ParseAms(message.payload);
      if (!ams.too_short && !ams.response() && ams.command != mailbox::AdsCommand::kNotification) {
        Await(Channel::kAoE, message);
      }
      DispatchAoe(message, {});
      break;
    }
    case Protocol::kVoE:
      DispatchVoe(message);
      break;
    case Protocol::kError:
      break;
  }
}

void MailboxTracker::DispatchCoeOut(const MailboxMessage& message) {
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
        Await(Channel::kSdo, message);
      } else {
        Answered(Channel::kSdo);
      }
      break;
    case mailbox::CoeService::kSdoInformation:
      sdo_info_.OnMessage(message, sink_);
      if (sdo_info_.open()) Await(Channel::kSdoInfo, message);
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

void MailboxTracker::DispatchIn(const MailboxMessage& message) {
  switch (message.header.protocol) {
    case Protocol::kError:
      OnErrorReply(message);
      break;
    case Protocol::kCoE:
      DispatchCoeIn(message);
      break;
    case Protocol::kEoE: {
      const mailbox::EoeType type = mailbox::ParseEoe(message.payload).type;
      const bool response = type == mailbox::EoeType::kSetIpResponse || type == mailbox::EoeType::kSetFilterResponse ||
                            type == mailbox::EoeType::kGetIpResponse || type == mailbox::EoeType::kGetFilterResponse;
      const Pending& p = pending(Channel::kEoE);
      eoe_in_.OnMessage(message, response && p.active ? p.request.frame : FrameRef{}, sink_);
      if (response) Answered(Channel::kEoE);
      break;
    }
    case Protocol::kFoE:
      foe_.OnMessage(message, sink_);
      Answered(Channel::kFoE);
      break;
    case Protocol::kSoE: {
      const mailbox::SoeHeader soe = mailbox::ParseSoe(message.payload);
      const bool response = soe.operation == mailbox::SoeOperation::kReadResponse ||
                            soe.operation == mailbox::SoeOperation::kWriteResponse;
      const Pending& p = pending(Channel::kSoE);
      soe_in_.OnMessage(message, response && p.active ? p.request.frame : FrameRef{}, sink_);
      if (response && !soe.incomplete) Answered(Channel::kSoE);
      break;
    }
    case Protocol::kAoE: {
      const bool response = mailbox::ParseAms(message.payload).response();
      const Pending& p = pending(Channel::kAoE);
      DispatchAoe(message, response && p.active ? p.request.frame : FrameRef{});
      if (response) Answered(Channel::kAoE);
      break;
    }
    case Protocol::kVoE:
      DispatchVoe(message);
      break;
  }
}

void MailboxTracker::DispatchCoeIn(const MailboxMessage& message) {
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
      if (!sdo_.awaiting_answer()) Answered(Channel::kSdo);
      break;
    case mailbox::CoeService::kSdoInformation:
      sdo_info_.OnMessage(message, sink_);
      if (!sdo_info_.open()) Answered(Channel::kSdoInfo);
      break;
    case mailbox::CoeService::kTxPdo:
    case mailbox::CoeService::kRxPdo:
    case mailbox::CoeService::kTxPdoRequest:
    case mailbox::CoeService::kRxPdoRequest:
      sink_.Publish(mailbox::CoePdo{slave_, message.direction, message.frame(), coe.service, coe.number, service});
      break;
  }
}

void MailboxTracker::DispatchAoe(const MailboxMessage& message, const FrameRef& request) {
  mailbox::AoeMessage event;
  event.slave = slave_;
  event.direction = message.direction;
  event.frame = message.frame();
  event.request = request;
  event.header = mailbox::ParseAms(message.payload);
  event.parameters = mailbox::ParseAds(event.header);
  sink_.Publish(event);
}

void MailboxTracker::DispatchVoe(const MailboxMessage& message) {
  const mailbox::VoeHeader voe = mailbox::ParseVoe(message.payload);
  sink_.Publish(
      mailbox::VoeMessage{slave_, message.direction, message.frame(), voe.vendor_id, voe.vendor_type, voe.data});
}

void MailboxTracker::OnErrorReply(const MailboxMessage& message) {
  ++counters_.error_replies;
  const mailbox::ErrorReply reply = mailbox::ParseErrorReply(message.payload);
  // Slaves number their answers themselves or repeat the number of the request; the latter settles it.
  const Pending* answered = nullptr;
  for (const Pending& p : pending_) {
    if (!p.active || p.request.counter == 0 || p.request.counter != message.header.counter) continue;
    if (answered == nullptr || p.request.frame.number > answered->request.frame.number) answered = &p;
  }
  if (answered == nullptr) answered = LatestPending();
  mailbox::MailboxErrorReply event;
  event.slave = slave_;
  event.frame = message.frame();
  event.type = reply.type;
  event.detail = reply.detail;
  if (answered != nullptr) {
    event.request = answered->request;
  } else if (last_out_answerable_) {
    event.request = last_out_;
  }
  last_out_answerable_ = false;
  sink_.Publish(event);
  if (answered == nullptr) return;
  const auto channel = static_cast<Channel>(answered - pending_.data());
  Answered(channel);
  switch (channel) {
    case Channel::kSdo:
      sdo_.OnMailboxError(reply.detail, event.frame, sink_);
      break;
    case Channel::kSdoInfo:
      sdo_info_.OnMailboxError(reply.detail, event.frame, sink_);
      break;
    case Channel::kFoE:
      foe_.OnMailboxError(reply.detail, event.frame, sink_);
      break;
    case Channel::kAoE:
    case Channel::kEoE:
    case Channel::kSoE:
    case Channel::kCount:
      break;
  }
}

// ---------------------------------------------------------------------------------------------------------------------
// Requests waiting for answers

void MailboxTracker::Await(Channel channel, const MailboxMessage& message) {
  Pending& p = pending(channel);
  if (p.active) Unanswered(p, MailboxUnanswered::End::kNextRequest, message.frame());
  p = Pending();
  if (message.assumed) return;  // answers are not in the capture
  p.active = true;
  p.certainty = message.certainty;
  p.request = Summarise(message);
}

void MailboxTracker::Unanswered(Pending& p, MailboxUnanswered::End end, const FrameRef& frame) {
  p.active = false;
  ++counters_.unanswered;
  MailboxUnanswered event;
  event.slave = slave_;
  event.request = p.request;
  event.end = end;
  event.ended = frame;
  event.polls = p.polls;
  event.first_poll = p.first_poll;
  event.last_poll = p.last_poll;
  event.not_taken = out_full_ && out_full_since_ > p.request.frame.number;
  event.read_lost = p.read_lost;
  event.certainty = p.certainty;
  sink_.Publish(event);
}

const MailboxTracker::Pending* MailboxTracker::LatestPending() const {
  const Pending* latest = nullptr;
  for (const Pending& p : pending_) {
    if (p.active && (latest == nullptr || p.request.frame.number > latest->request.frame.number)) latest = &p;
  }
  return latest;
}

void MailboxTracker::EndAll(TransferEnd why, const FrameRef& frame) {
  for (Pending& p : pending_) {
    if (p.active) Unanswered(p, EndOf(why), frame);
  }
  sdo_.End(why, sink_);
  sdo_info_.End(why, sink_);
  foe_.End(why, sink_);
  eoe_out_.End(sink_);
  eoe_in_.End(sink_);
  soe_out_.End(sink_);
  soe_in_.End(sink_);
  for (Box* box : {&out_, &in_}) {
    box->open = false;
    box->counter_known = false;
    box->has_last = false;
  }
  last_out_answerable_ = false;
  repeat_requested_ = false;
}

void MailboxTracker::Reset(const FrameRef& frame) {
  EndAll(TransferEnd::kReset, frame);
}
void MailboxTracker::Forget(const FrameRef& frame) {
  EndAll(TransferEnd::kGap, frame);
}
void MailboxTracker::Finish() {
  EndAll(TransferEnd::kCaptureEnd, {});
}

}  // namespace ecaudit::track
