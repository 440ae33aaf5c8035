/// in: the first frames of a capture.  out: which of its interfaces were at one bus, and which at another.
///
/// A machine with two masters, or two captures put together, hold two busses: what is sent on an interface comes back
/// on it, and on no other one. A tap hands returns to another interface, so do both ends of a redundant line while it
/// is whole (broken, both ends still send the same at once), and of a bridge each packet is seen on both interfaces.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "decoder/bus/direction.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::bus {

class InterfaceGroups {
 public:
  /// Captures with frames on more interfaces than this are taken for one bus.
  static constexpr std::size_t kMost = 8;

  /// Examines one frame of the look-ahead window.
  void Learn(const wire::FrameView& frame) noexcept;
  /// Ends the look-ahead. The bus is the one of which most is seen.
  /// @param described  interfaces that the capture describes so far: those without a frame in the window may get some
  void Finish(std::size_t described) noexcept;

  /// True for a frame on an interface that was at another bus: both copies of its frames were seen there. So it is for
  /// one that was not there in the window, while on the bus' own ones all was seen that was sent, unless the frame was
  /// seen there as well. To be asked of each frame, in order.
  [[nodiscard]] bool IsOther(const wire::FrameView& frame) noexcept;

 private:
  struct Seen {
    std::uint64_t key = 0;   ///< with the sender's address; 0: none
    std::uint64_t what = 0;  ///< the same without indices and sender
    std::uint64_t content = 0;
    Progress progress;
    FrameRef frame;
    std::uint64_t sender = 0;
    std::size_t at = 0;  ///< place of the interface
    std::uint8_t index = 0;
    bool mac_bit = false;
    bool only_broadcast = false;
    bool answered = false;
    bool taken = false;  ///< each slave that it names took part
  };
  struct Interface {
    std::uint16_t number = 0;
    std::uint32_t frames = 0;
    std::uint32_t pairs = 0;                           ///< frames that came back here, of those that were sent here
    std::array<std::uint32_t, kMost> crossed{};        ///< ... of those that were sent there
    std::array<std::uint32_t, kMost> copies{};         ///< seen there as well
    std::array<std::uint32_t, kMost> at_once{};        ///< sent there at once, by another sender ...
    std::array<std::uint32_t, kMost> both_accepted{};  ///< ... and the slaves that are named took part here and there
    std::size_t group = 0;
  };

  [[nodiscard]] std::optional<std::size_t> PlaceOf(std::uint16_t interface) noexcept;
  [[nodiscard]] static Seen FindCopy(const wire::FrameView& frame) noexcept;
  [[nodiscard]] static Seen Look(const wire::FrameView& frame, std::size_t at) noexcept;
  void Keep(const Seen& seen) noexcept;
  void Compare(const Seen& seen) noexcept;
  [[nodiscard]] bool IsCopy(const Seen& seen) const noexcept;
  [[nodiscard]] bool AreLinked(std::size_t a, std::size_t b) const noexcept;

  std::array<Interface, kMost> interfaces_{};
  std::size_t count_ = 0;
  bool too_many_ = false;
  std::array<Seen, 64> last_{};
  std::size_t next_ = 0;
  std::array<bool, kMost> other_{};
  std::array<bool, kMost> begun_{};  ///< so little was seen of it that it is as if it came later
  bool closed_ = false;              ///< what is sent on the bus' interfaces comes back on them
  bool awaits_more_ = false;         ///< of interfaces of which little or nothing was seen
};

}  // namespace ecaudit::bus
