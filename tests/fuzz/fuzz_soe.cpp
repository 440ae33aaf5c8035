/// Fuzzes SoE reassembly. Input: see mailbox_input.h.
#include "tests/fuzz/mailbox_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ecaudit;
  using namespace ecaudit::mailbox;
  CheckingSink sink;
  SoeReassembler reassembler;
  ForEachMessage(ByteSpan(data, size), Protocol::kSoE, [&](const MailboxMessage& message, Before before) {
    if (before == Before::kReset || before == Before::kGap) reassembler.End(sink);
    reassembler.OnMessage(message, {}, sink);
  });
  reassembler.End(sink);
  return 0;
}
