#include "cli/expected_rungs.h"

#include <algorithm>

#include "analyzers/compare/slave_matches.h"
#include "analyzers/result/progress.h"
#include "decoder/esc/al.h"

namespace ecaudit::startup {
namespace {

constexpr std::uint32_t kEnableOperation = 0x0008;

bool Expects(const ExpectedSlave& slave, StartupKey::Kind kind, auto&& fits) {
  return std::ranges::any_of(slave.steps, [&](const ExpectedStep& step) {
    return step.succeeds && step.key.kind == kind && fits(step.key.address);
  });
}

bool IsThere(const Rung* rung) {
  if (rung == nullptr || rung->status == RungStatus::kReached || rung->status == RungStatus::kUnknown) return true;
  return rung->status == RungStatus::kLost;  // what comes after the start-up is not its matter
}

void AddMissing(const SlaveSummary& slave, const SlaveNames& names, const Rung* rung,
                std::vector<std::string>& missing) {
  if (IsThere(rung)) return;
  std::string text = names.Of(slave.position) + ": " + std::string(rung->rung->text) +
                     " is expected and has the status " + std::string(Name(rung->status));
  if (rung->why != nullptr) text += " (" + std::string(rung->why->text) + ")";
  missing.push_back(std::move(text));
}

bool IsReported(const SlaveSummary& slave, const AnalysisResult& result) {
  return std::ranges::any_of(result.findings, [&](const Finding& finding) { return finding.slave == slave.id; });
}

bool EndsBefore(const SlaveSummary& slave, const AnalysisResult& result) {
  return std::ranges::any_of(result.not_evaluable, [&](const NotEvaluable& entry) {
    return entry.slave == slave.id && entry.reason.code == ReasonCode::kCaptureEnds;
  });
}

}  // namespace

std::vector<std::string> RungsMissing(const Expectation& expectation, const AnalysisResult& result) {
  std::vector<std::string> missing;
  const std::vector<SlaveMatch> matches = MatchSlaves(expectation.slaves, result.slaves);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!matches[i].place) continue;
    const ExpectedSlave& expected = expectation.slaves[i];
    const SlaveSummary& slave = result.slaves[*matches[i].place];
    if (IsReported(slave, result) || EndsBefore(slave, result)) continue;
    if (Expects(expected, StartupKey::Kind::kRequest,
                [](std::uint32_t state) { return state == static_cast<std::uint32_t>(esc::AlState::OP); })) {
      AddMissing(slave, result.slave_names, slave.progress.Find("op"), missing);
    }
    if (!Expects(expected, StartupKey::Kind::kDrive,
                 [](std::uint32_t word) { return (word & kEnableOperation) != 0; })) {
      continue;
    }
    for (const AxisLadder& axis : slave.axes)
      AddMissing(slave, result.slave_names, axis.ladder.Find("enabled"), missing);
  }
  return missing;
}

}  // namespace ecaudit::startup
