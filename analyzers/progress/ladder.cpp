#include "analyzers/progress/ladder.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <span>
#include <vector>

namespace ecaudit::progress {
namespace {

constexpr std::string_view kAxisRules = "drive-";

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

/// Others are about the slave with all its axes.
bool IsAboutAxis(const Finding& finding) {
  return finding.rule.substr(0, kAxisRules.size()) == kAxisRules;
}

/// What a slave does and what its drive shows reach the master some cycles apart.
bool IsOverBefore(const Finding& finding, const FrameRef& moment) {
  constexpr TimeNs kApartNs = 500'000'000;
  const FrameRef& last = finding.last.seen() ? finding.last : finding.first;
  if (!moment.seen() || !last.seen() || last.number >= moment.number) return false;
  return !last.has_time || !moment.has_time || Elapsed(last.time, moment.time) > kApartNs;
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
                      std::initializer_list<std::string_view> rules, const Holding& holding) {
  FindingIndex holder = kNoFinding;
  for (FindingIndex i = 0; i < result.findings.size(); ++i) {
    const Finding& finding = result.findings[i];
    if (finding.severity == Severity::kInfo || !IsAbout(finding, slave)) continue;
    if (std::find(rules.begin(), rules.end(), finding.rule) == rules.end()) continue;
    if (holding.axis >= 0 && IsAboutAxis(finding) && finding.axis != holding.axis) continue;
    if (IsOverBefore(finding, holding.lost)) continue;
    if (holding.first == 0 || finding.first.number == holding.first) return RootOf(result, i);
    if (holder == kNoFinding) holder = RootOf(result, i);
  }
  return holder;
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

/// A warning that rests on an assumption is reported, and decides nothing.
bool Decides(const Finding& finding) {
  if (finding.severity == Severity::kInfo) return false;
  return finding.confidence != Confidence::kInferred || finding.severity == Severity::kError;
}

/// What keeps the slave or axis from a rung: `root`, or the first of its consequences that is more than an assumption.
FindingIndex DecidingOf(const AnalysisResult& result, FindingIndex root) {
  if (Decides(result.findings[root])) return root;
  for (FindingIndex i = 0; i < result.findings.size(); ++i) {
    if (Decides(result.findings[i]) && RootOf(result, i) == root) return i;
  }
  return kNoFinding;
}

void Mark(const Ladder& ladder, AnalysisResult& result) {
  for (const Rung& rung : ladder.rungs) {
    const bool failed = rung.status == RungStatus::kNotReached || rung.status == RungStatus::kLost;
    if (!failed || rung.held_by >= result.findings.size()) continue;
    if (IsOneOf(kRungsOfTheEnd, rung.rung->code)) result.findings[rung.held_by].until = Finding::kCaptureEnds;
    if (!IsOneOf(kRungsOfWarnings, rung.rung->code)) continue;
    const FindingIndex deciding = DecidingOf(result, rung.held_by);
    if (deciding == kNoFinding) continue;
    Finding& finding = result.findings[deciding];
    if (finding.holds.empty() && !finding.severity_is_lowered) finding.holds = rung.rung->code;
  }
}

}  // namespace

void Climb(const ProgressModel& model, AnalysisResult& result) {
  std::vector<SlaveSummary*> by_id;
  for (SlaveSummary& slave : result.slaves) {
    slave.progress = LadderOf(slave, result);
    if (slave.id == kNoSlave) continue;
    if (by_id.size() <= slave.id) by_id.resize(std::size_t{slave.id} + 1);
    by_id[slave.id] = &slave;
  }
  model.ForEachAxis([&](SlaveId id, std::uint8_t axis, const AxisWatch& watch) {
    SlaveSummary* const slave = id < by_id.size() ? by_id[id] : nullptr;
    if (slave == nullptr) return;
    AxisLadder& added = slave->axes.emplace_back(AxisLadder{axis, LadderOf(watch, axis, *slave, result)});
    LoseAbove(slave->progress.rungs.front(), added.ladder);
  });
  model.ForEachMotor([&](SlaveId id, const MotorWatch& watch) {
    SlaveSummary* const slave = id < by_id.size() ? by_id[id] : nullptr;
    if (slave == nullptr) return;
    const auto number = static_cast<std::uint8_t>(slave->axes.size());
    AxisLadder& added = slave->axes.emplace_back(AxisLadder{number, LadderOf(watch, *slave, result)});
    LoseAbove(slave->progress.rungs.front(), added.ladder);
  });
  for (const SlaveSummary& slave : result.slaves) {
    Mark(slave.progress, result);
    for (const AxisLadder& axis : slave.axes) Mark(axis.ladder, result);
  }
}

}  // namespace ecaudit::progress
