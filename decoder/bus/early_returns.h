/// Returns that stand before their outbound copies in the file: interfaces and receive queues, each with a buffer of
/// its own, are not always written in order.
#pragma once

#include <array>
#include <cstdint>
#include <utility>

#include "decoder/bus/round_trip.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::bus {

class EarlyReturns {
 public:
  struct Return {
    std::uint64_t key = 0;
    FrameRef ref;
    std::uint16_t interface_index = 0;
    bool counted_as_missed = false;

    /// The time stamps have to show it, unless the clocks of the interfaces differ. On one interface equal stamps show
    /// nothing: a later frame of a master that uses one index only looks the same.
    [[nodiscard]] bool IsOf(const wire::FrameView& sent, bool clocks_differ) const noexcept {
      if (!ref.seen() || key != sent.key() || !AreTimed(sent.ref(), ref)) return false;
      const bool one_interface = interface_index == sent.interface_index();
      const std::int64_t least = one_interface ? 1 : clocks_differ ? -threshold::kSkewNs : 0;
      const std::int64_t apart = Elapsed(sent.ref(), ref);
      return apart >= least && apart <= threshold::kRecentNs;
    }
  };

  void Add(const wire::FrameView& returned, bool counted_as_missed) noexcept {
    any_ = true;
    last_[next_] = {returned.key(), returned.ref(), returned.interface_index(), counted_as_missed};
    next_ = (next_ + 1) % last_.size();
  }
  /// The return of this outbound frame, each once. @return ref not seen: none
  [[nodiscard]] Return Take(const wire::FrameView& sent, bool clocks_differ) noexcept {
    if (!any_) return {};  // nearly always
    for (Return& early : last_) {
      if (early.IsOf(sent, clocks_differ)) return std::exchange(early, {});
    }
    return {};
  }

 private:
  std::array<Return, 8> last_{};
  std::size_t next_ = 0;
  bool any_ = false;
};

}  // namespace ecaudit::bus
