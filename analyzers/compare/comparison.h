/// Where a start-up differs from what is expected.
///
/// Steps are aligned as the longest common sequence of both. What is left over on both sides is the same step with
/// another value, or at another place; what is left over on one side is missing or unexpected. A step that has to
/// succeed and was refused, or waited for without result, is one that failed.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "analyzers/result/analysis_result.h"
#include "analyzers/result/expectation.h"
#include "analyzers/result/reason.h"

namespace ecaudit::startup {

/// Neighbouring missing steps of one phase are one deviation, likewise unexpected ones.
struct Deviation {
  enum class Kind : std::uint8_t {
    kMissing,
    kUnexpected,
    kOrder,
    kValue,
    kFailed,
    kNotShown,  ///< may have failed: the capture ends before, or the master did not read it
    kSlow,
    kSlaveMissing,
    kSlaveUnexpected,
    kSlaveMoved,
    kRevision,
  };
  Kind kind = Kind::kMissing;
  SlaveId slave = kNoSlave;  ///< kNoSlave: the bus
  StartupPhase phase = StartupPhase::kScan;
  /// Missing; value, order, failed: the one or ones it is about. A request that failed, and others after it.
  std::vector<const ExpectedStep*> expected{};
  std::vector<const StartupStep*> actual{};   ///< unexpected, value, failed; order: where they happened
  std::vector<const ExpectedStep*> behind{};  ///< failed: steps that a start-up did not come to for that
  const ExpectedSlave* expected_slave = nullptr;
  /// Missing: the step that came where these should have come, usually a state request; null at the end.
  const StartupStep* next = nullptr;
  const StartupStep* previous = nullptr;  ///< the last expected step that happened before
  /// Order: the expected step after which (order) it should have come; null: it should have been first.
  const ExpectedStep* after = nullptr;
  bool to_the_end = false;     ///< missing: nothing that is expected later happened
  FrameRef frame{};            ///< to cite
  TimeNs limit = 0, took = 0;  ///< slow
  SlavePos position = 0;       ///< slave moved: where it stands
  std::uint32_t revision = 0;  ///< revision: of the device that stands there
};

/// A slave whose start-up, or a part of it, the capture does not show, so that nothing can be compared.
struct NotCompared {
  SlaveId slave = kNoSlave;
  Reason reason;
  std::optional<Deviation::Kind> only;  ///< deviations of this kind alone cannot be reported; unset: none can
};

struct Comparison {
  std::vector<Deviation> deviations;  ///< slave by slave, in the order of what is expected
  std::vector<NotCompared> not_compared;
  std::size_t cut = 0;  ///< slaves that the master had not brought to OP yet when the capture ended
};

/// True when the step has the value that is expected.
[[nodiscard]] bool HasValue(const ExpectedStep& expected, const StartupStep& actual);

/// What differs in one sequence of steps.
/// @param separate_mailbox  see Expectation
/// @param strict  reports steps that are not expected
[[nodiscard]] std::vector<Deviation> CompareSteps(std::span<const ExpectedStep> expected,
                                                  std::span<const StartupStep> actual, bool separate_mailbox,
                                                  bool strict);

/// The result refers into `expectation` and `result`, which must outlive it and not change.
[[nodiscard]] Comparison Compare(const Expectation& expectation, const AnalysisResult& result);

/// The start-up of `result` as an expectation: values that vary between runs are left open, limits are not set.
[[nodiscard]] Expectation ExpectationOf(const AnalysisResult& result);

}  // namespace ecaudit::startup
