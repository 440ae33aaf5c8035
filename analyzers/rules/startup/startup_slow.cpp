#include "analyzers/judge/startup_rule.h"
#include "decoder/base/text.h"

namespace ecaudit::startup_slow {
namespace {

constexpr RuleInfo kInfo{.id = "startup-slow",
                         .group = "Start-up",
                         .severity = Severity::kWarning,
                         .title = "A phase takes longer than its limit",
                         .needs = "an expectation with \"limit_ms\" for the phase, and time stamps",
                         .source = "ETG2100, init commands",
                         .doc = R"(
## What it checks
The time from the first to the last frame of a phase of one slave against the limit of the expectation.

## Why it matters
A start-up that takes longer every week points at a slave that answers late, at retries, or at a bus that was extended
without anybody noticing that the machine's start-up time depends on it.

## How it is decided
By the time stamps of the capture. Phases without a limit, and frames without time stamps, are not judged. The limit of
a slave goes before that of all slaves.

## Example
tests/rules/startup-slow/violates.trace

## What to do
Look at the steps of the phase (ecaudit startup): their frames and times show where it waited.
)"};

class StartupSlow final : public StartupRule {
 public:
  StartupSlow() : StartupRule(kInfo) {}

 private:
  using Kind = startup::Deviation::Kind;

  [[nodiscard]] bool Reports(Kind kind) const override { return kind == Kind::kSlow; }

  void Describe(const startup::Deviation& deviation, Finding& finding) const override {
    const std::string phase(Title(deviation.phase));
    finding.title = "Phase " + phase + " takes longer than " + Duration(deviation.limit);
    finding.message = "The phase " + phase + " took " + Duration(deviation.took) + " up to frame " +
                      std::to_string(deviation.frame.number) + "; its limit is " + Duration(deviation.limit) + ".";
    finding.evidence.push_back(Text("phase", std::string(Name(deviation.phase))));
    finding.evidence.push_back(Real("limit_ms", static_cast<double>(deviation.limit) / 1e6));
    finding.evidence.push_back(Real("took_ms", static_cast<double>(deviation.took) / 1e6));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<StartupSlow>};

}  // namespace
}  // namespace ecaudit::startup_slow
