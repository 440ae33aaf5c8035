/// Findings that a lost frame may still explain. A lost frame is detected only after enough later frames returned, so
/// findings that it explains are held back until then.
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
  /// Older ones are reported: a loss is detected long before this many further findings.
  static constexpr std::size_t kMax = 64;

  void Add(DeferredFinding deferred) { held_.push_back(std::move(deferred)); }
  /// A frame of this slave was lost: the findings that it explains are dropped.
  void Lost(SlaveId slave, FrameNo frame) {
    std::erase_if(held_, [&](const DeferredFinding& d) {
      return d.finding.slave == slave && d.from < frame && frame < d.finding.first.number;
    });
  }
  /// Passes the oldest ones beyond kMax to `report(DeferredFinding)`.
  template <typename Report>
  void SettleOld(Report&& report) {
    Settle(kMax, report);
  }
  /// Passes on all that are left, at the end of the capture.
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
