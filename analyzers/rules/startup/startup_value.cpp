#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/startup_rule.h"
#include "analyzers/words/step_text.h"

namespace ecaudit::startup_value {
namespace {

constexpr FindingKind kValue{
    .name = "value",
    .title =
        "[{part_of} has {part} instead of {expected_part}][{!part}{name} [{?reads}reads][{!reads}is] {actual} instead "
        "of {expected}]",
    .message = R"(The {step} in {sent_frame} [{?reads}reads][{!reads}sets] {actual}. Expected: {expected}.[ It was
{outcome}.])",
    .next = "Correct the master's configuration, or save the expectation again.",
    .identity = "step expected_bytes actual_bytes"};
constexpr FindingKind kRevision{
    .name = "revision",
    .title = "Revision of the device is {revision} instead of {expected_revision}",
    .message = R"(Vendor and product are those of the expected {expected_slave}. The revision is {revision}. Expected:
{expected_revision}.)",
    .next =
        R"([{?newer}Masters accept a newer revision: remove "revision" from the expectation if it does not matter.][{!newer}The
device is older and may lack functions of the newer revision: check its firmware.])",
    .identity = "revision expected_revision"};
constexpr const FindingKind* kKinds[] = {&kValue, &kRevision};

constexpr RuleInfo kInfo{.id = "startup-value",
                         .group = "Start-up",
                         .severity = Severity::kError,
                         .history = History::kWhole,
                         .title = "A step writes another value than expected",
                         .needs = "an expectation (startup --expect) that gives the value",
                         .source = "ETG2100, init commands",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
The values that register writes and SDO downloads of the start-up write, the values that uploads read where the
expectation gives them, and the revision of the devices.

## Why it matters
The usual reason why "the same" machine behaves differently: one parameter, one sync manager length, one cycle time.

## How it is decided
By the bytes on the wire. A number in the expectation is compared whatever its width. A value of null, or none, matches
all.

- In sync managers only what the master sets counts, not the status bytes of the controller.
- Logical addresses that differ because the bus holds other slaves or process data are not wrong.

## Example
tests/rules/startup-value/violates.trace

## What to do
The evidence has both values. Correct the master's configuration, or save the expectation again.
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
    const std::string wanted =
        Unprefixed(actual, startup::ExpectedValue(expected, Model(deviation), actual.data.size()));
    const std::string got = actual.text.empty() ? "nothing" : Unprefixed(actual, actual.text);
    finding.kind = &kValue;
    finding.Set("step", arg::Text(Noun(actual))).Set("expected", arg::Text(wanted)).Set("actual", arg::Text(got));
    if (expected.data) {
      finding.Set("expected_bytes", arg::Bytes(*expected.data));
      const auto [part_wanted, part_got] = startup::DifferingParts(actual.key, *expected.data, actual.data);
      if (!part_got.empty()) {
        finding.Set("part_of", arg::Text(actual.name))
            .Set("part", arg::Text(part_got))
            .Set("expected_part", arg::Text(part_wanted));
      }
    }
    finding.Set("actual_bytes", arg::Bytes(actual.data))
        .Set("name", arg::Text(actual.name))
        .Set("reads", arg::Flag(reads))
        .Set("sent_frame", arg::Frame(actual.frame.number));
    if (!actual.note.empty()) finding.Set("outcome", arg::Text(actual.note));
    if (actual.last.number != actual.frame.number) AddRelated(finding, actual.last.number);
  }

  void DescribeRevision(const startup::Deviation& deviation, Finding& finding) const {
    const std::uint32_t wanted = deviation.expected_slave->revision.value_or(0);
    finding.kind = &kRevision;
    finding.Set("expected_revision", arg::Hex(wanted, 8))
        .Set("revision", arg::Hex(deviation.revision, 8))
        .Set("expected_slave", arg::Text(SlaveText(*deviation.expected_slave, context().names())))
        .Set("newer", arg::Flag(deviation.revision > wanted));
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
