#include "analyzers/model/sync_manager_demand.h"

#include <algorithm>

#include "decoder/base/text.h"

namespace ecaudit::model {
namespace {

using device::SyncManagerUse;

constexpr const char* kEeprom = "the slave's EEPROM";
constexpr const char* kManual = "the manual of its family";
constexpr const char* kEsi = "its device description (ESI)";
constexpr const char* kStandard = "the EtherCAT standard";

// Types and enable bits of the sync manager category (esc-reference 11.1, decoder/esc/sii.h).
constexpr std::uint8_t kMailboxOutType = 1;
constexpr std::uint8_t kMailboxInType = 2;
constexpr std::uint8_t kProcessOutType = 3;
constexpr std::uint8_t kProcessInType = 4;
constexpr std::uint8_t kVirtual = 0x04;
constexpr std::uint8_t kOnlyInOp = 0x08;
constexpr std::uint8_t kModeMask = 0x03;  // of the control byte

const char* SourceOf(const device::DeviceDescription& family) {
  return family.esi ? kEsi : kManual;
}

void AddOnce(std::vector<std::uint32_t>& list, std::uint32_t value) {
  if (std::find(list.begin(), list.end(), value) == list.end()) list.push_back(value);
}

std::string Choice(const std::vector<std::uint32_t>& values, bool hex) {
  std::string out;
  for (const std::uint32_t value : values) {
    out += (out.empty() ? "" : " or ") + (hex ? Hex(value) : std::to_string(value));
  }
  return out;
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
  if (!demand.starts.empty()) demand.start_source = demand.length_source = kEeprom;
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
  if (out_words && in_words && out_words->size == 0 && in_words->size == 0) {
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
      demand.start_source = kEeprom;
      demand.enabled = (entry.enable & kOnlyInOp) == 0;
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
  std::vector<SyncManagerFault> faults;
  const std::string& law = demand.start_source.empty() ? std::string(kStandard) : demand.start_source;
  if (!settings.enabled()) {
    if (demand.enabled) faults.push_back({Field::kEnable, "not enabled", "enabled", law, 0, 1});
    return faults;
  }
  const bool mailbox_mode = demand.mailbox() || demand.one_buffer;
  if (mailbox_mode ? !settings.mailbox() : !settings.buffered()) {
    const char* observed = settings.mailbox()    ? "mailbox mode"
                           : settings.buffered() ? "three-buffer mode"
                                                 : "no valid mode";
    faults.push_back({Field::kMode, observed, mailbox_mode ? "mailbox mode" : "three-buffer mode", kStandard,
                      static_cast<std::uint32_t>(settings.mode()),
                      static_cast<std::uint32_t>(mailbox_mode ? esc::SmMode::MAILBOX : esc::SmMode::BUFFERED)});
  }
  const esc::SmDirection direction =
      demand.master_writes() ? esc::SmDirection::ECAT_WRITES : esc::SmDirection::ECAT_READS;
  if (settings.direction() != direction) {
    const char* observed = settings.ecat_writes()  ? "direction \"master writes\""
                           : settings.ecat_reads() ? "direction \"master reads\""
                                                   : "no valid direction";
    faults.push_back({Field::kDirection, observed, demand.master_writes() ? "\"master writes\"" : "\"master reads\"",
                      kStandard, static_cast<std::uint32_t>(settings.direction()),
                      static_cast<std::uint32_t>(direction)});
  }
  if (!demand.starts.empty() &&
      std::find(demand.starts.begin(), demand.starts.end(), settings.start) == demand.starts.end()) {
    faults.push_back({Field::kStart, "start " + Hex(settings.start), Choice(demand.starts, true), demand.start_source,
                      settings.start, demand.starts.front()});
  }
  if (!demand.lengths.empty() &&
      std::find(demand.lengths.begin(), demand.lengths.end(), settings.length) == demand.lengths.end()) {
    faults.push_back({Field::kLength, "length " + std::to_string(settings.length), Choice(demand.lengths, false),
                      demand.length_source, settings.length, demand.lengths.front()});
  } else if (demand.lengths.empty() && demand.max_length && settings.length > *demand.max_length) {
    faults.push_back({Field::kLength, "length " + std::to_string(settings.length),
                      "at most " + std::to_string(*demand.max_length), demand.length_source, settings.length,
                      *demand.max_length});
  } else if (settings.length == 0) {
    faults.push_back({Field::kLength, "length 0", "a length", kStandard, 0, 0});
  }
  return faults;
}

}  // namespace ecaudit::model
