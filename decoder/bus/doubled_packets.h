/// in: FrameView.  out: whether it is the packet before it once more.
///
/// A mirror port that mirrors both ways, or a bridge both of whose interfaces are captured, writes every packet twice.
/// A master's own repetition looks the same where the address does not show what came back, so it is the capture as a
/// whole that shows: frames that slaves took part in do not come twice directly one after the other, all of them. Where
/// only what came back stands there twice it may be the line that brought it twice.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "decoder/wire/frame_view.h"

namespace ecaudit::bus {

class DoubledPackets {
 public:
  /// Examines one frame of the look-ahead window.
  void Learn(const wire::FrameView& frame) noexcept;
  /// Ends the look-ahead.
  void Finish() noexcept;
  /// True where packets stand in the capture twice.
  [[nodiscard]] bool found() const { return found_; }
  /// True for the second one of two, where they do. To be asked of each frame, in order.
  [[nodiscard]] bool IsSecond(const wire::FrameView& frame) noexcept;

 private:
  struct Seen {
    std::uint64_t key = 0;
    std::uint64_t content = 0;
    FrameRef frame;
    bool twice = false;
  };

  bool Match(const wire::FrameView& frame) noexcept;

  std::array<Seen, 8> last_{};
  std::size_t next_ = 0;
  /// Frames, and of these those that stand there once more.
  struct Count {
    std::uint32_t once = 0;
    std::uint32_t twice = 0;
  };
  Count taken_;   ///< that slaves took part in
  Count others_;  ///< most of them on their way out
  bool found_ = false;
};

}  // namespace ecaudit::bus
