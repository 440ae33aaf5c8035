#include "analyzers/judge/refusal_reasons.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/model/sync_manager_demand.h"
#include "analyzers/sync/sync_model.h"
#include "analyzers/sync/sync_type.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/esc/sii.h"
#include "decoder/track/network.h"

namespace ecaudit {
namespace {

/// The case with all that is known of its slave.
struct Case {
  const RuleContext& context;
  const RefusalCase& refusal;
  const model::SlaveModel& model;
  const track::SlaveState& state;
  const sync::DcUnit& dc;
  esc::SiiContents sii;

  /// A setting that changed last in `changed` (0: never in the capture) was what it is when the slave refused.
  [[nodiscard]] bool Applied(FrameNo changed) const { return changed <= refusal.shown; }
  /// ... and can be the reason. A slave that held its state with a setting did not leave it because of that.
  [[nodiscard]] bool Counts(FrameNo changed) const {
    return Applied(changed) && (refusal.requested != 0 || changed > refusal.held_since);
  }
  /// Process data are exchanged in SAFEOP and OP only: that a slave that refuses SAFEOP takes none is a consequence.
  [[nodiscard]] bool ExchangeCounts() const {
    return refusal.requested == 0 || refusal.requested == static_cast<std::uint8_t>(esc::AlState::OP);
  }
  [[nodiscard]] FrameNo sync_changed() const { return std::max(dc.activation_changed(), dc.cycle_changed()); }
  [[nodiscard]] std::optional<esc::SyncManager> manager(std::size_t n) const {
    return state.sync_manager(n, Certainty::kInferred);
  }
  /// SYNC0 is generated; unset: 0x0981 is not known.
  [[nodiscard]] std::optional<bool> sync0() const {
    if (!dc.activation()) return std::nullopt;
    return dc.activation()->active() && dc.activation()->sync0();
  }
  [[nodiscard]] bool sync1() const { return dc.activation() && dc.activation()->sync1(); }
  [[nodiscard]] std::optional<std::uint32_t> sync0_cycle_ns() const {
    return state.registers.Value<std::uint32_t>(esc::kSync0Cycle);
  }
};

/// What a check found: notes about what is wrong, and words for what is right.
struct Outcome {
  const Word* reason = nullptr;
  std::uint8_t slot = 0;           ///< of `reason`
  const Word* possible = nullptr;  ///< a reason that nothing but the coincidence speaks for
  std::optional<Value> value;      ///< of the setting that the reason is about
  std::vector<Note> wrong;
  std::vector<const Word*> right;

  [[nodiscard]] bool none() const { return reason == nullptr && possible == nullptr; }

  /// The slave has to refuse this.
  /// @param why  for the title
  void Wrong(const NoteKind& note, const Word& why, Arguments arguments = {}) {
    if (reason == nullptr) reason = &why;
    wrong.push_back({&note, std::move(arguments)});
  }
  /// This may be why it refused.
  void May(const NoteKind& note, const Word& why, Arguments arguments = {}) {
    if (possible == nullptr) possible = &why;
    wrong.push_back({&note, std::move(arguments)});
  }
  void Right(const Word& word) { right.push_back(&word); }
};

using Check = void (*)(const Case&, Outcome&);

constexpr std::size_t kOutputs = 2, kInputs = 3;   // sync managers
constexpr std::uint16_t kLrwUnsupported = 0x0200;  // of 0x0008

Value Bytes(std::uint64_t count) {
  return arg::Count(count, "byte");
}

// ----- reasons, as short as a title needs them

constexpr Word kWhyMailboxNeverSet{"mailbox-never-set", "SM0 and SM1 were never set"};
constexpr Word kWhyMailboxOff{"mailbox-off", "the mailbox is not enabled"};
constexpr Word kWhyNoMailboxInEeprom{"no-mailbox-in-eeprom", "the EEPROM names no mailbox"};
constexpr Word kWhyBootstrapMailbox{"bootstrap-mailbox", "not the bootstrap mailbox of the EEPROM"};
constexpr Word kWhyWriteIgnored{"write-ignored", "sync manager written while enabled"};
constexpr Word kWhyLrwNotSupported{"lrw-not-supported", "the slave does not support LRW"};
constexpr Word kWhyNoOutputs{"no-outputs", "no outputs reach the slave"};
constexpr Word kWhyNoInputs{"no-inputs", "the slave gives no inputs"};
constexpr Word kWhyRxCount{"rx-count-exceeds-entries", "1C12h:0 counts more PDOs than shown"};
constexpr Word kWhyTxCount{"tx-count-exceeds-entries", "1C13h:0 counts more PDOs than shown"};
constexpr Word kWhyMappedLength{"mapped-length-differs", "length of a mapped object"};
constexpr Word kWhyWatchdogZero{"watchdog-zero", "watchdog time is 0"};
constexpr Word kWhySyncLeftOn{"sync-left-on", "SYNC0 left on by the last run"};
constexpr Word kWhySyncOff{"sync-off", "SYNC0 is not active"};
constexpr Word kWhySyncSetAfterRequest{"sync-set-after-request", "SYNC0 was activated too late"};
constexpr Word kWhySyncOn{"sync-on", "SYNC0 is active"};
constexpr Word kWhySyncCycleZero{"sync-cycle-zero", "the SYNC0 cycle is 0"};
constexpr Word kWhySyncCycleTooShort{"sync-cycle-too-short", "the SYNC0 cycle is too short"};
constexpr Word kWhySyncCycleRejected{"sync-cycle-rejected", "the SYNC0 cycle is not accepted"};
constexpr Word kWhySyncSettings{"sync-settings", "SYNC0 cycle or 0x0981"};
constexpr Word kWhyMailboxAsEeprom{"mailbox-as-eeprom", "firmware and EEPROM differ"};
constexpr Word kWhyTypesSwapped{"types-swapped", "1C00h of the slave swaps SM2 and SM3"};
constexpr Word kWhyNoRxPdo{"no-rx-pdo", "1C12h is empty, but SM2 is not"};
constexpr Word kWhyNoTxPdo{"no-tx-pdo", "1C13h is empty, but SM3 is not"};
constexpr Word kWhyRxUnassigned{"rx-unassigned", "1C12h assigns no PDO"};
constexpr Word kWhyTxUnassigned{"tx-unassigned", "1C13h assigns no PDO"};
constexpr Word kWhySyncTypeDiffers{"sync-type-differs", "1C32h:1 does not fit 0x0981"};
constexpr Word kWhyRateDiffers{"rate-differs", "cycle differs from SYNC0"};
constexpr Word kWhyIntervalsMissed{"sync0-intervals-missed", "process data irregular against SYNC0"};
constexpr Word kWhyAtPulse{"at-sync0-pulse", "process data arrive at the SYNC0 pulse"};
constexpr Word kWhyEepromHeld{"eeprom-held", "the master holds the EEPROM"};
constexpr Word kWhyOutputsUnseen{"sm2-unseen", "SM2 was never set"};
constexpr Word kWhyInputsUnseen{"sm3-unseen", "SM3 was never set"};
constexpr Word kWhySyncUnseen{"sync-unseen", "SYNC0 was never activated"};
constexpr Word kWhySyncTypeRejected{"sync-type-rejected", "the type in 1C32h:1"};
constexpr Word kWhyInputSyncTypeDiffers{"input-sync-type-differs", "1C33h:1 does not fit 0x0981"};
constexpr Word kWhyModuleDiffers{"module-differs", "other module than configured"};
constexpr Word kWhyModuleCountDiffers{"module-count-differs", "more or fewer modules than configured"};

/// Nothing that the master wrote since the set-up began is missing from the capture.
bool SetUpIsSeen(const Case& of) {
  return of.refusal.requested != 0 && of.state.set_up_since != 0 && !MissesPackets(of.context.pairing());
}

// ----- mailbox

constexpr Word kMailboxManagers{"mailbox-sync-managers", "the settings of SM0 and SM1"};
constexpr Word kMailboxEnabled{"mailbox-enabled", "SM0 and SM1 are enabled"};
constexpr Word kMailboxWords{"mailbox-words", "the mailbox words of the EEPROM"};

bool IsBlank(const esc::SyncManager& manager) {
  return manager.start == 0 && manager.length == 0 && !manager.enabled();
}

void CheckMailboxSet(const Case& of, Outcome& found) {
  const auto out = of.manager(0);
  const auto in = of.manager(1);
  const FrameNo changed = std::max(of.model.set_up.manager_changed(0), of.model.set_up.manager_changed(1));
  if (!out && !in) {
    if (SetUpIsSeen(of) && of.state.sync_manager_since[0] <= of.state.set_up_since)
      found.Wrong(refusal::kMailboxUnseen, kWhyMailboxNeverSet, {{"since", arg::Frame(of.state.set_up_since)}});
    return;
  }
  if (!out || !in || !of.Applied(changed)) return;
  if (IsBlank(*out) && IsBlank(*in)) {
    if (!of.Counts(changed)) return;
    Arguments arguments;
    const FrameNo since = std::max(of.state.sync_manager_since[0], of.state.sync_manager_since[1]);
    if (since != 0) arguments.Set("since", arg::Frame(since));
    found.Wrong(refusal::kMailboxNeverSet, kWhyMailboxNeverSet, std::move(arguments));
    return;
  }
  bool enabled = true;
  for (const std::size_t n : {std::size_t{0}, std::size_t{1}}) {
    if ((n == 0 ? *out : *in).enabled()) continue;
    enabled = false;
    if (!of.Counts(of.model.set_up.manager_changed(n))) continue;
    found.Wrong(refusal::kMailboxOff, kWhyMailboxOff, {{"sync_manager", arg::Number(static_cast<std::int64_t>(n))}});
  }
  // Which settings apply is not known after a write that an ESC ignores.
  if (!enabled || of.model.set_up.ignored(0) != nullptr || of.model.set_up.ignored(1) != nullptr) return;
  const auto demands = model::MailboxDemands(*of.model.profile, of.sii);
  const bool fit = demands.known && !demands.list.empty() &&
                   std::all_of(demands.list.begin(), demands.list.end(), [&](const model::SyncManagerDemand& demand) {
                     const auto manager = of.manager(demand.number);
                     return manager && model::FaultsOf(*manager, demand).empty();
                   });
  found.Right(fit ? kMailboxManagers : kMailboxEnabled);
}

void CheckMailboxWords(const Case& of, Outcome& found) {
  const auto& out = of.sii.header.standard_receive;
  const auto& in = of.sii.header.standard_send;
  if (!out || !in) return;
  if (out->size != 0 || in->size != 0) {
    found.Right(kMailboxWords);
    return;
  }
  if (of.refusal.requested == 0) return;
  Arguments arguments;
  const std::uint16_t protocols = of.sii.header.protocols.value_or(0);
  if (protocols != 0) arguments.Set("protocols", arg::Text(esc::SiiProtocolNames(protocols)));
  for (std::size_t n = 0; n < of.sii.sync_managers.size(); ++n) {
    const esc::SiiSyncManager& entry = of.sii.sync_managers[n];
    constexpr std::uint8_t kMailboxOut = 1;
    if (entry.type != kMailboxOut || entry.length == 0) continue;
    arguments.Set("sync_manager", arg::Number(static_cast<std::int64_t>(n))).Set("bytes", Bytes(entry.length));
    break;
  }
  // The master may have set a mailbox all the same.
  if (found.reason != nullptr) {
    found.Wrong(refusal::kNoMailboxInEeprom, kWhyNoMailboxInEeprom, std::move(arguments));
  } else {
    found.May(refusal::kNoMailboxInEeprom, kWhyNoMailboxInEeprom, std::move(arguments));
  }
}

/// Set as the EEPROM has it, and refused nevertheless.
void CheckMailboxFirmware(const Case& of, Outcome& found) {
  if (!found.none() || of.refusal.requested == 0) return;
  const std::array<std::optional<esc::SiiMailbox>, 2> words{of.sii.header.standard_receive,
                                                            of.sii.header.standard_send};
  for (std::size_t n = 0; n < words.size(); ++n) {
    const auto manager = of.manager(n);
    if (!manager || !manager->enabled() || !words[n] || words[n]->size == 0) return;
    if (manager->start != words[n]->offset || manager->length != words[n]->size) return;
    if (!manager->mailbox() || !of.Counts(of.model.set_up.manager_changed(n))) return;
  }
  found.May(refusal::kMailboxAsEeprom, kWhyMailboxAsEeprom);
}

void CheckBootstrap(const Case& of, Outcome& found) {
  const std::array<std::optional<esc::SiiMailbox>, 2> words{of.sii.header.bootstrap_receive,
                                                            of.sii.header.bootstrap_send};
  for (std::size_t n = 0; n < words.size(); ++n) {
    const auto manager = of.manager(n);
    if (!manager || !manager->enabled() || !words[n] || words[n]->size == 0) continue;
    if (manager->start == words[n]->offset && manager->length == words[n]->size) continue;
    if (!of.Counts(of.model.set_up.manager_changed(n))) continue;
    found.Wrong(refusal::kBootstrapMailbox, kWhyBootstrapMailbox,
                {{"sync_manager", arg::Number(static_cast<std::int64_t>(n))},
                 {"start", arg::Hex(manager->start)},
                 {"length", arg::Number(manager->length)},
                 {"expected_start", arg::Hex(words[n]->offset)},
                 {"expected_length", arg::Number(words[n]->size)}});
  }
}

/// What sync manager `n` has to be, as far as it is known: null where nothing is.
std::optional<model::SyncManagerDemand> DemandOf(const Case& of, std::size_t n) {
  const bool mailbox = n < kOutputs;
  const auto demands =
      mailbox ? model::MailboxDemands(*of.model.profile, of.sii) : model::ProcessDemands(*of.model.profile, of.sii);
  const auto own = std::find_if(demands.list.begin(), demands.list.end(),
                                [n](const model::SyncManagerDemand& demand) { return demand.number == n; });
  std::optional<model::SyncManagerDemand> demand;
  if (own != demands.list.end()) demand = *own;
  if (mailbox) return demand;
  const auto direction = n == kOutputs ? device::PdoDirection::kRx : device::PdoDirection::kTx;
  const model::ProcessLayout& layout = of.model.process.Layout(direction);
  const std::uint32_t bytes = layout.known() ? layout.bytes_of(static_cast<std::uint8_t>(n)) : 0;
  if (bytes == 0 || layout.source == model::LayoutSource::kDefault) return demand;
  if (!demand) {
    demand.emplace();
    demand->number = static_cast<std::uint8_t>(n);
    demand->use = n == kOutputs ? device::SyncManagerUse::kProcessOut : device::SyncManagerUse::kProcessIn;
  }
  demand->lengths = {bytes};
  return demand;
}

/// An ESC keeps the settings that an enabled sync manager has. They are a reason if they are not what the slave needs,
/// and those that the master wrote are. Where the written ones are wrong, too, they explain the refusal themselves.
void CheckIgnored(const Case& of, Outcome& found, std::size_t n) {
  const model::SetUpFacts::IgnoredWrite* ignored = of.model.set_up.ignored(n);
  if (ignored == nullptr || !of.Counts(ignored->frame)) return;
  const auto demand = DemandOf(of, n);
  bool refuted = false;
  if (demand) {
    // The enable bit is not part of what was ignored.
    const auto fits = [&](esc::SyncManager settings) {
      settings.activate = 1;
      return model::FaultsOf(settings, *demand).empty();
    };
    if (fits(ignored->kept) || (ignored->shown == 0 && !fits(ignored->written))) return;
    refuted = ignored->shown != 0;
  }
  Arguments arguments{{"sync_manager", arg::Number(static_cast<std::int64_t>(n))},
                      {"write_frame", arg::Frame(ignored->frame)},
                      {"kept_start", arg::Hex(ignored->kept.start)},
                      {"kept_length", arg::Number(ignored->kept.length)},
                      {"kept_control", arg::Hex(ignored->kept.control, 2)},
                      {"start", arg::Hex(ignored->written.start)},
                      {"length", arg::Number(ignored->written.length)},
                      {"control", arg::Hex(ignored->written.control, 2)}};
  if (ignored->shown != 0) arguments.Set("shown_frame", arg::Frame(ignored->shown));
  if (refuted) {
    found.Wrong(refusal::kWriteIgnored, kWhyWriteIgnored, std::move(arguments));
  } else {
    found.May(refusal::kWriteIgnored, kWhyWriteIgnored, std::move(arguments));
  }
}
void CheckMailboxIgnored(const Case& of, Outcome& found) {
  CheckIgnored(of, found, 0);
  CheckIgnored(of, found, 1);
}
void CheckOutputsIgnored(const Case& of, Outcome& found) {
  CheckIgnored(of, found, kOutputs);
}
void CheckInputsIgnored(const Case& of, Outcome& found) {
  CheckIgnored(of, found, kInputs);
}

// ----- process data

constexpr Word kLengths{"sync-manager-lengths", "the lengths of SM2 and SM3 against the assigned PDOs"};
constexpr Word kLrw{"lrw", "support of LRW (0x0008)"};
constexpr Word kOutputsArrive{"outputs", "the arrival of outputs"};
constexpr Word kInputsArrive{"inputs", "the arrival of inputs"};
constexpr Word kWatchdogTimes{"watchdog", "the watchdog time (0x0420) is not 0"};

/// sm-process-config reports lengths that differ.
void CheckLengths(const Case& of, Outcome& found) {
  for (const auto direction : {device::PdoDirection::kRx, device::PdoDirection::kTx}) {
    const model::ProcessLayout& layout = of.model.process.Layout(direction);
    const std::uint8_t n = direction == device::PdoDirection::kRx ? 2 : 3;
    const auto manager = of.manager(n);
    if (!layout.known() || layout.source == model::LayoutSource::kDefault || !manager) return;
    if (!of.Applied(std::max(layout.since, of.model.set_up.manager_changed(n)))) return;
    if (of.model.set_up.ignored(n) != nullptr) return;
    if (manager->length != layout.bytes_of(n)) return;
  }
  found.Right(kLengths);
}

/// The master never wrote the sync manager of process data.
void CheckManagerSet(const Case& of, Outcome& found, std::size_t n) {
  // Below SAFEOP a slave needs no process data.
  if (of.refusal.requested < static_cast<std::uint8_t>(esc::AlState::SAFEOP)) return;
  if (of.manager(n) || !SetUpIsSeen(of) || of.state.sync_manager_since[n] > of.state.set_up_since) return;
  static constexpr Word kOutputsWord{"outputs", "outputs", true};
  static constexpr Word kInputsWord{"inputs", "inputs", true};
  const bool outputs = n == kOutputs;
  const Word& why = outputs ? kWhyOutputsUnseen : kWhyInputsUnseen;
  Arguments arguments{{"sync_manager", arg::Number(static_cast<std::int64_t>(n))},
                      {"direction", arg::Of(outputs ? kOutputsWord : kInputsWord)},
                      {"since", arg::Frame(of.state.set_up_since)}};
  const model::ProcessLayout& layout =
      of.model.process.Layout(outputs ? device::PdoDirection::kRx : device::PdoDirection::kTx);
  const bool assigned = layout.known() && layout.source != model::LayoutSource::kDefault;
  const std::uint32_t bytes = assigned ? layout.bytes_of(static_cast<std::uint8_t>(n)) : 0;
  if (assigned && bytes == 0) return;
  if (bytes != 0) {
    arguments.Set("bytes", Bytes(bytes));
    found.Wrong(refusal::kManagerUnseen, why, std::move(arguments));
  } else {
    found.May(refusal::kManagerUnseen, why, std::move(arguments));
  }
}
void CheckOutputsSet(const Case& of, Outcome& found) {
  CheckManagerSet(of, found, kOutputs);
}
void CheckInputsSet(const Case& of, Outcome& found) {
  CheckManagerSet(of, found, kInputs);
}

/// Subindex 0 of an assignment that the master wrote counts more PDOs than the capture shows in the list.
void CheckCount(const Case& of, Outcome& found, std::uint16_t assignment) {
  const process::PdoObject* const list = of.model.process.seen().Find(assignment);
  const model::ObjectValue* const count = of.model.objects.Find(assignment, 0);
  if (list == nullptr || count == nullptr || !count->written || count->raw > 0xFF || !of.Counts(count->since)) return;
  const std::uint8_t* const counted = list->count.if_observed();
  const std::uint8_t shown = list->highest();
  if (counted == nullptr || *counted != count->raw || shown >= *counted) return;
  Arguments arguments{{"object", arg::Object(assignment, 0)},
                      {"entries", arg::Count(*counted, "entry")},
                      {"count_frame", arg::Frame(count->since)}};
  if (shown > 0) arguments.Set("shown", arg::Count(shown, "entry"));
  found.May(refusal::kCountExceeds, assignment == process::kTxAssignment ? kWhyTxCount : kWhyRxCount,
            std::move(arguments));
}

/// 1C00h lists the types of the process data sync managers the other way round.
void CheckTypes(const Case& of, Outcome& found) {
  constexpr std::uint16_t kTypes = 0x1C00;
  constexpr std::uint64_t kOutputType = 3, kInputType = 4;
  const auto type_of = [&](std::size_t n) {
    const model::ObjectValue* type = of.model.objects.Find(kTypes, static_cast<std::uint8_t>(n + 1));
    return type != nullptr && of.Applied(type->since) ? type->raw : 0;
  };
  const auto outputs = of.manager(kOutputs);
  if (type_of(kOutputs) != kInputType || type_of(kInputs) != kOutputType || !outputs || !outputs->enabled()) return;
  if (outputs->direction() != esc::SmDirection::ECAT_WRITES) return;
  found.Wrong(refusal::kTypesSwapped, kWhyTypesSwapped, {{"control", arg::Hex(outputs->control, 2)}});
}

/// The slave assigns no PDO to sync manager `n`. The code is about these process data: it wants some where the sync
/// manager has no length, and refuses them where it has.
void CheckAssigned(const Case& of, Outcome& found, std::size_t n) {
  const std::uint16_t assignment = n == kOutputs ? process::kRxAssignment : process::kTxAssignment;
  const model::ObjectValue* const count = of.model.objects.Find(assignment, 0);
  const auto manager = of.manager(n);
  if (of.refusal.requested == 0 || count == nullptr || count->raw != 0 || !of.Applied(count->since)) return;
  if (!manager) return;
  if (!manager->enabled() || manager->length == 0) {
    if (!found.none()) return;
    // That both lengths are 0 fits, and is what the slave refuses.
    std::erase(found.right, &kLengths);
    found.May(refusal::kNothingAssigned, n == kOutputs ? kWhyRxUnassigned : kWhyTxUnassigned,
              {{"object", arg::Object(assignment, 0)},
               {"count_frame", arg::Frame(count->since)},
               {"sync_manager", arg::Number(static_cast<std::int64_t>(n))}});
    return;
  }
  found.May(refusal::kNoPdoAssigned, n == kOutputs ? kWhyNoRxPdo : kWhyNoTxPdo,
            {{"object", arg::Object(assignment, 0)},
             {"count_frame", arg::Frame(count->since)},
             {"sync_manager", arg::Number(static_cast<std::int64_t>(n))},
             {"bytes", Bytes(manager->length)}});
}
void CheckOutputsAssigned(const Case& of, Outcome& found) {
  CheckAssigned(of, found, kOutputs);
}
void CheckInputsAssigned(const Case& of, Outcome& found) {
  CheckAssigned(of, found, kInputs);
}

void CheckOutputCount(const Case& of, Outcome& found) {
  CheckCount(of, found, process::kRxAssignment);
}
void CheckInputCount(const Case& of, Outcome& found) {
  CheckCount(of, found, process::kTxAssignment);
}

/// The master wrote a mapping with another length than the type of the object has.
void CheckMapped(const Case& of, Outcome& found, device::PdoDirection direction) {
  constexpr std::uint16_t kNoLength = 0xFF;  // the length byte of an entry without a length
  const model::ProcessLayout& layout = of.model.process.Layout(direction);
  if (!layout.known() || layout.source == model::LayoutSource::kDefault || !of.Counts(layout.since)) return;
  for (const model::Signal& signal : layout.signals) {
    // What the slave offers by itself is its own affair.
    const model::ObjectValue* written = of.model.objects.Find(signal.pdo, 0);
    if (signal.gap() || written == nullptr || !written->written) continue;
    const std::uint16_t bits = device::BitsOf(device::DataTypeFromCode(static_cast<std::uint16_t>(signal.type)));
    const bool none = bits == 0 && signal.bits == kNoLength;
    // A BOOLEAN may fill a byte.
    const bool differs = bits != 0 && bits != signal.bits && !(bits == 1 && signal.bits == 8);
    if (!none && !differs) continue;
    Arguments arguments{{"pdo", arg::Object(signal.pdo)},
                        {"object", arg::Object(signal.index, signal.subindex)},
                        {"mapped", arg::Count(signal.bits, "bit")}};
    if (differs) arguments.Set("expected", arg::Count(bits, "bit"));
    found.May(refusal::kMappedLength, kWhyMappedLength, std::move(arguments));
    return;
  }
}
void CheckMappedOutputs(const Case& of, Outcome& found) {
  CheckMapped(of, found, device::PdoDirection::kRx);
}
void CheckMappedInputs(const Case& of, Outcome& found) {
  CheckMapped(of, found, device::PdoDirection::kTx);
}

void CheckLrw(const Case& of, Outcome& found) {
  if (!of.ExchangeCounts()) return;
  const auto& outputs = of.model.outputs.since;
  const auto& inputs = of.model.inputs.since;
  const auto features = of.state.registers.Value<std::uint16_t>(esc::kEscFeatures, Certainty::kObserved);
  const bool by_register = features && (*features & kLrwUnsupported) != 0;
  const bool by_eeprom = of.sii.general && of.sii.general->no_lrw();
  const std::uint64_t missed = std::max(outputs.missed_by_lrw, inputs.missed_by_lrw);
  if (!by_register && !by_eeprom) {
    if (features && missed > 0) found.Right(kLrw);
    return;
  }
  if (missed == 0 || outputs.exchanged + inputs.exchanged > 0) return;
  static constexpr Word kRegister{"register", "bit 9 of 0x0008 is 1"};
  static constexpr Word kEeprom{"eeprom", "bit 1 of the flags in the general category of its EEPROM is 1"};
  Arguments arguments{{"source", arg::Of(by_register ? kRegister : kEeprom)},
                      {"missed", arg::Count(missed, "LRW datagram")}};
  if (outputs.request != 0) arguments.Set("since", arg::Frame(outputs.request));
  found.Wrong(refusal::kLrwUnsupported, kWhyLrwNotSupported, std::move(arguments));
}

/// It has outputs by its sync manager.
bool HasOutputs(const Case& of) {
  const auto manager = of.state.process_manager(esc::SmDirection::ECAT_WRITES);
  return manager.has_value();
}

void CheckOutputs(const Case& of, Outcome& found) {
  const auto& outputs = of.model.outputs.since;
  if (found.reason == &kWhyLrwNotSupported || !of.ExchangeCounts()) return;
  if (!HasOutputs(of) || outputs.request == 0) return;
  if (outputs.exchanged > 0) {
    // Of a slave that left its state that they arrived until then shows nothing.
    if (outputs.missed == 0 && of.refusal.requested != 0) found.Right(kOutputsArrive);
    return;
  }
  if (outputs.missed > 0) {
    found.Wrong(refusal::kOutputsNotAccepted, kWhyNoOutputs,
                {{"since", arg::Frame(outputs.request)},
                 {"missed", arg::Count(outputs.missed, "datagram")},
                 {"last_missed", arg::Frame(outputs.last_missed)}});
    return;
  }
  // Some FMMU writes, and it is known of all of them: what would reach it would be in the capture.
  const track::KnownFmmus& fmmus = of.context.network().fmmus(of.refusal.slave);
  const bool writes = std::any_of(fmmus.active.begin(), fmmus.active.end(),
                                  [](const track::KnownFmmus::Unit& unit) { return unit.fmmu.writes(); });
  const bool silent =
      fmmus.all && writes && !MissesPackets(of.context.pairing()) && of.context.network().last_gap() <= outputs.request;
  if (silent) found.Wrong(refusal::kOutputsNotSent, kWhyNoOutputs, {{"since", arg::Frame(outputs.request)}});
}

void CheckInputs(const Case& of, Outcome& found) {
  const auto& inputs = of.model.inputs.since;
  if (inputs.request == 0 || !of.ExchangeCounts()) return;
  if (inputs.exchanged > 0) {
    if (inputs.missed == 0 && of.refusal.requested != 0) found.Right(kInputsArrive);
  } else if (inputs.missed > 0) {
    found.Wrong(refusal::kInputsNotRead, kWhyNoInputs,
                {{"since", arg::Frame(inputs.request)},
                 {"missed", arg::Count(inputs.missed, "datagram")},
                 {"last_missed", arg::Frame(inputs.last_missed)}});
  }
}

void CheckWatchdog(const Case& of, Outcome& found) {
  const auto time = of.state.registers.Value<std::uint16_t>(esc::kProcessWatchdog);
  const FrameNo changed = of.model.set_up.watchdog_changed();
  if (!time || !of.Applied(changed)) return;
  if (*time != 0) {
    found.Right(kWatchdogTimes);
    return;
  }
  const auto manager = of.manager(kOutputs);
  const FrameNo both = std::max(changed, of.model.set_up.manager_changed(kOutputs));
  if (manager && manager->enabled() && manager->watchdog_trigger() && of.Counts(both)) {
    found.Wrong(refusal::kWatchdogZero, kWhyWatchdogZero,
                {{"register", arg::Register(esc::kProcessWatchdog)}, {"sync_manager", arg::Number(kOutputs)}});
  }
}

// ----- synchronisation

constexpr Word kSyncActive{"sync-active", "SYNC0 is active (0x0981)"};
constexpr Word kSyncInactive{"sync-inactive", "SYNC0 is off (0x0981)"};
constexpr Word kSyncCycle{"sync-cycle", "the SYNC0 cycle (0x09A0)"};
constexpr Word kSyncTypes{"sync-types", "the synchronisation type (1C32h:1) against 0x0981"};
constexpr Word kArrival{"arrival", "one frame with process data in each SYNC0 interval"};
constexpr Word kRate{"rate", "the cycle of the process data against SYNC0"};

void CheckLeftOn(const Case& of, Outcome& found) {
  const auto left = of.dc.left_on();
  if (!left || of.state.returned || !of.Counts(left->clock_set)) return;
  Arguments arguments{{"on_frame", arg::Frame(left->on)},
                      {"on_written", arg::Flag(left->on_written)},
                      {"clock_frame", arg::Frame(left->clock_set)}};
  if (left->off != 0) arguments.Set("off_frame", arg::Frame(left->off));
  found.May(refusal::kSyncLeftOn, kWhySyncLeftOn, std::move(arguments));
}

Value Activation(const Case& of) {
  return arg::Hex(of.dc.activation()->raw, 2);
}

/// The code demands that SYNC0 runs.
void CheckSyncActive(const Case& of, Outcome& found) {
  const auto sync0 = of.sync0();
  const FrameNo changed = of.dc.activation_changed();
  if (!sync0 && changed == 0 && SetUpIsSeen(of)) {
    found.May(refusal::kSyncUnseen, kWhySyncUnseen, {{"since", arg::Frame(of.state.set_up_since)}});
    return;
  }
  if (!sync0 || !of.Applied(changed)) return;
  if (!*sync0) {
    if (!of.Counts(changed)) return;
    Arguments arguments{{"activation", Activation(of)}};
    if (changed != 0) arguments.Set("write_frame", arg::Frame(changed));
    // Slaves without SYNC0 have this code, too: it speaks of any synchronisation.
    constexpr std::uint16_t kAnySynchronisation = 0x001A;
    if (of.refusal.code == kAnySynchronisation) {
      found.May(refusal::kSyncOff, kWhySyncOff, std::move(arguments));
    } else {
      found.Wrong(refusal::kSyncOff, kWhySyncOff, std::move(arguments));
    }
    return;
  }
  const auto& active = of.dc.active();
  // A read only shows that it is on, not since when.
  if (!active || of.refusal.request == 0 || active->frame.number <= of.refusal.request) {
    found.Right(kSyncActive);
    return;
  }
  if (!active->written) return;
  Arguments arguments{{"write_frame", arg::Frame(active->frame.number)},
                      {"requested", arg::State(of.refusal.requested)},
                      {"request_frame", arg::Frame(of.refusal.request)},
                      {"was_off", arg::Flag(active->was_off)}};
  if (active->was_off) {
    found.Wrong(refusal::kSyncOffAtRequest, kWhySyncSetAfterRequest, std::move(arguments));
  } else {
    found.May(refusal::kSyncOffAtRequest, kWhySyncSetAfterRequest, std::move(arguments));
  }
}

/// The code rejects SYNC0.
void CheckSyncUnsupported(const Case& of, Outcome& found) {
  const auto sync0 = of.sync0();
  const FrameNo changed = of.dc.activation_changed();
  if (!sync0 || !of.Applied(changed)) return;
  if (!*sync0) {
    found.Right(kSyncInactive);
    return;
  }
  const auto& active = of.dc.active();
  if (!active || !of.Counts(changed)) return;
  found.Wrong(refusal::kSyncOn, kWhySyncOn,
              {{"activation", Activation(of)},
               {"write_frame", arg::Frame(active->frame.number)},
               {"written", arg::Flag(active->written)}});
}

void CheckSyncCycle(const Case& of, Outcome& found) {
  const auto cycle = of.sync0_cycle_ns();
  if (!of.sync0().value_or(false) || !cycle || !of.Applied(of.sync_changed())) return;
  const bool counts = of.Counts(of.sync_changed());
  if (*cycle == 0) {
    if (counts) found.Wrong(refusal::kSyncCycleZero, kWhySyncCycleZero);
    return;
  }
  bool checked = false;
  for (const std::uint16_t object : sync::kSyncObjects) {
    constexpr std::uint8_t kMinimumCycle = 5;
    const model::ObjectValue* minimum = of.model.objects.Find(object, kMinimumCycle);
    if (minimum == nullptr || minimum->raw == 0) continue;
    checked = true;
    if (*cycle >= minimum->raw) continue;
    if (!counts) return;
    found.Wrong(refusal::kSyncCycleTooShort, kWhySyncCycleTooShort,
                {{"cycle_us", arg::Us(*cycle)},
                 {"minimum_us", arg::Us(static_cast<std::int64_t>(minimum->raw))},
                 {"object", arg::Object(object, kMinimumCycle)}});
    return;
  }
  if (checked) found.Right(kSyncCycle);
}

/// No setting is known to be wrong, but the code is about them: the slave does not accept what is set.
void CheckSyncSettings(const Case& of, Outcome& found) {
  const auto cycle = of.sync0_cycle_ns();
  if (!found.none() || !of.sync0().value_or(false) || !cycle || *cycle == 0 || !of.Counts(of.sync_changed())) return;
  if (std::find(found.right.begin(), found.right.end(), &kSyncCycle) != found.right.end()) return;
  found.value = arg::Ms(*cycle);
  constexpr std::uint16_t kInvalidSettings = 0x0030;
  if (of.refusal.code != kInvalidSettings) {
    found.Wrong(refusal::kSyncCycleRejected, kWhySyncCycleRejected, {{"cycle_us", arg::Us(*cycle)}});
    return;
  }
  Arguments arguments{{"cycle_us", arg::Us(*cycle)}, {"activation", Activation(of)}};
  if (of.dc.activation_changed() != 0) arguments.Set("write_frame", arg::Frame(of.dc.activation_changed()));
  found.May(refusal::kSyncSettings, kWhySyncSettings, std::move(arguments));
}

/// Of the first object that does not fit. Synchronous to the outputs (0x22) fits both.
void CheckSyncTypes(const Case& of, Outcome& found) {
  const auto sync0 = of.sync0();
  const bool unseen = !sync0 && of.dc.activation_changed() == 0 && SetUpIsSeen(of);
  if (!sync0 && !unseen) return;
  const bool active = sync0.value_or(false);
  bool fits = false;
  for (const std::uint16_t object : sync::kSyncObjects) {
    const model::ObjectValue* value = of.model.objects.Find(object, sync::kSyncTypeEntry);
    if (value == nullptr || !sync::IsKnownSyncType(value->raw)) continue;
    // Slaves change it themselves when SYNC0 is activated: what was read before shows nothing of the time after.
    const FrameNo changed = of.dc.activation_changed();
    if (!of.Applied(std::max(changed, value->since)) || (!value->written && value->since < changed)) continue;
    const auto type = static_cast<sync::SyncType>(value->raw);
    if (sync::NeedsPulses(type) == active || type == sync::SyncType::kSmEventOfInputs) {
      fits = true;
      continue;
    }
    if (!of.Counts(std::max(changed, value->written ? value->since : 0))) return;
    const bool inputs = object == sync::kSyncObjects[1];
    Arguments arguments{{"object", arg::Object(object, sync::kSyncTypeEntry)},
                        {"type", arg::Number(static_cast<std::int64_t>(value->raw), sync::Name(type))},
                        {"active", arg::Flag(active)}};
    if (unseen) {
      arguments.Set("since", arg::Frame(of.state.set_up_since));
    } else {
      arguments.Set("activation", Activation(of));
    }
    found.May(refusal::kSyncTypeDiffers, inputs ? kWhyInputSyncTypeDiffers : kWhySyncTypeDiffers, std::move(arguments));
    return;
  }
  if (fits && !unseen) found.Right(kSyncTypes);
}

/// The code rejects what the object names.
void CheckTypeRejected(const Case& of, Outcome& found) {
  constexpr std::uint16_t kNoFreeRun = 0x0027;
  const model::ObjectValue* value = of.model.objects.Find(sync::kSyncObjects[0], sync::kSyncTypeEntry);
  if (value == nullptr || !sync::IsKnownSyncType(value->raw) || !of.Applied(value->since)) return;
  const auto type = static_cast<sync::SyncType>(value->raw);
  const bool rejected = of.refusal.code == kNoFreeRun ? type == sync::SyncType::kFreeRun : sync::NeedsPulses(type);
  if (!rejected || !of.Counts(value->written ? value->since : 0)) return;
  found.May(refusal::kSyncTypeRejected, kWhySyncTypeRejected,
            {{"object", arg::Object(sync::kSyncObjects[0], sync::kSyncTypeEntry)},
             {"type", arg::Number(static_cast<std::int64_t>(value->raw), sync::Name(type))}});
}

/// A slave counts what it misses before it leaves OP. One that ran for long did not leave because of its rhythm.
bool HadNoTimeToShow(const Case& of) {
  constexpr FrameNo kShortly = 1000;
  if (of.refusal.requested != 0) return of.Counts(of.sync_changed());
  return of.refusal.shown <= of.refusal.held_since + kShortly;
}

void CheckRate(const Case& of, Outcome& found) {
  const auto cycle = of.sync0_cycle_ns();
  const sync::CyclicImage* image = of.context.sync().outputs(of.refusal.slave).image;
  if (!of.sync0().value_or(false) || !cycle || *cycle == 0 || image == nullptr || !image->has_nominal()) return;
  if (!of.Applied(of.sync_changed())) return;
  const auto expected = static_cast<TimeNs>(*cycle);
  const auto cycles = static_cast<double>(image->nominal_ns) / static_cast<double>(expected);
  Arguments arguments{{"rate_us", arg::Us(image->nominal_ns)},
                      {"cycle_us", arg::Us(expected)},
                      {"one_per_cycle", arg::Flag(NeedsOneFrameACycle(of.model))}};
  if (CycleDeviation(of.model, static_cast<double>(image->nominal_ns), expected) > kCycleTolerance) {
    if (!NeedsOneFrameACycle(of.model)) arguments.Set("neither", arg::Flag());
    if (of.Counts(of.sync_changed())) found.May(refusal::kRateDiffers, kWhyRateDiffers, std::move(arguments));
  } else if (std::abs(cycles - 1) <= kCycleTolerance) {
    found.Right(kRate);
  } else if (cycles < 1 && found.none() && of.Counts(of.sync_changed())) {
    // Several frames for one pulse are unusual: the slave uses one of them, and its code is about the cycle.
    arguments.Set("several", arg::Flag());
    found.May(refusal::kRateDiffers, kWhyRateDiffers, std::move(arguments));
  } else if (cycles > 1 && found.none() && !of.sync1() && HadNoTimeToShow(of)) {
    // Some slaves want several pulses for each frame: that is for the slave to accept, and this one rejects it.
    const auto pulses = static_cast<std::int64_t>(std::llround(cycles));
    arguments.Set("pulses", arg::Number(pulses)).Set("empty", arg::Number(pulses - 1));
    found.May(refusal::kRateDiffers, kWhyRateDiffers, std::move(arguments));
  }
}

/// How the frames came against SYNC0: before the request in SAFEOP, or in OP.
void CheckArrival(const Case& of, Outcome& found) {
  constexpr std::uint64_t kEnough = 20;  // frames
  constexpr std::uint64_t kOneIn = 20;   // intervals that a slave may miss
  constexpr TimeNs kClear = 8;           // of a cycle: a pulse is no longer than this part
  const sync::OutputWatch& outputs = of.context.sync().outputs(of.refusal.slave);
  const sync::Sync0Phase* phase = of.refusal.requested != 0 ? outputs.safeop_phase.get() : &outputs.phase;
  const auto cycle = of.sync0_cycle_ns();
  if (!found.none() || !of.ExchangeCounts() || !of.sync0().value_or(false) || !cycle || phase == nullptr) return;
  const std::uint64_t frames = phase->frames();
  if (frames < kEnough || !of.Applied(of.sync_changed()) || phase->uncertainty_ns() * kClear > TimeNs{*cycle}) return;
  const sync::Sync0Phase::Misses& misses = phase->misses();
  if (misses.empty > frames) return;  // another rhythm
  const std::uint64_t intervals = frames + misses.empty;
  Arguments arguments{{"cycle_us", arg::Us(TimeNs{*cycle})},
                      {"arrived", arg::Count(frames, "frame")},
                      {"uncertainty_us", arg::Us(phase->uncertainty_ns())}};
  if ((misses.empty + misses.doubled) * kOneIn >= intervals) {
    const double share = 100.0 * static_cast<double>(misses.empty + misses.doubled) / static_cast<double>(intervals);
    arguments.Set("empty", arg::Number(static_cast<std::int64_t>(misses.empty)))
        .Set("doubled", arg::Number(static_cast<std::int64_t>(misses.doubled)))
        .Set("intervals", arg::Count(intervals, "interval"))
        .Set("share", arg::Real(share, "%", share < 10 ? 1 : 0));
    if (misses.longest > 0) arguments.Set("longest", arg::Count(misses.longest, "interval"));
    found.May(refusal::kIntervalsMissed, kWhyIntervalsMissed, std::move(arguments));
  } else if (misses.undecided * 2 >= frames) {
    arguments.Set("at_pulse", arg::Number(static_cast<std::int64_t>(misses.undecided)));
    found.May(refusal::kAtPulse, kWhyAtPulse, std::move(arguments));
  } else if (misses.empty + misses.doubled + misses.undecided == 0) {
    found.Right(kArrival);
  }
}

// ----- EEPROM and modules

constexpr Word kEepromOffered{"eeprom-offered", "the EEPROM is offered to the slave (0x0500)"};
constexpr Word kModules{"modules", "the configured modules (F030h) against the detected ones (F050h)"};

void CheckEepromOwner(const Case& of, Outcome& found) {
  auto owned_by_pdi = of.state.sii.owned_by_pdi();
  if (const auto read = of.state.registers.Value<std::uint8_t>(esc::kEepromConfiguration); !owned_by_pdi && read) {
    owned_by_pdi = (*read & 1U) != 0;
  }
  const FrameNo since = of.model.set_up.eeprom_owner_since();
  if (!owned_by_pdi || !of.Applied(since)) return;
  if (*owned_by_pdi) {
    found.Right(kEepromOffered);
    return;
  }
  if (!of.Counts(since)) return;
  Arguments arguments;
  if (since != 0) arguments.Set("since", arg::Frame(since));
  found.Wrong(refusal::kEepromHeld, kWhyEepromHeld, std::move(arguments));
}

std::string ModuleName(const Case& of, std::uint32_t ident) {
  const auto& esi = of.model.profile->esi;
  const device::EsiModule* module = esi && esi->slot_rules ? esi->slot_rules->Find(ident) : nullptr;
  return module == nullptr ? std::string() : module->name;
}

/// A module list is right if all of it is compared: its number of entries (subindex 0), and each of them.
void CheckModules(const Case& of, Outcome& found) {
  using Modules = model::SlotModules;
  constexpr std::size_t kShown = 3;
  if (of.refusal.requested == 0) return;  // a slave reads its modules when it starts
  const Modules::List& configured = of.model.modules.configured();
  const Modules::List& detected = of.model.modules.detected();
  const bool counts_known =
      configured.count && detected.count && of.Applied(configured.count_since) && of.Applied(detected.count_since);
  const bool counts_differ = counts_known && *configured.count != *detected.count;
  if (counts_differ) {
    found.Wrong(refusal::kModuleCountDiffers, kWhyModuleCountDiffers,
                {{"configured", arg::Count(*configured.count, "module")},
                 {"configured_frame", arg::Frame(configured.count_since)},
                 {"detected", arg::Count(*detected.count, "module")},
                 {"detected_frame", arg::Frame(detected.count_since)}});
  }
  std::uint64_t compared = 0;
  std::size_t wrong = 0;
  for (const auto& [slot, wanted] : configured.entries) {
    const auto other = detected.entries.find(slot);
    if (other == detected.entries.end()) continue;
    const Modules::List::Entry& real = other->second;
    if (!of.Applied(wanted.since) || !of.Applied(real.since)) continue;
    if (counts_known && slot > std::max(*configured.count, *detected.count)) continue;  // of an older list
    ++compared;
    if (wanted.ident == real.ident || wrong == kShown) continue;
    if (++wrong == 1 && found.reason == nullptr) found.slot = slot;
    Arguments arguments{{"slot", arg::Number(slot)},
                        {"configured", arg::Hex(wanted.ident, 8)},
                        {"configured_object", arg::Object(Modules::kConfigured, slot)},
                        {"configured_frame", arg::Frame(wanted.since)},
                        {"detected", arg::Hex(real.ident, 8)},
                        {"detected_object", arg::Object(Modules::kDetected, slot)},
                        {"detected_frame", arg::Frame(real.since)}};
    if (auto name = ModuleName(of, wanted.ident); !name.empty()) arguments.Set("configured_name", arg::Text(name));
    if (auto name = ModuleName(of, real.ident); !name.empty()) arguments.Set("detected_name", arg::Text(name));
    found.Wrong(refusal::kModuleDiffers, kWhyModuleDiffers, std::move(arguments));
  }
  if (counts_known && !counts_differ && compared == *configured.count && wrong == 0) found.Right(kModules);
}

// ----- the table

constexpr std::size_t kMostChecks = 10;
struct Row {
  std::uint16_t code;
  std::array<Check, kMostChecks> checks;  ///< the likeliest reason first; null: no more
};

constexpr std::array kRows{
    Row{0x0015, {CheckMailboxSet, CheckBootstrap, CheckMailboxIgnored}},
    Row{0x0016, {CheckMailboxSet, CheckMailboxWords, CheckMailboxIgnored, CheckMailboxFirmware}},
    Row{0x0017,
        {CheckMailboxSet, CheckMailboxIgnored, CheckOutputsSet, CheckInputsSet, CheckOutputsIgnored, CheckInputsIgnored,
         CheckMappedOutputs, CheckMappedInputs, CheckLengths}},
    Row{0x0018, {CheckInputs, CheckLrw}},
    Row{0x0019, {CheckLrw, CheckOutputs}},
    Row{0x001A, {CheckLeftOn, CheckSyncActive, CheckSyncCycle, CheckRate, CheckArrival}},
    Row{0x001B, {CheckLrw, CheckOutputs}},
    Row{0x001D,
        {CheckTypes, CheckOutputsSet, CheckOutputsIgnored, CheckOutputCount, CheckMappedOutputs, CheckLengths,
         CheckOutputsAssigned}},
    Row{0x001E,
        {CheckTypes, CheckInputsSet, CheckInputsIgnored, CheckInputCount, CheckMappedInputs, CheckLengths,
         CheckInputsAssigned}},
    Row{0x001F, {CheckWatchdog}},
    Row{0x0024,
        {CheckTypes, CheckInputsSet, CheckInputsIgnored, CheckInputCount, CheckMappedInputs, CheckLengths,
         CheckInputsAssigned}},
    Row{0x0025,
        {CheckTypes, CheckOutputsSet, CheckOutputsIgnored, CheckOutputCount, CheckMappedOutputs, CheckLengths,
         CheckOutputsAssigned}},
    Row{0x0026, {CheckSyncTypes, CheckSyncCycle, CheckLengths}},
    Row{0x0027, {CheckTypeRejected, CheckSyncActive, CheckSyncTypes}},
    Row{0x0028, {CheckSyncUnsupported, CheckTypeRejected, CheckSyncTypes}},
    Row{0x002B, {CheckLrw, CheckOutputs, CheckInputs}},
    Row{0x002C, {CheckLeftOn, CheckSyncActive, CheckSyncCycle, CheckRate, CheckArrival}},
    Row{0x002D, {CheckLeftOn, CheckSyncActive, CheckSyncCycle, CheckRate, CheckArrival}},
    Row{0x002E, {CheckSyncCycle}},
    Row{0x0030, {CheckSyncActive, CheckSyncCycle, CheckSyncTypes, CheckLeftOn, CheckSyncSettings}},
    Row{0x0032, {CheckLeftOn, CheckSyncActive, CheckSyncCycle, CheckRate, CheckArrival}},
    Row{0x0033, {CheckLeftOn, CheckSyncActive, CheckSyncCycle, CheckRate, CheckArrival}},
    Row{0x0034, {CheckLeftOn, CheckSyncActive, CheckSyncCycle, CheckRate, CheckArrival}},
    Row{0x0035, {CheckSyncActive, CheckSyncCycle, CheckRate, CheckSyncTypes, CheckSyncSettings}},
    Row{0x0036, {CheckSyncActive, CheckSyncCycle, CheckSyncTypes, CheckSyncSettings}},
    Row{0x0050, {CheckEepromOwner}},
    Row{0x0070, {CheckModules}},
};

// ----- what the rows are about

/// The registers and objects that show what a check looks at.
struct About {
  Check check;
  std::array<SettingRange, 6> settings;  ///< empty ones at the end
};

constexpr SettingRange kMailboxRegisters{.first = 0x0800, .last = 0x080F};
constexpr SettingRange kOutputRegisters{.first = 0x0810, .last = 0x0817};
constexpr SettingRange kInputRegisters{.first = 0x0818, .last = 0x081F};
constexpr SettingRange kFurtherManagers{.first = 0x0820, .last = 0x087F};
constexpr SettingRange kFmmuRegisters{.first = 0x0600, .last = 0x06FF};
constexpr SettingRange kWatchdogRegisters{.first = 0x0400, .last = 0x0421};
constexpr SettingRange kClockRegisters{.first = 0x0900, .last = 0x098F};
constexpr SettingRange kSyncRegisters{.first = 0x0980, .last = 0x09AF};
constexpr SettingRange kEepromRegisters{.first = 0x0500, .last = 0x0501};
constexpr SettingRange kEepromMailbox{.kind = SettingRange::Kind::kEeprom, .first = 0x0014, .last = 0x001C};
constexpr SettingRange kRxObjects{.kind = SettingRange::Kind::kObject, .first = 0x1600, .last = 0x17FF};
constexpr SettingRange kTxObjects{.kind = SettingRange::Kind::kObject, .first = 0x1A00, .last = 0x1BFF};
constexpr SettingRange kRxAssigned{.kind = SettingRange::Kind::kObject, .first = 0x1C12, .last = 0x1C12};
constexpr SettingRange kTxAssigned{.kind = SettingRange::Kind::kObject, .first = 0x1C13, .last = 0x1C13};
constexpr SettingRange kSyncParameters{.kind = SettingRange::Kind::kObject, .first = 0x1C32, .last = 0x1C33};
constexpr SettingRange kDriveCycle{.kind = SettingRange::Kind::kObject, .first = 0x60C2, .last = 0x60C2};
constexpr SettingRange kModuleObjects{.kind = SettingRange::Kind::kObject, .first = 0xF030, .last = 0xF05F};

constexpr std::array kAbout{
    About{CheckMailboxSet, {kMailboxRegisters}},
    About{CheckMailboxWords, {kMailboxRegisters, kEepromMailbox}},
    About{CheckBootstrap, {kMailboxRegisters, kEepromMailbox}},
    About{CheckMailboxFirmware, {kMailboxRegisters, kEepromMailbox}},
    About{CheckOutputsSet, {kOutputRegisters}},
    About{CheckInputsSet, {kInputRegisters}},
    About{CheckMappedOutputs, {kRxObjects, kRxAssigned}},
    About{CheckMappedInputs, {kTxObjects, kTxAssigned}},
    About{CheckOutputsAssigned, {kRxAssigned}},
    About{CheckInputsAssigned, {kTxAssigned}},
    // The assignment of sync managers is not written by the master.
    About{CheckTypes, {}},
    About{CheckTypeRejected, {kSyncRegisters, kSyncParameters}},
    About{CheckSyncSettings, {kSyncRegisters, kSyncParameters}},
    About{CheckMailboxIgnored, {kMailboxRegisters}},
    About{CheckOutputsIgnored, {kOutputRegisters, kRxObjects, kRxAssigned}},
    About{CheckInputsIgnored, {kInputRegisters, kTxObjects, kTxAssigned}},
    About{CheckOutputCount, {kOutputRegisters, kRxObjects, kRxAssigned}},
    About{CheckInputCount, {kInputRegisters, kTxObjects, kTxAssigned}},
    // A row of a single direction names it by its other checks.
    About{CheckLengths, {}},
    About{CheckLrw, {kFmmuRegisters}},
    About{CheckOutputs, {kFmmuRegisters, kOutputRegisters}},
    About{CheckInputs, {kFmmuRegisters, kInputRegisters}},
    About{CheckWatchdog, {kWatchdogRegisters, kOutputRegisters}},
    About{CheckLeftOn, {kClockRegisters, kSyncRegisters}},
    About{CheckSyncActive, {kSyncRegisters, kSyncParameters}},
    About{CheckSyncUnsupported, {kSyncRegisters, kSyncParameters}},
    About{CheckSyncCycle, {kSyncRegisters, kSyncParameters, kDriveCycle}},
    About{CheckSyncTypes, {kSyncRegisters, kSyncParameters}},
    About{CheckRate, {kSyncRegisters, kClockRegisters, kDriveCycle}},
    About{CheckArrival, {kSyncRegisters, kClockRegisters}},
    About{CheckEepromOwner, {kEepromRegisters}},
    About{CheckModules, {kModuleObjects}},
};

/// What a slave checks at a request, for a code without a row.
struct AboutRequest {
  esc::AlState requested;
  std::array<SettingRange, 12> settings;
};
constexpr std::array kAboutRequests{
    AboutRequest{esc::AlState::PREOP, {kMailboxRegisters, kEepromRegisters}},
    AboutRequest{esc::AlState::SAFEOP,
                 {kMailboxRegisters, kOutputRegisters, kInputRegisters, kFurtherManagers, kFmmuRegisters, kRxObjects,
                  kTxObjects, kRxAssigned, kTxAssigned, kSyncRegisters, kSyncParameters, kModuleObjects}},
    AboutRequest{esc::AlState::OP,
                 {kOutputRegisters, kInputRegisters, kFurtherManagers, kFmmuRegisters, kWatchdogRegisters,
                  kClockRegisters, kSyncRegisters, kSyncParameters, kDriveCycle}},
};

void AddSettings(std::span<const SettingRange> settings, std::vector<SettingRange>& all) {
  for (const SettingRange& range : settings) {
    if (range.last == 0 || std::find(all.begin(), all.end(), range) != all.end()) continue;
    all.push_back(range);
  }
}

}  // namespace

std::vector<SettingRange> SettingsOfRefusal(std::uint16_t code, std::uint8_t requested) {
  std::vector<SettingRange> all;
  for (const Row& row : kRows) {
    if (row.code != code) continue;
    for (const About& about : kAbout) {
      if (std::find(row.checks.begin(), row.checks.end(), about.check) != row.checks.end()) {
        AddSettings(about.settings, all);
      }
    }
  }
  if (!all.empty()) return all;
  for (const AboutRequest& about : kAboutRequests) {
    if (static_cast<std::uint8_t>(about.requested) == requested) AddSettings(about.settings, all);
  }
  return all;
}

RefusalReasons FindRefusalReasons(const RuleContext& context, const RefusalCase& refusal) {
  const auto* row = std::find_if(kRows.begin(), kRows.end(), [&](const Row& r) { return r.code == refusal.code; });
  if (row == kRows.end()) return {};
  // After another request the settings are no longer those of the refusal.
  if (context.slave(refusal.slave).al.last_request() > std::max(refusal.request, refusal.shown)) return {};
  const track::SlaveState& state = context.network().state(refusal.slave);
  const Case of{context,
                refusal,
                context.slave(refusal.slave),
                state,
                context.sync().dc(refusal.slave),
                esc::ParseSii(state.sii.image())};
  Outcome found;
  for (const Check check : row->checks) {
    if (check != nullptr) check(of, found);
  }
  RefusalReasons reasons;
  reasons.inferred = found.reason == nullptr && found.possible != nullptr;
  reasons.reason = reasons.inferred ? found.possible : found.reason;
  reasons.slot = found.slot;
  reasons.value = found.value;
  if (!found.right.empty()) {
    std::vector<Value> words;
    for (const Word* word : found.right) words.push_back(arg::Of(*word));
    reasons.notes.push_back({&refusal::kChecked, {{"checked", arg::List(std::move(words))}}});
  }
  // What is wrong stands before the next step, which refers to it.
  std::move(found.wrong.begin(), found.wrong.end(), std::back_inserter(reasons.notes));
  return reasons;
}

void AddTo(Finding& finding, const RefusalReasons& reasons) {
  if (reasons.reason != nullptr) finding.Set("reason", arg::Of(*reasons.reason));
  if (reasons.slot != 0) finding.Set("slot", arg::Number(reasons.slot));
  if (reasons.value) finding.Set("reason_value", *reasons.value);
  if (reasons.inferred) {
    finding.Set("reason_inferred", arg::Flag());
    finding.confidence = Confidence::kInferred;
  }
  const bool checked = std::any_of(reasons.notes.begin(), reasons.notes.end(),
                                   [](const Note& note) { return note.kind == &refusal::kChecked; });
  if (checked) finding.Set("checked", arg::Flag());
  finding.notes.insert(finding.notes.end(), reasons.notes.begin(), reasons.notes.end());
}

std::vector<std::uint16_t> CodesWithReasons() {
  std::vector<std::uint16_t> codes;
  for (const Row& row : kRows) codes.push_back(row.code);
  return codes;
}

}  // namespace ecaudit
