#include "decoder/capture/pcapng_writer.h"

#include <algorithm>

#include "decoder/capture/pcapng_block.h"

namespace ecaudit::capture {
namespace {

constexpr std::uint16_t kShbUserApplication = 4;
constexpr std::uint64_t kSectionLengthUnknown = ~std::uint64_t{0};
constexpr std::uint64_t kNsPerSecond = 1'000'000'000;
constexpr std::uint8_t kBinary = 0x80;

/// At most `limit` bytes of `text`, cut between UTF-8 characters.
std::string_view Cut(std::string_view text, std::size_t limit) {
  std::size_t length = std::min(text.size(), limit);
  while (length > 0 && length < text.size() && (static_cast<unsigned char>(text[length]) & 0xC0U) == 0x80U) --length;
  return text.substr(0, length);
}

}  // namespace

PcapngWriter::Clock PcapngWriter::ClockOf(std::int64_t resolution_ns) {
  std::int64_t step = kNsPerSecond;
  for (std::uint8_t digits = 0; digits <= 9; ++digits, step /= 10) {
    if (step == resolution_ns) return {digits};
  }
  // Interface::resolution_ns of 2^-n seconds is rounded up; down to 2^-29 no two of them are the same.
  for (std::uint8_t bits = 1; bits <= 29; ++bits) {
    const std::uint64_t one = std::uint64_t{1} << bits;
    if (static_cast<std::int64_t>((kNsPerSecond + one - 1) / one) == resolution_ns) {
      return {static_cast<std::uint8_t>(kBinary | bits)};
    }
  }
  return {};
}

std::uint64_t PcapngWriter::Clock::Ticks(TimeNs time) const {
  const auto ns = static_cast<std::uint64_t>(std::max<TimeNs>(time, 0));
  if ((tsresol & kBinary) != 0) {
    // The reader rounded down, so the ticks are the least that give this time.
    const std::uint64_t seconds = ns / kNsPerSecond;
    const std::uint64_t rest = ns % kNsPerSecond;
    const unsigned bits = tsresol & 0x7FU;
    return (seconds << bits) + ((rest << bits) + kNsPerSecond - 1) / kNsPerSecond;
  }
  std::uint64_t divisor = 1;
  for (unsigned digits = tsresol; digits < 9; ++digits) divisor *= 10;
  return ns / divisor;
}

void PcapngWriter::U16(std::uint16_t value) {
  for (unsigned shift = 0; shift < 16; shift += 8) out_ += static_cast<char>(value >> shift & 0xFFU);
}

void PcapngWriter::U32(std::uint32_t value) {
  for (unsigned shift = 0; shift < 32; shift += 8) out_ += static_cast<char>(value >> shift & 0xFFU);
}

void PcapngWriter::U64(std::uint64_t value) {
  U32(static_cast<std::uint32_t>(value & 0xFFFFFFFFU));
  U32(static_cast<std::uint32_t>(value >> 32U));
}

void PcapngWriter::Stamp(std::uint64_t ticks) {
  U32(static_cast<std::uint32_t>(ticks >> 32U));
  U32(static_cast<std::uint32_t>(ticks & 0xFFFFFFFFU));
}

void PcapngWriter::Data(ByteSpan bytes) {
  out_.append(bytes.begin(), bytes.end());
  out_.append(pcapng::Padded(bytes.size()) - bytes.size(), '\0');
}

void PcapngWriter::Option(std::uint16_t code, std::string_view value) {
  U16(code);
  U16(static_cast<std::uint16_t>(value.size()));
  out_ += value;
  out_.append(pcapng::Padded(value.size()) - value.size(), '\0');
}

void PcapngWriter::Begin(std::uint32_t type) {
  block_ = out_.size();
  U32(type);
  U32(0);
}

void PcapngWriter::End() {
  const auto length = static_cast<std::uint32_t>(out_.size() - block_ + pcapng::kTrailerBytes);
  for (std::size_t i = 0; i < 4; ++i) out_[block_ + 4 + i] = static_cast<char>(length >> (8 * i) & 0xFFU);
  U32(length);
}

void PcapngWriter::BeginSection(std::string_view application, std::string_view comment) {
  Begin(pcapng::kSectionHeader);
  U32(pcapng::kByteOrderMagic);
  U16(1);
  U16(0);
  U64(kSectionLengthUnknown);
  if (!comment.empty()) Option(pcapng::kOptComment, Cut(comment, kMaxCommentBytes));
  Option(kShbUserApplication, application);
  EndOfOptions();
  End();
}

void PcapngWriter::AddInterface(const Interface& interface) {
  const Clock clock = ClockOf(interface.resolution_ns);
  clocks_.push_back(clock);
  Begin(pcapng::kInterfaceDescription);
  U16(interface.link_type);
  U16(0);
  U32(interface.snap_length);
  if (!interface.name.empty()) Option(pcapng::kIfName, interface.name);
  Option(pcapng::kIfTsResol, std::string(1, static_cast<char>(clock.tsresol)));
  EndOfOptions();
  End();
}

void PcapngWriter::AddPacket(const CapturedFrame& frame, std::span<const std::string> comments) {
  if (frame.interface_index >= clocks_.size()) return;
  if (frame.has_time) last_time_ = frame.time;
  Begin(pcapng::kEnhancedPacket);
  U32(frame.interface_index);
  Stamp(frame.has_time ? clocks_[frame.interface_index].Ticks(frame.time) : 0);
  U32(static_cast<std::uint32_t>(frame.bytes.size()));
  U32(frame.original_length);
  Data(frame.bytes);
  for (const std::string& comment : comments) Option(pcapng::kOptComment, Cut(comment, kMaxCommentBytes));
  std::uint32_t flags = pcapng::FcsFlags(frame.fcs_bytes);
  if (frame.flag != PacketFlag::kNone) flags |= frame.flag == PacketFlag::kInbound ? 1U : 2U;
  if (flags != 0) {
    U16(pcapng::kPacketFlags);
    U16(4);
    U32(flags);
  }
  if (!comments.empty() || flags != 0) EndOfOptions();
  End();
}

void PcapngWriter::AddStatistics(const std::vector<Interface>& interfaces) {
  for (std::size_t i = 0; i < interfaces.size() && i < clocks_.size(); ++i) {
    if (!interfaces[i].dropped) continue;
    Begin(pcapng::kInterfaceStatistics);
    U32(static_cast<std::uint32_t>(i));
    Stamp(clocks_[i].Ticks(last_time_));
    U16(pcapng::kIsbIfDrop);
    U16(8);
    U64(*interfaces[i].dropped);
    EndOfOptions();
    End();
  }
}

}  // namespace ecaudit::capture
