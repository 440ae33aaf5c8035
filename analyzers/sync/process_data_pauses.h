/// in: logical datagrams.  out: the pauses of all outputs on the bus.
///
/// Where the capture does not show the FMMUs of a slave, it is not known which datagrams are its outputs. But where no
/// slave got any, it got none.
///
/// keeps: the last four pauses.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "decoder/base/ids.h"
#include "decoder/base/time.h"
#include "decoder/track/events.h"

namespace ecaudit::sync {

class ProcessDataPauses {
 public:
  struct Pause {
    FrameRef from, to;  ///< the frames before and after it, with time stamps

    [[nodiscard]] TimeNs length() const { return Elapsed(from.time, to.time); }
  };

  /// LRW and LWR that returned and that a slave took part in count, once for each frame.
  void On(const track::LogicalAccess& access);
  /// The longest pause in which a watchdog may have expired that shows in frame `now`, and did not in frame `before`
  /// (0: nothing is known of it before). Outputs that have not come again by `now` are a pause, too.
  /// @return unset: there is none, or `now` has no time stamp
  [[nodiscard]] std::optional<Pause> LongestBetween(FrameNo before, const FrameRef& now) const;

 private:
  /// No process data watchdog in use is shorter.
  static constexpr TimeNs kShortest = 10'000'000;
  /// A pause is this number of times as long as what is usual.
  static constexpr TimeNs kUnusual = 4;
  /// A slave shows that its watchdog expired within this time.
  static constexpr TimeNs kShows = 20'000'000;

  [[nodiscard]] bool IsPause(TimeNs length) const {
    return length >= kShortest && usual_ > 0 && length / kUnusual >= usual_;
  }

  FrameRef last_;
  TimeNs usual_ = 0;     ///< the shorter one of the last two intervals: a single long one does not change it
  TimeNs interval_ = 0;  ///< the last one that was no pause
  std::array<Pause, 4> pauses_{};
  std::size_t next_ = 0;
};

}  // namespace ecaudit::sync
