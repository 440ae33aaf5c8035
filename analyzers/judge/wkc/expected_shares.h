/// in: one working counter, and what each slave counts.  out: whose share is missing, and the words for it.
#pragma once

#include "analyzers/judge/rule_context.h"
#include "analyzers/model/logical_expectation.h"
#include "analyzers/result/finding.h"
#include "decoder/track/events.h"

namespace ecaudit::wkc {

[[nodiscard]] inline Value SlaveValue(const RuleContext& context, SlaveId slave) {
  return arg::Slave(slave, context.Label(slave));
}
/// What each slave counts: "slave 1 (0x1002) 3".
[[nodiscard]] Value SharesOf(const RuleContext& context, const model::LogicalExpectation& expected,
                             wire::Command command);
/// One is what a slave counts for inputs; for outputs it counts two.
[[nodiscard]] inline bool AreInputs(const track::LogicalAccess& access, int missing) {
  return access.command == wire::Command::LRW && missing == 1;
}
/// The slave whose share is exactly what is missing, when only one is.
[[nodiscard]] SlaveId OnlyCandidate(const model::LogicalExpectation& expected, const track::LogicalAccess& access,
                                    std::uint16_t most);
/// What the number that is missing shows.
[[nodiscard]] Note HintOf(const RuleContext& context, const model::LogicalExpectation& expected,
                          const track::LogicalAccess& access, std::uint16_t most);
/// Names slaves whose controller may not support the LRW that the master uses.
void AddSeparateLrw(const RuleContext& context, Finding& finding, const model::LogicalExpectation& expected);
/// Why the expected working counter is a range although all slaves are in OP.
void AddOneBuffers(const RuleContext& context, Finding& finding, const model::LogicalExpectation& expected);

}  // namespace ecaudit::wkc
