#include <algorithm>
#include <set>
#include <string>

#include "analyzers/judge/refusal_predictions.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_manager_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/model/sync_manager_demand.h"
#include "decoder/base/text.h"
#include "decoder/process/pdo_mapping.h"
#include "decoder/track/network.h"

namespace ecaudit::sm_process_config {
namespace {

constexpr std::uint16_t kInvalidSyncManager = 0x0017;
constexpr auto kPreop = static_cast<std::uint8_t>(esc::AlState::PREOP);
constexpr std::uint8_t kOutputs = 2;  // sync managers of slaves with a mailbox
constexpr std::uint8_t kInputs = 3;

constexpr RuleInfo kInfo{
    .id = "sm-process-config",
    .group = "Sync managers and FMMUs",
    .severity = Severity::kError,
    .title = "The process-data sync managers are set wrong when SAFEOP is requested",
    .needs =
        "the settings of the process-data sync managers, the state before the request, and the slave's EEPROM or "
        "family",
    .source = "ETG1000.6, sync managers; ESC-1, sync manager",
    .doc = R"(
## What it checks
When the master requests SAFEOP from a slave in PREOP (for families that check again, as Pilz, also OP from SAFEOP):
whether the sync managers of the process data (SM2: outputs, SM3: inputs) are enabled, in three-buffer mode, in the
right direction, at the start address that the slave wants, and as long as the assigned PDOs.

## Why it matters
The slave verifies these settings at this transition. With a wrong one it stays in PREOP and answers with an AL status
code: 0x0017 by the manuals of the drives, 0x001D (outputs) or 0x001E (inputs) by the standard.

## How it is decided
Start address: against the sync manager category of the slave's own EEPROM, as far as the master read it; else an ESI
file; else the manual of the drive family. Length: against the PDOs assigned in 1C12h and 1C13h and what is mapped into
them, from SDO transfers of the capture, an ENI file, the slave's default (EEPROM or ESI) and the fixed PDOs of the
manual. A default is not held against a sync manager of another length: the slave may have kept another assignment from
before the capture. Without known PDOs a sync manager that is off and of length 0 is no fault. Where a fault of the
mapping was found for the same direction, the wrong length follows from it (caused_by). The rule judges what the master
wrote last; where the slave reaches the state all the same, the finding becomes an info.

## Example
samples/captures/two-slaves-one-refuses.pcapng: SM2 has 8 bytes, the PDO needs 6.

## What to do
Write the sync manager as a whole, after switching it off, with the start address of the EEPROM and the length of the
assigned PDOs.
)"};

class SmProcessConfig final : public Rule {
 public:
  SmProcessConfig() : Rule(kInfo) {
    Subscribe<model::AlRequestJudged>(&SmProcessConfig::On);
    Subscribe<model::AlAnswered>(&SmProcessConfig::On);
  }

  void On(const model::AlRequestJudged& e) {
    const model::AlRequestRecord& request = e.request;
    const auto to = static_cast<esc::AlState>(request.control.state());
    if (to != esc::AlState::SAFEOP && to != esc::AlState::OP) return;
    if (request.verdict == model::AlVerdict::kUnknown && to == esc::AlState::SAFEOP) {
      NotEvaluable(e.slave, "the state of the slave was not read before SAFEOP was requested", request.frame.number);
      return;
    }
    const device::DeviceDescription& family = *context().slave(e.slave).profile;
    if (request.verdict != model::AlVerdict::kLegal) return;
    if (!Verifies(family, request.from, to)) {
      // Asked again before an answer was seen: that one is judged already.
      if (to == esc::AlState::SAFEOP && request.from == 0 && request.possible.contains(kPreop) &&
          !judged_.contains(e.slave)) {
        NotEvaluable(e.slave, "the state of the slave was not read before SAFEOP was requested", request.frame.number);
      }
      return;
    }
    judged_.insert(e.slave);
    const track::SlaveState& state = context().network().state(e.slave);
    auto demands = model::ProcessDemands(family, esc::ParseSii(state.sii.image()));
    if (!demands.known) {
      NotEvaluable(e.slave, "the start of the process data: neither EEPROM nor family says it", request.frame.number);
      demands = WithoutStart(e.slave);
    }
    for (model::SyncManagerDemand& demand : demands.list) {
      const auto layout = AddLength(e, demand);
      Judge(e, state, demand, layout);
    }
  }

  void On(const model::AlAnswered& e) { predictions_.On(context(), e); }

 private:
  /// PREOP to SAFEOP; and SAFEOP to OP where the manual binds the refusal for sync managers to that transition, too.
  static bool Verifies(const device::DeviceDescription& family, std::uint8_t from, esc::AlState to) {
    if (to == esc::AlState::SAFEOP) return from == kPreop;
    if (from != static_cast<std::uint8_t>(esc::AlState::SAFEOP)) return false;
    const device::AlStatusCode* code = family.al_status_code(kInvalidSyncManager);
    return code != nullptr && code->exclusive && code->AppliesTo(esc::AlState::SAFEOP, esc::AlState::OP);
  }

  static device::PdoDirection DirectionOf(const model::SyncManagerDemand& demand) {
    return demand.master_writes() ? device::PdoDirection::kRx : device::PdoDirection::kTx;
  }

  /// Only that the PDOs known have a sync manager each.
  [[nodiscard]] model::SyncManagerDemands WithoutStart(SlaveId slave) const {
    model::SyncManagerDemands demands;
    for (const auto direction : {device::PdoDirection::kRx, device::PdoDirection::kTx}) {
      const model::ProcessLayout& layout = context().slave(slave).process.Layout(direction);
      if (!layout.known() || layout.pdos.empty()) continue;
      const bool rx = direction == device::PdoDirection::kRx;
      model::SyncManagerDemand demand;
      demand.number = layout.signals.empty() ? (rx ? kOutputs : kInputs) : layout.signals.front().sync_manager;
      demand.use = rx ? device::SyncManagerUse::kProcessOut : device::SyncManagerUse::kProcessIn;
      demands.list.push_back(demand);
    }
    return demands;
  }

  /// What the assigned PDOs ask for; where they are known, the layout.
  const model::ProcessLayout* AddLength(const model::AlRequestJudged& e, model::SyncManagerDemand& demand) {
    const model::ProcessLayout& layout = context().slave(e.slave).process.Layout(DirectionOf(demand));
    // An EEPROM without PDOs leaves them to the objects.
    const bool none_by_default = layout.source == model::LayoutSource::kDefault && layout.pdos.empty();
    if (!layout.known() || none_by_default) {
      NotEvaluable(e.slave, "the length: what PDOs are assigned is not known", e.request.frame.number);
      return nullptr;
    }
    const bool in_this_one = std::any_of(layout.signals.begin(), layout.signals.end(),
                                         [&](const model::Signal& s) { return s.sync_manager == demand.number; });
    if (!in_this_one && !layout.signals.empty()) return nullptr;  // the slave has several in this direction
    demand.lengths = {layout.bytes_of(demand.number)};
    demand.length_source = SourceText(layout, DirectionOf(demand));
    return &layout;
  }

  static std::string SourceText(const model::ProcessLayout& layout, device::PdoDirection direction) {
    std::string pdos;
    for (const std::uint16_t pdo : layout.pdos) pdos += (pdos.empty() ? "" : ", ") + ObjectName(pdo);
    if (pdos.empty()) pdos = "none";
    switch (layout.source) {
      case model::LayoutSource::kEni:
        return "the PDOs of the ENI file (" + pdos + ")";
      case model::LayoutSource::kDefault:
        return "the slave's default PDOs (" + pdos + ")";
      default:
        return "the PDOs assigned in " +
               ObjectName(direction == device::PdoDirection::kRx ? process::kRxAssignment : process::kTxAssignment) +
               " (" + pdos + "; frame " + std::to_string(layout.since) + ")";
    }
  }

  void Judge(const model::AlRequestJudged& e, const track::SlaveState& state, const model::SyncManagerDemand& demand,
             const model::ProcessLayout* layout) {
    const auto known = SyncManagerOf(state, demand.number);
    if (!known) {
      NotEvaluable(e.slave, "sync manager " + std::to_string(demand.number) + " was not set in the capture",
                   e.request.frame.number);
      return;
    }
    const bool no_data = layout != nullptr ? layout->bytes_of(demand.number) == 0 : known->settings.length == 0;
    if (no_data && !known->settings.enabled()) return;
    const auto faults = model::FaultsOf(known->settings, demand);
    if (faults.empty()) return;
    const std::uint64_t key = SettingsKey(demand.number, known->settings);
    FindingIndex index = Repeat(e.slave, key, e.request.frame);
    if (index == kNoFinding) {
      Finding finding = DescribeFaults(context(), e, demand, *known, faults);
      if (layout != nullptr) {
        AddRelated(finding, layout->since);
        if (layout->assumed) finding.confidence = Confidence::kInferred;
      }
      const bool length = std::any_of(faults.begin(), faults.end(), [](const model::SyncManagerFault& f) {
        return f.field == model::SyncManagerFault::Field::kLength;
      });
      if (length) finding.caused_by = context().MappingFault(e.slave, DirectionOf(demand));
      index = Report(key, std::move(finding));
    }
    predictions_.Add(context(), e.slave, e.request.frame.number, index);
  }

  RefusalPredictions predictions_;
  std::set<SlaveId> judged_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SmProcessConfig>};

}  // namespace
}  // namespace ecaudit::sm_process_config
