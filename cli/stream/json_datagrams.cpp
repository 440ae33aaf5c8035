#include "cli/stream/json_datagrams.h"

#include "cli/stream/datagram_text.h"
#include "cli/stream/json_line.h"
#include "cli/stream/short_text.h"
#include "decoder/base/text.h"
#include "decoder/esc/register_map.h"

namespace ecaudit::cli {

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

void DatagramObjects::Append(std::string& out, const DatagramRow& row) {
  const wire::DatagramView& d = row.datagram;
  ShortText<128> place;
  place.Put("{\"frame\":");
  place.Number(row.frame.ref().number);
  place.Put(",\"datagram\":");
  place.Number(d.ordinal());
  place.Put(",\"time_s\":");
  if (!row.since_start_ns) place.Put("null");
  place.AppendTo(out);
  if (row.since_start_ns) {
    if (row.frame.ref().number != frame_) {
      frame_ = row.frame.ref().number;
      seconds_.clear();
      AppendSeconds(seconds_, *row.since_start_ns);
    }
    out += seconds_;
  }
  if (const std::string time = row.time.Iso(row.frame.ref()); !time.empty()) {
    out += ",\"time\":";
    AppendJsonString(out, time);
  }
  const DatagramFields::Place& kept = fields_.Find(row);
  out += kept.ahead;
  AppendNumber(out, d.index());
  out += kept.behind;
  AppendHexBytes(out, d.data());
  out += "\"}";
}

}  // namespace ecaudit::cli
