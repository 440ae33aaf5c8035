#include "analyzers/model/sync_manager_demand.h"

#include <algorithm>

namespace ecaudit::model {
namespace {

using device::SyncManagerUse;

// Types and enable bits of the sync manager category (esc-reference 11.1, decoder/esc/sii.h).
constexpr std::uint8_t kMailboxOutType = 1;
constexpr std::uint8_t kMailboxInType = 2;
constexpr std::uint8_t kProcessOutType = 3;
constexpr std::uint8_t kProcessInType = 4;
constexpr std::uint8_t kEnable = 0x01;
constexpr std::uint8_t kVirtual = 0x04;
constexpr std::uint8_t kOnlyInOp = 0x08;
constexpr std::uint8_t kModeMask = 0x03;  // of the control byte

DemandSource SourceOf(const device::DeviceDescription& family) {
  return family.esi ? DemandSource::kEsi : DemandSource::kManual;
}

void AddOnce(std::vector<std::uint32_t>& list, std::uint32_t value) {
  if (std::find(list.begin(), list.end(), value) == list.end()) list.push_back(value);
}

/// One of the values of `allowed` is expected.
SyncManagerFault FaultOf(SyncManagerFault::Field field, DemandSource source, std::uint32_t observed,
                         const std::vector<std::uint32_t>& allowed) {
  return {field, source, observed, allowed.front(), {allowed.begin() + 1, allowed.end()}, false};
}

bool Contains(const std::vector<std::uint32_t>& list, std::uint32_t value) {
  return std::find(list.begin(), list.end(), value) != list.end();
}

SyncManagerDemand MailboxDemand(SyncManagerUse use, const esc::SiiContents& sii,
                                const std::optional<esc::SiiMailbox>& words) {
  SyncManagerDemand demand;
  demand.use = use;
  demand.number = use == SyncManagerUse::kMailboxOut ? 0 : 1;
  if (words && words->size != 0) {
    demand.starts.push_back(words->offset);
    demand.lengths.push_back(words->size);
  }
  const std::uint8_t type = use == SyncManagerUse::kMailboxOut ? kMailboxOutType : kMailboxInType;
  for (std::size_t n = 0; n < sii.sync_managers.size() && n < esc::kMaxSyncManagers; ++n) {
    const esc::SiiSyncManager& entry = sii.sync_managers[n];
    if (entry.type != type) continue;
    demand.number = static_cast<std::uint8_t>(n);
    // The category may leave start and length to the mailbox words.
    if (entry.length != 0) {
      AddOnce(demand.starts, entry.start);
      AddOnce(demand.lengths, entry.length);
    }
    break;
  }
  if (!demand.starts.empty()) demand.start_source = demand.length_source = DemandSource::kEeprom;
  return demand;
}

void FillFromFamily(SyncManagerDemand& demand, const device::SyncManagerRule& rule,
                    const device::DeviceDescription& family) {
  demand.reference = rule.source;
  if (demand.starts.empty() && rule.start) {
    demand.starts.push_back(*rule.start);
    demand.start_source = SourceOf(family);
  }
  if (!demand.lengths.empty()) return;
  demand.max_length = rule.max_length;
  demand.length_source = SourceOf(family);
  // The length of a mailbox is that of the device description; what a manual prints is only an example of it.
  if (demand.mailbox() && family.esi) demand.lengths = rule.lengths;
}

}  // namespace

SyncManagerDemands MailboxDemands(const device::DeviceDescription& family, const esc::SiiContents& sii) {
  SyncManagerDemands demands;
  const auto& out_words = sii.header.standard_receive;
  const auto& in_words = sii.header.standard_send;
  const bool no_words = out_words && in_words && out_words->size == 0 && in_words->size == 0;
  // An EEPROM whose words are empty by mistake still names protocols and has the sync managers of the mailbox.
  const bool by_category = sii.header.protocols.value_or(0) != 0 &&
                           std::any_of(sii.sync_managers.begin(), sii.sync_managers.end(), [](const auto& entry) {
                             return entry.type == kMailboxOutType && entry.length != 0;
                           });
  if (no_words && !by_category) {
    demands.known = true;
    return demands;
  }
  for (const SyncManagerUse use : {SyncManagerUse::kMailboxOut, SyncManagerUse::kMailboxIn}) {
    SyncManagerDemand demand = MailboxDemand(use, sii, use == SyncManagerUse::kMailboxOut ? out_words : in_words);
    for (const device::SyncManagerRule& rule : family.mailbox.sync_managers) {
      if (rule.use != use) continue;
      if (demand.starts.empty()) demand.number = rule.number;
      if (rule.number == demand.number) FillFromFamily(demand, rule, family);
      break;
    }
    if (demand.starts.empty()) continue;
    demands.known = true;
    demands.list.push_back(std::move(demand));
  }
  return demands;
}

SyncManagerDemands ProcessDemands(const device::DeviceDescription& family, const esc::SiiContents& sii) {
  SyncManagerDemands demands;
  const auto of_family = [&](std::uint8_t number, SyncManagerUse use) -> const device::SyncManagerRule* {
    const device::SyncManagerRule* rule = family.mailbox.FindSyncManager(number);
    return rule != nullptr && rule->use == use ? rule : nullptr;
  };
  if (sii.Complete(esc::SiiCategoryType::SYNC_MANAGER)) {
    demands.known = true;
    for (std::size_t n = 0; n < sii.sync_managers.size() && n < esc::kMaxSyncManagers; ++n) {
      const esc::SiiSyncManager& entry = sii.sync_managers[n];
      if ((entry.type != kProcessOutType && entry.type != kProcessInType) || (entry.enable & kVirtual) != 0) continue;
      SyncManagerDemand demand;
      demand.number = static_cast<std::uint8_t>(n);
      demand.use = entry.type == kProcessOutType ? SyncManagerUse::kProcessOut : SyncManagerUse::kProcessIn;
      demand.starts.push_back(entry.start);
      demand.start_source = DemandSource::kEeprom;
      demand.enabled = (entry.enable & kOnlyInOp) == 0;
      demand.off_in_eeprom = (entry.enable & kEnable) == 0;
      demand.one_buffer = (entry.control & kModeMask) == static_cast<std::uint8_t>(esc::SmMode::MAILBOX);
      if (const device::SyncManagerRule* rule = of_family(demand.number, demand.use)) {
        FillFromFamily(demand, *rule, family);
      }
      demands.list.push_back(std::move(demand));
    }
    return demands;
  }
  for (const device::SyncManagerRule& rule : family.mailbox.sync_managers) {
    if (rule.use != SyncManagerUse::kProcessOut && rule.use != SyncManagerUse::kProcessIn) continue;
    if (!rule.start) continue;
    SyncManagerDemand demand;
    demand.number = rule.number;
    demand.use = rule.use;
    FillFromFamily(demand, rule, family);
    demands.known = true;
    demands.list.push_back(std::move(demand));
  }
  return demands;
}

std::vector<SyncManagerFault> FaultsOf(const esc::SyncManager& settings, const SyncManagerDemand& demand) {
  using Field = SyncManagerFault::Field;
  constexpr DemandSource kStandard = DemandSource::kStandard;
  std::vector<SyncManagerFault> faults;
  if (!settings.enabled()) {
    // The EEPROM may have its start, and no enable bit.
    const bool of_standard = demand.start_source == DemandSource::kNone || demand.off_in_eeprom;
    const DemandSource source = of_standard ? kStandard : demand.start_source;
    if (demand.enabled) faults.push_back({Field::kEnable, source, 0, 1, {}, false});
    return faults;
  }
  const bool mailbox_mode = demand.mailbox() || demand.one_buffer;
  if (mailbox_mode ? !settings.mailbox() : !settings.buffered()) {
    const esc::SmMode mode = mailbox_mode ? esc::SmMode::MAILBOX : esc::SmMode::BUFFERED;
    faults.push_back({Field::kMode,
                      kStandard,
                      static_cast<std::uint32_t>(settings.mode()),
                      static_cast<std::uint32_t>(mode),
                      {},
                      false});
  }
  const esc::SmDirection direction =
      demand.master_writes() ? esc::SmDirection::ECAT_WRITES : esc::SmDirection::ECAT_READS;
  if (settings.direction() != direction) {
    faults.push_back({Field::kDirection,
                      kStandard,
                      static_cast<std::uint32_t>(settings.direction()),
                      static_cast<std::uint32_t>(direction),
                      {},
                      false});
  }
  if (!demand.starts.empty() && !Contains(demand.starts, settings.start)) {
    faults.push_back(FaultOf(Field::kStart, demand.start_source, settings.start, demand.starts));
  }
  if (!demand.lengths.empty() && !Contains(demand.lengths, settings.length)) {
    faults.push_back(FaultOf(Field::kLength, demand.length_source, settings.length, demand.lengths));
  } else if (demand.lengths.empty() && demand.max_length && settings.length > *demand.max_length) {
    faults.push_back({Field::kLength, demand.length_source, settings.length, *demand.max_length, {}, true});
  } else if (settings.length == 0) {
    faults.push_back({Field::kLength, kStandard, 0, 0, {}, false});
  }
  return faults;
}

}  // namespace ecaudit::model
