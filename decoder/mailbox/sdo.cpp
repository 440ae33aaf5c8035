#include "decoder/mailbox/sdo.h"

#include <algorithm>

#include "decoder/base/names.h"

namespace ecaudit::mailbox {
namespace {

constexpr Named<std::uint32_t> kAbortTexts[] = {
    {0x05030000, "toggle bit not alternated"},
    {0x05040000, "SDO protocol timeout"},
    {0x05040001, "command specifier not valid or unknown"},
    {0x05040002, "invalid block size"},
    {0x05040003, "invalid sequence number"},
    {0x05040004, "block CRC error"},
    {0x05040005, "out of memory"},
    {0x06010000, "unsupported access to an object"},
    {0x06010001, "attempt to read a write-only object"},
    {0x06010002, "attempt to write a read-only object"},
    {0x06010003, "subindex cannot be written, subindex 0 must be 0 for write access"},
    {0x06010004, "complete access not supported for this object"},
    {0x06010005, "object length exceeds the mailbox size"},
    {0x06010006, "object is mapped to an RxPDO, download blocked"},
    {0x06020000, "object does not exist"},
    {0x06040041, "object cannot be mapped into the PDO"},
    {0x06040042, "mapped objects would exceed the PDO length"},
    {0x06040043, "general parameter incompatibility"},
    {0x06040047, "general internal incompatibility in the device"},
    {0x06060000, "access failed because of a hardware error"},
    {0x06070010, "data type or length of the parameter does not match"},
    {0x06070012, "data type does not match, length of the parameter too high"},
    {0x06070013, "data type does not match, length of the parameter too low"},
    {0x06090011, "subindex does not exist"},
    {0x06090030, "value range of the parameter exceeded"},
    {0x06090031, "value written too high"},
    {0x06090032, "value written too low"},
    {0x06090033, "detected module ident list does not match the configured one"},
    {0x06090036, "maximum value is less than minimum value"},
    {0x060A0023, "resource not available"},
    {0x08000000, "general error"},
    {0x08000020, "data cannot be transferred or stored"},
    {0x08000021, "data cannot be transferred or stored because of local control"},
    {0x08000022, "data cannot be transferred or stored in the present device state"},
    {0x08000023, "dynamic generation of the object dictionary failed or no dictionary is present"},
    {0x08000024, "no data available"},
};

constexpr std::size_t kInitiateBytes = 8;
constexpr std::size_t kSegmentBytes = 7;  // data of a segment that fills the smallest SDO message

void ParseSegment(ByteSpan sdo, SdoMessage& message, bool with_data) {
  message.toggle = (message.command & 0x10U) != 0;
  if (!with_data) return;
  message.last = (message.command & 0x01U) != 0;
  ByteSpan data = Slice(sdo, 1);
  // Unused bytes are only declared for the smallest message; longer segments end with the mailbox length.
  const std::size_t unused = message.command >> 1U & 0x07U;
  if (data.size() <= kSegmentBytes) data = data.first(std::min(data.size(), kSegmentBytes - unused));
  message.data = data;
}

void ParseInitiate(ByteSpan sdo, SdoMessage& message, bool with_data) {
  message.complete_access = (message.command & 0x10U) != 0;
  if (!with_data) return;
  const bool size_indicated = (message.command & 0x01U) != 0;
  message.expedited = (message.command & 0x02U) != 0;
  if (message.expedited) {
    const std::size_t bytes = size_indicated ? 4U - (message.command >> 2U & 0x03U) : 4U;
    if (size_indicated) message.size = static_cast<std::uint32_t>(bytes);
    message.data = Slice(sdo, 4, bytes);
    message.too_short = message.too_short || sdo.size() < kInitiateBytes;
    return;
  }
  message.too_short = message.too_short || sdo.size() < kInitiateBytes;
  message.data = Slice(sdo, kInitiateBytes);
  if (!size_indicated || message.too_short) return;
  message.size = LittleEndian<std::uint32_t>(sdo, 4);
  if (message.data.size() > *message.size) {
    message.excess = static_cast<std::uint32_t>(message.data.size() - *message.size);
    message.data = message.data.first(*message.size);
  }
}

void ParseAbort(ByteSpan sdo, SdoMessage& message) {
  message.too_short = message.too_short || sdo.size() < kInitiateBytes;
  message.abort_code = LittleEndian<std::uint32_t>(sdo, 4);
  if (!AbortCodeText(message.abort_code).empty()) return;
  const auto next = LittleEndian<std::uint32_t>(sdo, 8);
  if (!AbortCodeText(next).empty()) message.displaced_abort_code = next;
}

}  // namespace

SdoKind KindOf(std::uint8_t command, Direction direction) {
  const unsigned specifier = command >> 5U;
  constexpr SdoKind kRequests[] = {SdoKind::kDownloadSegment, SdoKind::kDownloadInitiate, SdoKind::kUploadInitiate,
                                   SdoKind::kUploadSegment, SdoKind::kAbort};
  constexpr SdoKind kResponses[] = {SdoKind::kUploadSegment, SdoKind::kDownloadSegment, SdoKind::kUploadInitiate,
                                    SdoKind::kDownloadInitiate, SdoKind::kAbort};
  if (specifier > 4) return SdoKind::kReserved;
  return direction == Direction::kOut ? kRequests[specifier] : kResponses[specifier];
}

SdoMessage ParseSdo(ByteSpan sdo, Direction direction) {
  SdoMessage message;
  message.direction = direction;
  if (sdo.empty()) {
    message.too_short = true;
    return message;
  }
  const bool request = direction == Direction::kOut;
  message.command = sdo[0];
  message.kind = KindOf(message.command, direction);
  if (message.kind != SdoKind::kDownloadSegment && message.kind != SdoKind::kUploadSegment) {
    message.has_object = true;
    message.too_short = sdo.size() < 4;
    message.index = LittleEndian<std::uint16_t>(sdo, 1);
    message.subindex = LittleEndian<std::uint8_t>(sdo, 3);
  }
  switch (message.kind) {
    case SdoKind::kDownloadInitiate:
      ParseInitiate(sdo, message, request);
      break;
    case SdoKind::kUploadInitiate:
      ParseInitiate(sdo, message, !request);
      break;
    case SdoKind::kDownloadSegment:
      ParseSegment(sdo, message, request);
      break;
    case SdoKind::kUploadSegment:
      ParseSegment(sdo, message, !request);
      break;
    case SdoKind::kAbort:
      ParseAbort(sdo, message);
      break;
    case SdoKind::kReserved:
      break;
  }
  return message;
}

std::string_view AbortCodeText(std::uint32_t code) {
  return NameIn(kAbortTexts, code);
}

}  // namespace ecaudit::mailbox
