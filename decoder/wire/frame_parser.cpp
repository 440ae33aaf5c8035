#include "decoder/wire/frame_parser.h"

#include "decoder/base/bytes.h"

namespace ecaudit::wire {
namespace {

constexpr std::size_t kHeadBytes = 16;
constexpr std::size_t kWord = sizeof(std::uint64_t);
/// Command, and length with its flags: where a datagram ends, and whether another one follows.
constexpr std::uint64_t kCut = 0xFFFF'0000'0000'00FF;

/// A probe may have put its record after the frame (esc-reference 1.5): begins like one.
bool MayEndWithEsl(ByteSpan bytes) {
  constexpr std::size_t kEslBytes = 16;
  constexpr std::uint32_t kCookie = 0x1005'0101, kBothKinds = 0xFEFF'FFFF;
  return (LoadLittleEndian<std::uint32_t>(bytes.data() + bytes.size() - kEslBytes) & kBothKinds) == kCookie;
}

/// Nothing but its bytes shows where such a frame is cut.
bool IsPlain(const capture::CapturedFrame& frame) {
  return frame.link_type == static_cast<std::uint16_t>(capture::LinkType::kEthernet) && !frame.damaged &&
         frame.bytes.size() >= frame.original_length && frame.bytes.size() >= kHeadBytes && !MayEndWithEsl(frame.bytes);
}

}  // namespace

/// @param key of the frame, if it is of this shape
bool FrameParser::Fits(const Shape& shape, const capture::CapturedFrame& frame, std::uint64_t& key) noexcept {
  if (shape.size != frame.bytes.size()) return false;
  const std::uint8_t* const bytes = frame.bytes.data();
  if (LoadLittleEndian<std::uint64_t>(bytes) != shape.head[0] ||
      LoadLittleEndian<std::uint64_t>(bytes + kWord) != shape.head[1]) {
    return false;
  }
  // The first datagram is where it was, then; and so is each next one, as long as those before are the same.
  const std::uint16_t* offset = shape.view.offsets().data();
  std::uint64_t hash = shape.view.size();
  std::uint64_t different = 0;
  for (std::size_t i = 0; i < shape.view.size(); ++i) {
    const auto header = LoadLittleEndian<std::uint64_t>(bytes + offset[i]);
    different |= (header & kCut) ^ shape.cut[i];
    hash = FrameView::MixKey(hash, header & shape.kept[i]);
  }
  key = hash;
  return different == 0;
}

const FrameView& FrameParser::Parse(const capture::CapturedFrame& frame) noexcept {
  if (frame.fcs_bytes != 0) return ParseWithFcs(frame);
  if (!IsPlain(frame)) return ParseAlone(frame);
  std::uint64_t key = 0;
  std::size_t found = shapes_[last_].next;
  if (!Fits(shapes_[found], frame, key)) {
    for (found = 0; found < kShapes && !Fits(shapes_[found], frame, key); ++found) {
    }
    if (found == kShapes) return ParseAnew(frame);
  }
  shapes_[last_].next = found;
  last_ = found;
  FrameView& view = shapes_[found].view;
  view.MoveTo(frame, key);
  return view;
}

const FrameView& FrameParser::ParseWithFcs(const capture::CapturedFrame& frame) noexcept {
  return Parse(frame.WithoutFcs());
}

const FrameView& FrameParser::ParseAlone(const capture::CapturedFrame& frame) noexcept {
  other_ = FrameView::Parse(frame);
  if (accepts_lengths_) other_.AcceptLength();
  return other_;
}

const FrameView& FrameParser::ParseAnew(const capture::CapturedFrame& frame) noexcept {
  (void)ParseAlone(frame);
  if (other_.kind() != FrameKind::kEtherCat || other_.size() > kDatagrams || other_.vlan_tags() > 0 ||
      other_.encapsulation() != Encapsulation::kEthernet || other_.esl().present) {
    return other_;
  }
  given_ = (given_ + 1) % kShapes;
  Shape& shape = shapes_[given_];
  shape.view = other_;
  shape.size = frame.bytes.size();
  for (std::size_t i = 0; i < shape.head.size(); ++i) {
    shape.head[i] = LoadLittleEndian<std::uint64_t>(frame.bytes.data() + i * kWord);
  }
  for (std::size_t i = 0; i < shape.view.size(); ++i) {
    const DatagramView datagram = shape.view[i];
    shape.cut[i] = LoadLittleEndian<std::uint64_t>(datagram.bytes().data()) & kCut;
    shape.kept[i] = DatagramView::KeptMask(datagram.command());
  }
  shapes_[last_].next = given_;
  last_ = given_;
  return shape.view;
}

}  // namespace ecaudit::wire
