#include "analyzers/result/absence.h"

#include <algorithm>

namespace ecaudit {
namespace {

constexpr std::string_view kCountRule = "bus-slave-count-changed";
constexpr std::string_view kCounterRule = "wkc-mismatch";

/// Whether the value is the slave, or a list that holds it.
bool Names(const Value& value, SlaveId slave) {
  if (value.type == Value::Type::kSlave) return value.number == slave;
  const std::vector<Value>& items = value.items();
  return std::ranges::any_of(items, [slave](const Value& item) { return Names(item, slave); });
}

bool IsMissing(const Finding& finding, const SlaveSummary& slave) {
  const Value* const missing = finding.arguments.Find("missing");
  if (missing != nullptr && Names(*missing, slave.id)) return true;
  // The list is bounded; those that are not named are at the end of the bus as well.
  const Value* const first = finding.arguments.Find("first_missing_position");
  return finding.arguments.Has("more_missing") && first != nullptr && slave.position >= first->number;
}

/// The first later finding that shows the slaves back.
FrameRef ReturnOf(const Finding& gone, const AnalysisResult& result) {
  for (const Finding& finding : result.findings) {
    const bool back = finding.Is(kCountRule, "returned") || finding.Is(kCountRule, "more");
    if (back && finding.first.number > gone.first.number) return finding.first;
  }
  return {};
}

/// Later than this the capture shows nothing of the slave.
FrameNo LastSignOf(const SlaveSummary& slave) {
  FrameNo last = std::max(slave.rx_pdo.last, slave.tx_pdo.last);
  for (const AlStep& step : slave.al_history) {
    if (step.kind == AlStep::Kind::kState) last = std::max(last, step.frame.number);
  }
  return last;
}

/// A single answer may be lost; a slave that is gone answers no more.
constexpr std::uint64_t kFewestUnanswered = 3;

}  // namespace

std::vector<Absence> AbsencesOf(const SlaveSummary& slave, const AnalysisResult& result) {
  std::vector<Absence> absences;
  for (FindingIndex i = 0; i < result.findings.size(); ++i) {
    const Finding& finding = result.findings[i];
    if (finding.Is(kCountRule, "fewer") && !finding.arguments.Has("still_answers") && IsMissing(finding, slave)) {
      absences.push_back({finding.first, ReturnOf(finding, result), true, i});
    } else if (finding.Is(kCounterRule, "no-answer") && finding.slave == slave.id &&
               finding.count >= kFewestUnanswered) {
      const bool to_the_end = finding.last.number > LastSignOf(slave);
      absences.push_back({finding.first, to_the_end ? FrameRef() : finding.last, true, i});
    } else if (finding.rule == kCounterRule && IsMissing(finding, slave)) {
      absences.push_back({finding.first, finding.last, false, i});
    }
  }
  return absences;
}

bool OthersAreMissing(const SlaveSummary& slave, const FrameRef& from, const FrameRef& to,
                      const AnalysisResult& result) {
  return std::ranges::any_of(result.findings, [&](const Finding& finding) {
    return finding.rule == kCounterRule && finding.arguments.Has("missing") && !IsMissing(finding, slave) &&
           finding.first.number <= from.number && finding.last.number >= to.number;
  });
}

}  // namespace ecaudit
