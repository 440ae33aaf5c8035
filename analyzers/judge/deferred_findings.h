/// Findings that a lost frame may still explain. That a frame was lost shows only when enough later ones came back, so
/// what looks odd because of it is held back until then.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>

#include "analyzers/result/finding.h"

namespace ecaudit {

struct DeferredFinding {
  FrameNo from = 0;  ///< a frame of this slave lost between `from` and finding.first explains it
  std::uint64_t key = 0;
  Finding finding;
};

class DeferredFindings {
 public:
  /// Older ones are settled: a loss is known long before so many more odd things have happened.
  static constexpr std::size_t kMax = 64;

  void Add(DeferredFinding deferred) { held_.push_back(std::move(deferred)); }
  /// A frame of this slave turns out to be lost: what it explains is dropped.
  void Lost(SlaveId slave, FrameNo frame) {
    std::erase_if(held_, [&](const DeferredFinding& d) {
      return d.finding.slave == slave && d.from < frame && frame < d.finding.first.number;
    });
  }
  /// Hands the oldest ones that are too many to `report(DeferredFinding)`.
  template <typename Report>
  void SettleOld(Report&& report) {
    Settle(kMax, report);
  }
  /// Hands out all that are left, at the end of the capture.
  template <typename Report>
  void SettleAll(Report&& report) {
    Settle(0, report);
  }

 private:
  template <typename Report>
  void Settle(std::size_t keep, Report&& report) {
    while (held_.size() > keep) {
      report(std::move(held_.front()));
      held_.pop_front();
    }
  }

  std::deque<DeferredFinding> held_;
};

}  // namespace ecaudit
