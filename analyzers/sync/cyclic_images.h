/// in: frames that carried process data, and when.  out: the rhythm of each logical address by every clock.
///
/// keeps: the first CyclicImages::kMost logical addresses; later ones are not measured.
#pragma once

#include <array>
#include <cstdint>
#include <utility>

#include "analyzers/sync/interval_statistics.h"
#include "analyzers/sync/time_base.h"
#include "decoder/wire/command.h"

namespace ecaudit::sync {

/// Frames that a median has to rest on.
inline constexpr std::uint64_t kEnoughIntervals = 20;

/// The cyclic process data of one logical address, and their rhythm by every clock.
struct CyclicImage {
  bool used = false;
  wire::Command command = wire::Command::NOP;
  std::uint32_t address = 0;
  FrameTime last;
  bool last_was_sent = false;  ///< its outbound copy is in the capture: the time is that of its sending
  FrameNo gap_from = 0;        ///< last frame but one ...
  Interval gap;                ///< ... and how far it lies before the last, for all slaves that both of them fed
  Interval rhythm;             ///< the same by rhythm_base(); kNone: that clock does not show it
  IntervalStatistics by_dc, by_esl, by_stamp;
  /// Median of the last intervals between frames that a slave accepted, renewed now and then: masters change their
  /// cycle. Once slaves are in OP it is theirs: before, masters may send in another rhythm.
  TimeNs nominal_ns = 0;
  TimeNs spread_ns = 0;          ///< half of these intervals lie within this
  std::uint64_t nominal_of = 0;  ///< intervals so far when it was renewed

  static constexpr std::size_t kSent = 16;
  std::array<FrameNo, kSent> sent{};  ///< outbound frames with these data, the newest at sent_count - 1
  std::uint64_t sent_count = 0;

  [[nodiscard]] std::pair<const IntervalStatistics*, TimeBase> Best() const;
  /// The clock by which most intervals are measured. Intervals of two clocks are not compared: a master that sets the
  /// reference clock now and then leaves a few that only stamps measure.
  [[nodiscard]] TimeBase rhythm_base() const {
    const std::uint64_t all = by_stamp.count();
    if (by_dc.count() * 2 >= all && by_dc.count() > 0) return TimeBase::kDc;
    return by_esl.count() * 2 >= all && by_esl.count() > 0 ? TimeBase::kEsl : TimeBase::kCapture;
  }
  /// The median rests on enough intervals, and is none of 0. Where most of these lie before OP, those in OP keep to it.
  [[nodiscard]] bool has_nominal() const { return has_nominal_; }
  /// A frame with these data, once.
  /// @param was_sent its outbound copy is in the capture
  /// @param taken  a slave took part in them
  /// @param in_op  some slave whose data these are is in OP
  /// @return whether it is the next after the last one, so that `gap` and `rhythm` count as an interval
  bool Add(const FrameTime& time, bool was_sent, bool taken, bool in_op);

 private:
  /// True when `frame` is the next that was sent after `last`; frames that never returned, or in another order,
  /// would else count as cycles without data.
  [[nodiscard]] bool SentNext(FrameNo frame) const;
  /// Each clock for itself: which is best is known when all is measured.
  void AddInterval(const Intervals& since, const FrameRef& from, const FrameRef& to);
  [[nodiscard]] bool holds_in_op() const {
    return op_intervals_ >= kEnoughIntervals || (op_intervals_ > 0 && 2 * kept_ >= op_intervals_);
  }
  void Note(TimeNs interval, bool in_op);
  void RenewNominal(std::size_t count);
  [[nodiscard]] std::uint64_t CountKept() const;

  static constexpr std::size_t kRecent = 128;
  std::array<TimeNs, kRecent> recent_{};  // intervals, the newest at intervals_ - 1
  std::uint64_t intervals_ = 0;
  std::uint64_t counted_from_ = 0;  // those before are of another rhythm
  bool in_op_ = false;              // when the last frame came
  bool has_nominal_ = false;
  // The first ones since some slave is in OP, and those of them that are about nominal_ns.
  std::uint64_t op_intervals_ = 0, kept_ = 0;
};

class CyclicImages {
 public:
  static constexpr std::size_t kMost = 32;

  /// Of these process data, made when there is room for them; else null.
  CyclicImage* Find(wire::Command command, std::uint32_t address);
  /// @param image  of these
  [[nodiscard]] std::size_t NumberOf(const CyclicImage& image) const {
    return static_cast<std::size_t>(&image - images_.data());
  }
  /// An outbound frame carries these process data.
  void OnSent(wire::Command command, std::uint32_t address, FrameNo frame) {
    if (CyclicImage* image = Find(command, address)) image->sent[image->sent_count++ % CyclicImage::kSent] = frame;
  }
  /// No interval reaches back over here.
  void ForgetLast();
  /// The image that was exchanged most often; null when none was exchanged twice.
  [[nodiscard]] const CyclicImage* Busiest() const;

 private:
  std::array<CyclicImage, kMost> images_;
};

}  // namespace ecaudit::sync
