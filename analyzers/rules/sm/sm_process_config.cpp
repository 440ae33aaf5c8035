#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "analyzers/judge/padded_struct.h"
#include "analyzers/judge/refusal_predictions.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_manager_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/model/sync_manager_demand.h"
#include "analyzers/words/what.h"
#include "decoder/track/network.h"

namespace ecaudit::sm_process_config {
namespace {

constexpr auto kPreop = static_cast<std::uint8_t>(esc::AlState::PREOP);
constexpr std::uint8_t kOutputs = 2;  // sync managers of slaves with a mailbox
constexpr std::uint8_t kInputs = 3;

constexpr Word kProcessDataStart{"process-data-start", "the start of the process data in the EEPROM"};

// ExplainRequest(): the later rule names the nearer cause.
constexpr std::string_view kAfter[] = {"sm-mailbox-config"};

constexpr RuleInfo kInfo{
    .id = "sm-process-config",
    .group = "Sync managers and FMMUs",
    .severity = Severity::kError,
    .title = "The process-data sync managers are set wrong at the SAFEOP request",
    .needs =
        "the settings of the process-data sync managers, the state before the request, and the slave's EEPROM or "
        "family",
    .source = "ETG1000.6, sync managers; ESC-1, sync manager",
    .kinds = sync_manager_fault::kKinds,
    .notes = sync_manager_fault::kNotes,
    .after = kAfter,
    .doc = R"(
## What it checks
When the master requests SAFEOP from a slave in PREOP, the sync managers of the process data (SM2: outputs, SM3: inputs)
must be:

- enabled
- in three-buffer mode
- in the right direction
- at the start address that the slave requires
- as long as the assigned PDOs

For families that check again, as Pilz, this holds also for OP from SAFEOP.

## Why it matters
The slave verifies these settings at this transition. With a wrong one it stays in PREOP and answers with an AL status
code: 0x0017 by the manuals of the drives, 0x001D (outputs) or 0x001E (inputs) by the standard.

## How it is decided
The settings that the master wrote last are compared.

- The start address comes from the sync manager category of the slave's own EEPROM, as far as the master read it. Else
  it comes from an ESI file, else from the manual of the drive family.
- The length comes from the PDOs assigned in 1C12h and 1C13h and their mapping: SDO transfers of the capture, an ENI
  file, the slave's default (EEPROM or ESI), or the fixed PDOs of the manual.
- A default is not compared with a sync manager of another length: the slave may have kept another assignment from
  before the capture.
- If the PDOs are not known, a sync manager that is off and of length 0 is no fault.
- If the entries have that length in a C struct with padding, a note states it.
- If a fault of the mapping was found for the same direction, the wrong length follows from it (caused_by).
- If the slave reaches the state in spite of wrong settings, the finding becomes an info.

## Example
samples/captures/two-slaves-one-refuses.pcapng: SM2 has 8 bytes, the PDO needs 6.

## What to do
Switch the sync manager off and write it as a whole, with the start address of the EEPROM and the length of the assigned
PDOs.
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
      NotEvaluable(e.slave, ReasonCode::kNotInCapture, what::kAlStateBefore, request.frame.number);
      return;
    }
    const device::DeviceDescription& family = *context().slave(e.slave).profile;
    if (request.verdict != model::AlVerdict::kLegal) return;
    if (!Verifies(family, request.from, to)) {
      // Requested again before an answer was seen: the first request is evaluated already.
      if (to == esc::AlState::SAFEOP && request.from == 0 && request.possible.contains(kPreop) &&
          !evaluated_.contains(e.slave)) {
        NotEvaluable(e.slave, ReasonCode::kNotInCapture, what::kAlStateBefore, request.frame.number);
      }
      return;
    }
    evaluated_.insert(e.slave);
    const track::SlaveState& state = context().network().state(e.slave);
    auto demands = model::ProcessDemands(family, esc::ParseSii(state.sii.image()));
    if (!demands.known) {
      NotEvaluable(e.slave, ReasonCode::kNotInCapture, kProcessDataStart, request.frame.number);
      demands = WithoutStart(e.slave);
    }
    for (model::SyncManagerDemand& demand : demands.list) {
      const auto layout = AddLength(e, demand);
      Evaluate(e, state, demand, layout);
    }
  }

  void On(const model::AlAnswered& e) { predictions_.On(context(), e); }

 private:
  /// PREOP to SAFEOP; and SAFEOP to OP if the manual has the refusal for sync managers at that transition too.
  static bool Verifies(const device::DeviceDescription& family, std::uint8_t from, esc::AlState to) {
    if (to == esc::AlState::SAFEOP) return from == kPreop;
    if (from != static_cast<std::uint8_t>(esc::AlState::SAFEOP)) return false;
    const device::AlStatusCode* code = family.al_status_code(esc::al_code::kSyncManagers);
    return code != nullptr && code->exclusive && code->AppliesTo(esc::AlState::SAFEOP, esc::AlState::OP);
  }

  static device::PdoDirection DirectionOf(const model::SyncManagerDemand& demand) {
    return demand.master_writes() ? device::PdoDirection::kRx : device::PdoDirection::kTx;
  }

  /// Only that the known PDOs have a sync manager each.
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

  /// Adds the length of the assigned PDOs.
  /// @return the layout, if it is known
  const model::ProcessLayout* AddLength(const model::AlRequestJudged& e, model::SyncManagerDemand& demand) {
    const model::ProcessLayout& layout = context().slave(e.slave).process.Layout(DirectionOf(demand));
    // An EEPROM without PDOs leaves them to the objects.
    const bool none_by_default = layout.source == model::LayoutSource::kDefault && layout.pdos.empty();
    if (!layout.known() || none_by_default) {
      NotEvaluable(e.slave, ReasonCode::kNotInCapture, what::kMapping, e.request.frame.number);
      return nullptr;
    }
    const bool in_this_one =
        std::ranges::any_of(layout.signals, [&](const model::Signal& s) { return s.sync_manager == demand.number; });
    if (!in_this_one && !layout.signals.empty()) return nullptr;  // the slave has several in this direction
    demand.lengths = {layout.bytes_of(demand.number)};
    demand.length_source = SourceOf(layout);
    return &layout;
  }

  static model::DemandSource SourceOf(const model::ProcessLayout& layout) {
    switch (layout.source) {
      case model::LayoutSource::kEni:
        return model::DemandSource::kEniPdos;
      case model::LayoutSource::kDefault:
        return model::DemandSource::kDefaultPdos;
      default:
        return model::DemandSource::kAssignedPdos;
    }
  }

  /// The PDOs that give the length, and where they were assigned.
  static void SetPdos(Finding& finding, const model::ProcessLayout& layout) {
    std::vector<Value> pdos;
    for (const std::uint16_t pdo : layout.pdos) pdos.push_back(arg::Object(pdo));
    if (pdos.empty()) {
      finding.Set("no_pdos", arg::Flag());
    } else {
      finding.Set("pdos", arg::List(std::move(pdos)));
    }
    if (layout.source == model::LayoutSource::kObserved) finding.Set("assigned_frame", arg::Frame(layout.since));
  }

  /// A length that the entries have in a struct of the master.
  static void AddPadding(const model::ProcessLayout& layout, std::uint8_t number, std::uint32_t length,
                         Finding& finding) {
    const auto padded = PaddedStruct::Of(layout, number);
    if (!padded || padded->bytes() != length) return;
    finding.Add(sync_manager_fault::kPaddedStruct, {{"bytes", arg::Count(length, "byte")},
                                                    {"padding", arg::Count(length - layout.bytes_of(number), "byte")}});
  }

  void Evaluate(const model::AlRequestJudged& e, const track::SlaveState& state, const model::SyncManagerDemand& demand,
                const model::ProcessLayout* layout) {
    const auto known = SyncManagerOf(state, demand.number);
    if (!known) {
      NotEvaluable(e.slave, ReasonCode::kNotInCapture, SyncManagerWord(demand.number), e.request.frame.number);
      return;
    }
    const bool no_data = layout != nullptr ? layout->bytes_of(demand.number) == 0 : known->settings.length == 0;
    if (no_data && !known->settings.enabled()) return;
    const auto faults = model::FaultsOf(known->settings, demand);
    if (faults.empty()) return;
    // The write that switches it on may be one of those that are missing.
    if (!known->settings.enabled() && MayBeSetUnseen(context(), e, *known)) {
      NotEvaluable(e.slave, ReasonCode::kCaptureGap, SyncManagerWord(demand.number), e.request.frame.number);
      return;
    }
    const std::uint64_t key = SettingsKey(demand.number, known->settings);
    FindingIndex index = Repeat(e.slave, key, e.request.frame);
    if (index == kNoFinding) {
      Finding finding = DescribeFaults(context(), e, demand, *known, faults);
      if (layout != nullptr) {
        AddRelated(finding, layout->since);
        if (layout->assumed) finding.confidence = Confidence::kInferred;
      }
      const bool length = std::ranges::any_of(
          faults, [](const model::SyncManagerFault& f) { return f.field == model::SyncManagerFault::Field::kLength; });
      if (length) finding.caused_by = context().MappingFault(e.slave, DirectionOf(demand));
      if (length && layout != nullptr) {
        SetPdos(finding, *layout);
        AddPadding(*layout, demand.number, known->settings.length, finding);
      }
      index = Report(key, std::move(finding));
    }
    const bool as_in_eeprom = demand.off_in_eeprom && faults.front().field == model::SyncManagerFault::Field::kEnable;
    predictions_.Add(context(), e.slave, e.request.frame.number, index,
                     as_in_eeprom ? RefusalPredictions::Echo::kCounts : RefusalPredictions::Echo::kShowsNothing);
  }

  RefusalPredictions predictions_;
  std::set<SlaveId> evaluated_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SmProcessConfig>};

}  // namespace
}  // namespace ecaudit::sm_process_config
