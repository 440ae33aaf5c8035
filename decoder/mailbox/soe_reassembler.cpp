#include "decoder/mailbox/soe_reassembler.h"

namespace ecaudit::mailbox {

void SoeReassembler::OnMessage(const MailboxMessage& message, const FrameRef& request, EventSink& sink) {
  const SoeHeader header = ParseSoe(message.payload);
  if (header.too_short) return;
  if (open_ && (header.operation != message_.operation || header.drive != message_.drive)) End(sink);
  if (!open_) {
    message_ = SoeMessage();
    message_.slave = message.slave;
    message_.direction = message.direction;
    message_.operation = header.operation;
    message_.drive = header.drive;
    message_.elements = header.elements;
    message_.fragments = 0;
    data_.Clear();
    open_ = true;
  } else if (fragments_left_ != (header.incomplete ? header.idn_or_fragments_left : 0) + 1U) {
    message_.fragment_error = true;
  }
  ++message_.fragments;
  message_.frame = message.frame();
  message_.request = request;
  ByteSpan data = header.data;
  if (header.error && !header.incomplete && data.size() >= 2) {
    message_.error_code = LittleEndian<std::uint16_t>(data, data.size() - 2);
    data = data.first(data.size() - 2);
  }
  message_.size += data.size();
  data_.Append(data);
  if (header.incomplete) {
    fragments_left_ = header.idn_or_fragments_left;
    return;
  }
  message_.idn = header.idn_or_fragments_left;
  Emit(sink);
}

void SoeReassembler::Emit(EventSink& sink) {
  open_ = false;
  message_.data = data_;
  sink.Publish(message_);
  message_.data = {};
  data_.Clear();
}

void SoeReassembler::End(EventSink& sink) {
  if (!open_) return;
  message_.fragment_error = true;
  message_.idn_known = false;
  Emit(sink);
}

}  // namespace ecaudit::mailbox
