#include "decoder/track/mailbox_tracker.h"

#include <algorithm>

namespace ecaudit::track {
namespace {

using mailbox::Direction;
using mailbox::MailboxMessage;
using mailbox::Problem;
using mailbox::TransferEnd;

constexpr EscAddress kOutStatus = 0x0805;  // sync manager 0: bit 3, mailbox full
constexpr EscAddress kInStatus = 0x080D;   // sync manager 1: bit 3 mailbox full, bit 0 written
constexpr EscAddress kInEnd = 0x0810;
constexpr EscAddress kFirstRam = 0x1000;

/// First address after the access.
std::uint32_t EndOf(const SlaveAccess& access) {
  return access.address +
         static_cast<std::uint32_t>(std::max<std::size_t>({access.written.size(), access.read.size(), 1}));
}

bool TouchesRegisters(const SlaveAccess& access) {
  return access.address < kInEnd && EndOf(access) > kOutStatus;
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

}  // namespace

void MailboxTracker::SetWindow(const MailboxWindow& window, const FrameRef& frame) {
  if (window == window_) return;
  if (in_.use == MailboxUse::kOn) left_ = {in_.start, in_.length, frame.number};
  window_ = window;
  const bool out_changed = out_.Configure(window.out_start, window.out_length, window.out_use);
  const bool in_changed = in_.Configure(window.in_start, window.in_length, window.in_use);
  const bool forgotten =
      (out_changed && window.out_use == MailboxUse::kUnknown) || (in_changed && window.in_use == MailboxUse::kUnknown);
  if (out_changed || in_changed) EndAll(forgotten ? TransferEnd::kGap : TransferEnd::kReset, frame);
  protocols_.SetMailboxLengths(window.out_length, window.in_length);
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

void MailboxTracker::OnDoubtful(const SlaveAccess& access) {
  if (access.broadcast || EndOf(access) <= kFirstRam || !access.sent.seen()) return;
  if (access.written.empty()) {
    if (in_.use == MailboxUse::kOn && in_.Overlaps(access.address, 1)) {
      protocols_.OnReadDoubtful(access.sent.number);
    }
    return;
  }
  EscAddress start = out_.start;
  std::uint16_t length = out_.length;
  if (out_.use != MailboxUse::kOn || out_.Overlaps(access.address, access.written.size())) {
    protocols_.pending().Filled();
  }
  if (out_.use != MailboxUse::kOn) {
    if (out_.inferred_start == 0 || access.address != out_.inferred_start) return;
    start = access.address;
    length = static_cast<std::uint16_t>(access.written.size());
  } else if (!out_.Overlaps(access.address, access.written.size())) {
    return;
  }
  if (!doubtful_) doubtful_ = std::make_unique<DoubtfulRequest>(shared_bytes_);
  doubtful_->Keep(access, start, length);
}

/// What became of a write is known.
/// @return it is the one that an answer proved, and on record
bool MailboxTracker::SettleDoubt(const SlaveAccess& access) {
  if (doubtful_ && access.acceptance != Acceptance::kUnknown) doubtful_->Known(access.sent.number);
  if (proven_ == 0 || access.sent.number != proven_) return false;
  if (access.acceptance == Acceptance::kAccepted) protocols_.pending().Arrived(proven_, Certainty::kObserved);
  return true;
}

/// The slave answers a request that nothing else shows to have reached it: then it did.
void MailboxTracker::ProveRequest(ByteSpan answer, const SlaveAccess& read) {
  if (!doubtful_ || !doubtful_->sent().seen()) return;
  const FrameRef sent = doubtful_->sent();
  if (sent.number <= out_.last_frame) {
    doubtful_->Forget();
    return;
  }
  if (out_.open || !read.sent.seen() || read.sent.number < sent.number) return;
  if (protocols_.pending().Latest() != nullptr || !doubtful_->IsAnsweredBy(answer)) return;
  proven_ = sent.number;
  SlaveAccess written;
  written.slave = slave_;
  written.sent = sent;
  out_.Begin(sent, Acceptance::kUnknown);
  Deliver(out_, Direction::kOut, doubtful_->message(), written);
  out_.last_acceptance = Acceptance::kAccepted;  // the same once more is a request of its own
  doubtful_->Forget();
}

// ---------------------------------------------------------------------------------------------------------------------
// Accesses

void MailboxTracker::OnWrite(const SlaveAccess& access) {
  if (out_.use != MailboxUse::kOn) {
    OnUnconfiguredWrite(access);
    return;
  }
  const std::uint32_t address = access.address;
  if (!out_.Overlaps(address, access.written.size()) || SettleDoubt(access)) return;
  if (access.acceptance != Acceptance::kRefused) protocols_.pending().Filled();
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

/// Where a message was recognised, the next one need not look like one: a header that fits is enough.
bool MailboxTracker::IsMessage(const MailboxBox& box, Direction direction, ByteSpan bytes) {
  if (box.inferred_start == 0) return mailbox::LooksLikeMessage(bytes, direction);
  return mailbox::ParseMessage(bytes, 0, direction).problem == mailbox::Problem::kNone;
}

/// No configuration states where the mailbox is, or it is off.
void MailboxTracker::OnUnconfiguredWrite(const SlaveAccess& access) {
  if (access.acceptance != Acceptance::kRefused) protocols_.pending().Filled();
  if (out_.use == MailboxUse::kNone || access.address < kFirstRam || wire::IsLogical(access.command)) return;
  if (out_.inferred_start != 0 && access.address != out_.inferred_start) return;
  if (!IsMessage(out_, Direction::kOut, access.written)) return;
  if (out_.use == MailboxUse::kOff && out_.length != 0 && access.address != out_.start) return;
  if (SettleDoubt(access)) return;
  out_.inferred_start = out_.use == MailboxUse::kUnknown ? access.address : EscAddress{0};
  if (access.acceptance == Acceptance::kRefused) {
    OnRefusedWrite(access, access.written);
    return;
  }
  if (access.acceptance == Acceptance::kUnknown && access.sent.number < out_.last_frame) {
    OnLateWrite(access, access.written);
    return;
  }
  out_.Begin(access.sent.seen() ? access.sent : access.returned, access.acceptance);
  Deliver(out_, Direction::kOut, access.written, access);
}

void MailboxTracker::OnRead(const SlaveAccess& access) {
  if (access.acceptance == Acceptance::kUnknown && left_.Held(access)) {
    PublishLostRead(access);
    return;
  }
  if (in_.use != MailboxUse::kOn) {
    OnUnconfiguredRead(access);
    return;
  }
  const std::uint32_t address = access.address;
  if (!in_.Overlaps(address, std::max<std::size_t>(access.read.size(), 1))) return;
  if (access.acceptance != Acceptance::kUnknown) protocols_.OnReadBack(access.sent.number);
  switch (access.acceptance) {
    case Acceptance::kAssumed:
      return;  // what came back is not in the capture
    case Acceptance::kUnknown:
      OnLostRead(access);
      return;
    case Acceptance::kRefused:
      if (address > in_.start) return;
      in_.open = false;
      OnEmptyRead(access.frame());
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
    OnEmptyRead(access.frame());
  } else if (access.acceptance == Acceptance::kUnknown && in_.inferred_start != 0) {
    OnLostRead(access);
  }
  if (access.read.empty() || !IsMessage(in_, Direction::kIn, access.read)) return;
  in_.inferred_start = access.address;
  in_.Begin(access.frame(), access.acceptance);
  Deliver(in_, Direction::kIn, access.read, access);
}

void MailboxTracker::Assemble(MailboxBox& box, Direction direction, const SlaveAccess& access, ByteSpan data) {
  if (access.address <= box.start) {
    // A read from the first byte again only reads the same message once more; a write begins another one.
    if (box.open && !box.answered && direction == Direction::kOut) DeliverIncomplete(access);
    box.Begin(direction == Direction::kOut && access.sent.seen() ? access.sent : access.frame(), access.acceptance);
  }
  if (const auto whole = box.Add(access, data)) Deliver(box, direction, *whole, access);
}

void MailboxTracker::OnRefusedWrite(const SlaveAccess& access, ByteSpan bytes) {
  ++counters_.refused_writes;
  mailbox::MailboxRefused event;
  event.slave = slave_;
  event.sent = access.sent;
  event.returned = access.returned;
  event.header = mailbox::ParseHeader(bytes);
  event.same_as_last = out_.SameAsLast(bytes);
  event.off = out_.use == MailboxUse::kOff;
  if (out_.has_last) {
    event.last_message = out_.last_original;
    event.last_protocol = out_.last_protocol;
  }
  out_.Refused(bytes);
  event.attempt = out_.refusals;
  if (const PendingRequests::Request* latest = protocols_.pending().Latest()) {
    event.outstanding = latest->request;
  } else {
    protocols_.OnUnknownRequest();
  }
  sink_.Publish(event);
  // The mailbox is full of the first copy, so that one has arrived although its frame never returned.
  if (event.same_as_last && !event.off) protocols_.pending().Arrived(out_.last_original, Certainty::kObserved);
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
  message.repeated = out_.SameAsLast(bytes);
  if (message.repeated) ++counters_.repeated;
  sink_.Publish(message);
}

/// The master looked for an answer and the mailbox was empty.
void MailboxTracker::OnEmptyRead(const FrameRef& frame) {
  ++counters_.empty_reads;
  protocols_.pending().Poll(frame);
}

void MailboxTracker::OnLostRead(const SlaveAccess& access) {
  in_.open = false;
  in_.counter_known = false;
  PublishLostRead(access);
}

void MailboxTracker::PublishLostRead(const SlaveAccess& access) {
  ++counters_.lost_reads;
  mailbox::MailboxReadLost event;
  event.slave = slave_;
  event.frame = access.frame();
  event.outstanding = protocols_.pending().OnLostRead(access.sent.number);
  sink_.Publish(event);
  protocols_.OnReadLost(access.sent.number);
}

void MailboxTracker::OnRegisters(const SlaveAccess& access) {
  repeats_.OnWrite(access);
  if (access.broadcast) return;
  if (const ByteSpan status = access.Covered(access.read, kOutStatus, 1); !status.empty()) {
    // Who reads nothing but the status takes it for that of a mailbox.
    const bool mailbox = out_.use == MailboxUse::kOn || (out_.use == MailboxUse::kUnknown && access.read.size() == 1);
    protocols_.pending().SawOutMailbox((status[0] & 0x08U) != 0, mailbox, access.frame());
  }
  if (const ByteSpan status = access.Covered(access.read, kInStatus, 1); !status.empty() && (status[0] & 0x09U) == 0) {
    protocols_.pending().Poll(access.frame());
  }
  repeats_.OnRead(access);
}

// ---------------------------------------------------------------------------------------------------------------------
// Messages

bool MailboxTracker::IsRepetition(const MailboxBox& box, const MailboxMessage& message, std::uint64_t hash) const {
  if (!box.has_last || hash != box.last_hash) return false;
  if (message.direction == Direction::kIn) return repeats_.requested();
  // A slave drops a message whose counter it has just seen. Some masters never count; where the first copy was answered
  // already, the second is a request of its own.
  if (box.last_acceptance == Acceptance::kUnknown) return true;
  if (box.last_acceptance == Acceptance::kAssumed && message.header.counter != 0) return true;
  const PendingRequests::Request* latest = protocols_.pending().Latest();
  return message.header.counter != 0 && latest != nullptr && latest->request.frame.number == box.last_original;
}

MailboxMessage MailboxTracker::Message(const MailboxBox& box, Direction direction, ByteSpan bytes,
                                       const SlaveAccess& access) const {
  const bool on = box.use == MailboxUse::kOn;
  const mailbox::MessageView view = mailbox::ParseMessage(bytes, on ? box.length : 0, direction);
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
  message.counter_step = box.StepOf(view.header);
  return message;
}

void MailboxTracker::Deliver(MailboxBox& box, Direction direction, ByteSpan bytes, const SlaveAccess& access) {
  if (direction == Direction::kIn) ProveRequest(bytes, access);
  const std::uint64_t hash = HashOfMessage(bytes);
  MailboxMessage message = Message(box, direction, bytes, access);
  message.repeated = IsRepetition(box, message, hash);
  if (direction == Direction::kOut && box.refusals > 0 && hash == box.refused_hash) {
    message.refused_before = box.refusals;
  }
  if (direction == Direction::kIn) {
    const std::uint8_t request_counter = protocols_.pending().LatestCounter();
    message.counter_echoes_request = request_counter != 0 && request_counter == message.header.counter;
    // The capture may miss the access to the last byte of what it answers.
    out_.answered = true;
    repeats_.End();
  }
  box.Delivered(message, hash);
  Count(message);
  sink_.Publish(message);
  if (message.repeated) {
    if (direction == Direction::kOut) protocols_.pending().Arrived(out_.last_original, message.certainty);
    return;
  }
  const bool readable = message.problem != Problem::kNoHeader && message.problem != Problem::kLengthZero;
  if (message.mailbox_off) return;
  if (readable) {
    protocols_.OnMessage(message);
  } else if (direction == Direction::kOut && message.problem == Problem::kLengthZero) {
    protocols_.pending().Wrote(message);  // the slave may answer it with an error reply
  }
}

void MailboxTracker::Count(const MailboxMessage& message) {
  if (message.repeated) {
    ++counters_.repeated;
  } else {
    ++(message.direction == Direction::kOut ? counters_.requests : counters_.responses);
  }
  if (message.problem != Problem::kNone) ++counters_.malformed;
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

void MailboxTracker::EndAll(TransferEnd why, const FrameRef& frame) {
  protocols_.End(why, frame);
  out_.End();
  in_.End();
  repeats_.End();
  if (doubtful_) doubtful_->Forget();
}

void MailboxTracker::Reset(const FrameRef& frame) {
  EndAll(TransferEnd::kReset, frame);
}
void MailboxTracker::Forget(const FrameRef& frame) {
  EndAll(TransferEnd::kGap, frame);
  protocols_.pending().BeginAfterGap(frame);
}
void MailboxTracker::Finish() {
  EndAll(TransferEnd::kCaptureEnd, {});
}

}  // namespace ecaudit::track
