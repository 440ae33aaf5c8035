/// Fuzzes the parsers of AoE, VoE and error replies. Input: one payload.
#include "decoder/mailbox/voe.h"
#include "tests/fuzz/mailbox_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ecaudit;
  using namespace ecaudit::mailbox;
  const ByteSpan payload(data, size);
  CheckingSink sink;
  AoeMessage message;
  message.header = ParseAms(payload);
  message.parameters = ParseAds(message.header);
  Check(message.header.too_short == (size < kAmsHeaderBytes));
  Check(message.parameters.data.size() <= message.header.data.size());
  Check(message.header.data.size() <= message.header.length);
  sink.On(message);
  const VoeHeader voe = ParseVoe(payload);
  sink.On(VoeMessage{1, Direction::kOut, {}, voe.vendor_id, voe.vendor_type, voe.data});
  sink.Text(MailboxErrorText(ParseErrorReply(payload).detail));
  return 0;
}
