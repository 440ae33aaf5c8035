#include "analyzers/core/startup_rule.h"
#include "analyzers/startup/step_text.h"
#include "decoder/base/text.h"

namespace ecaudit {
namespace {

constexpr RuleInfo kInfo{.id = "startup-value",
                         .group = "Start-up",
                         .severity = Severity::kError,
                         .title = "A step writes another value than expected",
                         .needs = "an expectation (startup --expect) that gives the value",
                         .source = "ETG2100, init commands",
                         .doc = R"(
## What it checks
What register writes and SDO downloads of the start-up write, and what uploads bring where the expectation says.

## Why it matters
The usual reason why "the same" machine behaves differently: one parameter, one sync manager length, one cycle time.

## How it is decided
Bytes as they were on the wire; a number in the expectation is compared whatever the width. A value of null, or none,
fits all. In sync managers only what the master sets counts, not the status bytes of the controller.

## Example
tests/rules/startup-value/violates.trace

## What to do
The evidence holds both values. Correct the master's configuration, or save the expectation anew.
)"};

class StartupValue final : public StartupRule {
 public:
  StartupValue() : StartupRule(kInfo) {}

 private:
  using Kind = startup::Deviation::Kind;

  [[nodiscard]] bool Reports(Kind kind) const override { return kind == Kind::kValue; }

  void Describe(const startup::Deviation& deviation, Finding& finding) const override {
    const startup::ExpectedStep& expected = *deviation.expected.front();
    const StartupStep& actual = *deviation.actual.front();
    const std::string expected_text = startup::ExpectedValue(expected, Model(deviation));
    const bool reads = actual.key.kind == StartupKey::Kind::kUpload;
    const std::string actual_text = actual.text.empty() ? "nothing" : actual.text;
    finding.title = actual.name + (reads ? " reads " : " is ") + Unprefixed(actual, actual_text) + " instead of " +
                    Unprefixed(actual, expected_text);
    finding.message = "The " + Noun(actual) + " in frame " + std::to_string(actual.frame.number) +
                      (reads ? " brought " : " writes ") + actual_text + "; expected is " + expected_text + ".";
    if (!actual.note.empty()) finding.message += " It was " + actual.note + ".";
    finding.evidence.push_back(Text("step", Noun(actual)));
    finding.evidence.push_back(Text("expected", expected_text));
    finding.evidence.push_back(Text("actual", actual_text));
    if (expected.data) finding.evidence.push_back(Text("expected_bytes", HexBytes(*expected.data)));
    finding.evidence.push_back(Text("actual_bytes", HexBytes(actual.data)));
    if (actual.last.number != actual.frame.number) AddRelated(finding, actual.last.number);
  }

  /// Register texts begin with the register's name, which stands before them already.
  static std::string Unprefixed(const StartupStep& step, const std::string& text) {
    const std::string prefix = step.name + ": ";
    return text.starts_with(prefix) ? text.substr(prefix.size()) : text;
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<StartupValue>};

}  // namespace
}  // namespace ecaudit
