#include <algorithm>
#include <array>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/status_code_watcher.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_text.h"
#include "analyzers/words/what.h"

namespace ecaudit::al_wrong_status_code {
namespace {

constexpr FindingKind kNotDocumented{
    .name = "not-documented",
    .title = "AL status code {al_status_code:number} is not documented for {transition}",
    .message = R"(In {frame} the slave gives AL status code {al_status_code} for {transition}. [{!manual}The EtherCAT
standard][The manual ({manual})] gives this code only for {documented}.)",
    .next = "Rely on the request in the capture more than on this code.",
    .identity = "al_status_code transition",
    .next_stays = true};

constexpr const FindingKind* kKinds[] = {&kNotDocumented};

constexpr Word kCodesOfTransitions{"codes-of-transitions", "the AL status codes of each transition", true};

constexpr Word Same(std::string_view text) {
  return {text, text};
}
/// From the state of the row to that of the column; a state by itself is an error in it.
constexpr std::array kStates{esc::AlState::INIT, esc::AlState::PREOP, esc::AlState::BOOT, esc::AlState::SAFEOP,
                             esc::AlState::OP};
constexpr std::array<std::array<Word, 5>, 5> kTransitions{
    {{Same("an error in INIT"), Same("INIT to PREOP"), Same("INIT to BOOT"), Same("INIT to SAFEOP"),
      Same("INIT to OP")},
     {Same("PREOP to INIT"), Same("an error in PREOP"), Same("PREOP to BOOT"), Same("PREOP to SAFEOP"),
      Same("PREOP to OP")},
     {Same("BOOT to INIT"), Same("BOOT to PREOP"), Same("an error in BOOT"), Same("BOOT to SAFEOP"),
      Same("BOOT to OP")},
     {Same("SAFEOP to INIT"), Same("SAFEOP to PREOP"), Same("SAFEOP to BOOT"), Same("an error in SAFEOP"),
      Same("SAFEOP to OP")},
     {Same("OP to INIT"), Same("OP to PREOP"), Same("OP to BOOT"), Same("OP to SAFEOP"), Same("an error in OP")}}};
constexpr Word kErrorInNoState = Same("an error in an undefined state");

const Word& TransitionWord(esc::AlState from, esc::AlState to) {
  const auto row = std::ranges::find(kStates, from);
  const auto column = std::ranges::find(kStates, to);
  if (row == kStates.end() || column == kStates.end()) return kErrorInNoState;
  return kTransitions[static_cast<std::size_t>(row - kStates.begin())]
                     [static_cast<std::size_t>(column - kStates.begin())];
}

// They are its causes.
constexpr std::string_view kAfter[] = {"al-refused", "al-unexpected-change"};

constexpr RuleInfo kInfo{.id = "al-wrong-status-code",
                         .group = "AL state machine",
                         .severity = Severity::kWarning,
                         .history = History::kWhole,
                         .title = "The AL status code is documented, but not for this transition",
                         .needs = "the AL status code and the transition it refuses",
                         .source = "ETG1000.6, AL Status Code register 0x0134",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Whether the AL status code of a refused request is one that the manual of the family gives for this transition. For an
error that appears by itself, whether it is one that the manual gives for this state.

## Why it matters
The code names the wrong cause. For example, 0x0017 (sync manager) for a request that is not allowed makes the engineer
check the sync managers.

## How it is decided
Only if the manual gives the code for certain transitions. The rule reports nothing:

- for codes that the manual does not list at all: see al-undocumented-status-code
- if the state before the request is not known
- for a request of the current state: it is an acknowledge and leaves the old code
- for codes that the profile tolerates for the transition

## Example
samples/captures/wrong-status-code.pcapng

## What to do
Rely on the request in the capture more than on the code. Report the code to the vendor.
)"};

class AlWrongStatusCode final : public StatusCodeWatcher {
 public:
  AlWrongStatusCode() : StatusCodeWatcher(kInfo) {}

 private:
  static bool Fits(const device::DeviceDescription& family, const device::AlStatusCode& entry, const Context& c) {
    const auto from = static_cast<esc::AlState>(c.from);
    if (c.to == 0) return entry.AppliesIn(from);
    if (!esc::IsAlState(c.to)) return true;  // the manuals do not give the answer to an undefined state
    const auto to = static_cast<esc::AlState>(c.to);
    if (entry.AppliesTo(from, to) || Tolerates(family, c)) return true;
    const device::AlTransition* row = family.al_transition(from, to);
    return row != nullptr && std::ranges::find(row->refusal_codes, c.code) != row->refusal_codes.end();
  }

  void OnCode(const Context& c) override {
    const device::DeviceDescription& family = *context().slave(c.slave).profile;
    const device::AlStatusCode* entry = family.al_status_code(c.code);
    if (c.code == 0 || entry == nullptr) return;
    if (!entry->exclusive) return NotEvaluable(c.slave, ReasonCode::kNotInProfile, kCodesOfTransitions, c.frame.number);
    if (c.from == 0) return NotEvaluable(c.slave, ReasonCode::kNotInCapture, what::kAlStateBefore, c.frame.number);
    if (c.from == c.to || Fits(family, *entry, c)) return;
    const std::uint64_t key =
        static_cast<std::uint64_t>(c.code) << 16U | static_cast<std::uint64_t>(c.from) << 8U | c.to;
    if (Repeat(c.slave, key, c.frame) != kNoFinding) return;
    const auto from = static_cast<esc::AlState>(c.from);
    std::vector<Value> documented;
    for (const auto& t : entry->transitions) documented.push_back(arg::Of(TransitionWord(t.from, t.to)));
    for (const esc::AlState state : entry->states) documented.push_back(arg::Of(TransitionWord(state, state)));
    Finding finding = Found(kNotDocumented, c.slave, c.frame);
    finding.Set("al_status_code", CodeValue(c.code, family))
        .Set("transition", arg::Of(TransitionWord(from, c.to == 0 ? from : static_cast<esc::AlState>(c.to))))
        .Set("documented", arg::List(std::move(documented)));
    SetManual(finding, family);
    finding.reference = ReferenceTo(entry->source);
    Report(key, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlWrongStatusCode>};

}  // namespace
}  // namespace ecaudit::al_wrong_status_code
