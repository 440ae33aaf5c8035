#include "analyzers/judge/startup_rule.h"
#include "analyzers/words/step_text.h"
#include "decoder/base/text.h"

namespace ecaudit::startup_value {
namespace {

constexpr RuleInfo kInfo{.id = "startup-value",
                         .group = "Start-up",
                         .severity = Severity::kError,
                         .title = "A step writes another value than expected",
                         .needs = "an expectation (startup --expect) that gives the value",
                         .source = "ETG2100, init commands",
                         .doc = R"(
## What it checks
What register writes and SDO downloads of the start-up write, and what uploads bring where the expectation says; and
the revision of the devices.

## Why it matters
The usual reason why "the same" machine behaves differently: one parameter, one sync manager length, one cycle time.

## How it is decided
Bytes as they were on the wire; a number in the expectation is compared whatever the width. A value of null, or none,
fits all. In sync managers only what the master sets counts, not the status bytes of the controller. Logical addresses
that differ because the bus holds other slaves, or other process data, than expected are no wrong values.

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

  [[nodiscard]] bool Reports(Kind kind) const override { return kind == Kind::kValue || kind == Kind::kRevision; }

  void Describe(const startup::Deviation& deviation, Finding& finding) const override {
    if (deviation.kind == Kind::kRevision) return DescribeRevision(deviation, finding);
    const startup::ExpectedStep& expected = *deviation.expected.front();
    const StartupStep& actual = *deviation.actual.front();
    const bool reads = actual.key.kind == StartupKey::Kind::kUpload;
    const std::string wanted = Unprefixed(actual, startup::ExpectedValue(expected, Model(deviation)));
    const std::string got = actual.text.empty() ? "nothing" : Unprefixed(actual, actual.text);
    finding.title = actual.name + (reads ? " reads " : " is ") + got + " instead of " + wanted;
    if (expected.data) {
      const auto [part_wanted, part_got] = startup::DifferingParts(actual.key, *expected.data, actual.data);
      if (!part_got.empty()) finding.title = actual.name + " has " + part_got + " instead of " + part_wanted;
    }
    finding.message = "The " + Noun(actual) + " in frame " + std::to_string(actual.frame.number) +
                      (reads ? " brought " : " sets ") + got + "; expected is " + wanted + ".";
    if (!actual.note.empty()) finding.message += " It was " + actual.note + ".";
    finding.evidence.push_back(Text("step", Noun(actual)));
    finding.evidence.push_back(Text("expected", wanted));
    finding.evidence.push_back(Text("actual", got));
    if (expected.data) finding.evidence.push_back(Text("expected_bytes", HexBytes(*expected.data)));
    finding.evidence.push_back(Text("actual_bytes", HexBytes(actual.data)));
    if (actual.last.number != actual.frame.number) AddRelated(finding, actual.last.number);
  }

  static void DescribeRevision(const startup::Deviation& deviation, Finding& finding) {
    const std::uint32_t wanted = deviation.expected_slave->revision.value_or(0);
    const std::string got = Hex(deviation.revision, 8);
    finding.title = "The revision of the device is " + got + " instead of " + Hex(wanted, 8);
    finding.message = "Vendor and product are those of the expected " + SlaveText(*deviation.expected_slave) +
                      ", the revision is " + got + "; expected is " + Hex(wanted, 8) + ". ";
    finding.message += deviation.revision > wanted
                           ? "Masters accept a newer one; take \"revision\" out of the expectation if you do, too."
                           : "It is older: what the newer one added it may not have.";
    finding.evidence.push_back(HexNumber("expected_revision", wanted));
    finding.evidence.push_back(HexNumber("revision", deviation.revision));
  }

  /// Register texts begin with the register's name, which stands before them already.
  static std::string Unprefixed(const StartupStep& step, const std::string& text) {
    const std::string prefix = step.name + ": ";
    return text.starts_with(prefix) ? text.substr(prefix.size()) : text;
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<StartupValue>};

}  // namespace
}  // namespace ecaudit::startup_value
