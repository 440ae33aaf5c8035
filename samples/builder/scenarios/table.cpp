#include "samples/builder/scenarios/scenario.h"

namespace ecaudit::samples {
namespace {

constexpr Scenario kScenarios[] = {
    {"clean-startup", "One drive from the scan to OP, enabled and moved in about 100 cycles of 1 ms, and back to INIT.",
     "No findings.", CleanStartup},
};

}  // namespace

std::span<const Scenario> AllScenarios() {
  return kScenarios;
}

}  // namespace ecaudit::samples
