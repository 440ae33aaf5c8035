/// What the program writes beside the captures: the table for people and the same for tests.
#pragma once

#include <string>
#include <vector>

#include "samples/builder/scenarios/scenario.h"

namespace ecaudit::samples {

struct MadeSample {
  const Scenario* scenario = nullptr;
  Sample sample{};
  [[nodiscard]] std::string file_name() const { return std::string(scenario->name) + "." + sample.extension; }
};

[[nodiscard]] std::vector<MadeSample> MakeAll();
/// samples/README.md.
[[nodiscard]] std::string ReadmeText(const std::vector<MadeSample>& made);
/// samples/captures/expected.json: for each file its packets and the findings of a correct report.
[[nodiscard]] std::string ExpectedJson(const std::vector<MadeSample>& made);

}  // namespace ecaudit::samples
