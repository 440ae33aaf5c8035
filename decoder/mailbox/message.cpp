#include <algorithm>

#include "decoder/mailbox/coe.h"
#include "decoder/mailbox/header.h"
#include "decoder/mailbox/sdo.h"

namespace ecaudit::mailbox {
namespace {

constexpr std::size_t kEmergencyBytes = 8;
constexpr std::size_t kSdoInfoHeaderBytes = 4;

Problem CheckCoe(ByteSpan payload, Direction direction) {
  if (payload.size() < kCoeHeaderBytes) return Problem::kServiceTooShort;
  const CoeHeader coe = ParseCoeHeader(payload);
  const ByteSpan service = Slice(payload, kCoeHeaderBytes);
  switch (coe.service) {
    case CoeService::kEmergency:
      return service.size() < kEmergencyBytes ? Problem::kServiceTooShort : Problem::kNone;
    case CoeService::kSdoRequest:
    case CoeService::kSdoResponse: {
      const SdoMessage sdo = ParseSdo(service, direction);
      if (sdo.too_short) return Problem::kServiceTooShort;
      return sdo.kind == SdoKind::kReserved ? Problem::kServiceInvalid : Problem::kNone;
    }
    case CoeService::kSdoInformation: {
      if (service.size() < kSdoInfoHeaderBytes) return Problem::kServiceTooShort;
      const unsigned opcode = service[0] & 0x7FU;
      return opcode >= 1 && opcode <= 7 ? Problem::kNone : Problem::kServiceInvalid;
    }
    case CoeService::kTxPdo:
    case CoeService::kRxPdo:
    case CoeService::kTxPdoRequest:
    case CoeService::kRxPdoRequest:
      return Problem::kNone;
  }
  return Problem::kServiceInvalid;
}

/// `low` to `high`: the defined values of the operation in the first byte behind `mask`.
Problem CheckOperation(ByteSpan payload, std::size_t fixed_bytes, unsigned mask, unsigned low, unsigned high) {
  if (payload.size() < fixed_bytes) return Problem::kServiceTooShort;
  const unsigned operation = payload[0] & mask;
  return operation >= low && operation <= high ? Problem::kNone : Problem::kServiceInvalid;
}

Problem CheckService(Protocol protocol, ByteSpan payload, Direction direction) {
  switch (protocol) {
    case Protocol::kError:
      return payload.size() < 4 ? Problem::kServiceTooShort : Problem::kNone;
    case Protocol::kAoE:
      return payload.size() < 32 ? Problem::kServiceTooShort : Problem::kNone;
    case Protocol::kEoE:
      return CheckOperation(payload, 4, 0x0F, 0, 9);
    case Protocol::kCoE:
      return CheckCoe(payload, direction);
    case Protocol::kFoE:
      return CheckOperation(payload, 6, 0xFF, 1, 6);
    case Protocol::kSoE:
      return CheckOperation(payload, 4, 0x07, 1, 6);
    case Protocol::kVoE:
      return Problem::kNone;  // what a vendor puts in there is his choice
  }
  return Problem::kUnknownType;
}

}  // namespace

MessageView ParseMessage(ByteSpan bytes, std::size_t mailbox_length, Direction direction) {
  MessageView view;
  view.header = ParseHeader(bytes);
  view.payload = Slice(bytes, kHeaderBytes, view.header.length);
  const std::size_t needed = kHeaderBytes + view.header.length;
  if (bytes.size() < kHeaderBytes) {
    view.problem = Problem::kNoHeader;
  } else if (view.header.length == 0) {
    view.problem = Problem::kLengthZero;
  } else if (mailbox_length != 0 && needed > mailbox_length) {
    view.problem = Problem::kLengthBeyondMailbox;
  } else if (needed > bytes.size()) {
    view.problem = Problem::kLengthBeyondData;
  } else if (view.header.reserved_bit) {
    view.problem = Problem::kReservedBit;
  } else {
    view.problem = CheckService(view.header.protocol, view.payload, direction);
  }
  return view;
}

}  // namespace ecaudit::mailbox
