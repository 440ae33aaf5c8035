#include "cli/stream/message_text.h"

#include "decoder/base/text.h"
#include "decoder/mailbox/diagnosis_message.h"
#include "decoder/mailbox/eoe.h"
#include "decoder/mailbox/error_reply.h"
#include "decoder/mailbox/foe.h"
#include "decoder/mailbox/sdo.h"
#include "decoder/mailbox/sdo_info.h"
#include "decoder/mailbox/voe.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit::cli {
namespace {

using namespace mailbox;

std::string Text(ByteSpan bytes) {
  return "\"" + Printable(std::string(bytes.begin(), bytes.end())) + "\"";
}

std::string AbortText(std::uint32_t code) {
  const std::string_view text = AbortCodeText(code);
  return "abort " + Hex(code, 8) + (text.empty() ? "" : " " + std::string(text));
}

/// ", maps 6077h:0, 16 bit": what an entry of 16xxh, 1Axxh, 1C12h or 1C13h holds; "" for all else.
std::string EntryText(const SdoMessage& sdo, bool written) {
  if (!sdo.has_object || sdo.complete_access || !sdo.expedited || sdo.subindex == 0) return {};
  if (process::IsAssignment(sdo.index) && sdo.data.size() == 2) {
    return std::string(written ? ", assigns " : ": ") + ObjectName(LittleEndian<std::uint16_t>(sdo.data, 0));
  }
  const bool mapping = process::IsRxMapping(sdo.index) || process::IsTxMapping(sdo.index);
  if (!mapping || sdo.data.size() != 4) return {};
  const auto entry = process::MappingEntry::FromValue(LittleEndian<std::uint32_t>(sdo.data, 0));
  const std::string what = entry.index == 0 ? "a gap" : ObjectName(entry.index, entry.subindex);
  return std::string(written ? ", maps " : ": ") + what + ", " + std::to_string(entry.bits) + " bit";
}

/// ": error, diag code 0x...": a whole message of the diagnosis history; "" for all else.
std::string DiagnosisOf(const SdoMessage& sdo, const DiagnosisTexts* texts) {
  if (!sdo.has_object || sdo.complete_access || !IsDiagnosisMessage(sdo.index, sdo.subindex)) return {};
  if (sdo.data.size() < kDiagnosisHeaderBytes || (sdo.size && *sdo.size > sdo.data.size())) return {};
  return ": " + DiagnosisText(ParseDiagnosisMessage(sdo.data), texts);
}

std::string SdoText(const SdoMessage& sdo, const DiagnosisTexts* texts) {
  if (sdo.too_short) return "too short";
  const std::string object = sdo.has_object ? " " + ObjectName(sdo.index, sdo.subindex) : "";
  const std::string access = sdo.complete_access ? ", complete access" : "";
  const bool request = sdo.direction == Direction::kOut;
  const std::string bytes = ", " + Count(sdo.data.size(), "byte");
  const std::string toggle = sdo.toggle ? ", toggle 1" : ", toggle 0";
  switch (sdo.kind) {
    case SdoKind::kDownloadInitiate: {
      if (!request) return "download" + object + " done";
      const bool all = sdo.expedited || !sdo.size || *sdo.size <= sdo.data.size();
      return "download" + object + access + bytes + (all ? "" : " of " + Grouped(*sdo.size)) + EntryText(sdo, true);
    }
    case SdoKind::kUploadInitiate: {
      if (request) return "upload" + object + access;
      const bool all = sdo.expedited || !sdo.size || *sdo.size <= sdo.data.size();
      return "upload" + object + access + bytes + (all ? "" : " of " + Grouped(*sdo.size)) + EntryText(sdo, false) +
             DiagnosisOf(sdo, texts);
    }
    case SdoKind::kDownloadSegment:
      return "download segment" + (request ? bytes : "") + toggle + (request && sdo.last ? ", last" : "");
    case SdoKind::kUploadSegment:
      return "upload segment" + (request ? "" : bytes) + toggle + (!request && sdo.last ? ", last" : "");
    case SdoKind::kAbort:
      return AbortText(sdo.abort_code) + (object.empty() ? "" : ", object" + object);
    case SdoKind::kReserved:
      break;
  }
  return "reserved command " + Hex(sdo.command, 2);
}

std::string SdoInfoText(const SdoInfoHeader& info) {
  std::string text = Name(info.opcode);
  if (info.too_short) return text + ", too short";
  const auto word = LittleEndian<std::uint16_t>(info.data, 0);
  switch (info.opcode) {
    case SdoInfoOpcode::kListRequest:
      text += ", " + ListTypeName(word);
      break;
    case SdoInfoOpcode::kObjectRequest:
    case SdoInfoOpcode::kObjectResponse:
      if (Fits(info.data, 0, 2)) text += " " + ObjectName(word);
      break;
    case SdoInfoOpcode::kEntryRequest:
    case SdoInfoOpcode::kEntryResponse:
      if (Fits(info.data, 0, 3)) text += " " + ObjectName(word, info.data[2]);
      break;
    case SdoInfoOpcode::kError:
      text += ": " + AbortText(LittleEndian<std::uint32_t>(info.data, 0));
      break;
    case SdoInfoOpcode::kListResponse:
      break;
  }
  if (info.fragments_left != 0) text += ", " + Count(info.fragments_left, "fragment") + " left";
  return text;
}

std::string CoeText(const MailboxMessage& message, const DiagnosisTexts* texts) {
  const CoeHeader coe = ParseCoeHeader(message.payload);
  const ByteSpan rest = Slice(message.payload, kCoeHeaderBytes);
  switch (coe.service) {
    case CoeService::kSdoRequest:
    case CoeService::kSdoResponse:
      return SdoText(ParseSdo(rest, message.direction), texts);
    case CoeService::kSdoInformation:
      return SdoInfoText(ParseSdoInfo(rest));
    case CoeService::kEmergency:
      return "code " + Hex(ParseEmergency(rest).error_code);
    case CoeService::kTxPdo:
    case CoeService::kRxPdo:
      return "PDO " + std::to_string(coe.number) + ", " + Count(rest.size(), "byte");
    case CoeService::kTxPdoRequest:
    case CoeService::kRxPdoRequest:
      return "PDO " + std::to_string(coe.number);
  }
  return {};
}

std::string FoeText(const MailboxMessage& message) {
  const FoeMessage foe = ParseFoe(message.payload);
  if (foe.too_short) return "too short";
  switch (foe.operation) {
    case FoeOperation::kReadRequest:
    case FoeOperation::kWriteRequest:
      return Text(foe.data);
    case FoeOperation::kData:
      return "packet " + std::to_string(foe.parameter) + ", " + Count(foe.data.size(), "byte");
    case FoeOperation::kAcknowledge:
      return "packet " + std::to_string(foe.parameter);
    case FoeOperation::kError: {
      const std::string_view meaning = FoeErrorText(foe.parameter);
      return Hex(foe.parameter, 8) + (meaning.empty() ? "" : " " + std::string(meaning)) +
             (foe.data.empty() ? "" : ", " + Text(foe.data));
    }
    case FoeOperation::kBusy:
      return std::to_string(foe.done) + " of " + std::to_string(foe.entire);
  }
  return {};
}

std::string EoeText(const MailboxMessage& message) {
  const EoeHeader eoe = ParseEoe(message.payload);
  if (eoe.too_short || eoe.type != EoeType::kFragment) return {};
  return "frame " + std::to_string(eoe.frame) + ", fragment " + std::to_string(eoe.fragment) +
         (eoe.last_fragment ? " (last), " : ", ") + Count(eoe.data.size(), "byte");
}

std::string SoeText(const MailboxMessage& message) {
  const SoeHeader soe = ParseSoe(message.payload);
  if (soe.too_short) return "too short";
  std::string text =
      soe.incomplete ? Count(soe.idn_or_fragments_left, "fragment") + " left" : IdnName(soe.idn_or_fragments_left);
  text += ", drive " + std::to_string(soe.drive);
  if (const std::string elements = ElementNames(soe.elements); !elements.empty()) text += ", " + elements;
  return text + (soe.error ? ", error" : "");
}

std::string AoeText(const MailboxMessage& message) {
  const AmsHeader ams = ParseAms(message.payload);
  if (ams.too_short) return "too short";
  return Name(ams.command) + (ams.response() ? " response" : " request") + ", invoke id " +
         std::to_string(ams.invoke_id);
}

std::string ErrorText(const MailboxMessage& message) {
  const ErrorReply reply = ParseErrorReply(message.payload);
  const std::string_view text = MailboxErrorText(reply.detail);
  return text.empty() ? "detail " + Hex(reply.detail) : std::string(text);
}

std::string BodyText(const MailboxMessage& message, const DiagnosisTexts* texts) {
  switch (message.header.protocol) {
    case Protocol::kError:
      return ErrorText(message);
    case Protocol::kAoE:
      return AoeText(message);
    case Protocol::kEoE:
      return EoeText(message);
    case Protocol::kCoE:
      return CoeText(message, texts);
    case Protocol::kFoE:
      return FoeText(message);
    case Protocol::kSoE:
      return SoeText(message);
    case Protocol::kVoE: {
      const VoeHeader voe = ParseVoe(message.payload);
      return "vendor " + Hex(voe.vendor_id, 8) + ", type " + std::to_string(voe.vendor_type);
    }
  }
  return {};
}

}  // namespace

std::string ServiceName(const MailboxMessage& message) {
  if (message.payload.empty()) return {};
  switch (message.header.protocol) {
    case Protocol::kCoE:
      return Fits(message.payload, 0, kCoeHeaderBytes) ? Name(ParseCoeHeader(message.payload).service) : "";
    case Protocol::kFoE:
      return Name(ParseFoe(message.payload).operation);
    case Protocol::kEoE:
      return Name(ParseEoe(message.payload).type);
    case Protocol::kSoE:
      return Name(ParseSoe(message.payload).operation);
    case Protocol::kError:
      return "error reply";
    case Protocol::kAoE:
    case Protocol::kVoE:
      break;
  }
  return {};
}

std::string DescribeMessage(const MailboxMessage& message, const DiagnosisTexts* texts) {
  std::string text = message.header.protocol == Protocol::kError ? "mailbox" : Name(message.header.protocol);
  if (const std::string service = ServiceName(message); !service.empty()) text += " " + service;
  if (const std::string body = BodyText(message, texts); !body.empty()) text += ": " + body;
  return text;
}

std::string DescribeRequest(const RequestSummary& request) {
  std::string text = Name(request.protocol);
  if (request.protocol == Protocol::kCoE) {
    text += " " + Name(static_cast<CoeService>(request.operation));
    if (request.index) text += " " + ObjectName(*request.index, request.subindex ? *request.subindex : -1);
  } else if (request.protocol == Protocol::kSoE && request.index) {
    text += " " + Name(static_cast<SoeOperation>(request.operation)) + " " + IdnName(*request.index);
  } else if (request.protocol == Protocol::kFoE) {
    text += " " + Name(static_cast<FoeOperation>(request.operation));
  } else if (request.protocol == Protocol::kEoE) {
    text += " " + Name(static_cast<EoeType>(request.operation));
  }
  return text;
}

}  // namespace ecaudit::cli
