#include "decoder/track/mailbox_box.h"

#include "decoder/base/wrapping.h"

namespace ecaudit::track {

std::uint64_t HashOfMessage(ByteSpan bytes) {
  std::uint64_t hash = 0xCBF29CE484222325ULL;
  const std::size_t whole = mailbox::kHeaderBytes + mailbox::ParseHeader(bytes).length;
  for (const std::uint8_t byte : Slice(bytes, 0, whole)) {
    hash = WrappingProduct(hash ^ byte, std::uint64_t{0x100000001B3});
  }
  return hash;
}

bool MailboxBox::Configure(EscAddress new_start, std::uint16_t new_length, MailboxUse new_use) {
  const bool was_on = use == MailboxUse::kOn;
  const bool changed = was_on && (new_use != MailboxUse::kOn || new_start != start || new_length != length);
  use = new_use;
  open = false;
  if (use == MailboxUse::kOn) {
    start = new_start;
    length = new_length;
  }
  return changed;
}

void MailboxBox::Begin(const FrameRef& frame, Acceptance of) {
  first = frame;
  acceptance = of;
  answered = false;
}

std::optional<ByteSpan> MailboxBox::Add(const SlaveAccess& access, ByteSpan data) {
  const std::uint32_t address = access.address;
  const bool from_first = address <= start;
  const bool to_last = address + static_cast<std::uint32_t>(data.size()) >= end();
  if (!from_first && !open) return std::nullopt;  // the beginning was refused or is not in the capture
  if (access.acceptance != Acceptance::kAccepted) acceptance = access.acceptance;
  const std::size_t offset = from_first ? 0 : address - start;
  const ByteSpan inside = from_first ? Slice(data, start - address, length) : Slice(data, 0, end() - address);
  open = !to_last;
  if (from_first) {
    bytes.Clear();
    if (to_last) return inside;
  }
  // Bytes after a gap in the mailbox do not belong to the message: masters skip from its end to the last byte of the
  // mailbox.
  if (offset <= bytes.size() && offset + inside.size() > bytes.size()) {
    const ByteSpan fresh = inside.subspan(bytes.size() - offset);
    bytes.Append(fresh);
  }
  if (!to_last) return std::nullopt;
  if (bytes.full()) {
    // There was no room for it: its content is not known, and nothing is wrong with it.
    End();
    return std::nullopt;
  }
  return ByteSpan(bytes);
}

mailbox::CounterStep MailboxBox::StepOf(const mailbox::Header& header) const {
  using mailbox::CounterStep;
  if (!counter_known) return header.counter == 0 ? CounterStep::kUnused : CounterStep::kUnknown;
  if (header.counter == 0 || counter == 0) return CounterStep::kUnused;
  if (header.counter == counter) return CounterStep::kSame;
  return header.counter == mailbox::NextCounter(counter) ? CounterStep::kNext : CounterStep::kSkipped;
}

bool MailboxBox::SameAsLast(ByteSpan message) const {
  return has_last && HashOfMessage(message) == last_hash;
}

void MailboxBox::Refused(ByteSpan message) {
  const std::uint64_t hash = HashOfMessage(message);
  if (refusals == 0 || hash != refused_hash) refusals = 0;
  refused_hash = hash;
  if (refusals < UINT32_MAX) ++refusals;
}

void MailboxBox::Delivered(const mailbox::MailboxMessage& message, std::uint64_t hash) {
  counter = message.header.counter;
  counter_known = message.problem != mailbox::Problem::kNoHeader;
  has_last = true;
  last_hash = hash;
  last_frame = message.frame().number;
  last_protocol = message.header.protocol;
  if (message.refused_before > 0) refusals = 0;
  // A repetition that was accepted proves that the slave has the message, even if the first copy never returned.
  if (!message.repeated || acceptance != Acceptance::kUnknown) last_acceptance = acceptance;
  if (!message.repeated) last_original = last_frame;
}

}  // namespace ecaudit::track
