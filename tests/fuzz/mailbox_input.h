/// Shared by the mailbox fuzz targets: a sink that reads everything it is given and checks what is promised of it, and
/// inputs cut into messages.
///
/// Input of the message targets: | flags | length | payload ... | again and again. Flags: bit 0 from the slave, 1
/// assumed (outbound-only capture), 2 frame never returned, 3 no time stamp, 7:5 what happens before it (1 lost read, 2
/// mailbox error, 3 reset, 4 gap).
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "analyzers/wiring/event_bus.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/coe_types.h"
#include "decoder/mailbox/eoe.h"
#include "decoder/mailbox/error_reply.h"
#include "decoder/mailbox/events.h"
#include "decoder/mailbox/foe.h"
#include "decoder/mailbox/sdo.h"
#include "decoder/mailbox/sdo_info.h"
#include "decoder/mailbox/sdo_transfer.h"
#include "decoder/mailbox/soe_reassembler.h"

namespace ecaudit::mailbox {

inline void Check(bool condition) {
  if (!condition) std::abort();
}

class CheckingSink : public EventBus {
 public:
  CheckingSink() {
    ListenTo<MailboxMessage, MailboxRefused, MailboxUnanswered, MailboxErrorReply, SdoTransfer, SdoUnexpected, SdoInfo,
             Emergency, CoePdo, EoeFrame, EoeControl, FoeTransfer, SoeMessage, AoeMessage, VoeMessage>(Stage::kModel,
                                                                                                       *this);
  }
  /// What was read has an effect, so that the reads are not optimised away.
  ~CheckingSink() { Check(sum_ != 0); }

  void On(const MailboxMessage& m) {
    Check(m.payload.size() <= m.header.length);
    Check(Describe(m.problem).empty() == (m.problem == Problem::kNone));
    Read(m.payload);
    Read(m.behind);
    Text(Name(m.header.protocol));
  }
  void On(const MailboxRefused& r) { Text(Name(r.header.protocol)); }
  void On(const MailboxUnanswered& u) { Check(u.polls == 0 || u.last_poll.seen()); }
  void On(const MailboxErrorReply& e) { Text(MailboxErrorText(e.detail)); }
  void On(const SdoTransfer& t) {
    Check(t.data.size() <= t.size && t.data.size() <= SdoTransferTracker::kMaxStoredBytes);
    Check(!t.duration || (t.request.has_time && t.response.has_time));
    Check(t.outcome != SdoOutcome::kAborted || t.last.seen());
    Check(t.certainty == Certainty::kUnknown || t.has_object);
    Read(t.data);
    Text(Name(t.service));
    Text(Name(t.kind));
    Check(!Name(t.outcome).empty());
    Text(AbortCodeText(t.abort_code));
    Text(FormatValue(static_cast<DataType>(t.index % 0x300), t.data.first(t.data.size() < 64 ? t.data.size() : 64)));
  }
  void On(const SdoUnexpected& u) { Check(!Describe(u.reason).empty()); }
  void On(const SdoInfo& i) {
    for (const std::uint16_t index : i.indices) sum_ += index;
    Check(i.name.size() <= SdoInfoTracker::kMaxBytes);
    Text(i.name);
    Read(i.default_value);
    Read(i.minimum);
    Read(i.maximum);
    Text(Name(static_cast<DataType>(i.data_type)));
    Text(AccessText(i.access));
    Text(ObjectCodeName(i.object_code));
    Text(ListTypeName(i.list_type));
  }
  void On(const Emergency& e) { sum_ += e.data.error_code; }
  void On(const CoePdo& p) { Read(p.data); }
  void On(const EoeFrame& f) {
    Check(f.data.size() <= f.size && f.data.size() <= EoeReassembler::kMaxFrameBytes);
    Read(f.data);
    Text(EtherTypeName(f.summary.ether_type));
    Text(Describe(f.problem));
  }
  void On(const EoeControl& c) {
    Read(c.ip.dns_name);
    Text(Name(c.type));
    if (c.ip.ip) Text(IpText(*c.ip.ip));
    if (c.ip.mac) Text(ecaudit::MacText(*c.ip.mac));
    if (c.result) Text(EoeResultText(*c.result));
  }
  void On(const FoeTransfer& f) {
    Check(f.file_name.size() <= FoeTracker::kMaxNameBytes && f.error_text.size() <= FoeTracker::kMaxNameBytes);
    Text(f.file_name);
    Text(f.error_text);
    Text(FoeErrorText(f.error_code));
  }
  void On(const SoeMessage& m) {
    Check(m.data.size() <= m.size && m.data.size() <= SoeReassembler::kMaxStoredBytes);
    Read(m.data);
    Text(IdnName(m.idn));
    Text(ElementNames(m.elements));
    Text(Name(m.operation));
    if (m.error_code) Text(SoeErrorText(*m.error_code));
  }
  void On(const AoeMessage& m) {
    Read(m.parameters.data);
    Text(ecaudit::mailbox::Text(m.header.target));
    Text(Name(m.header.command));
  }
  void On(const VoeMessage& m) { Read(m.data); }

  void Read(ByteSpan bytes) {
    for (const std::uint8_t byte : bytes) sum_ += byte;
  }
  void Text(std::string_view text) {
    for (const char c : text) sum_ += static_cast<unsigned char>(c);
  }

 private:
  std::uint64_t sum_ = 1;
};

enum class Before : std::uint8_t { kNothing, kReadLost, kMailboxError, kReset, kGap };

/// Calls `use(message, before)` for every message of the input.
template <typename Use>
void ForEachMessage(ByteSpan input, Protocol protocol, Use&& use) {
  FrameNo frame = 0;
  for (std::size_t at = 0; Fits(input, at, 2);) {
    const unsigned flags = input[at];
    const ByteSpan payload = Slice(input, at + 2, input[at + 1]);
    at += 2 + payload.size();
    MailboxMessage message;
    message.slave = 1;
    message.direction = (flags & 1U) != 0 ? Direction::kIn : Direction::kOut;
    message.assumed = (flags & 2U) != 0;
    message.certainty = (flags & 4U) != 0 ? Certainty::kUnknown : Certainty::kObserved;
    const FrameRef ref{++frame, static_cast<TimeNs>(frame) * 1000, (flags & 8U) == 0};
    (message.direction == Direction::kOut ? message.sent : message.returned) = ref;
    message.header.protocol = protocol;
    message.header.length = static_cast<std::uint16_t>(payload.size());
    message.payload = payload;
    use(message, static_cast<Before>(flags >> 5U));
  }
}

}  // namespace ecaudit::mailbox
