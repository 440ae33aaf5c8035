#include <set>

#include "analyzers/judge/refusal_predictions.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_manager_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/model/sync_manager_demand.h"
#include "analyzers/words/what.h"
#include "decoder/track/network.h"

namespace ecaudit::sm_mailbox_config {
namespace {

constexpr Word kMailboxSettings{"mailbox-settings", "the mailbox settings in the EEPROM", true};
constexpr Word kMailboxLengths{"mailbox-lengths", "the mailbox lengths in the EEPROM", true};

// ExplainRequest(): the later rule names the nearer cause.
constexpr std::string_view kAfter[] = {"pdo-unsupported"};

constexpr RuleInfo kInfo{
    .id = "sm-mailbox-config",
    .group = "Sync managers and FMMUs",
    .severity = Severity::kError,
    .title = "The mailbox sync managers are set wrong when PREOP is requested",
    .needs =
        "the settings of the mailbox sync managers, the state before the request, and the slave's EEPROM or family",
    .source = "ETG1000.6, sync managers; ESC-1, sync manager",
    .kinds = sync_manager_fault::kKinds,
    .notes = sync_manager_fault::kNotes,
    .after = kAfter,
    .doc = R"(
## What it checks
When the master requests PREOP from a slave in INIT, the sync managers of the two mailboxes must be:

- enabled
- in mailbox mode
- in the right direction (SM0: the master writes, SM1: the master reads)
- at the start address and of the length that the slave requires

## Why it matters
The slave verifies these settings at this transition. With a wrong one it stays in INIT and answers with an AL status
code (0x0016 by the standard, 0x0017 by the Kollmorgen manuals). No SDO works before it is corrected.

## How it is decided
The settings that the master wrote last are compared with the first of these sources:

- the slave's own EEPROM, as far as the master read it: words 0x18 to 0x1B (standard mailboxes) and the sync manager
  category
- an ESI file
- the manual of the drive family

Manuals print the mailbox length as an example only (512, while a real AKD uses 1024). Without EEPROM or ESI the length
is not evaluated. A slave whose EEPROM names no mailbox is not evaluated. If the slave reaches PREOP in spite of wrong
settings, the finding becomes an info.

## Example
samples/captures/bad-mailbox-config.pcapng: SM0 has 64 bytes, the EEPROM requires 128.

## What to do
Use start and length of the EEPROM or the ESI file. Switch the sync manager off before its start, length or control byte
is written: an ESC ignores such a write while the sync manager is enabled.
)"};

class SmMailboxConfig final : public Rule {
 public:
  SmMailboxConfig() : Rule(kInfo) {
    Subscribe<model::AlRequestJudged>(&SmMailboxConfig::On);
    Subscribe<model::AlAnswered>(&SmMailboxConfig::On);
  }

  void On(const model::AlRequestJudged& e) {
    constexpr auto kInit = static_cast<std::uint8_t>(esc::AlState::INIT);
    const model::AlRequestRecord& request = e.request;
    if (request.control.state() != static_cast<std::uint8_t>(esc::AlState::PREOP)) return;
    if (request.verdict == model::AlVerdict::kUnknown) {
      NotEvaluable(e.slave, ReasonCode::kNotInCapture, what::kAlStateBefore, request.frame.number);
      return;
    }
    if (request.verdict != model::AlVerdict::kLegal) return;
    if (request.from != kInit) {
      // Requested again before an answer was seen: the first request is evaluated already.
      if (request.from == 0 && request.possible.contains(kInit) && !evaluated_.contains(e.slave)) {
        NotEvaluable(e.slave, ReasonCode::kNotInCapture, what::kAlStateBefore, request.frame.number);
      }
      return;
    }
    evaluated_.insert(e.slave);
    const track::SlaveState& state = context().network().state(e.slave);
    const auto demands = model::MailboxDemands(*context().slave(e.slave).profile, esc::ParseSii(state.sii.image()));
    if (!demands.known) return NotEvaluable(e.slave, ReasonCode::kNotInCapture, kMailboxSettings, request.frame.number);
    for (const model::SyncManagerDemand& demand : demands.list) Evaluate(e, state, demand);
  }

  void On(const model::AlAnswered& e) { predictions_.On(context(), e); }

 private:
  void Evaluate(const model::AlRequestJudged& e, const track::SlaveState& state,
                const model::SyncManagerDemand& demand) {
    const auto known = SyncManagerOf(state, demand.number);
    if (!known) {
      NotEvaluable(e.slave, ReasonCode::kNotInCapture, SyncManagerWord(demand.number), e.request.frame.number);
      return;
    }
    if (demand.lengths.empty()) {
      NotEvaluable(e.slave, ReasonCode::kNotInCapture, kMailboxLengths, e.request.frame.number);
    }
    const auto faults = model::FaultsOf(known->settings, demand);
    if (faults.empty()) return;
    // The write that switches it on may be one of those that are missing.
    if (!known->settings.enabled() && MayBeSetUnseen(context(), e, *known)) {
      NotEvaluable(e.slave, ReasonCode::kCaptureGap, SyncManagerWord(demand.number), e.request.frame.number);
      return;
    }
    const std::uint64_t key = SettingsKey(demand.number, known->settings);
    FindingIndex index = Repeat(e.slave, key, e.request.frame);
    if (index == kNoFinding) index = Report(key, DescribeFaults(context(), e, demand, *known, faults));
    predictions_.Add(context(), e.slave, e.request.frame.number, index);
  }

  RefusalPredictions predictions_;
  std::set<SlaveId> evaluated_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SmMailboxConfig>};

}  // namespace
}  // namespace ecaudit::sm_mailbox_config
