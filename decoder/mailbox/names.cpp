#include <string>

#include "decoder/mailbox/coe.h"
#include "decoder/mailbox/header.h"

namespace ecaudit::mailbox {

std::string Name(Protocol protocol) {
  switch (protocol) {
    case Protocol::kError:
      return "error";
    case Protocol::kAoE:
      return "AoE";
    case Protocol::kEoE:
      return "EoE";
    case Protocol::kCoE:
      return "CoE";
    case Protocol::kFoE:
      return "FoE";
    case Protocol::kSoE:
      return "SoE";
    case Protocol::kVoE:
      return "VoE";
  }
  return "type " + std::to_string(static_cast<unsigned>(protocol));
}

std::string_view Describe(Problem problem) {
  switch (problem) {
    case Problem::kNone:
      return "";
    case Problem::kNoHeader:
      return "fewer than the six bytes of the mailbox header were transferred";
    case Problem::kLengthZero:
      return "the length field is 0";
    case Problem::kLengthBeyondMailbox:
      return "the length field announces more than the mailbox can hold";
    case Problem::kLengthBeyondData:
      return "fewer bytes were transferred than the length field announces";
    case Problem::kReservedBit:
      return "the reserved bit after the counter is set";
    case Problem::kUnknownType:
      return "the protocol type is a reserved number";
    case Problem::kServiceTooShort:
      return "the length is too short for the service";
    case Problem::kServiceInvalid:
      return "the service, operation or command is a reserved number";
    case Problem::kNotCompleted:
      return "the last byte of the mailbox was not accessed before the next message began";
  }
  return "";
}

std::string Name(CoeService service) {
  switch (service) {
    case CoeService::kEmergency:
      return "emergency";
    case CoeService::kSdoRequest:
      return "SDO request";
    case CoeService::kSdoResponse:
      return "SDO response";
    case CoeService::kTxPdo:
      return "TxPDO";
    case CoeService::kRxPdo:
      return "RxPDO";
    case CoeService::kTxPdoRequest:
      return "TxPDO remote transmission request";
    case CoeService::kRxPdoRequest:
      return "RxPDO remote transmission request";
    case CoeService::kSdoInformation:
      return "SDO information";
  }
  return "service " + std::to_string(static_cast<unsigned>(service));
}

}  // namespace ecaudit::mailbox
