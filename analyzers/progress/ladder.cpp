#include "analyzers/progress/ladder.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <span>

namespace ecaudit::progress {
namespace {

/// Whether "0-3, 7" names it.
bool Names(std::string_view positions, SlavePos position) {
  const char* at = positions.data();
  const char* const end = at + positions.size();
  while (at != end) {
    unsigned first = 0;
    const auto [after_first, wrong] = std::from_chars(at, end, first);
    if (wrong != std::errc()) {
      ++at;
      continue;
    }
    unsigned last = first;
    at = after_first;
    if (at != end && *at == '-') at = std::from_chars(at + 1, end, last).ptr;
    if (first <= position && position <= last) return true;
  }
  return false;
}

bool IsAbout(const Finding& finding, const SlaveSummary& slave) {
  if (finding.slave != kNoSlave) return finding.slave == slave.id;
  return Names(finding.affected.positions, slave.position);
}

}  // namespace

FindingIndex RootOf(const AnalysisResult& result, FindingIndex finding) {
  for (std::size_t steps = 0; steps < result.findings.size(); ++steps) {
    const FindingIndex cause = result.findings[finding].caused_by;
    if (cause >= result.findings.size()) break;
    finding = cause;
  }
  return finding;
}

FindingIndex HolderOf(const AnalysisResult& result, const SlaveSummary& slave,
                      std::initializer_list<std::string_view> rules, int axis) {
  for (FindingIndex i = 0; i < result.findings.size(); ++i) {
    const Finding& finding = result.findings[i];
    if (finding.severity == Severity::kInfo || !IsAbout(finding, slave)) continue;
    if (axis >= 0 && finding.axis != axis) continue;
    if (std::find(rules.begin(), rules.end(), finding.rule) == rules.end()) continue;
    return RootOf(result, i);
  }
  return kNoFinding;
}

namespace {

/// Rungs that a warning may hold: without them the slave or axis does not do what the master wants. A warning about
/// settings or synchronisation of a slave that goes on working is only a warning.
constexpr std::array<std::string_view, 12> kRungsOfWarnings{"answers",  "preop", "mailbox",   "safeop",
                                                            "exchange", "op",    "no-fault",  "voltage",
                                                            "enabled",  "mode",  "commanded", "follows"};

/// Rungs that are what the capture ends with; others fail once, and what held them may be over.
constexpr std::array<std::string_view, 6> kRungsOfTheEnd{"answers", "preop", "safeop", "op", "no-fault", "enabled"};

bool IsOneOf(std::span<const std::string_view> codes, std::string_view code) {
  return std::find(codes.begin(), codes.end(), code) != codes.end();
}

void Mark(const Ladder& ladder, AnalysisResult& result) {
  for (const Rung& rung : ladder.rungs) {
    const bool failed = rung.status == RungStatus::kNotReached || rung.status == RungStatus::kLost;
    if (!failed || rung.held_by >= result.findings.size()) continue;
    if (IsOneOf(kRungsOfTheEnd, rung.rung->code)) result.findings[rung.held_by].until = Finding::kCaptureEnds;
    if (!IsOneOf(kRungsOfWarnings, rung.rung->code)) continue;
    Finding& finding = result.findings[rung.held_by];
    if (finding.holds.empty() && !finding.severity_is_lowered) finding.holds = rung.rung->code;
  }
}

}  // namespace

void Climb(const ProgressModel& model, AnalysisResult& result) {
  for (SlaveSummary& slave : result.slaves) slave.progress = LadderOf(slave, result);
  model.ForEachAxis([&](SlaveId id, std::uint8_t axis, const AxisWatch& watch) {
    for (SlaveSummary& slave : result.slaves) {
      if (slave.id != id) continue;
      AxisLadder& added = slave.axes.emplace_back(AxisLadder{axis, LadderOf(watch, axis, slave, result)});
      LoseAbove(slave.progress.rungs.front(), added.ladder);
    }
  });
  for (const SlaveSummary& slave : result.slaves) {
    Mark(slave.progress, result);
    for (const AxisLadder& axis : slave.axes) Mark(axis.ladder, result);
  }
}

}  // namespace ecaudit::progress
