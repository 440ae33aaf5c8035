#include "cli/stream/datagram_lines.h"

#include <algorithm>
#include <span>
#include <string_view>

#include "cli/stream/columns.h"
#include "cli/stream/json_line.h"
#include "cli/stream/message_text.h"
#include "cli/stream/short_text.h"
#include "decoder/base/text.h"
#include "decoder/esc/datagram_text.h"
#include "decoder/esc/register_map.h"
#include "decoder/esc/register_text.h"

namespace ecaudit::cli {
namespace {

constexpr std::size_t kShownDatagramBytes = 16;  // of data that no register describes

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

/// "FPRD"; a command that does not exist by its number.
void AppendCommand(std::string& out, const wire::DatagramView& d) {
  if (wire::IsDefined(d.command_byte())) {
    out += wire::Name(d.command());
  } else {
    AppendNumber(out, d.command_byte());
  }
}

std::string SlaveText(const DatagramRow& row) {
  if (row.slave) return std::to_string(*row.slave);
  const wire::DatagramView& d = row.datagram;
  if (!HasEscAddress(d)) return "-";
  return wire::IsBroadcast(d.command()) ? "all" : "?";
}

std::string AddressText(const wire::DatagramView& d) {
  if (wire::IsLogical(d.command())) return Hex(d.logical_address(), 8);
  return Hex(d.adp()) + ":" + Hex(d.ado());
}

std::string_view DatagramArrow(const DatagramRow& row) {
  return row.outbound() ? "->" : row.returned() ? "<-" : "--";
}

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

/// A slave was addressed and no slave answered.
bool Unanswered(const DatagramRow& row) {
  return row.returned() && row.datagram.wkc() == 0 && row.datagram.command() != wire::Command::NOP;
}

}  // namespace

const std::string& RegisterNames::Find(EscAddress address, std::uint16_t length) {
  const std::uint32_t key = static_cast<std::uint32_t>(address) << 16U | length;
  const auto found = names_.find(key);
  if (found != names_.end()) return found->second;
  if (names_.size() >= kMaxEntries) names_.clear();
  const std::string name = esc::AccessName(address, length);
  std::string json;
  if (name.empty()) {
    json = "null";
  } else {
    AppendJsonString(json, name);
  }
  return names_.emplace(key, std::move(json)).first->second;
}

const DatagramFields::Place& DatagramFields::Find(const DatagramRow& row) {
  constexpr std::uint64_t kIndex = 0xFF00;
  const wire::DatagramView& d = row.datagram;
  const Key key{.header = LoadLittleEndian<std::uint64_t>(d.bytes().data()) & ~kIndex,
                .irq = d.irq(),
                .wkc = d.wkc(),
                .slave = row.slave,
                .direction = row.direction};
  Place& place = places_[(std::size_t{d.ordinal()} * 2 + (row.outbound() ? 1 : 0)) % kPlaces];
  if (place.ahead.empty() || place.key != key) {
    place.key = key;
    Write(row, place);
  }
  return place;
}

void DatagramFields::Write(const DatagramRow& row, Place& place) {
  const wire::DatagramView& d = row.datagram;
  // Keys and separators come to 163 characters, numbers and words to 90 at most.
  ShortText<320> fields;
  fields.Put(",\"direction\":\"");
  fields.Put(DirectionName(row.direction));
  fields.Put("\",\"command\":\"");
  if (wire::IsDefined(d.command_byte())) {
    fields.Put(wire::Name(d.command()));
  } else {
    fields.Number(d.command_byte());
  }
  fields.Put("\",\"index\":");
  place.ahead.clear();
  fields.AppendTo(place.ahead);
  ShortText<320> behind;
  behind.Put(",\"adp\":");
  behind.Number(d.adp());
  behind.Put(",\"ado\":");
  behind.Number(d.ado());
  if (wire::IsLogical(d.command())) {
    behind.Put(",\"logical\":");
    behind.Number(d.logical_address());
  }
  behind.Put(",\"length\":");
  behind.Number(d.length());
  behind.Put(",\"irq\":");
  behind.Number(d.irq());
  behind.Put(",\"wkc\":");
  behind.Number(d.wkc());
  behind.Put(",\"more\":");
  behind.Bool(d.more());
  behind.Put(",\"circulating\":");
  behind.Bool(d.circulating());
  behind.Put(",\"slave\":");
  if (row.slave) {
    behind.Number(*row.slave);
  } else {
    behind.Put("null");
  }
  behind.Put(",\"register\":");
  place.behind.clear();
  behind.AppendTo(place.behind);
  if (HasEscAddress(d)) {
    place.behind += names_.Find(d.ado(), d.length());
  } else {
    place.behind += "null";
  }
  place.behind += ",\"data\":\"";
}

void AppendDatagramJson(std::string& out, const DatagramRow& row, DatagramFields& fields) {
  const wire::DatagramView& d = row.datagram;
  ShortText<128> place;
  place.Put("{\"frame\":");
  place.Number(row.frame.ref().number);
  place.Put(",\"datagram\":");
  place.Number(d.ordinal());
  place.Put(",\"time_s\":");
  if (!row.since_start_ns) place.Put("null");
  place.AppendTo(out);
  if (row.since_start_ns) out += row.seconds;
  if (const std::string time = row.time.Iso(row.frame.ref()); !time.empty()) {
    out += ",\"time\":";
    AppendJsonString(out, time);
  }
  const DatagramFields::Place& kept = fields.Find(row);
  out += kept.ahead;
  AppendNumber(out, d.index());
  out += kept.behind;
  AppendHexBytes(out, d.data());
  out += "\"}";
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

std::string DatagramTextHeader(const TimeColumn& time, bool color) {
  std::string out;
  Columns columns(out, color);
  columns.Right("frame", 10, report::Style::kBold).Right(time.title(), time.width(), report::Style::kBold);
  columns.Left("", 2).Left("cmd", 4, report::Style::kBold).Right("slave", 5, report::Style::kBold);
  columns.Left("address", 13, report::Style::kBold).Right("bytes", 5, report::Style::kBold);
  columns.Right("wkc", 5, report::Style::kBold).Last("content", report::Style::kBold);
  return out;
}

void AppendDatagramText(std::string& out, const DatagramRow& row, ContentTexts& contents, bool color) {
  const wire::DatagramView& d = row.datagram;
  std::string frame = std::to_string(row.frame.ref().number);
  if (row.frame.size() > 1) frame += "." + std::to_string(d.ordinal());
  std::string command;
  AppendCommand(command, d);
  const report::Style faint = row.outbound() ? report::Style::kPlain : report::Style::kFaint;
  Columns columns(out, color);
  columns.Right(frame, 10)
      .Right(row.time.Text(row.frame.ref(), row.since_start_ns), row.time.width(), report::Style::kFaint)
      .Left(DatagramArrow(row), 2, faint);
  columns.Left(command, 4, report::Style::kInfo).Right(SlaveText(row), 5).Left(AddressText(d), 13);
  columns.Right(std::to_string(d.length()), 5);
  columns.Right(row.outbound() && d.wkc() == 0 ? "" : std::to_string(d.wkc()), 5,
                Unanswered(row) ? report::Style::kWarning : report::Style::kPlain);
  columns.Last(contents.Find(row));
}

std::size_t LinesOf(const wire::FrameView& frame) {
  const bool problem = frame.kind() != wire::FrameKind::kOther && frame.kind() != wire::FrameKind::kEtherCat;
  return frame.size() + (problem ? 1 : 0);
}

std::optional<std::string> FrameProblemText(const wire::FrameView& frame, std::optional<std::int64_t> since_start_ns,
                                            const TimeColumn& time, bool color) {
  std::string problem;
  switch (frame.kind()) {
    case wire::FrameKind::kOther:
    case wire::FrameKind::kEtherCat:
      return std::nullopt;
    case wire::FrameKind::kMalformed:
      problem = "malformed: " + std::string(wire::Describe(frame.problem()));
      break;
    case wire::FrameKind::kCut:
      problem = "cut by the snap length: the rest is not in the capture";
      break;
    case wire::FrameKind::kDamagedOnWire:
      problem = "damaged on the wire: the probe saw a CRC or alignment error";
      break;
  }
  std::string out;
  Columns columns(out, color);
  columns.Right(std::to_string(frame.ref().number), 10)
      .Right(time.Text(frame.ref(), since_start_ns), time.width(), report::Style::kFaint)
      .Left("!!", 2, report::Style::kError)
      .Last(problem, report::Style::kError);
  return out;
}

}  // namespace ecaudit::cli
