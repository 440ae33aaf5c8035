#include "analyzers/judge/startup_rule.h"

namespace ecaudit::startup_slow {
namespace {

constexpr FindingKind kSlow{
    .name = "slow",
    .title = "Phase {phase} takes {took_ms} instead of {limit_ms} at most",
    .message = "The phase {phase} took {took_ms} up to {frame}. Its limit in the expectation is {limit_ms}.",
    .next = "Read the steps of the phase (ecaudit startup): their frames and times show where it waited.",
    .identity = "phase"};
constexpr const FindingKind* kKinds[] = {&kSlow};

constexpr RuleInfo kInfo{.id = "startup-slow",
                         .group = "Start-up",
                         .severity = Severity::kWarning,
                         .history = History::kWhole,
                         .title = "A phase takes longer than its limit",
                         .needs = "an expectation with \"limit_ms\" for the phase, and time stamps",
                         .source = "ETG2100, init commands",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
The time from the first to the last frame of a phase of one slave against the limit of the expectation.

## Why it matters
A start-up that takes longer every week indicates a slave that answers late, retries, or a bus that was extended.

## How it is decided
By the time stamps of the capture. Phases without a limit, and frames without time stamps, are not evaluated. The limit
of a slave overrides that of all slaves.

## Example
tests/rules/startup-slow/violates.trace

## What to do
Read the steps of the phase (ecaudit startup): their frames and times show where it waited.
)"};

class StartupSlow final : public StartupRule {
 public:
  StartupSlow() : StartupRule(kInfo) {}

 private:
  using Kind = startup::Deviation::Kind;

  [[nodiscard]] bool Reports(Kind kind) const override { return kind == Kind::kSlow; }

  void Describe(const startup::Deviation& deviation, Finding& finding) const override {
    finding.kind = &kSlow;
    finding.Set("phase", PhaseValue(deviation.phase))
        .Set("limit_ms", arg::Ms(deviation.limit))
        .Set("took_ms", arg::Ms(deviation.took));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<StartupSlow>};

}  // namespace
}  // namespace ecaudit::startup_slow
