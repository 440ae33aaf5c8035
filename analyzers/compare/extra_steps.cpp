#include "analyzers/compare/extra_steps.h"

#include <algorithm>

#include "analyzers/compare/startup_registers.h"

namespace ecaudit::diff {
namespace {

bool SameStep(const StartupStep& a, const StartupStep& b) {
  return a.key == b.key && (a.volatile_value || (a.size == b.size && startup::SameValue(a.key, a.data, b.data)) ||
                            a.key.kind == StartupKey::Kind::kUpload);
}

const StartupStep* FindSame(const StartupSummary& startup, const StartupStep& step) {
  const auto found =
      std::ranges::find_if(startup.steps, [&](const StartupStep& other) { return SameStep(step, other); });
  return found == startup.steps.end() ? nullptr : &*found;
}

std::size_t Times(const StartupSummary& startup, const StartupStep& step) {
  return static_cast<std::size_t>(
      std::ranges::count_if(startup.steps, [&](const StartupStep& other) { return SameStep(step, other); }));
}

}  // namespace

ExtraSteps SortOut(const std::vector<const StartupStep*>& extra, const StartupSummary& here,
                   const StartupSummary& there) {
  ExtraSteps out;
  for (const StartupStep* step : extra) {
    const auto first = std::ranges::find(there.steps, step->key, &StartupStep::key);
    if (first == there.steps.end()) {
      out.fresh.push_back(step);
      continue;
    }
    if (std::ranges::any_of(out.again, [&](const StepAgain& known) { return SameStep(*known.step, *step); })) {
      continue;
    }
    StepAgain& again = out.again.emplace_back();
    again.step = step;
    again.here = Times(here, *step);
    again.there = Times(there, *step);
    const StartupStep* same = FindSame(there, *step);
    again.same_value = same != nullptr;
    again.other = same != nullptr ? same : &*first;
    if (same == nullptr) again.as_there = FindSame(here, *again.other);
  }
  return out;
}

}  // namespace ecaudit::diff
