/// in: CapturedFrame.  out: FrameView, as FrameView::Parse() makes it.
///
/// keeps: how frames of a few kinds were cut into datagrams.
///
/// Nearly every frame is like one before: as long, between the same addresses, with datagrams of the same commands and
/// lengths. Then it is cut at the same places, and nothing but that has to be examined.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "decoder/capture/frame_source.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::wire {

class FrameParser {
 public:
  /// @return the view; it borrows frame.bytes, and is valid until the next call
  [[nodiscard]] const FrameView& Parse(const capture::CapturedFrame& frame) noexcept;
  /// From now on frames are well formed if only their EtherCAT length is wrong.
  void AcceptLengths() { accepts_lengths_ = true; }

 private:
  /// Masters send few kinds of frames in a cycle, and each comes back.
  static constexpr std::size_t kShapes = 8;
  static constexpr std::size_t kDatagrams = 8;

  struct Shape {
    std::size_t size = 0;                 ///< of the packet; 0: no shape
    std::array<std::uint64_t, 2> head{};  ///< of the packet: both addresses, EtherType, EtherCAT header
    std::size_t next = 0;                 ///< the shape of the frame after the last one like this
    FrameView view;                       ///< of the last one
    /// Of each datagram: what has to be the same, and what of its header the frame's key is made of.
    std::array<std::uint64_t, kDatagrams> cut{}, kept{};
  };

  [[nodiscard]] static bool Fits(const Shape& shape, const capture::CapturedFrame& frame, std::uint64_t& key) noexcept;
  // Seldom, and so no part of Parse().
  [[gnu::noinline]] const FrameView& ParseWithFcs(const capture::CapturedFrame& frame) noexcept;
  [[gnu::noinline]] const FrameView& ParseAlone(const capture::CapturedFrame& frame) noexcept;
  [[gnu::noinline]] const FrameView& ParseAnew(const capture::CapturedFrame& frame) noexcept;

  std::array<Shape, kShapes> shapes_;
  std::size_t last_ = 0;   ///< shape of the frame before
  std::size_t given_ = 0;  ///< the shape that was made last
  bool accepts_lengths_ = false;
  FrameView other_;  ///< of a frame without shape
};

}  // namespace ecaudit::wire
