#include "samples/builder/frame_builder.h"

#include <algorithm>

namespace ecaudit::samples {
namespace {

constexpr std::uint16_t kEtherTypeEtherCat = 0x88A4;
constexpr std::uint16_t kEtherTypeIpv4 = 0x0800;
constexpr std::uint16_t kEtherTypeVlan = 0x8100;
constexpr std::uint16_t kEtherTypeVlanOuter = 0x88A8;
constexpr std::uint16_t kUdpPort = 34980;

std::uint16_t InternetChecksum(ByteView bytes) {
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
    sum += (static_cast<std::uint32_t>(bytes[i]) << 8U) | bytes[i + 1];
  }
  while (sum > 0xFFFFU) sum = (sum & 0xFFFFU) + (sum >> 16U);
  return static_cast<std::uint16_t>(~sum & 0xFFFFU);
}

// UDP checksum 0 means "none" with IPv4, as EtherCAT masters send it: slaves change the data on the fly.
Bytes UdpPacket(ByteView payload) {
  Bytes ip;
  AppendBe<std::uint8_t>(ip, 0x45);
  AppendBe<std::uint8_t>(ip, 0);
  AppendBe<std::uint16_t>(ip, static_cast<std::uint16_t>(28 + payload.size()));
  AppendBe<std::uint16_t>(ip, 0);
  AppendBe<std::uint16_t>(ip, 0);
  AppendBe<std::uint8_t>(ip, 64);
  AppendBe<std::uint8_t>(ip, 17);
  AppendBe<std::uint16_t>(ip, 0);
  AppendBytes(ip, Bytes{192, 168, 1, 1});
  AppendBytes(ip, Bytes{255, 255, 255, 255});
  const std::uint16_t checksum = InternetChecksum(ip);
  ip[10] = static_cast<std::uint8_t>(checksum >> 8U);
  ip[11] = static_cast<std::uint8_t>(checksum & 0xFFU);
  AppendBe<std::uint16_t>(ip, kUdpPort);
  AppendBe<std::uint16_t>(ip, kUdpPort);
  AppendBe<std::uint16_t>(ip, static_cast<std::uint16_t>(8 + payload.size()));
  AppendBe<std::uint16_t>(ip, 0);
  AppendBytes(ip, payload);
  return ip;
}

Bytes EslRecordBytes(const EslTag& tag) {
  // One flag bit a port, in the order of Wireshark's ESL dissector.
  constexpr std::array<std::uint16_t, 12> kPortBits{0x0080, 0x0040, 0x0020, 0x0010, 0x0008, 0x0004,
                                                    0x0002, 0x0001, 0x8000, 0x4000, 0x0400, 0x0200};
  std::uint16_t flags = kPortBits[tag.port % kPortBits.size()];
  if (tag.alignment_error) flags |= 0x0800U;
  if (tag.crc_error) flags |= 0x1000U;
  if (tag.has_time) flags |= 0x2000U;
  Bytes record{0x01, 0x01, 0x05, 0x10, 0x00, 0x00};
  AppendLe(record, flags);
  AppendLe(record, tag.has_time ? tag.time_ns : std::uint64_t{0});
  return record;
}

void AppendLinkHeader(Bytes& out, const EtherCatFrame& frame, const Encapsulation& around) {
  const std::uint16_t inner = around.udp ? kEtherTypeIpv4 : kEtherTypeEtherCat;
  const std::uint16_t first =
      around.vlan_tags.empty() ? inner : (around.vlan_tags.size() > 1 ? kEtherTypeVlanOuter : kEtherTypeVlan);
  const std::uint8_t packet_type = around.cooked_outgoing ? 4 : 1;
  switch (around.link) {
    case Link::kEthernet:
      AppendBytes(out, frame.destination);
      AppendBytes(out, frame.source);
      AppendBe(out, first);
      break;
    case Link::kCooked:
      AppendBe<std::uint16_t>(out, packet_type);
      AppendBe<std::uint16_t>(out, 1);  // ARPHRD_ETHER
      AppendBe<std::uint16_t>(out, 6);
      AppendBytes(out, frame.source);
      AppendBe<std::uint16_t>(out, 0);
      AppendBe(out, first);
      break;
    case Link::kCooked2:
      AppendBe(out, first);
      AppendBe<std::uint16_t>(out, 0);
      AppendBe(out, around.cooked_interface);
      AppendBe<std::uint16_t>(out, 1);
      AppendBe(out, packet_type);
      AppendBe<std::uint8_t>(out, 6);
      AppendBytes(out, frame.source);
      AppendBe<std::uint16_t>(out, 0);
      break;
  }
  for (std::size_t i = 0; i < around.vlan_tags.size(); ++i) {
    AppendBe(out, around.vlan_tags[i]);
    AppendBe(out, i + 1 < around.vlan_tags.size() ? kEtherTypeVlan : inner);
  }
}

std::size_t BytesOf(const std::vector<Datagram>& datagrams) {
  constexpr std::size_t kAroundData = 12;
  std::size_t bytes = 0;
  for (const Datagram& d : datagrams) bytes += kAroundData + d.data.size();
  return bytes;
}

void AppendDatagrams(Bytes& out, const std::vector<Datagram>& datagrams) {
  for (std::size_t i = 0; i < datagrams.size(); ++i) {
    const Datagram& d = datagrams[i];
    auto length = static_cast<std::uint16_t>(d.data.size() & 0x07FFU);
    if (d.circulating) length |= 0x4000U;
    if (i + 1 < datagrams.size()) length |= 0x8000U;
    out.push_back(static_cast<std::uint8_t>(d.command));
    out.push_back(d.index);
    AppendLe(out, d.adp);
    AppendLe(out, d.ado);
    AppendLe(out, length);
    AppendLe(out, d.irq);
    AppendBytes(out, d.data);
    AppendLe(out, d.wkc);
  }
}

}  // namespace

std::uint16_t LinkTypeNumber(Link link) {
  switch (link) {
    case Link::kEthernet:
      return 1;
    case Link::kCooked:
      return 113;
    case Link::kCooked2:
      return 276;
  }
  return 1;
}

Bytes EncodeDatagrams(const std::vector<Datagram>& datagrams) {
  Bytes out;
  out.reserve(BytesOf(datagrams));
  AppendDatagrams(out, datagrams);
  return out;
}

Bytes EncodePayload(const std::vector<Datagram>& datagrams, std::size_t padding) {
  constexpr std::size_t kHeader = 2;
  const std::size_t bytes = BytesOf(datagrams) + padding;
  Bytes out;
  out.reserve(kHeader + bytes);
  AppendLe(out, static_cast<std::uint16_t>((bytes & 0x07FFU) | 0x1000U));
  AppendDatagrams(out, datagrams);
  out.resize(kHeader + bytes, 0);
  return out;
}

Bytes EncodePacket(const EtherCatFrame& frame, ByteView payload, const Encapsulation& around) {
  constexpr std::size_t kAroundPayload = 96;
  Bytes out;
  out.reserve(std::max(payload.size() + kAroundPayload, around.minimum_bytes));
  AppendLinkHeader(out, frame, around);
  if (around.udp) {
    AppendBytes(out, UdpPacket(payload));
  } else {
    AppendBytes(out, payload);
  }
  if (out.size() < around.minimum_bytes) out.resize(around.minimum_bytes, 0);
  if (around.esl) {
    const Bytes record = EslRecordBytes(*around.esl);
    out.insert(around.esl->in_front ? out.begin() : out.end(), record.begin(), record.end());
  }
  return out;
}

Bytes EncodePacket(const EtherCatFrame& frame, const Encapsulation& around) {
  return EncodePacket(frame, EncodePayload(frame.datagrams, frame.padding), around);
}

MacAddress AfterSlave(MacAddress source) {
  source[0] |= 0x02U;
  return source;
}

}  // namespace ecaudit::samples
