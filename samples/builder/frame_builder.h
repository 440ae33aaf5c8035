/// EtherCAT frames as plain data, and their encoding in every encapsulation a capture may hold.
///
///   | Ethernet 14 | VLAN 4 each | IPv4 + UDP 28 | EtherCAT header 2 | datagrams | padding |    (ESL record 16 before
///   or behind) | cooked 16 (v1) or 20 (v2) | EtherCAT header 2 | datagrams | padding |
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "samples/builder/wire_bytes.h"

namespace ecaudit::samples {

using MacAddress = std::array<std::uint8_t, 6>;

/// Datagram commands, ETG.1000.4.
enum class Cmd : std::uint8_t {
  NOP,
  APRD,
  APWR,
  APRW,
  FPRD,
  FPWR,
  FPRW,
  BRD,
  BWR,
  BRW,
  LRD,
  LWR,
  LRW,
  ARMW,
  FRMW,
};

[[nodiscard]] constexpr bool CmdReads(Cmd c) {
  return c != Cmd::NOP && c != Cmd::APWR && c != Cmd::FPWR && c != Cmd::BWR && c != Cmd::LWR;
}
[[nodiscard]] constexpr bool CmdWrites(Cmd c) {
  return c != Cmd::NOP && c != Cmd::APRD && c != Cmd::FPRD && c != Cmd::BRD && c != Cmd::LRD;
}
[[nodiscard]] constexpr bool CmdIsLogical(Cmd c) {
  return c == Cmd::LRD || c == Cmd::LWR || c == Cmd::LRW;
}
/// Every slave adds one to the first address half of these.
[[nodiscard]] constexpr bool CmdCountsSlaves(Cmd c) {
  return c == Cmd::APRD || c == Cmd::APWR || c == Cmd::APRW || c == Cmd::ARMW || c == Cmd::BRD || c == Cmd::BWR ||
         c == Cmd::BRW;
}

struct Datagram {
  Cmd command = Cmd::NOP;
  std::uint8_t index = 0;
  std::uint16_t adp = 0;  ///< position, station address, or the low half of a logical address
  std::uint16_t ado = 0;  ///< ESC address, or the high half of a logical address
  Bytes data{};           ///< at most 1,486 bytes
  std::uint16_t wkc = 0;
  std::uint16_t irq = 0;
  bool circulating = false;

  [[nodiscard]] std::uint32_t logical() const { return adp | (static_cast<std::uint32_t>(ado) << 16U); }
  void set_logical(std::uint32_t address) {
    adp = static_cast<std::uint16_t>(address & 0xFFFFU);
    ado = static_cast<std::uint16_t>(address >> 16U);
  }
};

struct EtherCatFrame {
  MacAddress destination{0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF};
  MacAddress source{0x01, 0x01, 0x01, 0x01, 0x01, 0x01};
  std::vector<Datagram> datagrams{};
  std::size_t padding = 0;  ///< zeros behind the datagrams that the EtherCAT length covers
};

/// 16 bytes that an ET2000 or CU2508 probe adds (esc-reference 1.5).
struct EslTag {
  bool in_front = false;  ///< before the Ethernet header instead of behind the frame
  std::uint8_t port = 0;  ///< 0-11
  std::uint64_t time_ns = 0;
  bool has_time = true;
  bool crc_error = false;
  bool alignment_error = false;
};

enum class Link : std::uint8_t { kEthernet, kCooked, kCooked2 };
/// The link type number of pcap and pcapng.
[[nodiscard]] std::uint16_t LinkTypeNumber(Link link);

/// Everything around the datagrams.
struct Encapsulation {
  Link link = Link::kEthernet;
  std::vector<std::uint16_t> vlan_tags{};  ///< tag control words, outer first; two or more: outer EtherType 0x88A8
  bool udp = false;                        ///< IPv4 and UDP port 34980
  bool cooked_outgoing = false;            ///< packet type 4 "sent by us" instead of 1 "broadcast"; cooked links only
  std::uint32_t cooked_interface = 2;      ///< interface index of cooked v2
  std::size_t minimum_bytes = 0;           ///< zero padding up to this size; 60 for what a slave returned
  std::optional<EslTag> esl{};
};

/// Datagrams one behind the other; the more flag is set on all but the last.
[[nodiscard]] Bytes EncodeDatagrams(const std::vector<Datagram>& datagrams);
/// EtherCAT header (type 1) and datagrams, with `padding` zeros behind them that its length covers.
[[nodiscard]] Bytes EncodePayload(const std::vector<Datagram>& datagrams, std::size_t padding = 0);
/// `payload` (an EtherCAT header and what follows) with everything around it, as it stands in a capture file.
[[nodiscard]] Bytes EncodePacket(const EtherCatFrame& frame, ByteView payload, const Encapsulation& around);
/// The whole frame.
[[nodiscard]] Bytes EncodePacket(const EtherCatFrame& frame, const Encapsulation& around = {});
/// `source` as a slave leaves it: the locally-administered bit set (esc-reference 1.6).
[[nodiscard]] MacAddress AfterSlave(MacAddress source);

}  // namespace ecaudit::samples
