#include "cli/anonymize/mailbox_cleaner.h"

#include <algorithm>
#include <cctype>
#include <string>

#include "decoder/base/bytes.h"
#include "decoder/mailbox/coe.h"
#include "decoder/mailbox/sdo.h"

namespace ecaudit::cli::anonymize {
namespace {

using mailbox::Direction;
using mailbox::Protocol;

/// Device name, hardware and software version: texts of every device.
bool IsTextObject(std::uint16_t index) {
  return index >= 0x1008 && index <= 0x100A;
}

constexpr std::uint16_t kIdentity = 0x1018;

/// The place of `part` in `whole`, to be written to.
Bytes Writable(Bytes whole, ByteSpan part) {
  if (part.empty()) return {};
  return whole.subspan(static_cast<std::size_t>(part.data() - whole.data()), part.size());
}

bool LooksLikeText(ByteSpan data) {
  std::size_t letters = 0;
  std::size_t end = data.size();
  while (end > 0 && data[end - 1] == 0) --end;
  for (const std::uint8_t byte : data.first(end)) {
    if ((byte < 0x20 || byte > 0x7E) && byte < 0xA0) return false;
    letters += std::isalpha(byte) != 0 ? 1 : 0;
  }
  return letters >= 2;
}

Bytes From(Bytes bytes, std::size_t offset) {
  return bytes.subspan(std::min(offset, bytes.size()));
}

}  // namespace

void MailboxCleaner::Clean(std::uint32_t slave, Direction direction, Bytes data, const Secrets& learned) {
  const mailbox::Header header = mailbox::ParseHeader(data);
  Bytes rest = From(data, mailbox::kHeaderBytes);
  const Bytes payload = rest.first(std::min<std::size_t>(header.length, rest.size()));
  // After a message stands what was left of earlier ones.
  Cross(rest.subspan(payload.size()));
  switch (header.protocol) {
    case Protocol::kCoE: {
      if (payload.size() < mailbox::kCoeHeaderBytes) return;
      const mailbox::CoeService service = mailbox::ParseCoeHeader(payload).service;
      const Bytes body = From(payload, mailbox::kCoeHeaderBytes);
      if (service == mailbox::CoeService::kSdoRequest || service == mailbox::CoeService::kSdoResponse) {
        CleanSdo(slave, direction, body);
        BlotSecrets(body, learned);
      } else if (service == mailbox::CoeService::kSdoInformation) {
        BlotSecrets(body, learned);
      }
      return;
    }
    case Protocol::kFoE:
      return CleanFoe(payload);
    case Protocol::kEoE:
      return CleanEoe(payload);
    case Protocol::kAoE:
      return CleanAoe(payload);
    case Protocol::kSoE:
      BlotRuns(From(payload, 4), 4, secrets_);
      ++removed_.other_messages;
      return;
    case Protocol::kVoE:
      Clear(From(payload, 6));  // vendor and type stay
      ++removed_.other_messages;
      return;
    case Protocol::kError:
      return;
  }
}

void MailboxCleaner::CleanSdo(std::uint32_t slave, Direction direction, Bytes sdo) {
  const mailbox::SdoMessage message = mailbox::ParseSdo(sdo, direction);
  const std::pair key(slave, direction);
  const Bytes data = Writable(sdo, message.data);
  if (message.kind == mailbox::SdoKind::kUploadSegment || message.kind == mailbox::SdoKind::kDownloadSegment) {
    if (data.empty() || (!text_segments_.contains(key) && !LooksLikeText(data))) return;
    BlotText(data, secrets_);
    ++removed_.sdo_values;
    if (message.last) text_segments_.erase(key);
    return;
  }
  if (!message.has_object || message.kind == mailbox::SdoKind::kAbort) return;
  const bool carries = message.kind == (direction == Direction::kIn ? mailbox::SdoKind::kUploadInitiate
                                                                    : mailbox::SdoKind::kDownloadInitiate);
  if (!carries) return;
  text_segments_.erase(key);
  if (message.index == kIdentity) {
    // Complete access has subindex 0 in two bytes in front of the four numbers.
    const std::size_t serial = message.complete_access ? (message.subindex == 0 ? 14 : 12) : 0;
    if ((message.complete_access || message.subindex == 4) && data.size() >= serial + 4) {
      Clear(data.subspan(serial, 4));
      ++removed_.sdo_values;
    }
    return;
  }
  const bool text = IsTextObject(message.index) || (!message.expedited && LooksLikeText(data));
  if (text || (!message.expedited && data.empty() && message.size)) {
    if (IsTextObject(message.index) || text) text_segments_.insert(key);
  }
  if (!text) return;
  BlotText(data, secrets_);
  ++removed_.sdo_values;
}

void MailboxCleaner::CleanFoe(Bytes payload) {
  if (payload.empty()) return;
  enum : std::uint8_t { kFoeRead = 1, kFoeWrite = 2, kFoeData = 3, kFoeError = 5, kFoeBusy = 6 };
  const std::uint8_t operation = payload[0];
  const Bytes rest = From(payload, 6);
  if (operation == kFoeRead || operation == kFoeWrite) {
    const Bytes password = From(payload, 2);
    Clear(password.first(password.size() - rest.size()));
  }
  if (operation == kFoeData) {
    Clear(rest);
  } else if (operation == kFoeRead || operation == kFoeWrite || operation == kFoeError || operation == kFoeBusy) {
    BlotText(rest, secrets_);
  } else {
    return;
  }
  ++removed_.file_parts;
}

void MailboxCleaner::CleanEoe(Bytes payload) {
  Clear(From(payload, 4));
  ++removed_.network_frames;
}

void MailboxCleaner::CleanNetId(Bytes net_id) {
  const std::string text(net_id.begin(), net_id.end());
  const auto [known, added] = net_ids_.try_emplace(text, static_cast<std::uint8_t>(net_ids_.size() + 1));
  const std::uint8_t made[6] = {192, 0, 2, known->second, 1, 1};
  std::copy(std::begin(made), std::end(made), net_id.begin());
}

void MailboxCleaner::CleanAoe(Bytes payload) {
  if (payload.size() < 32) return;
  CleanNetId(payload.first(6));
  CleanNetId(payload.subspan(8, 6));
  BlotRuns(From(payload, 32), 4, secrets_);
  ++removed_.other_messages;
}

}  // namespace ecaudit::cli::anonymize
