#include "analyzers/judge/pdo_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::pdo_assign_state {
namespace {

constexpr RuleInfo kInfo{.id = "pdo-assign-state",
                         .group = "PDO mapping",
                         .severity = Severity::kError,
                         .subject = Subject::kMappingWrites,
                         .title = "PDO assignment or mapping is changed outside PREOP",
                         .needs = "the AL state of the slave",
                         .source = "ETG1000.6, PDO assignment; MKD, 4.6",
                         .doc = R"(
## What it checks
Downloads to 1C12h, 1C13h and the mapping objects 1600h-17FFh and 1A00h-1BFFh while the slave is in SAFEOP or OP.

## Why it matters
Process data are exchanged in these states; a slave that took the change would read its outputs at other places than the
master writes them. Slaves abort the download (0x08000022), some leave the state.

## How it is decided
Only where AL Status showed SAFEOP or OP and no request has been under way since. Where the state was never read the
rule says so. Uploads do not count.

## Example
samples/captures/pdo-assigned-in-safeop.pcapng

## What to do
Request PREOP, write the mapping, set up the sync managers anew, and go back to SAFEOP and OP.
)"};

class PdoAssignState final : public PdoRule {
 public:
  PdoAssignState() : PdoRule(kInfo, WhenAccepted::kStands) {}

 private:
  void OnDownload(const mailbox::SdoTransfer& e, const std::vector<Write>& writes) override {
    const model::AlMachine& al = context().slave(e.slave).al;
    if (al.possible().empty()) {
      NotEvaluable(e.slave, "the state of the slave is not known", FrameOf(e).number);
      return;
    }
    const bool op = al.SettledIn(esc::AlState::OP);
    if (!op && !al.SettledIn(esc::AlState::SAFEOP)) return;
    const std::string state = op ? "OP" : "SAFEOP";
    const std::string name = ObjectName(e.index);
    Finding finding;
    finding.title = name + " is written in " + state;
    finding.message = "In frame " + std::to_string(FrameOf(e).number) + " the master downloads " +
                      Hex(writes.front().value) + " to " + ObjectName(e.index, writes.front().subindex) +
                      " while the slave is in " + state + "." + OutcomeText(e) +
                      " Assignment and mapping may be changed in PREOP only.";
    finding.evidence.push_back(Text("object", ObjectName(e.index, writes.front().subindex)));
    finding.evidence.push_back(HexNumber("value", writes.front().value));
    finding.evidence.push_back(Text("state", state));
    Tell(e, e.index, std::uint64_t{e.index} << 1U | (op ? 1U : 0U), std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<PdoAssignState>};

}  // namespace
}  // namespace ecaudit::pdo_assign_state
