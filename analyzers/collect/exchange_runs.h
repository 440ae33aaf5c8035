/// in: what a slave did with its process data, datagram by datagram.  out: ExchangeLane.
///
/// keeps: at most kMost runs.
#pragma once

#include <cstdint>

#include "analyzers/model/exchange.h"
#include "analyzers/result/timeline.h"

namespace ecaudit::timeline {

class ExchangeRuns {
 public:
  static constexpr std::size_t kMost = 300;

  void Add(const FrameRef& frame, model::Exchange exchange) {
    using Kind = ExchangeRun::Kind;
    if (!frame.has_time) return;
    const Kind kind = exchange == model::Exchange::kNo        ? Kind::kMissing
                      : exchange == model::Exchange::kUnknown ? Kind::kUnclear
                                                              : Kind::kTaken;
    const bool pause = Pauses(frame);
    std::vector<ExchangeRun>& runs = lane_.runs;
    if (runs.empty() || pause || runs.back().kind != kind) {
      if (runs.size() < kMost) {
        runs.push_back({kind, frame, frame, 1});
        return;
      }
      lane_.left_out = true;
    }
    runs.back().last = frame;
    ++runs.back().count;
  }
  [[nodiscard]] const ExchangeLane& lane() const { return lane_; }

 private:
  static constexpr std::uint64_t kEnough = 8;       ///< intervals that a rhythm takes
  static constexpr TimeNs kPauseOf = 5;             ///< times as long as usual is a pause ...
  static constexpr TimeNs kLeastPause = 2'000'000;  ///< ... but no shorter one than this

  /// Follows the rhythm; true when this frame is late by far.
  bool Pauses(const FrameRef& frame) {
    const TimeNs interval = frame.time - last_;
    const bool first = intervals_ == 0 && lane_.runs.empty();
    last_ = frame.time;
    if (first || interval < 0) return false;
    if (intervals_ >= kEnough && interval > kPauseOf * usual_ && interval > kLeastPause) return true;
    usual_ = intervals_ == 0 ? interval : usual_ + (interval - usual_) / 16;
    ++intervals_;
    return false;
  }

  ExchangeLane lane_;
  TimeNs last_ = 0;
  TimeNs usual_ = 0;
  std::uint64_t intervals_ = 0;
};

}  // namespace ecaudit::timeline
