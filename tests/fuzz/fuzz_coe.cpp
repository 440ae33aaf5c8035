/// Fuzzes CoE: SDO messages and transfers, SDO information, emergencies. Input: see mailbox_input.h; payloads begin
/// with the CoE header.
#include "tests/fuzz/mailbox_input.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ecaudit;
  using namespace ecaudit::mailbox;
  CheckingSink sink;
  SdoTransferTracker sdo(1);
  SdoInfoTracker info(1);
  ForEachMessage(ByteSpan(data, size), Protocol::kCoE, [&](const MailboxMessage& message, Before before) {
    switch (before) {
      case Before::kReadLost:
        sdo.OnReadLost(message.frame().number);
        break;
      case Before::kMailboxError:
        sdo.OnMailboxError(7, message.frame(), sink);
        info.OnMailboxError(7, message.frame(), sink);
        break;
      case Before::kReset:
        sdo.End(TransferEnd::kReset, sink);
        info.End(TransferEnd::kReset, sink);
        break;
      case Before::kGap:
        sdo.End(TransferEnd::kGap, sink);
        info.End(TransferEnd::kGap, sink);
        break;
      case Before::kNothing:
        break;
    }
    const CoeHeader coe = ParseCoeHeader(message.payload);
    const ByteSpan service = Slice(message.payload, kCoeHeaderBytes);
    sink.Text(Name(coe.service));
    switch (coe.service) {
      case CoeService::kEmergency:
        sink.On(Emergency{1, message.frame(), ParseEmergency(service)});
        break;
      case CoeService::kSdoInformation:
        info.OnMessage(message, sink);
        break;
      default: {
        const SdoMessage parsed = ParseSdo(service, message.direction);
        Check(parsed.data.size() + parsed.excess <= service.size());
        sdo.OnMessage(message, sink);
      }
    }
  });
  sdo.End(TransferEnd::kCaptureEnd, sink);
  info.End(TransferEnd::kCaptureEnd, sink);
  Check(!sdo.open() && !info.open());
  if (size >= 2) {
    sink.Text(FormatValue(static_cast<DataType>(LittleEndian<std::uint16_t>(ByteSpan(data, size), 0) % 0x290),
                          ByteSpan(data + 2, size - 2)));
  }
  return 0;
}
