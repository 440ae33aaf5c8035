#include "cli/report/alike_steps.h"

#include <string>
#include <utility>

#include "cli/report/json_sections.h"
#include "cli/report/json_text.h"

namespace ecaudit::report {
namespace {

/// Steps are alike when a report would show the same of them.
std::string StepAsShown(const StartupStep& step) {
  JsonText text(JsonText::Layout::kLine);
  text.Object([&](JsonObject& json) { PutStepWhat(json, step); });
  return text.Take();
}

}  // namespace

AlikeSteps::AlikeSteps(std::span<const SlaveSummary> slaves) {
  if (slaves.size() < 2) return;
  std::vector<Row> shown;
  std::vector<std::pair<const StartupStep*, std::size_t>> in;
  std::unordered_map<std::string, std::size_t> index;
  for (const SlaveSummary& slave : slaves) {
    if (!slave.startup.seen) continue;
    for (const StartupStep& step : slave.startup.steps) {
      const std::size_t row = index.try_emplace(StepAsShown(step), shown.size()).first->second;
      if (row == shown.size()) shown.push_back({&step, {}});
      in.emplace_back(&step, row);
      std::vector<SlavePos>& positions = shown[row].slaves;
      if (positions.empty() || positions.back() != slave.position) positions.push_back(slave.position);
    }
  }
  std::vector<std::optional<std::size_t>> place(shown.size());
  for (std::size_t row = 0; row < shown.size(); ++row) {
    if (shown[row].slaves.size() < 2) continue;
    place[row] = rows_.size();
    rows_.push_back(std::move(shown[row]));
  }
  for (const auto& [step, row] : in) {
    if (place[row]) row_of_.emplace(step, *place[row]);
  }
}

std::optional<std::size_t> AlikeSteps::RowOf(const StartupStep& step) const {
  const auto row = row_of_.find(&step);
  return row == row_of_.end() ? std::nullopt : std::optional(row->second);
}

}  // namespace ecaudit::report
