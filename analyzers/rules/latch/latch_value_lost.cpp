#include <cctype>
#include <variant>

#include "analyzers/judge/latch_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"

namespace ecaudit::latch_value_lost {
namespace {

constexpr RuleInfo kInfo{.id = "latch-value-lost",
                         .group = "Latch",
                         .severity = Severity::kError,
                         .title = "A latched position is thrown away unread",
                         .needs = "latch control and status words; what the inputs hold",
                         .source = "AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9",
                         .doc = R"(
## What it checks
Whether the position of a valid latch was read before its enable bit was cleared or the latch was armed again.

## Why it matters
The position of that edge is gone: the master lost a measurement.

## How it is decided
Read means: the object with the position is mapped and a frame carried it while the valid bit was set, its read
selector was acknowledged, or it was uploaded by SDO. The finding names the control word that cleared the enable bit,
and only when the master had seen the valid bit before. That the valid bit falls with the enable bit is not in the
manuals, so the value counts as lost when the valid bit is gone, or the latch armed again, and the position was not read
by then; where all goes by SDO, also when the status word was never read again. Not evaluable where the contents of the
inputs are not known.

## Example
samples/captures/latch-misuse.pcapng

## What to do
Read the position first: map its object, or set the read selector and wait for the acknowledge.
)"};

class LatchValueLost final : public LatchRule {
 public:
  LatchValueLost() : LatchRule(kInfo, model::LatchMisuse::Kind::kValueLost) {}

  void Finish() override {
    LatchRule::Finish();
    // What can never be read is lost as a consequence.
    std::vector<Finding>& findings = context().store.findings();
    const auto edge_of = [](const Finding& finding) {
      const auto* name = finding.evidence.empty() ? nullptr : std::get_if<std::string>(&finding.evidence.front().value);
      return name == nullptr ? std::string_view() : std::string_view(*name);
    };
    for (Finding& own : findings) {
      if (own.rule != kInfo.id) continue;
      for (std::size_t i = 0; i < findings.size(); ++i) {
        const Finding& other = findings[i];
        if (other.rule == "latch-not-mapped" && other.slave == own.slave && edge_of(other) == edge_of(own)) {
          own.caused_by = static_cast<FindingIndex>(i);
        }
      }
    }
  }

 protected:
  void Describe(const model::LatchMisuse& misuse, Finding& finding) const override {
    finding.title = "Position of " + EdgeText(misuse) + " lost: disarmed before it was read";
    finding.message = EdgeText(misuse) + CaptureText(misuse.capture) + " was disarmed " + FrameText(misuse) +
                      ", and its position was neither carried by a mapped object nor acknowledged for its selector " +
                      std::to_string(misuse.edge->selector) + " nor uploaded by SDO. ";
    finding.message[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(finding.message[0])));
    if (misuse.capture.selected.seen()) {
      finding.message += "The selector was set in frame " + std::to_string(misuse.capture.selected.number) +
                         ", but the master did not wait for the acknowledge. ";
    }
    finding.message += "Read the position before the enable bit is cleared.";
    finding.evidence.push_back(Text("edge", misuse.edge->name));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<LatchValueLost>};

}  // namespace
}  // namespace ecaudit::latch_value_lost
