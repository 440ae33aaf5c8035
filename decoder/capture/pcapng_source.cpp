#include "decoder/capture/pcapng_source.h"

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "decoder/base/allowance.h"
#include "decoder/base/text.h"
#include "decoder/capture/capture_stream.h"
#include "decoder/capture/ethercat_traces.h"
#include "decoder/capture/fcs_finder.h"
#include "decoder/capture/pcapng_block.h"
#include "decoder/capture/time_scale.h"

namespace ecaudit::capture {
namespace {

using pcapng::OptionReader;

constexpr std::size_t kMaxComments = 1000;
constexpr std::size_t kMaxCommentBytes = 4096;
constexpr std::size_t kMaxNameBytes = 256;
constexpr std::uint32_t kPeekedAt = 256;       // bytes of a block that is passed over
constexpr std::size_t kMaxInterfaces = 65535;  // CapturedFrame::interface_index

/// What a block turned out to be.
enum class BlockResult : std::uint8_t { kPacket, kOther, kEnd, kDamaged };

/// `value` as text of at most `limit` bytes, cut between UTF-8 characters.
std::string Text(ByteSpan value, std::size_t limit) {
  std::size_t length = std::min(value.size(), limit);
  while (length > 0 && length < value.size() && (value[length] & 0xC0U) == 0x80U) --length;
  return {value.begin(), value.begin() + static_cast<std::ptrdiff_t>(length)};
}

/// More packets were dropped; a sum of counts, which may hold anything, stops at what is no count any more.
std::uint64_t AndDropped(std::uint64_t before, std::uint64_t more) {
  return std::min(before + std::min(more, CaptureInfo::kMostDropped), CaptureInfo::kMostDropped);
}

class PcapngSource final : public FrameSource {
 public:
  PcapngSource(std::unique_ptr<InputStream> stream, const std::string& name) : stream_(std::move(stream)) {
    info_.path = name;
    info_.format = FormatName("pcapng", stream_->compression());
  }

  /// Reads the first section header, and the interfaces directly after it.
  /// @return what is wrong with the header; empty when nothing is
  std::string Start() {
    CapturedFrame none;
    if (ReadBlock(none) == BlockResult::kDamaged) return info_.damage->message;
    while (status_ == ReadStatus::kFrame && NextIs(pcapng::kInterfaceDescription)) {
      if (ReadBlock(none) == BlockResult::kDamaged) status_ = ReadStatus::kDamaged;
    }
    return {};
  }

  ReadStatus Next(CapturedFrame& frame) noexcept override {
    while (status_ == ReadStatus::kFrame) {
      switch (ReadBlock(frame)) {
        case BlockResult::kPacket:
          return ReadStatus::kFrame;
        case BlockResult::kOther:
          break;
        case BlockResult::kEnd:
          status_ = ReadStatus::kEnd;
          break;
        case BlockResult::kDamaged:
          status_ = ReadStatus::kDamaged;
          break;
      }
    }
    return status_;
  }
  const CaptureInfo& info() const noexcept override { return info_; }
  std::uint64_t bytes_read() const noexcept override { return stream_->bytes_read(); }
  std::uint64_t bytes_total() const noexcept override { return stream_->bytes_total(); }

 private:
  /// What Interface has no room for.
  struct InterfaceState {
    TimeScale scale;
    FcsFinder fcs;
    std::uint64_t dropped_by_packets = 0;  // sum of the drop counts in packet blocks
    std::uint64_t dropped_by_statistics = 0;
  };

  BlockResult ReadBlock(CapturedFrame& frame);
  bool NextIs(std::uint32_t type);
  /// Takes a block out of the stream that is not looked into, without holding all of it in memory.
  BlockResult PassOver(std::uint32_t type, std::uint32_t length);
  BlockResult SectionHeader(ByteSpan block);
  BlockResult InterfaceDescription(ByteSpan block);
  BlockResult EnhancedPacket(ByteSpan block, CapturedFrame& frame);
  BlockResult ObsoletePacket(ByteSpan block, CapturedFrame& frame);
  BlockResult SimplePacket(ByteSpan block, CapturedFrame& frame);
  BlockResult InterfaceStatistics(ByteSpan block);
  /// What enhanced and obsolete packet blocks have in common: time stamp from offset 12 on, lengths, data, options.
  BlockResult StampedPacket(ByteSpan block, std::uint32_t interface, CapturedFrame& frame);
  /// @return whether they declare a frame check sequence
  bool PacketOptions(ByteSpan options, std::size_t interface, CapturedFrame& frame);
  void FillFrame(std::size_t interface, std::uint32_t original_length, ByteSpan bytes, CapturedFrame& frame);
  void AddComment(FrameNo frame, ByteSpan text);
  void CountDropped(std::size_t interface);
  std::size_t interfaces_in_section() const { return interfaces_.size() - section_start_; }

  /// @param offset  of the damaged block; without it, where the stream stands
  BlockResult Damaged(std::string message, std::optional<std::uint64_t> offset = std::nullopt);
  BlockResult EndsInside(const std::string& what, std::optional<std::uint64_t> offset = std::nullopt);
  /// The packet that would come next: "packet 812".
  std::string NextPacket() const { return "packet " + std::to_string(number_ + 1); }

  std::unique_ptr<InputStream> stream_;
  CaptureInfo info_;
  Allowance name_bytes_{CaptureInfo::kNameBytes};
  ReadStatus status_ = ReadStatus::kFrame;
  FrameNo number_ = 0;  // of the last block that Wireshark would number
  ByteOrder order_;
  std::vector<InterfaceState> interfaces_;
  std::size_t section_start_ = 0;  // interface 0 of this section
  std::uint32_t sections_ = 0;     // that have begun
  std::size_t last_block_ = 0;     // length of the block whose bytes are lent out, consumed by the next call
};

constexpr std::string_view kTwoLengths = " has two different block lengths";

/// False for blocks that are passed over.
bool IsRead(std::uint32_t type) {
  switch (type) {
    case pcapng::kSectionHeader:
    case pcapng::kInterfaceDescription:
    case pcapng::kEnhancedPacket:
    case pcapng::kObsoletePacket:
    case pcapng::kSimplePacket:
    case pcapng::kInterfaceStatistics:
      return true;
    default:
      return false;
  }
}

std::string BlockName(std::uint32_t type, const std::string& next_packet) {
  switch (type) {
    case pcapng::kEnhancedPacket:
    case pcapng::kSimplePacket:
    case pcapng::kObsoletePacket:
      return next_packet;
    case pcapng::kInterfaceDescription:
      return "an interface description before " + next_packet;
    case pcapng::kSectionHeader:
      return "a section header before " + next_packet;
    default:
      return "a block of type " + Hex(type, 8) + " before " + next_packet;
  }
}

constexpr std::size_t kStampedPacketBytes = 32;

std::size_t MinimumBytes(std::uint32_t type) {
  switch (type) {
    case pcapng::kSectionHeader:
      return 28;
    case pcapng::kInterfaceDescription:
      return 20;
    case pcapng::kEnhancedPacket:
    case pcapng::kObsoletePacket:
      return kStampedPacketBytes;
    case pcapng::kSimplePacket:
      return 16;
    case pcapng::kInterfaceStatistics:
      return 24;
    default:
      return pcapng::kMinBlockBytes;
  }
}

BlockResult PcapngSource::ReadBlock(CapturedFrame& frame) {
  stream_->Consume(std::exchange(last_block_, 0));
  ByteSpan bytes = stream_->Peek(pcapng::kMinBlockBytes);
  if (bytes.empty() && stream_->error().empty()) return BlockResult::kEnd;
  if (bytes.size() < pcapng::kMinBlockBytes) return EndsInside("a block header before " + NextPacket());

  const std::uint32_t type = order_.At(bytes.data());
  if (type == pcapng::kSectionHeader) {
    order_.big_endian = BigEndian<std::uint32_t>(bytes, 8) == pcapng::kByteOrderMagic;
    if (order_.U32(bytes, 8) != pcapng::kByteOrderMagic) return Damaged("a section header has no byte-order magic");
  }
  const std::uint32_t length = order_.At(bytes.data() + pcapng::kBlockHeaderBytes / 2);
  const bool packet = type == pcapng::kEnhancedPacket;  // nearly always
  const bool read = packet || IsRead(type);
  if (length < (packet ? kStampedPacketBytes : MinimumBytes(type)) || length % 4 != 0 ||
      length > (read ? pcapng::kMaxReadBlockBytes : pcapng::kMaxBlockBytes)) {
    return Damaged(BlockName(type, NextPacket()) + " has an impossible block length, " + Grouped(length) + " bytes");
  }
  if (!read) return PassOver(type, length);
  if (bytes.size() < length) bytes = stream_->Peek(length);
  if (bytes.size() < length) return EndsInside(BlockName(type, NextPacket()));
  bytes = bytes.first(length);
  if (order_.At(bytes.data() + length - pcapng::kTrailerBytes) != length) {
    return Damaged(BlockName(type, NextPacket()) + std::string(kTwoLengths));
  }
  last_block_ = length;

  const ByteSpan block = bytes.first(length - pcapng::kTrailerBytes);
  if (packet) return EnhancedPacket(block, frame);
  switch (type) {
    case pcapng::kSimplePacket:
      return SimplePacket(block, frame);
    case pcapng::kObsoletePacket:
      return ObsoletePacket(block, frame);
    case pcapng::kSectionHeader:
      return SectionHeader(block);
    case pcapng::kInterfaceDescription:
      return InterfaceDescription(block);
    default:
      return InterfaceStatistics(block);
  }
}

bool PcapngSource::NextIs(std::uint32_t type) {
  stream_->Consume(std::exchange(last_block_, 0));
  const ByteSpan bytes = stream_->Peek(pcapng::kMinBlockBytes);
  return bytes.size() >= pcapng::kMinBlockBytes && order_.At(bytes.data()) == type;
}

BlockResult PcapngSource::PassOver(std::uint32_t type, std::uint32_t length) {
  const std::uint64_t start = stream_->offset();
  if (!pcapng::HoldsNoPacket(type) && HoldsEtherCat(Slice(stream_->Peek(std::min(length, kPeekedAt)), 0, length))) {
    ++info_.unread_blocks;
  }
  const bool whole = stream_->Skip(length - pcapng::kTrailerBytes);
  const ByteSpan trailer = stream_->Peek(pcapng::kTrailerBytes);
  if (!whole || trailer.size() < pcapng::kTrailerBytes) return EndsInside(BlockName(type, NextPacket()), start);
  if (order_.U32(trailer, 0) != length) return Damaged(BlockName(type, NextPacket()) + std::string(kTwoLengths), start);
  stream_->Consume(pcapng::kTrailerBytes);
  if (pcapng::IsNumberedRecord(type)) ++number_;
  return BlockResult::kOther;
}

//  | type 4 | length 4 | byte-order magic 4 | major 2 | minor 2 | section length 8 | options |
BlockResult PcapngSource::SectionHeader(ByteSpan block) {
  const unsigned major = order_.U16(block, 12);
  if (major != 1) return Damaged("pcapng version " + std::to_string(major) + " is not known");
  section_start_ = interfaces_.size();
  ++sections_;
  OptionReader options(Slice(block, 24), order_);
  while (const auto option = options.Next()) {
    if (option->code == pcapng::kOptComment) AddComment(0, option->value);
  }
  return BlockResult::kOther;
}

//  | type 4 | length 4 | link type 2 | reserved 2 | snap length 4 | options |
BlockResult PcapngSource::InterfaceDescription(ByteSpan block) {
  if (interfaces_.size() >= kMaxInterfaces) return Damaged("there are more than 65,535 interfaces");
  Interface interface;
  interface.link_type = order_.U16(block, 8);
  interface.snap_length = order_.U32(block, 12);
  std::uint8_t resolution = 6;
  std::int64_t offset_s = 0;
  unsigned fcs_length = 0;
  bool valid = true;
  OptionReader options(Slice(block, 16), order_);
  while (const auto option = options.Next()) {
    if (option->code == pcapng::kOptComment) AddComment(0, option->value);
    if (option->code == pcapng::kIfName) interface.name = Text(option->value, kMaxNameBytes);
    if (option->code == pcapng::kIfTsResol) {
      valid = valid && option->value.size() == 1;
      if (!option->value.empty()) resolution = option->value[0];
    }
    if (option->code == pcapng::kIfFcsLength && option->value.size() == 1) fcs_length = option->value[0];
    if (option->code == pcapng::kIfTsOffset) {
      valid = valid && option->value.size() == 8;
      offset_s = static_cast<std::int64_t>(order_.U64(option->value, 0));
    }
  }
  // Without its options the time stamps would be wrong by orders of magnitude: better no packets than these.
  if (!valid || options.broken()) {
    return Damaged("the options of interface " + std::to_string(interfaces_.size()) + " are not valid");
  }
  if (!name_bytes_.Take(interface.name.size())) {
    info_.name_bytes_left_out += interface.name.size();
    interface.name = {};
  }
  InterfaceState state;
  state.scale = TimeScale(resolution, offset_s);
  state.fcs.Declare(fcs_length);
  interface.resolution_ns = state.scale.resolution_ns();
  interface.section = sections_ - 1;
  interfaces_.push_back(state);
  info_.interfaces.push_back(std::move(interface));
  return BlockResult::kOther;
}

//  | type 4 | length 4 | interface 4 | time high 4 | time low 4 | captured 4 | original 4 | data | options |
BlockResult PcapngSource::EnhancedPacket(ByteSpan block, CapturedFrame& frame) {
  return StampedPacket(block, order_.At(block.data() + 8), frame);  // long enough: MinimumBytes()
}

//  | type 4 | length 4 | interface 2 | drops 2 | time high 4 | time low 4 | captured 4 | original 4 | data | options |
BlockResult PcapngSource::ObsoletePacket(ByteSpan block, CapturedFrame& frame) {
  constexpr std::uint16_t kUnknown = 0xFFFF;
  const std::uint16_t interface = order_.U16(block, 8);
  const std::uint16_t drops = order_.U16(block, 10);
  const BlockResult result = StampedPacket(block, interface, frame);
  if (result == BlockResult::kPacket && drops != kUnknown) {
    std::uint64_t& dropped = interfaces_[section_start_ + interface].dropped_by_packets;
    dropped = AndDropped(dropped, drops);
    CountDropped(section_start_ + interface);
  }
  return result;
}

BlockResult PcapngSource::StampedPacket(ByteSpan block, std::uint32_t interface, CapturedFrame& frame) {
  constexpr std::size_t kDataOffset = 28;
  if (interface >= interfaces_in_section()) {
    return Damaged(NextPacket() + " belongs to interface " + std::to_string(interface) +
                   ", which the file does not describe");
  }
  // A block of this type has these fields, and its trailer was taken off (MinimumBytes()).
  const std::uint8_t* const fields = block.data();
  const std::uint32_t captured = order_.At(fields + 20);
  if (!Fits(block, kDataOffset, captured)) {
    return Damaged(NextPacket() + " has a captured length larger than its block, " + Grouped(captured) + " bytes");
  }
  const std::size_t index = section_start_ + interface;
  FillFrame(index, order_.At(fields + 24), ByteSpan(fields + kDataOffset, captured), frame);
  const std::uint64_t ticks = static_cast<std::uint64_t>(order_.At(fields + 12)) << 32U | order_.At(fields + 16);
  const std::optional<TimeNs> time = interfaces_[index].scale.ToNs(ticks);
  frame.time = time.value_or(0);
  frame.has_time = time.has_value();
  const ByteSpan options = Slice(block, kDataOffset + pcapng::Padded(captured));
  const bool has_fcs = !options.empty() && PacketOptions(options, index, frame);
  frame.fcs_bytes = interfaces_[index].fcs.In(frame, has_fcs);
  return BlockResult::kPacket;
}

bool PcapngSource::PacketOptions(ByteSpan options, std::size_t interface, CapturedFrame& frame) {
  OptionReader reader(options, order_);
  bool has_fcs = false;
  while (const auto option = reader.Next()) {
    if (option->code == pcapng::kOptComment) AddComment(frame.number, option->value);
    if (option->code == pcapng::kPacketFlags && option->value.size() == 4) {
      const std::uint32_t flags = order_.U32(option->value, 0);
      const std::uint32_t direction = flags & 3U;
      if (direction == 1) frame.flag = PacketFlag::kInbound;
      if (direction == 2) frame.flag = PacketFlag::kOutbound;
      frame.damaged = (flags & pcapng::kDamagedOnWire) != 0;
      has_fcs = pcapng::FcsBytesOf(flags) != 0;
    }
    if (option->code == pcapng::kEpbDropCount && option->value.size() == 8) {
      std::uint64_t& dropped = interfaces_[interface].dropped_by_packets;
      dropped = AndDropped(dropped, order_.U64(option->value, 0));
      CountDropped(interface);
    }
  }
  return has_fcs;
}

//  | type 4 | length 4 | original 4 | data |      of interface 0 of the section, cut to its snap length
BlockResult PcapngSource::SimplePacket(ByteSpan block, CapturedFrame& frame) {
  constexpr std::size_t kDataOffset = 12;
  if (interfaces_in_section() == 0) {
    return Damaged(NextPacket() + " belongs to interface 0, which the file does not describe");
  }
  const std::uint32_t original = order_.U32(block, 8);
  const std::uint32_t snap_length = info_.interfaces[section_start_].snap_length;
  const std::uint32_t captured = snap_length == 0 ? original : std::min(original, snap_length);
  if (!Fits(block, kDataOffset, captured)) {
    return Damaged(NextPacket() + " has a captured length larger than its block, " + Grouped(captured) + " bytes");
  }
  FillFrame(section_start_, original, block.subspan(kDataOffset, captured), frame);
  frame.time = 0;
  frame.has_time = false;
  frame.fcs_bytes = interfaces_[section_start_].fcs.In(frame);
  return BlockResult::kPacket;
}

//  | type 4 | length 4 | interface 4 | time high 4 | time low 4 | options |
BlockResult PcapngSource::InterfaceStatistics(ByteSpan block) {
  const std::uint32_t interface = order_.U32(block, 8);
  if (interface >= interfaces_in_section()) return BlockResult::kOther;
  std::optional<std::uint64_t> dropped;
  OptionReader options(Slice(block, 20), order_);
  while (const auto option = options.Next()) {
    if ((option->code == pcapng::kIsbIfDrop || option->code == pcapng::kIsbOsDrop) && option->value.size() == 8) {
      dropped = AndDropped(dropped.value_or(0), order_.U64(option->value, 0));
    }
  }
  if (dropped) {
    interfaces_[section_start_ + interface].dropped_by_statistics = *dropped;
    CountDropped(section_start_ + interface);
  }
  return BlockResult::kOther;
}

void PcapngSource::FillFrame(std::size_t interface, std::uint32_t original_length, ByteSpan bytes,
                             CapturedFrame& frame) {
  ++info_.packets;
  frame.number = ++number_;
  frame.link_type = info_.interfaces[interface].link_type;
  frame.interface_index = static_cast<std::uint16_t>(interface);
  frame.flag = PacketFlag::kNone;
  frame.damaged = false;
  frame.fcs_bytes = 0;
  frame.original_length = original_length;
  frame.bytes = bytes;
}

void PcapngSource::AddComment(FrameNo frame, ByteSpan text) {
  if (info_.comments.size() < kMaxComments) info_.comments.push_back({frame, Text(text, kMaxCommentBytes)});
}

void PcapngSource::CountDropped(std::size_t interface) {
  const InterfaceState& state = interfaces_[interface];
  info_.interfaces[interface].dropped = std::max(state.dropped_by_packets, state.dropped_by_statistics);
}

BlockResult PcapngSource::Damaged(std::string message, std::optional<std::uint64_t> offset) {
  last_block_ = 0;
  info_.damage = Damage{std::move(message), offset.value_or(stream_->offset()), number_};
  return BlockResult::kDamaged;
}

BlockResult PcapngSource::EndsInside(const std::string& what, std::optional<std::uint64_t> offset) {
  if (stream_->stopped()) return BlockResult::kEnd;
  return Damaged(stream_->error().empty() ? "file ends inside " + what : StreamDamage(*stream_, number_), offset);
}

}  // namespace

Result<std::unique_ptr<FrameSource>> OpenPcapng(std::unique_ptr<InputStream> stream, const std::string& name) {
  auto source = std::make_unique<PcapngSource>(std::move(stream), name);
  const std::string problem = source->Start();
  if (!problem.empty()) return Error{DisplayName(name) + " is not a readable capture: " + problem};
  return std::unique_ptr<FrameSource>(std::move(source));
}

}  // namespace ecaudit::capture
