#include "cli/stream/datagram_text.h"

#include <algorithm>
#include <span>

#include "cli/stream/json_line.h"
#include "cli/stream/message_text.h"
#include "decoder/base/text.h"
#include "decoder/esc/datagram_text.h"
#include "decoder/esc/register_map.h"
#include "decoder/esc/register_text.h"

namespace ecaudit::cli {
namespace {

constexpr std::size_t kShownDatagramBytes = 16;  // of data that no register describes

/// "-> CoE SDO request: upload 1018h:1"; "" where no mailbox is accessed, or nothing is in it.
std::string MessageOf(const DatagramRow& row) {
  const wire::DatagramView& d = row.datagram;
  if (!row.mailbox || (row.returned() && d.wkc() == 0 && *row.mailbox == mailbox::Direction::kIn)) return {};
  mailbox::MailboxMessage message;
  message.direction = *row.mailbox;
  message.header = mailbox::ParseHeader(d.data());
  message.payload = Slice(d.data(), mailbox::kHeaderBytes, message.header.length);
  if (message.payload.empty()) return {};
  const bool out = message.direction == mailbox::Direction::kOut;
  return std::string(out ? "mailbox -> " : "mailbox <- ") + DescribeMessage(message, row.diagnosis_texts);
}

std::string ContentText(const DatagramRow& row) {
  const wire::DatagramView& d = row.datagram;
  if (!wire::IsDefined(d.command_byte())) return "command " + std::to_string(d.command_byte()) + " does not exist";
  // Where the direction is unknown, a working counter shows that slaves were passed.
  std::string text = esc::DescribeDatagram(d, row.returned() || (!row.outbound() && d.wkc() != 0));
  const bool raw = wire::IsLogical(d.command()) || (HasEscAddress(d) && d.ado() >= esc::kProcessRam);
  const bool has_data = wire::Writes(d.command()) || !row.outbound();
  if (const std::string message = has_data ? MessageOf(row) : std::string(); !message.empty()) {
    text = message;
  } else if (raw && has_data && !d.data().empty()) {
    text += ": " + HexBytes(Slice(d.data(), 0, kShownDatagramBytes));
    if (d.data().size() > kShownDatagramBytes) text += "...";
  }
  if (d.circulating()) text += " (circulating)";
  if (d.irq() != 0) text += " [events: " + esc::DescribeEvents(d.irq()) + "]";
  return text;
}

}  // namespace

std::string_view DirectionName(bus::Direction direction) {
  switch (direction) {
    case bus::Direction::kOutbound:
      return "outbound";
    case bus::Direction::kReturned:
      return "returned";
    case bus::Direction::kByPair:
    case bus::Direction::kForeign:
      break;
  }
  return "unknown";
}

bool HasEscAddress(const wire::DatagramView& d) {
  return wire::IsDefined(d.command_byte()) && d.command() != wire::Command::NOP && !wire::IsLogical(d.command());
}

void AppendCommand(std::string& out, const wire::DatagramView& d) {
  if (wire::IsDefined(d.command_byte())) {
    out += wire::Name(d.command());
  } else {
    AppendNumber(out, d.command_byte());
  }
}

const std::string& ContentTexts::Find(const DatagramRow& row) {
  const ByteSpan bytes = row.datagram.bytes();
  Place& place = places_[(std::size_t{row.datagram.ordinal()} * 2 + (row.outbound() ? 1 : 0)) % kPlaces];
  // All but the index, which every frame has another one of.
  const auto kept = [](auto const& all) { return std::span(all).subspan(2); };
  const bool same = place.bytes.size() == bytes.size() && place.direction == row.direction &&
                    place.mailbox == row.mailbox && place.bytes[0] == bytes[0] &&
                    std::ranges::equal(kept(place.bytes), kept(bytes));
  if (same) return place.text;
  place.bytes.assign(bytes.begin(), bytes.end());
  place.direction = row.direction;
  place.mailbox = row.mailbox;
  place.text = ContentText(row);
  return place.text;
}

std::size_t LinesOf(const wire::FrameView& frame) {
  return frame.size() + (IsUnsound(frame) ? 1 : 0);
}

bool IsUnsound(const wire::FrameView& frame) {
  return frame.kind() != wire::FrameKind::kOther && frame.kind() != wire::FrameKind::kEtherCat;
}

std::string ProblemText(const wire::FrameView& frame) {
  switch (frame.kind()) {
    case wire::FrameKind::kOther:
    case wire::FrameKind::kEtherCat:
      break;
    case wire::FrameKind::kMalformed:
      return "malformed: " + std::string(wire::Describe(frame.problem()));
    case wire::FrameKind::kCut:
      return "cut by the snap length: the rest is not in the capture";
    case wire::FrameKind::kDamagedOnWire:
      return "damaged on the wire: the probe saw a CRC or alignment error";
  }
  return {};
}

}  // namespace ecaudit::cli
