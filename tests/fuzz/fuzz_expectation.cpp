/// Expectations of start-ups, JSON or ENI: any text is read or refused with a reason; a start-up that goes exactly as
/// expected deviates in nothing; what is saved of it can be read again.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "analyzers/compare/comparison.h"
#include "analyzers/result/analysis_result.h"
#include "analyzers/result/expectation.h"
#include "cli/expectation_file.h"
#include "tests/fuzz/memory_file.h"

namespace {

using namespace ecaudit;

void Check(bool condition) {
  if (!condition) std::abort();
}

/// The step as it happens when the master does what is expected.
StartupStep Done(const startup::ExpectedStep& expected, FrameNo frame) {
  StartupStep step;
  step.key = expected.key;
  step.phase = expected.phase;
  step.frame.number = step.last.number = frame;
  step.name = expected.name;
  if (expected.data) step.data = *expected.data;
  if (expected.number) {
    for (unsigned i = 0; i < 8; ++i) {
      step.data.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(*expected.number) >> 8U * i));
    }
  }
  step.size = step.data.size();
  return step;
}

std::vector<StartupStep> Done(const std::vector<startup::ExpectedStep>& expected) {
  std::vector<StartupStep> steps;
  for (const startup::ExpectedStep& step : expected) steps.push_back(Done(step, steps.size() + 1));
  return steps;
}

AnalysisResult ResultAsExpected(const startup::Expectation& expectation) {
  AnalysisResult result;
  result.bus.startup.seen = true;
  result.bus.startup.steps = Done(expectation.bus);
  for (const startup::ExpectedSlave& expected : expectation.slaves) {
    SlaveSummary& slave = result.slaves.emplace_back();
    slave.id = static_cast<SlaveId>(result.slaves.size() - 1);
    slave.position = expected.position;
    slave.identity.vendor_id = expected.vendor_id;
    slave.identity.product_code = expected.product_code;
    slave.identity.revision = expected.revision;
    slave.name = expected.name;
    slave.startup.seen = true;
    slave.startup.steps = Done(expected.steps);
  }
  return result;
}

bool SameKeys(const std::vector<startup::ExpectedStep>& a, const std::vector<startup::ExpectedStep>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i].key != b[i].key) return false;
  }
  return true;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::MemoryFile file(std::string_view(reinterpret_cast<const char*>(data), size));
  const auto expectation = cli::ReadExpectation(file.path());
  Check(expectation || !expectation.error().message.empty());
  if (!expectation) return 0;
  const startup::Expectation& expected = **expectation;

  const auto as_expected = [&](const std::vector<startup::ExpectedStep>& steps) {
    return startup::CompareSteps(steps, Done(steps), expected.separate_mailbox, true).empty();
  };
  Check(as_expected(expected.bus));
  for (const startup::ExpectedSlave& slave : expected.slaves) Check(as_expected(slave.steps));

  AnalysisResult result = ResultAsExpected(expected);
  (void)startup::Compare(expected, result);
  const fuzz::MemoryFile saved(cli::WriteExpectation(result));
  const auto again = cli::ReadExpectation(saved.path());
  Check(again.has_value());
  Check(SameKeys((*again)->bus, expected.bus) && (*again)->slaves.size() == expected.slaves.size());
  for (std::size_t i = 0; i < expected.slaves.size(); ++i) {
    Check(SameKeys((*again)->slaves[i].steps, expected.slaves[i].steps));
  }

  // Something else than expected: half of the slaves, and half of their steps.
  result.slaves.resize(result.slaves.size() / 2);
  for (SlaveSummary& slave : result.slaves) slave.startup.steps.resize(slave.startup.steps.size() / 2);
  (void)startup::Compare(expected, result);
  return 0;
}
