#include "decoder/mailbox/eoe.h"

#include <algorithm>

#include "decoder/base/names.h"
#include "decoder/base/text.h"

namespace ecaudit::mailbox {
namespace {

constexpr std::size_t kBlockBytes = 32;
constexpr std::size_t kTimeBytes = 4;

using Mac = std::array<std::uint8_t, 6>;

Mac MacAt(ByteSpan bytes, std::size_t offset) {
  Mac mac{};
  const ByteSpan from = Slice(bytes, offset, mac.size());
  std::ranges::copy(from, mac.begin());
  return mac;
}

void SummariseIpv4(ByteSpan packet, EthernetSummary& summary) {
  if (packet.size() < 20 || packet[0] >> 4U != 4) return;
  const std::size_t header_bytes = static_cast<std::size_t>(packet[0] & 0x0FU) * 4;
  summary.ip_protocol = packet[9];
  summary.source_ip = BigEndian<std::uint32_t>(packet, 12);
  summary.destination_ip = BigEndian<std::uint32_t>(packet, 16);
  const bool first_fragment = (BigEndian<std::uint16_t>(packet, 6) & 0x1FFFU) == 0;
  const bool has_ports = packet[9] == 6 || packet[9] == 17;
  if (header_bytes < 20 || !first_fragment || !has_ports || !Fits(packet, header_bytes, 4)) return;
  summary.source_port = BigEndian<std::uint16_t>(packet, header_bytes);
  summary.destination_port = BigEndian<std::uint16_t>(packet, header_bytes + 2);
}

}  // namespace

std::string Name(EoeType type) {
  static constexpr Named<EoeType> kNames[] = {
      {EoeType::kFragment, "fragment"},
      {EoeType::kTimestampResponse, "time stamp response"},
      {EoeType::kSetIpRequest, "set IP request"},
      {EoeType::kSetIpResponse, "set IP response"},
      {EoeType::kSetFilterRequest, "set address filter request"},
      {EoeType::kSetFilterResponse, "set address filter response"},
      {EoeType::kGetIpRequest, "get IP request"},
      {EoeType::kGetIpResponse, "get IP response"},
      {EoeType::kGetFilterRequest, "get address filter request"},
      {EoeType::kGetFilterResponse, "get address filter response"},
  };
  const std::string_view name = NameIn(kNames, type);
  return !name.empty() ? std::string(name) : "type " + std::to_string(static_cast<unsigned>(type));
}

std::string_view Describe(EoeFrame::Problem problem) {
  static constexpr Named<EoeFrame::Problem> kNames[] = {
      {EoeFrame::Problem::kNone, ""},
      {EoeFrame::Problem::kNoStart, "the first fragment is not in the capture"},
      {EoeFrame::Problem::kFragmentMissing, "a fragment is missing"},
      {EoeFrame::Problem::kWrongOffset, "a fragment's offset does not continue the one before"},
      {EoeFrame::Problem::kWrongSize, "the fragments do not add up to the announced size"},
      {EoeFrame::Problem::kUnfinished, "the last fragment never came"},
  };
  static_assert(NamesAll(kNames, EoeFrame::Problem::kUnfinished));
  return NameIn(kNames, problem);
}

std::string_view EoeResultText(std::uint16_t result) {
  static constexpr Named<std::uint16_t> kNames[] = {
      {0x0000, "success"},       {0x0001, "unspecified error"},  {0x0002, "unsupported frame type"},
      {0x0201, "no IP support"}, {0x0202, "DHCP not supported"}, {0x0401, "no filter support"},
  };
  return NameIn(kNames, result);
}

EoeIpParameters ParseIpParameters(ByteSpan data) {
  EoeIpParameters parameters;
  parameters.flags = LittleEndian<std::uint32_t>(data, 0);
  const auto has = [&](unsigned bit, std::size_t offset, std::size_t length) {
    const bool announced = (parameters.flags >> bit & 1U) != 0;
    const bool fits = Fits(data, offset, length);
    parameters.cut |= announced && !fits;
    return announced && fits;
  };
  // IP addresses are numbers here, least significant byte first (192.168.0.139 is 8b 00 a8 c0).
  if (has(0, 4, 6)) parameters.mac = MacAt(data, 4);
  if (has(1, 10, 4)) parameters.ip = LittleEndian<std::uint32_t>(data, 10);
  if (has(2, 14, 4)) parameters.subnet_mask = LittleEndian<std::uint32_t>(data, 14);
  if (has(3, 18, 4)) parameters.gateway = LittleEndian<std::uint32_t>(data, 18);
  if (has(4, 22, 4)) parameters.dns_server = LittleEndian<std::uint32_t>(data, 22);
  if (has(5, 26, 1)) {
    const ByteSpan name = Slice(data, 26, 32);
    parameters.dns_name = name.first(static_cast<std::size_t>(std::ranges::find(name, 0) - name.begin()));
  }
  return parameters;
}

EthernetSummary SummariseEthernet(ByteSpan frame) {
  EthernetSummary summary;
  if (frame.size() < 14) return summary;
  summary.valid = true;
  summary.destination = MacAt(frame, 0);
  summary.source = MacAt(frame, 6);
  std::size_t offset = 12;
  summary.ether_type = BigEndian<std::uint16_t>(frame, offset);
  while (summary.ether_type == 0x8100 && Fits(frame, offset, 6)) {
    if (!summary.vlan) summary.vlan = static_cast<std::uint16_t>(BigEndian<std::uint16_t>(frame, offset + 2) & 0x0FFFU);
    offset += 4;
    summary.ether_type = BigEndian<std::uint16_t>(frame, offset);
  }
  const ByteSpan payload = Slice(frame, offset + 2);
  if (summary.ether_type == 0x0800) SummariseIpv4(payload, summary);
  if (summary.ether_type == 0x0806 && payload.size() >= 28 && payload[4] == 6 && payload[5] == 4) {
    summary.source_ip = BigEndian<std::uint32_t>(payload, 14);
    summary.destination_ip = BigEndian<std::uint32_t>(payload, 24);
  }
  return summary;
}

std::string EtherTypeName(std::uint16_t ether_type) {
  switch (ether_type) {
    case 0x0800:
      return "IPv4";
    case 0x0806:
      return "ARP";
    case 0x8100:
      return "VLAN";
    case 0x86DD:
      return "IPv6";
    case 0x88A4:
      return "EtherCAT";
    case 0x88CC:
      return "LLDP";
    case 0x88F7:
      return "PTP";
    case 0x8892:
      return "PROFINET";
    default:
      return Hex(ether_type);
  }
}

std::string IpText(std::uint32_t address) {
  return std::to_string(address >> 24U) + "." + std::to_string(address >> 16U & 0xFFU) + "." +
         std::to_string(address >> 8U & 0xFFU) + "." + std::to_string(address & 0xFFU);
}

void EoeReassembler::OnMessage(const MailboxMessage& message, const FrameRef& request, EventSink& sink) {
  const EoeHeader header = ParseEoe(message.payload);
  if (header.too_short) return;
  if (header.type == EoeType::kFragment) {
    OnFragment(message, header, sink);
    return;
  }
  EoeControl control;
  control.slave = message.slave;
  control.direction = message.direction;
  control.frame = message.frame();
  control.request = request;
  control.type = header.type;
  switch (header.type) {
    case EoeType::kSetIpResponse:
    case EoeType::kSetFilterResponse:
      control.result = header.result;
      break;
    case EoeType::kSetIpRequest:
    case EoeType::kGetIpResponse:
      control.ip = ParseIpParameters(header.data);
      break;
    case EoeType::kTimestampResponse:
      if (header.data.size() >= kTimeBytes) control.timestamp = LittleEndian<std::uint32_t>(header.data, 0);
      break;
    default:
      break;
  }
  sink.Publish(control);
}

void EoeReassembler::OnFragment(const MailboxMessage& message, const EoeHeader& header, EventSink& sink) {
  if (header.fragment == 0) {
    if (open_) Emit(EoeFrame::Problem::kUnfinished, sink);
    Begin(message, header);
  } else if (skipping_) {
    skipping_ = !header.last_fragment;
    return;
  } else if (!open_) {
    Begin(message, header);
    GiveUp(EoeFrame::Problem::kNoStart, header, sink);
    return;
  } else if (header.fragment != next_fragment_ || header.frame != frame_.frame_number) {
    GiveUp(EoeFrame::Problem::kFragmentMissing, header, sink);
    return;
  } else if (static_cast<std::uint64_t>(header.blocks) * kBlockBytes != frame_.size) {
    GiveUp(EoeFrame::Problem::kWrongOffset, header, sink);
    return;
  }
  ++frame_.fragments;
  frame_.last = message.frame();
  frame_.time_requested = frame_.time_requested || header.time_requested;
  next_fragment_ = static_cast<std::uint8_t>(header.fragment + 1);
  ByteSpan data = header.data;
  if (header.last_fragment && header.time_appended && data.size() >= kTimeBytes) {
    frame_.timestamp = LittleEndian<std::uint32_t>(data, data.size() - kTimeBytes);
    data = data.first(data.size() - kTimeBytes);
  }
  frame_.size += data.size();
  data_.Append(data);
  if (!header.last_fragment) return;
  // Whether the announced size includes the time stamp, the sources do not state: both are fine.
  const auto blocks = [](std::uint64_t bytes) { return (bytes + kBlockBytes - 1) / kBlockBytes; };
  const bool fits = blocks(frame_.size) == announced_blocks_ ||
                    (frame_.timestamp && blocks(frame_.size + kTimeBytes) == announced_blocks_);
  Emit(fits ? EoeFrame::Problem::kNone : EoeFrame::Problem::kWrongSize, sink);
}

void EoeReassembler::Begin(const MailboxMessage& message, const EoeHeader& header) {
  frame_ = EoeFrame();
  frame_.slave = message.slave;
  frame_.direction = message.direction;
  frame_.first = message.frame();
  frame_.last = message.frame();
  frame_.port = header.port;
  frame_.frame_number = header.frame;
  data_.Clear();
  open_ = true;
  skipping_ = false;
  next_fragment_ = 0;
  announced_blocks_ = header.blocks;
}

void EoeReassembler::GiveUp(EoeFrame::Problem problem, const EoeHeader& header, EventSink& sink) {
  skipping_ = !header.last_fragment;
  Emit(problem, sink);
}

void EoeReassembler::Emit(EoeFrame::Problem problem, EventSink& sink) {
  open_ = false;
  frame_.problem = problem;
  frame_.data = data_;
  frame_.summary = SummariseEthernet(data_);
  sink.Publish(frame_);
  frame_.data = {};
  data_.Clear();
}

void EoeReassembler::End(EventSink& sink) {
  if (open_) Emit(EoeFrame::Problem::kUnfinished, sink);
}

}  // namespace ecaudit::mailbox
