#include "decoder/wire/frame_view.h"

#include <algorithm>

#include "decoder/capture/ethercat_traces.h"
#include "decoder/wire/link_header.h"

namespace ecaudit::wire {
namespace {

constexpr std::uint16_t kEtherTypeEtherCat = 0x88A4;
constexpr std::uint16_t kEtherTypeIpv4 = 0x0800;
constexpr std::uint16_t kUdpPortEtherCat = 34980;
constexpr std::uint8_t kIpProtocolUdp = 17;
constexpr std::size_t kEslBytes = 16;
constexpr std::size_t kMaxOffset = 0xFFFF;  ///< datagrams are kept by 16-bit offsets; no real frame comes near

std::uint64_t Mac(ByteSpan bytes, std::size_t offset) {
  return static_cast<std::uint64_t>(BigEndian<std::uint16_t>(bytes, offset)) << 32U |
         BigEndian<std::uint32_t>(bytes, offset + 2);
}

/// The record starts with 01 01 05 10|11 00 00 (esc-reference 1.5).
bool IsEslCookie(ByteSpan bytes, std::size_t offset) {
  return Fits(bytes, offset, kEslBytes) && bytes[offset] == 0x01 && bytes[offset + 1] == 0x01 &&
         bytes[offset + 2] == 0x05 && (bytes[offset + 3] == 0x10 || bytes[offset + 3] == 0x11) &&
         bytes[offset + 4] == 0x00 && bytes[offset + 5] == 0x00;
}

EslRecord ReadEsl(ByteSpan record) {
  struct PortBit {
    std::uint16_t mask;
    std::uint8_t port;
  };
  constexpr PortBit kPorts[] = {{0x0080, 0}, {0x0040, 1}, {0x0020, 2}, {0x0010, 3}, {0x0008, 4},  {0x0004, 5},
                                {0x0002, 6}, {0x0001, 7}, {0x8000, 8}, {0x4000, 9}, {0x0400, 10}, {0x0200, 11}};
  const auto flags = LittleEndian<std::uint16_t>(record, 6);
  EslRecord esl;
  esl.present = true;
  esl.crc_error = (flags & 0x1000U) != 0;
  esl.alignment_error = (flags & 0x0800U) != 0;
  esl.has_time = (flags & 0x2000U) != 0;
  esl.time_ns = LittleEndian<std::uint64_t>(record, 8);
  for (const PortBit& bit : kPorts) {
    if ((flags & bit.mask) != 0) {
      esl.port = bit.port;
      break;
    }
  }
  return esl;
}

bool IsNetAnalyzer(std::uint16_t link_type) {
  return link_type == static_cast<std::uint16_t>(capture::LinkType::kNetAnalyzer) ||
         link_type == static_cast<std::uint16_t>(capture::LinkType::kNetAnalyzerTransparent);
}

/// Word of a netANALYZER, little endian: error bits 0-7, event of an input 8, with preamble 9, version 10-13, port
/// 14-15, length 16-27. After it the frame with its FCS.
/// @return the frame without the word, the preamble and the FCS; empty: no frame
capture::CapturedFrame ReadNetAnalyzer(const capture::CapturedFrame& packet, EslRecord& record) {
  constexpr std::size_t kWordBytes = 4;
  constexpr std::uint8_t kPreamble = 0x55, kStart = 0xD5, kFcs = 4;
  constexpr std::uint32_t kFcsError = 0x04, kOtherDamage = 0x13;  // wrong symbol, alignment, start of frame
  capture::CapturedFrame frame = packet;
  const auto word = LittleEndian<std::uint32_t>(packet.bytes, 0);
  std::size_t begin = kWordBytes;
  const bool has_preamble = (word >> 9U & 1U) != 0;
  if (has_preamble) {
    while (begin < packet.bytes.size() && packet.bytes[begin] == kPreamble) ++begin;
    if (begin < packet.bytes.size() && packet.bytes[begin] == kStart) ++begin;
  }
  const bool is_event = (word >> 8U & 1U) != 0;
  const ByteSpan rest = packet.bytes.subspan(std::min(begin, packet.bytes.size()));
  frame.bytes = is_event ? rest.first(0) : rest;
  // An event is no frame that was cut.
  frame.original_length =
      is_event
          ? 0
          : static_cast<std::uint32_t>(packet.original_length - std::min<std::size_t>(packet.original_length, begin));
  frame.fcs_bytes = kFcs;
  record.present = !is_event;
  record.port = static_cast<std::uint8_t>(word >> 14U & 3U);
  record.crc_error = (word & kFcsError) != 0;
  record.alignment_error = (word & kOtherDamage) != 0;
  return frame.WithoutFcs();
}

bool AllZero(ByteSpan bytes) {
  return std::all_of(bytes.begin(), bytes.end(), [](std::uint8_t byte) { return byte == 0; });
}

using ReadWord = std::uint16_t (*)(ByteSpan, std::size_t);

/// With the bytes of its EtherCAT header swapped, and the lengths of datagrams read by `word`, the frame is whole.
bool IsWholeIfSwapped(ByteSpan bytes, std::size_t offset, ReadWord word) {
  const auto header = BigEndian<std::uint16_t>(bytes, offset);
  std::size_t at = offset + 2;
  const std::size_t end = at + (header & 0x07FFU);
  if (header >> 12U != 1 || end > bytes.size()) return false;
  bool more = true;
  while (more) {
    if (at + kDatagramHeaderBytes + kWorkingCounterBytes > end) return false;
    if (bytes[at] == 0 || !IsDefined(bytes[at])) return false;
    const std::uint16_t length_word = word(bytes, at + 6);
    more = (length_word & 0x8000U) != 0;
    at += kDatagramHeaderBytes + (length_word & 0x07FFU) + kWorkingCounterBytes;
  }
  return at == end;
}

/// A master that does not convert lengths to little-endian.
bool IsBigEndian(ByteSpan bytes, std::size_t offset) {
  return IsWholeIfSwapped(bytes, offset, &BigEndian<std::uint16_t>) ||
         IsWholeIfSwapped(bytes, offset, &LittleEndian<std::uint16_t>);
}

/// The source address. Some slaves exchange both addresses: no station has a group's address to send from, and what
/// then is the destination is the master. Masters with such a source address (SOEM) send to all or to a group.
std::uint64_t SenderIn(ByteSpan bytes, const LinkHeader& header) {
  constexpr std::uint64_t kGroup = std::uint64_t{1} << 40U;
  const std::uint64_t source = Mac(bytes, header.source);
  if ((source & kGroup) == 0 || !header.destination) return source;
  const std::uint64_t destination = Mac(bytes, *header.destination);
  return destination == 0 || (destination & kGroup) != 0 ? source : destination | kMacBit;
}

/// Takes the record of a probe, the sender and the packet type.
void ReadLinkHeader(const capture::CapturedFrame& frame, const LinkHeader& header, bool cut, FrameFields& fields) {
  ByteSpan bytes = frame.bytes;
  if (frame.link_type == static_cast<std::uint16_t>(capture::LinkType::kEthernet)) {
    if (IsEslCookie(bytes, 0)) {
      fields.esl_ = ReadEsl(bytes.first(kEslBytes));
      bytes = bytes.subspan(kEslBytes);
    } else if (!cut && bytes.size() >= kEslBytes && IsEslCookie(bytes, bytes.size() - kEslBytes)) {
      fields.esl_ = ReadEsl(bytes.last(kEslBytes));
      bytes = bytes.first(bytes.size() - kEslBytes);
    }
  }
  fields.bytes_ = bytes;
  fields.source_mac_ = SenderIn(bytes, header);
  const std::size_t size = header.packet_type_bytes;
  if (size == 0 || fields.flag_ != capture::PacketFlag::kNone || !Fits(bytes, header.packet_type, size)) return;
  constexpr unsigned kSentByRecorder = 4;
  unsigned type = 0;
  for (const std::uint8_t byte : bytes.subspan(header.packet_type, size)) type = type << 8U | byte;
  fields.flag_ = type == kSentByRecorder ? capture::PacketFlag::kOutbound : capture::PacketFlag::kInbound;
}

/// Passes tags, and IP and UDP where they carry EtherCAT.
/// @return where the EtherCAT header lies; nothing in a frame of another kind
std::optional<std::size_t> PassToEtherCat(const LinkHeader& header, bool cut, FrameFields& fields) {
  const ByteSpan bytes = fields.bytes_;
  const auto ends_before = [&](std::size_t end) { return cut && bytes.size() < end; };
  fields.cut_before_type_ = ends_before(header.type + 2);
  auto ethertype = BigEndian<std::uint16_t>(bytes, header.type);
  std::size_t offset = header.payload;
  // However many tags: what follows them is looked for as far as the packet goes.
  while (IsVlanTag(ethertype)) {
    if (fields.vlan_tags_ < 0xFF) ++fields.vlan_tags_;
    fields.cut_before_type_ = ends_before(offset + 4);
    ethertype = BigEndian<std::uint16_t>(bytes, offset + 2);
    offset += 4;
  }
  if (ethertype == kEtherTypeEtherCat) return offset;
  if (ethertype != kEtherTypeIpv4) return std::nullopt;

  fields.cut_before_type_ = ends_before(offset + 20);
  if (!Fits(bytes, offset, 20) || bytes[offset] >> 4U != 4) return std::nullopt;
  const std::size_t ip_header = static_cast<std::size_t>(bytes[offset] & 0x0FU) * 4;
  const bool fragment = (BigEndian<std::uint16_t>(bytes, offset + 6) & 0x3FFFU) != 0;
  if (ip_header < 20 || fragment || bytes[offset + 9] != kIpProtocolUdp) return std::nullopt;
  fields.cut_before_type_ = ends_before(offset + ip_header + 8);
  if (!Fits(bytes, offset, ip_header + 8)) return std::nullopt;
  const std::size_t udp = offset + ip_header;
  if (BigEndian<std::uint16_t>(bytes, udp) != kUdpPortEtherCat &&
      BigEndian<std::uint16_t>(bytes, udp + 2) != kUdpPortEtherCat) {
    return std::nullopt;
  }
  fields.encapsulation_ = Encapsulation::kUdp;
  return udp + 8;
}

}  // namespace

std::string_view Describe(FrameProblem problem) {
  switch (problem) {
    case FrameProblem::kNone:
      return "no problem";
    case FrameProblem::kNoHeader:
      return "the frame ends before the EtherCAT header is complete";
    case FrameProblem::kLengthBeyondFrame:
      return "the EtherCAT length reaches past the end of the frame";
    case FrameProblem::kDatagramBeyondLength:
      return "a datagram reaches past the EtherCAT length";
    case FrameProblem::kMoreWithoutDatagram:
      return "the more flag announces a datagram that does not follow";
    case FrameProblem::kUnknownCommand:
      return "a datagram has a command that is not defined";
    case FrameProblem::kNoDatagram:
      return "the EtherCAT length is too short for a datagram";
    case FrameProblem::kByteOrder:
      return "the EtherCAT header is big-endian";
  }
  return "?";
}

FrameView FrameView::Parse(const capture::CapturedFrame& packet) noexcept {
  FrameView view;
  const bool of_netanalyzer = IsNetAnalyzer(packet.link_type);
  const capture::CapturedFrame frame =
      of_netanalyzer ? ReadNetAnalyzer(packet, static_cast<FrameFields&>(view).esl_) : packet.WithoutFcs();
  view.ref_ = frame.ref();
  view.interface_index_ = frame.interface_index;
  view.flag_ = frame.flag;
  const bool cut = frame.bytes.size() < frame.original_length;
  FrameFields& fields = view;
  const std::optional<LinkHeader> header = LinkHeaderOf(frame.link_type);
  if (!header) {
    view.other_link_ = capture::HoldsEtherCat(frame.bytes);
    return view;
  }
  ReadLinkHeader(frame, *header, cut, fields);
  const std::optional<std::size_t> offset = PassToEtherCat(*header, cut, fields);
  if (!offset) return view;
  if (!Fits(view.bytes_, *offset, 2)) {
    view.kind_ = cut ? FrameKind::kCut : FrameKind::kMalformed;
    view.problem_ = cut ? FrameProblem::kNone : FrameProblem::kNoHeader;
  } else {
    view.ParseDatagrams(*offset, cut);
    view.key_ = view.KeyOfDatagrams();
  }
  const bool damaged = view.esl_.crc_error || view.esl_.alignment_error || frame.damaged;
  if (damaged && view.kind_ != FrameKind::kOther) view.kind_ = FrameKind::kDamagedOnWire;
  return view;
}

std::uint64_t FrameView::KeyOfDatagrams() const noexcept {
  std::uint64_t hash = count_;
  // ParseDatagrams() found all of them inside; here nothing but their headers is looked at.
  const std::uint16_t* offset = offsets_.data();
  for (const std::uint16_t* const end = offset + count_; offset != end; ++offset) {
    hash = MixKey(hash, DatagramView::KeptHeaderAt(bytes_.data() + *offset));
  }
  return hash;
}

void FrameView::ParseDatagrams(std::size_t offset, bool cut) noexcept {
  const auto header = LittleEndian<std::uint16_t>(bytes_, offset);
  has_header_ = true;
  ethercat_type_ = static_cast<std::uint8_t>(header >> 12U);
  if (ethercat_type_ != 1) {  // kOther: an ESC processes type 1 only
    if (!cut && IsBigEndian(bytes_, offset)) Fail(FrameProblem::kByteOrder);
    return;
  }

  const std::size_t start = offset + 2;
  const std::size_t announced_end = start + (header & 0x07FFU);
  kind_ = FrameKind::kEtherCat;
  if (announced_end > bytes_.size()) {
    if (cut) {
      kind_ = FrameKind::kCut;
    } else {
      Fail(FrameProblem::kLengthBeyondFrame);
    }
  }

  // Datagrams are read as far as the more flags and the bytes go, also after the EtherCAT length of a malformed frame:
  // `decode` shows what Wireshark shows. Padding is no datagram, though. Stages that draw conclusions examine kind()
  // first.
  std::size_t at = start;
  bool more = true;
  // What nearly all datagrams are: whole, inside the length, known.
  const std::size_t end = std::min({announced_end, bytes_.size(), kMaxOffset});
  std::uint16_t* const offsets = offsets_.data();
  while (more && count_ < kMaxDatagrams && at + kDatagramHeaderBytes + kWorkingCounterBytes <= end) {
    const std::uint8_t* datagram = bytes_.data() + at;
    const auto length_word = LoadLittleEndian<std::uint16_t>(datagram + 6);
    const std::size_t size = kDatagramHeaderBytes + (length_word & 0x07FFU) + kWorkingCounterBytes;
    if (size > end - at || !IsDefined(*datagram)) break;
    offsets[count_++] = static_cast<std::uint16_t>(at);
    more = (length_word & 0x8000U) != 0;
    at += size;
    offsets[count_] = static_cast<std::uint16_t>(at);
  }
  const bool known = !more;
  if (more) more = ParseOddDatagrams(at, announced_end);
  if (known && problem_ == FrameProblem::kLengthBeyondFrame) {
    whole_ = true;
    padding_ = static_cast<std::uint16_t>(announced_end - at);
  }
  if (kind_ == FrameKind::kMalformed) {
    if (!cut && IsBigEndian(bytes_, offset)) {
      count_ = 0;
      problem_ = FrameProblem::kByteOrder;
      whole_ = false;
    }
    return;
  }
  if (more) {
    if (kind_ == FrameKind::kEtherCat) Fail(FrameProblem::kMoreWithoutDatagram);  // as many as the length can cover
    return;
  }
  // Slaves stop where the more flag is clear: what the length covers after it is padding, whatever it holds, and all
  // that the snap length has taken.
  kind_ = FrameKind::kEtherCat;
  if (at < announced_end) padding_ = static_cast<std::uint16_t>(announced_end - at);
}

void FrameView::Fail(FrameProblem problem) noexcept {
  kind_ = FrameKind::kMalformed;
  if (problem_ == FrameProblem::kNone) problem_ = problem;
}

/// What is cut, goes beyond the length, or is no known command, from `at` on, which is left after the last datagram.
/// True when another datagram was announced.
bool FrameView::ParseOddDatagrams(std::size_t& at, std::size_t announced_end) noexcept {
  bool more = true;
  while (more && count_ < kMaxDatagrams) {
    if (!Fits(bytes_, at, kDatagramHeaderBytes)) {
      if (kind_ != FrameKind::kCut) {
        Fail(count_ == 0 ? FrameProblem::kNoDatagram : FrameProblem::kMoreWithoutDatagram);
      }
      break;
    }
    const auto length_word = LittleEndian<std::uint16_t>(bytes_, at + 6);
    const std::size_t size = kDatagramHeaderBytes + (length_word & 0x07FFU) + kWorkingCounterBytes;
    if (!Fits(bytes_, at, size) || at + size > kMaxOffset) {
      if (kind_ != FrameKind::kCut) Fail(FrameProblem::kDatagramBeyondLength);
      break;
    }
    if (at + size > announced_end) {
      Fail(at >= announced_end ? (count_ == 0 ? FrameProblem::kNoDatagram : FrameProblem::kMoreWithoutDatagram)
                               : FrameProblem::kDatagramBeyondLength);
      if (at >= announced_end && AllZero(bytes_.subspan(at, size))) break;
    }
    if (!IsDefined(bytes_[at])) Fail(FrameProblem::kUnknownCommand);
    offsets_[count_++] = static_cast<std::uint16_t>(at);
    more = (length_word & 0x8000U) != 0;
    at += size;
    offsets_[count_] = static_cast<std::uint16_t>(at);
  }
  return more;
}

}  // namespace ecaudit::wire
