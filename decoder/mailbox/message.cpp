
#include "decoder/mailbox/aoe.h"
#include "decoder/mailbox/coe.h"
#include "decoder/mailbox/emergency.h"
#include "decoder/mailbox/header.h"
#include "decoder/mailbox/sdo.h"
#include "decoder/mailbox/sdo_info.h"
#include "decoder/mailbox/soe.h"

namespace ecaudit::mailbox {
namespace {

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

/// `low` to `high`: the defined values of the operation in the first byte after `mask`.
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

bool LooksLikeCoe(ByteSpan payload, Direction direction) {
  const CoeHeader coe = ParseCoeHeader(payload);
  if (coe.reserved != 0) return false;
  const bool pdo = coe.service >= CoeService::kTxPdo && coe.service <= CoeService::kRxPdoRequest;
  if (!pdo && coe.number != 0) return false;
  switch (coe.service) {
    case CoeService::kEmergency:
    case CoeService::kSdoResponse:
    case CoeService::kTxPdo:
      return direction == Direction::kIn;
    case CoeService::kRxPdo:
    case CoeService::kTxPdoRequest:
    case CoeService::kRxPdoRequest:
      return direction == Direction::kOut;
    case CoeService::kSdoRequest:
    case CoeService::kSdoInformation:
      return true;
  }
  return false;
}

}  // namespace

bool LooksLikeMessage(ByteSpan bytes, Direction direction) {
  const MessageView view = ParseMessage(bytes, 0, direction);
  if (view.problem != Problem::kNone || view.header.channel != 0) return false;
  const ByteSpan payload = view.payload;
  switch (view.header.protocol) {
    case Protocol::kError:
      return direction == Direction::kIn && payload.size() == 4 && LittleEndian<std::uint16_t>(payload, 0) == 1;
    case Protocol::kAoE: {
      const AmsHeader ams = ParseAms(payload);
      return ams.length == ams.data.size() && (ams.state_flags & 0x04U) != 0 && static_cast<unsigned>(ams.command) <= 9;
    }
    case Protocol::kEoE:
      return (payload[1] & 0xF8U) == 0;
    case Protocol::kCoE:
      return LooksLikeCoe(payload, direction);
    case Protocol::kFoE:
      return payload[1] == 0;
    case Protocol::kSoE: {
      const auto operation = static_cast<SoeOperation>(payload[0] & 0x07U);
      const bool request = operation == SoeOperation::kReadRequest || operation == SoeOperation::kWriteRequest;
      return request == (direction == Direction::kOut);
    }
    case Protocol::kVoE:
      return false;
  }
  return false;
}

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
