/// in: logical datagrams with outputs.  out: the pauses of all process data on the bus.
///
/// Where the capture does not show the FMMUs of a slave, it is not known which datagrams are its outputs. But where no
/// slave got any, it got none.
///
/// keeps: the last pauses.
#pragma once

#include <array>
#include <optional>

#include "analyzers/judge/rule_context.h"
#include "analyzers/result/finding_kind.h"
#include "decoder/base/ids.h"
#include "decoder/base/time.h"
#include "decoder/track/events.h"

namespace ecaudit {

inline constexpr NoteKind kAllPaused{
    .name = "process-data-paused",
    .text =
        R"(From {paused_from} to {paused_to}, for {pause_ms}, no slave got outputs (LRW, LWR). The FMMUs of this slave
are not in the capture: which of them are its own is not known.)"};
/// For the title of what such a pause may have caused.
inline constexpr Word kWhyPaused{"process-data-paused", "no outputs"};

class ProcessDataPauses {
 public:
  struct Pause {
    FrameRef from, to;  ///< the frames before and after it

    [[nodiscard]] TimeNs length() const { return Elapsed(from.time, to.time); }
  };

  void On(const track::LogicalAccess& access);
  /// The longest pause in which a watchdog may have expired that shows in frame `now`, and did not in frame `before`.
  /// Outputs that have not come again by `now` are a pause, too.
  [[nodiscard]] std::optional<Pause> LongestBetween(FrameNo before, const FrameRef& now) const;
  /// The same as possible reason of AL status code 0x001B, which a slave of unknown FMMUs shows in frame `now`. Where
  /// they are known, sync-watchdog-margin measures the outputs of the slave itself.
  [[nodiscard]] std::optional<Pause> ReasonOf(const RuleContext& context, SlaveId slave, FrameNo before,
                                              const FrameRef& now) const;

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
  TimeNs usual_ = 0;  ///< the shorter ones of the last two intervals, over and over: a single pause does not change it
  TimeNs interval_ = 0;
  std::array<Pause, 4> pauses_{};
  std::size_t next_ = 0;
};

[[nodiscard]] Note NoteOf(const ProcessDataPauses::Pause& pause);

}  // namespace ecaudit
