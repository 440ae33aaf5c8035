/// Fuzzes FoE transfers. Input: mailbox lengths (2 bytes, times 8), then see mailbox_input.h.
#include "tests/fuzz/mailbox_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ecaudit;
  using namespace ecaudit::mailbox;
  if (size < 2) return 0;
  CheckingSink sink;
  FoeTracker tracker(1);
  tracker.SetMailboxLengths(static_cast<std::uint16_t>(data[0] * 8), static_cast<std::uint16_t>(data[1] * 8));
  ForEachMessage(ByteSpan(data + 2, size - 2), Protocol::kFoE, [&](const MailboxMessage& message, Before before) {
    if (before == Before::kMailboxError) tracker.OnMailboxError(2, message.frame(), sink);
    if (before == Before::kReset) tracker.End(TransferEnd::kReset, sink);
    if (before == Before::kGap) tracker.End(TransferEnd::kGap, sink);
    sink.Text(Name(ParseFoe(message.payload).operation));
    tracker.OnMessage(message, sink);
  });
  tracker.End(TransferEnd::kCaptureEnd, sink);
  Check(!tracker.open());
  return 0;
}
