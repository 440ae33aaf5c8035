#include "decoder/track/doubtful_request.h"

#include "decoder/mailbox/coe.h"
#include "decoder/mailbox/header.h"
#include "decoder/mailbox/sdo.h"

namespace ecaudit::track {
namespace {

using mailbox::Direction;
using mailbox::Protocol;
using mailbox::SdoKind;

bool IsSdo(mailbox::CoeService service) {
  return service == mailbox::CoeService::kSdoRequest || service == mailbox::CoeService::kSdoResponse;
}

bool AnswersSdo(const mailbox::SdoMessage& request, const mailbox::SdoMessage& answer) {
  const bool abort = answer.kind == SdoKind::kAbort;
  if (!abort && answer.kind != request.kind) return false;
  if (!request.has_object || !answer.has_object) return true;
  return answer.index == request.index && (answer.subindex == request.subindex || request.complete_access);
}

bool AnswersCoe(ByteSpan request, ByteSpan answer) {
  const mailbox::CoeService asked = mailbox::ParseCoeHeader(request).service;
  const mailbox::CoeService told = mailbox::ParseCoeHeader(answer).service;
  if (!IsSdo(asked) || !IsSdo(told)) return asked == mailbox::CoeService::kSdoInformation && told == asked;
  return AnswersSdo(mailbox::ParseSdo(Slice(request, mailbox::kCoeHeaderBytes), Direction::kOut),
                    mailbox::ParseSdo(Slice(answer, mailbox::kCoeHeaderBytes), Direction::kIn));
}

}  // namespace

void DoubtfulRequest::Keep(const SlaveAccess& access, EscAddress start, std::uint16_t length) {
  const std::uint32_t address = access.address;
  const std::uint32_t end = std::uint32_t{start} + length;
  if (address <= start) {
    bytes_.Clear();
    const ByteSpan inside = Slice(access.written, start - address, length);
    bytes_.Append(Slice(inside, 0, mailbox::kHeaderBytes + mailbox::ParseHeader(inside).length));
  } else {
    // Bytes after a gap in the mailbox do not belong to the message: masters skip from its end to the last byte of the
    // mailbox.
    if (!sent_.seen() || whole_) return;
    const std::size_t offset = address - start;
    const ByteSpan inside = Slice(access.written, 0, end - address);
    if (offset <= bytes_.size() && offset + inside.size() > bytes_.size()) {
      bytes_.Append(inside.subspan(bytes_.size() - offset));
    }
  }
  sent_ = access.sent;
  whole_ = address + static_cast<std::uint32_t>(access.written.size()) >= end && !bytes_.full();
}

void DoubtfulRequest::Forget() {
  sent_ = {};
  whole_ = false;
  bytes_.Clear();
}

bool DoubtfulRequest::IsAnsweredBy(ByteSpan answer) const {
  const mailbox::MessageView request = mailbox::ParseMessage(bytes_, 0, Direction::kOut);
  const mailbox::MessageView told = mailbox::ParseMessage(answer, 0, Direction::kIn);
  if (request.problem != mailbox::Problem::kNone || told.problem != mailbox::Problem::kNone) return false;
  if (told.header.protocol == Protocol::kError) return true;
  if (told.header.protocol != request.header.protocol) return false;
  switch (told.header.protocol) {
    case Protocol::kCoE:
      return AnswersCoe(request.payload, told.payload);
    case Protocol::kAoE:
    case Protocol::kFoE:
    case Protocol::kSoE:
      return true;
    case Protocol::kEoE:
    case Protocol::kVoE:
    case Protocol::kError:
      break;
  }
  return false;
}

}  // namespace ecaudit::track
