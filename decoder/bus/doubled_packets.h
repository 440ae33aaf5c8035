/// in: FrameView.  out: whether it is the packet before it once more.
///
/// A mirror port that mirrors both ways, or a bridge both of whose interfaces are captured, writes every packet twice.
/// A master's own repetition looks the same where the address does not show what came back, so it is the capture as a
/// whole that shows: frames that slaves took part in do not come twice directly one after the other, all of them. Where
/// only what came back stands there twice it may be the line that brought it twice. Where only what was sent stands
/// there twice, and came back once, it is the recorder as well: it has seen the frames before and after a bridge.
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
  /// True for the second one of two, where packets stand in the capture twice. To be asked of each frame, in order.
  [[nodiscard]] bool IsSecond(const wire::FrameView& frame) noexcept;

 private:
  enum class Twice : std::uint8_t { kNone, kSent, kAll };

  struct Seen {
    std::uint64_t key = 0;
    std::uint64_t content = 0;
    FrameRef frame;
    bool twice = false;
  };

  /// The newest frames.
  struct Window {
    std::array<Seen, 8> last{};
    std::size_t next = 0;
    /// True when it is one of them once more, and no other copy of that frame stands between them; else it is added.
    bool Match(const wire::FrameView& frame, std::int64_t together_ns) noexcept;
  };

  /// Frames, and of these those that stand there once more.
  struct Count {
    std::uint32_t once = 0;
    std::uint32_t twice = 0;
    void Add(bool again) noexcept { ++(again ? twice : once); }
  };

  Window window_;       ///< of all frames
  Window sent_window_;  ///< of those that no slave took part in: another copy of one may come after its return
  Count taken_;         ///< that slaves took part in
  Count others_;        ///< most of them on their way out
  Count sent_;          ///< these as in `sent_window_`
  Twice twice_ = Twice::kNone;
};

}  // namespace ecaudit::bus
