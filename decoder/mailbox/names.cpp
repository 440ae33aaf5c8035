#include "decoder/base/names.h"

#include <string>

#include "decoder/mailbox/coe.h"
#include "decoder/mailbox/header.h"

namespace ecaudit::mailbox {

std::string Name(Protocol protocol) {
  static constexpr Named<Protocol> kNames[] = {
      {Protocol::kError, "error"}, {Protocol::kAoE, "AoE"}, {Protocol::kEoE, "EoE"}, {Protocol::kCoE, "CoE"},
      {Protocol::kFoE, "FoE"},     {Protocol::kSoE, "SoE"}, {Protocol::kVoE, "VoE"},
  };
  const std::string_view name = NameIn(kNames, protocol);
  return !name.empty() ? std::string(name) : "type " + std::to_string(static_cast<unsigned>(protocol));
}

std::string_view Describe(Problem problem) {
  static constexpr Named<Problem> kNames[] = {
      {Problem::kNone, ""},
      {Problem::kNoHeader, "fewer than the six bytes of the mailbox header were transferred"},
      {Problem::kLengthZero, "the length field is 0"},
      {Problem::kLengthBeyondMailbox, "the length field announces more than the mailbox can hold"},
      {Problem::kLengthBeyondData, "fewer bytes were transferred than the length field announces"},
      {Problem::kReservedBit, "the reserved bit after the counter is set"},
      {Problem::kUnknownType, "the protocol type is a reserved number"},
      {Problem::kServiceTooShort, "the length is too short for the service"},
      {Problem::kServiceInvalid, "the service, operation or command is a reserved number"},
      {Problem::kNotCompleted, "the last byte of the mailbox was not accessed before the next message began"},
  };
  static_assert(NamesAll(kNames, Problem::kNotCompleted));
  return NameIn(kNames, problem);
}

std::string Name(CoeService service) {
  static constexpr Named<CoeService> kNames[] = {
      {CoeService::kEmergency, "emergency"},
      {CoeService::kSdoRequest, "SDO request"},
      {CoeService::kSdoResponse, "SDO response"},
      {CoeService::kTxPdo, "TxPDO"},
      {CoeService::kRxPdo, "RxPDO"},
      {CoeService::kTxPdoRequest, "TxPDO remote transmission request"},
      {CoeService::kRxPdoRequest, "RxPDO remote transmission request"},
      {CoeService::kSdoInformation, "SDO information"},
  };
  const std::string_view name = NameIn(kNames, service);
  return !name.empty() ? std::string(name) : "service " + std::to_string(static_cast<unsigned>(service));
}

}  // namespace ecaudit::mailbox
