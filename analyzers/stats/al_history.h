/// in: AL requests and status reads.  out: the AL history of each slave for the report.
#pragma once

#include <deque>
#include <vector>

#include "analyzers/core/analysis_result.h"
#include "decoder/track/events.h"

namespace ecaudit {

class AlHistory {
 public:
  static constexpr std::size_t kMaxSteps = 200;  ///< a slave; later ones are counted only

  struct Story {
    std::vector<AlStep> steps;
    std::uint64_t left_out = 0;
    std::optional<std::uint16_t> status, code;  ///< last observed
  };

  void On(const track::AlRequest& request);
  void On(const track::AlStatusRead& read);
  void On(const track::AlStatusCodeRead& read);
  /// Empty for a slave that was never asked.
  [[nodiscard]] const Story& of(SlaveId slave) const;

 private:
  Story& Get(SlaveId slave);
  static void Add(Story& story, const AlStep& step);

  std::deque<Story> stories_;
  Story none_;
};

}  // namespace ecaudit
