#include "decoder/mailbox/sdo_info.h"

#include "decoder/base/names.h"

namespace ecaudit::mailbox {
namespace {

constexpr std::size_t kKeptIndices = 512;

SdoInfo::Kind InfoKindOf(SdoInfoOpcode opcode) {
  switch (opcode) {
    case SdoInfoOpcode::kListRequest:
    case SdoInfoOpcode::kListResponse:
      return SdoInfo::Kind::kList;
    case SdoInfoOpcode::kObjectRequest:
    case SdoInfoOpcode::kObjectResponse:
      return SdoInfo::Kind::kObject;
    case SdoInfoOpcode::kEntryRequest:
    case SdoInfoOpcode::kEntryResponse:
      return SdoInfo::Kind::kEntry;
    case SdoInfoOpcode::kError:
      break;
  }
  return SdoInfo::Kind::kUnknown;
}

std::string_view TextOf(ByteSpan bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};  // bytes as characters, nothing else
}

/// "PREOP SAFEOP" for bits 0 to 2.
std::string States(unsigned bits) {
  std::string text;
  for (const auto& [bit, name] : {std::pair{1U, "PREOP"}, {2U, "SAFEOP"}, {4U, "OP"}}) {
    if ((bits & bit) == 0) continue;
    if (!text.empty()) text += ' ';
    text += name;
  }
  return text;
}

}  // namespace

std::string Name(SdoInfoOpcode opcode) {
  static constexpr Named<SdoInfoOpcode> kNames[] = {
      {SdoInfoOpcode::kListRequest, "object list request"},
      {SdoInfoOpcode::kListResponse, "object list response"},
      {SdoInfoOpcode::kObjectRequest, "object description request"},
      {SdoInfoOpcode::kObjectResponse, "object description response"},
      {SdoInfoOpcode::kEntryRequest, "entry description request"},
      {SdoInfoOpcode::kEntryResponse, "entry description response"},
      {SdoInfoOpcode::kError, "SDO information error"},
  };
  const std::string_view name = NameIn(kNames, opcode);
  return !name.empty() ? std::string(name) : "opcode " + std::to_string(static_cast<unsigned>(opcode));
}

std::string ListTypeName(std::uint16_t list_type) {
  switch (list_type) {
    case 0:
      return "lengths of the lists";
    case 1:
      return "all objects";
    case 2:
      return "objects mappable in RxPDOs";
    case 3:
      return "objects mappable in TxPDOs";
    case 4:
      return "objects to be stored for a device replacement";
    case 5:
      return "start-up parameters";
    default:
      return "list " + std::to_string(list_type);
  }
}

std::string AccessText(std::uint16_t access) {
  const unsigned read = access & 0x07U;
  const unsigned write = access >> 3U & 0x07U;
  std::string text = read != 0 && write != 0 ? "rw" : read != 0 ? "ro" : write != 0 ? "wo" : "none";
  std::string states;
  if (read != 0 && read != 7) states = "read " + States(read);
  if (write != 0 && write != 7) states += (states.empty() ? "write " : ", write ") + States(write);
  if (!states.empty()) text += " (" + states + ")";
  for (const auto& [bit, name] : {std::pair{6U, " rxpdo"}, {7U, " txpdo"}, {8U, " backup"}, {9U, " settings"}}) {
    if ((access >> bit & 1U) != 0) text += name;
  }
  return text;
}

void SdoInfoTracker::OnMessage(const MailboxMessage& message, EventSink& sink) {
  const SdoInfoHeader header = ParseSdoInfo(Slice(message.payload, kCoeHeaderBytes));
  if (header.too_short) return;
  if (message.direction == Direction::kOut) {
    OnRequest(message, header, sink);
  } else {
    OnResponse(message, header, sink);
  }
}

void SdoInfoTracker::OnRequest(const MailboxMessage& message, const SdoInfoHeader& header, EventSink& sink) {
  if (open_) Close(SdoInfo::Outcome::kSuperseded, sink);
  info_ = SdoInfo();
  info_.slave = slave_;
  info_.kind = InfoKindOf(header.opcode);
  info_.request = message.frame();
  if (info_.kind == SdoInfo::Kind::kList) {
    info_.list_type = LittleEndian<std::uint16_t>(header.data, 0);
  } else {
    info_.index = LittleEndian<std::uint16_t>(header.data, 0);
    info_.subindex = info_.kind == SdoInfo::Kind::kEntry ? LittleEndian<std::uint8_t>(header.data, 2) : std::uint8_t{0};
  }
  data_.Clear();
  open_ = true;
  assumed_ = message.assumed;
}

void SdoInfoTracker::OnResponse(const MailboxMessage& message, const SdoInfoHeader& header, EventSink& sink) {
  const SdoInfo::Kind kind = InfoKindOf(header.opcode);
  const bool error = header.opcode == SdoInfoOpcode::kError;
  if (open_ && !error && info_.kind != kind) {
    if (info_.request.seen()) return;  // answers something else: the message itself is on record
    Close(SdoInfo::Outcome::kGap, sink);
  }
  if (!open_) {
    info_ = SdoInfo();
    info_.slave = slave_;
    info_.kind = kind;
    data_.Clear();
    open_ = true;
    assumed_ = false;
  }
  info_.response = message.frame();
  if (error) {
    info_.malformed = header.data.size() < 4;
    const ByteSpan code = info_.malformed && header.data.empty() ? message.behind : header.data;
    info_.abort_code = LittleEndian<std::uint32_t>(code, 0);
    Close(SdoInfo::Outcome::kError, sink);
    return;
  }
  if (info_.fragments != 0 && header.fragments_left + 1U != fragments_left_) info_.fragment_error = true;
  if (info_.fragments == 0 && !info_.request.seen() && kind == SdoInfo::Kind::kList &&
      !(header.data.size() >= 2 && LittleEndian<std::uint16_t>(header.data, 0) <= 5)) {
    info_.fragment_error = true;  // the first fragment, which names the list, is not in the capture
  }
  ++info_.fragments;
  fragments_left_ = header.fragments_left;
  data_.Append(header.data);
  if (header.incomplete && header.fragments_left != 0) return;
  if (header.incomplete || header.fragments_left != 0) info_.fragment_error = true;
  switch (kind) {
    case SdoInfo::Kind::kList:
      DecodeList();
      break;
    case SdoInfo::Kind::kObject:
      DecodeObject();
      break;
    case SdoInfo::Kind::kEntry:
      DecodeEntry();
      break;
    case SdoInfo::Kind::kUnknown:
      break;
  }
  Close(SdoInfo::Outcome::kCompleted, sink);
}

void SdoInfoTracker::DecodeList() {
  info_.malformed = data_.size() < 2;
  info_.list_type = LittleEndian<std::uint16_t>(data_, 0);
  indices_.clear();
  for (std::size_t i = 2; i + 1 < data_.size(); i += 2) indices_.push_back(LittleEndian<std::uint16_t>(data_, i));
  info_.indices = indices_;
}

void SdoInfoTracker::DecodeObject() {
  const ByteSpan data = data_;
  info_.malformed = data.size() < 6;
  info_.index = LittleEndian<std::uint16_t>(data, 0);
  info_.data_type = LittleEndian<std::uint16_t>(data, 2);
  info_.max_subindex = LittleEndian<std::uint8_t>(data, 4);
  info_.object_code = LittleEndian<std::uint8_t>(data, 5);
  info_.name = TextOf(Slice(data, 6));
}

void SdoInfoTracker::DecodeEntry() {
  const ByteSpan data = data_;
  info_.malformed = data.size() < 10;
  info_.index = LittleEndian<std::uint16_t>(data, 0);
  info_.subindex = LittleEndian<std::uint8_t>(data, 2);
  info_.value_info = LittleEndian<std::uint8_t>(data, 3);
  info_.data_type = LittleEndian<std::uint16_t>(data, 4);
  info_.bit_length = LittleEndian<std::uint16_t>(data, 6);
  info_.access = LittleEndian<std::uint16_t>(data, 8);
  std::size_t at = 10;
  const std::size_t value_bytes = (info_.bit_length + std::size_t{7}) / 8;
  const auto take = [&](unsigned bit, std::size_t bytes) -> ByteSpan {
    if ((info_.value_info >> bit & 1U) == 0) return {};
    const ByteSpan part = Slice(data, at, bytes);
    if (part.size() < bytes) info_.malformed = true;
    at += bytes;
    return part;
  };
  if (const ByteSpan unit = take(3, 2); unit.size() == 2) info_.unit = LittleEndian<std::uint16_t>(unit, 0);
  info_.default_value = take(4, value_bytes);
  info_.minimum = take(5, value_bytes);
  info_.maximum = take(6, value_bytes);
  info_.name = TextOf(Slice(data, at));
}

void SdoInfoTracker::OnMailboxError(std::uint16_t detail, const FrameRef& frame, EventSink& sink) {
  if (!open_) return;
  info_.mailbox_error = detail;
  info_.response = frame;
  Close(SdoInfo::Outcome::kMailboxError, sink);
}

void SdoInfoTracker::End(TransferEnd why, EventSink& sink) {
  if (!open_) return;
  Close(why == TransferEnd::kCaptureEnd ? SdoInfo::Outcome::kCaptureEnd
        : why == TransferEnd::kReset    ? SdoInfo::Outcome::kReset
                                        : SdoInfo::Outcome::kGap,
        sink);
}

void SdoInfoTracker::Close(SdoInfo::Outcome outcome, EventSink& sink) {
  open_ = false;
  const bool answered = outcome == SdoInfo::Outcome::kCompleted || outcome == SdoInfo::Outcome::kError ||
                        outcome == SdoInfo::Outcome::kMailboxError;
  info_.outcome = assumed_ && !answered ? SdoInfo::Outcome::kNotCaptured : outcome;
  if (info_.request.has_time && info_.response.has_time) info_.duration = info_.response.time - info_.request.time;
  sink.Publish(info_);
  info_ = SdoInfo();
  data_.Clear();
  if (indices_.capacity() > kKeptIndices) indices_ = {};
}

}  // namespace ecaudit::mailbox
