/// Steps of the start-up that several slaves have alike. A master does nearly the same to forty drives: a report shows
/// it once, with the slaves, and of each slave only when.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "analyzers/result/analysis_result.h"

namespace ecaudit::report {

class AlikeSteps {
 public:
  struct Row {
    const StartupStep* step;  ///< of the first slave
    std::vector<SlavePos> slaves;
  };

  /// Borrows the steps of `slaves`.
  explicit AlikeSteps(std::span<const SlaveSummary> slaves);

  /// In the order in which the slaves have them.
  [[nodiscard]] const std::vector<Row>& rows() const { return rows_; }
  /// The row that holds a step; empty if only one slave has it.
  [[nodiscard]] std::optional<std::size_t> RowOf(const StartupStep& step) const;

 private:
  std::vector<Row> rows_;
  std::unordered_map<const StartupStep*, std::size_t> row_of_;
};

}  // namespace ecaudit::report
