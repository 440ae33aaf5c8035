#include "analyzers/judge/pdo_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/what.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::pdo_assign_state {
namespace {

constexpr FindingKind kOutsidePreop{
    .name = "outside-preop",
    .title = "{object:number} is written in {state} instead of PREOP",
    .message = R"(The master downloads {value} to {object} in {frame}, while the slave is in {state}. Assignment and
mapping may be changed in PREOP only. {outcome}[ with {abort_code}].)",
    .next = "Request PREOP, then write the mapping.",
    .identity = "index state"};
constexpr const FindingKind* kKinds[] = {&kOutsidePreop};

// ExplainRequest(): the later rule names the nearer cause.
constexpr std::string_view kAfter[] = {"pdo-assign-order"};

constexpr RuleInfo kInfo{.id = "pdo-assign-state",
                         .group = "PDO mapping",
                         .severity = Severity::kError,
                         .subject = Subject::kMappingWrites,
                         .title = "PDO assignment or mapping is changed outside PREOP",
                         .needs = "the AL state of the slave",
                         .source = "ETG1000.6, PDO assignment; MKD, 4.6",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Downloads to 1C12h, 1C13h and the mapping objects 1600h-17FFh and 1A00h-1BFFh while the slave is in SAFEOP or OP.

## Why it matters
Process data are exchanged in these states. A slave that accepted the change would read its outputs at other places than
the master writes them. Slaves abort the download (0x08000022). Some leave the state.

## How it is decided
The finding needs an AL Status of SAFEOP or OP, and no state request since. If the state was never read, the rule is not
evaluated. Uploads do not count.

## Example
samples/captures/pdo-assigned-in-safeop.pcapng

## What to do
Request PREOP, write the mapping, set up the sync managers again, and go back to SAFEOP and OP.
)"};

class PdoAssignState final : public PdoRule {
 public:
  PdoAssignState() : PdoRule(kInfo, WhenAccepted::kStays) {}

 private:
  void OnDownload(const mailbox::SdoTransfer& e, const std::vector<Write>& writes) override {
    const model::AlMachine& al = context().slave(e.slave).al;
    if (al.possible().empty()) {
      NotEvaluable(e.slave, ReasonCode::kNotInCapture, what::kAlState, FrameOf(e).number);
      return;
    }
    const bool op = al.SettledIn(esc::AlState::OP);
    if (!op && !al.SettledIn(esc::AlState::SAFEOP)) return;
    const esc::AlState state = op ? esc::AlState::OP : esc::AlState::SAFEOP;
    Finding finding = Found(kOutsidePreop, e.slave, FrameOf(e));
    finding.Set("object", arg::Object(e.index, writes.front().subindex))
        .Set("index", arg::Hex(e.index))
        .Set("value", arg::Hex(writes.front().value))
        .Set("state", arg::State(static_cast<std::uint8_t>(state)));
    ReportDownload(e, e.index, std::uint64_t{e.index} << 1U | (op ? 1U : 0U), std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<PdoAssignState>};

}  // namespace
}  // namespace ecaudit::pdo_assign_state
