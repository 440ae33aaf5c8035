/// Fuzzes EoE: reassembly, IP parameters and the frames inside. Input: see mailbox_input.h.
#include "tests/fuzz/mailbox_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ecaudit;
  using namespace ecaudit::mailbox;
  CheckingSink sink;
  EoeReassembler out;
  EoeReassembler in;
  ForEachMessage(ByteSpan(data, size), Protocol::kEoE, [&](const MailboxMessage& message, Before before) {
    EoeReassembler& reassembler = message.direction == Direction::kOut ? out : in;
    if (before == Before::kReset || before == Before::kGap) reassembler.End(sink);
    reassembler.OnMessage(message, {}, sink);
  });
  out.End(sink);
  in.End(sink);
  const EthernetSummary summary = SummariseEthernet(ByteSpan(data, size));
  Check(summary.valid == (size >= 14));
  Check(!summary.source_port || summary.source_ip);
  sink.Read(ParseIpParameters(ByteSpan(data, size)).dns_name);
  return 0;
}
