#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/status_code_watcher.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_text.h"
#include "decoder/base/text.h"

namespace ecaudit::al_wrong_status_code {
namespace {

constexpr RuleInfo kInfo{.id = "al-wrong-status-code",
                         .group = "AL state machine",
                         .severity = Severity::kWarning,
                         .title = "The AL status code is documented, but not for this transition",
                         .needs = "the AL status code and the transition it refuses",
                         .source = "ETG1000.6, AL Status Code register 0x0134",
                         .doc = R"(
## What it checks
Whether the AL status code of a refused request is one that the manual of the family gives for this transition; and for
an error that appears by itself, one that it gives for this state.

## Why it matters
The code points the wrong way: 0x0017 (sync manager) for a request that is simply not allowed sends the engineer to the
wrong place.

## How it is decided
Only where the manual binds the code to certain transitions. Codes that the manual does not list at all are
al-undocumented-status-code. Silent while the state before the request is not known, for a request of the current state
(an acknowledge, which leaves the old code), and for codes that the profile tolerates for the transition.

## Example
samples/captures/wrong-status-code.pcapng

## What to do
Trust what the capture shows of the request more than the code, and tell the vendor.
)"};

class AlWrongStatusCode final : public StatusCodeWatcher {
 public:
  AlWrongStatusCode() : StatusCodeWatcher(kInfo) {}

 private:
  static bool Fits(const device::DeviceDescription& family, const device::AlStatusCode& entry, const Context& c) {
    const auto from = static_cast<esc::AlState>(c.from);
    if (c.to == 0) return entry.AppliesIn(from);
    if (!esc::IsAlState(c.to)) return true;  // the manuals do not say how they answer to what is no state
    const auto to = static_cast<esc::AlState>(c.to);
    if (entry.AppliesTo(from, to) || Tolerates(family, c)) return true;
    const device::AlTransition* row = family.al_transition(from, to);
    return row != nullptr &&
           std::find(row->refusal_codes.begin(), row->refusal_codes.end(), c.code) != row->refusal_codes.end();
  }

  void OnCode(const Context& c) override {
    const device::DeviceDescription& family = *context().slave(c.slave).profile;
    const device::AlStatusCode* entry = family.al_status_code(c.code);
    if (c.code == 0 || entry == nullptr) return;
    if (!entry->exclusive) {
      NotEvaluable(c.slave, "the profile does not bind AL status codes to transitions", c.frame.number);
      return;
    }
    if (c.from == 0) {
      NotEvaluable(c.slave, "the state before the request is not known", c.frame.number);
      return;
    }
    if (c.from == c.to || Fits(family, *entry, c)) return;
    const std::uint64_t key =
        static_cast<std::uint64_t>(c.code) << 16U | static_cast<std::uint64_t>(c.from) << 8U | c.to;
    if (Repeat(c.slave, key, c.frame) != kNoFinding) return;
    const std::string what =
        c.to == 0 ? "an error in " + esc::StateName(c.from) : esc::StateName(c.from) + " to " + esc::StateName(c.to);
    Finding finding;
    finding.slave = c.slave;
    finding.first = c.frame;
    finding.title = "AL status code " + Hex(c.code) + " does not belong to " + what;
    finding.message = "The slave gives AL status code " + CodeText(c.code, family) + " for " + what + " in frame " +
                      std::to_string(c.frame.number) + ". " + LawText(family) + " gives it only for ";
    std::string others;
    for (const auto& t : entry->transitions) {
      others += (others.empty() ? "" : ", ") + std::string(esc::StateName(t.from)) + " to " +
                std::string(esc::StateName(t.to));
    }
    for (const esc::AlState state : entry->states) {
      others += (others.empty() ? "" : ", ") + std::string("an error in ") + std::string(esc::StateName(state));
    }
    finding.message += others + ". Trust what the capture shows of the request more than the code.";
    finding.evidence.push_back(HexNumber("al_status_code", c.code));
    finding.evidence.push_back(Text("transition", what));
    finding.reference = ReferenceTo(entry->source);
    Report(key, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlWrongStatusCode>};

}  // namespace
}  // namespace ecaudit::al_wrong_status_code
