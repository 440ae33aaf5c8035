/// in: the frames of one sender in the order in which they were sent.  out: how fast it sends, and what fits between
/// two of its frames.
#pragma once

#include <cstdint>

#include "decoder/bus/index_sequence.h"
#include "decoder/bus/round_trip.h"

namespace ecaudit::bus {

class SendingRhythm {
 public:
  IndexSequence indices;
  FrameRef last;

  /// Learns from the distance to the frame before whether stamps are those of single frames.
  void CompareStamps(std::int64_t apart) noexcept;
  /// Learns the distance. @return true when a master that sends like this was silent for long
  bool TakeDistance(std::int64_t apart) noexcept;

  /// Enough frames show how far apart they are sent.
  [[nodiscard]] bool known() const noexcept {
    return longest_before_ns_ > 0 || frames_ >= threshold::kRhythmKnownFrames;
  }
  [[nodiscard]] std::int64_t mean_ns() const noexcept { return mean_ns_; }          ///< running average; 0: not known
  [[nodiscard]] std::int64_t shortest_ns() const noexcept { return shortest_ns_; }  ///< 0: not known
  /// How many indices the master has, if it may have used all of them once between two frames with the same one.
  /// @return 0: there was no time for that
  [[nodiscard]] std::uint32_t IndicesThatMayBeMissing(std::int64_t apart) const noexcept;
  /// True when the frames whose indices are skipped could be sent from one frame to the other, as fast as the wire or
  /// the master permits. Stamps that frames share, or that are too coarse for round trips, show nothing.
  [[nodiscard]] bool HasTimeForSkipped(const FrameRef& from, const FrameRef& to, const RoundTrip& trip) const noexcept;
  /// The same where the distance is known: the skipped frames follow one another no faster than those of late did.
  [[nodiscard]] bool HasTimeAtRate(std::int64_t apart) const noexcept;
  /// True when no more frames fit between one and the return of another than the one that returned.
  [[nodiscard]] bool OnlyOneFits(const FrameRef& sent, const FrameRef& returned) const noexcept;

 private:
  /// Stamps are those of an interrupt or of several clocks: many frames have the one of the frame before.
  [[nodiscard]] bool HasSharedStamps() const noexcept { return shared_score_ > threshold::kSharedScore; }

  std::int64_t mean_ns_ = 0;
  std::int64_t longest_ns_ = 0;         ///< longest distance of the frames counted in frames_ ...
  std::int64_t longest_before_ns_ = 0;  ///< ... and of kRhythmFrames before
  std::int64_t shortest_ns_ = 0;        ///< of all frames
  std::int64_t nearest_ns_ = 0;         ///< shortest distance of the frames counted in frames_; 0: not known ...
  std::int64_t nearest_before_ns_ = 0;  ///< ... and of kRhythmFrames before
  std::uint32_t frames_ = 0;
  int shared_score_ = 0;  ///< kSharedOneIn more for each stamp that is not later than the one before, else 1 less
};

}  // namespace ecaudit::bus
