#include "decoder/capture/fcs_finder.h"

#include <cstddef>

#include <zlib.h>

#include "decoder/base/bytes.h"

namespace ecaudit::capture {
namespace {

constexpr std::size_t kEthernetHeader = 14;
constexpr std::size_t kShortestFrame = 60;  // without FCS, as it is on the wire
constexpr std::uint16_t kEtherCat = 0x88A4;

/// The last four bytes are the checksum of those before.
bool Matches(ByteSpan bytes) {
  if (bytes.size() < kEthernetHeader + FcsFinder::kBytes) return false;
  const std::size_t size = bytes.size() - FcsFinder::kBytes;
  const auto sum = static_cast<std::uint32_t>(crc32(0, bytes.data(), static_cast<unsigned>(size)));
  return LittleEndian<std::uint32_t>(bytes, size) == sum;
}

/// Without the last four bytes it is still a frame, and they are no part of its datagrams: what a file declares may be
/// wrong of the frames that the recording machine sent.
bool HasRoom(const CapturedFrame& frame) {
  if (frame.original_length < kShortestFrame + FcsFinder::kBytes) return false;
  if (!Fits(frame.bytes, kEthernetHeader, 2)) return true;
  if (BigEndian<std::uint16_t>(frame.bytes, kEthernetHeader - 2) != kEtherCat) return true;
  const std::size_t length = LittleEndian<std::uint16_t>(frame.bytes, kEthernetHeader) & 0x07FFU;
  return kEthernetHeader + 2 + length + FcsFinder::kBytes <= frame.original_length;
}

}  // namespace

std::uint8_t FcsFinder::Examine(const CapturedFrame& frame, bool declared) noexcept {
  if (frame.link_type != static_cast<std::uint16_t>(LinkType::kEthernet)) return 0;
  // Whether there is room is cheap to see, and nearly always so.
  if (declared || state_ == State::kDeclared) return HasRoom(frame) || Matches(frame.bytes) ? kBytes : 0;
  if (frame.bytes.size() < frame.original_length) return 0;
  const bool matches = Matches(frame.bytes);
  if (matches) {
    state_ = State::kSome;
  } else if (state_ == State::kUnknown && --probes_left_ == 0) {
    state_ = State::kNone;
  }
  return matches ? kBytes : 0;
}

}  // namespace ecaudit::capture
