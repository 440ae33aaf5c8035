#include "analyzers/judge/sync_manager_text.h"

#include <algorithm>
#include <array>
#include <utility>

#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_text.h"
#include "decoder/base/wrapping.h"

namespace ecaudit {
namespace {

using Fault = model::SyncManagerFault;

Value SourceValue(model::DemandSource source) {
  static constexpr Word kStandard{"standard", "the EtherCAT standard"}, kEeprom{"eeprom", "the slave's EEPROM"},
      kEsi{"esi", "its device description (ESI)"}, kManual{"manual", "the manual of its family"},
      kEniPdos{"eni-pdos", "the PDOs of the ENI file"}, kDefaultPdos{"default-pdos", "the slave's default PDOs"},
      kAssignedPdos{"assigned-pdos", "the assigned PDOs"};
  switch (source) {
    case model::DemandSource::kNone:
    case model::DemandSource::kStandard:
      break;
    case model::DemandSource::kEeprom:
      return arg::Of(kEeprom);
    case model::DemandSource::kEsi:
      return arg::Of(kEsi);
    case model::DemandSource::kManual:
      return arg::Of(kManual);
    case model::DemandSource::kEniPdos:
      return arg::Of(kEniPdos);
    case model::DemandSource::kDefaultPdos:
      return arg::Of(kDefaultPdos);
    case model::DemandSource::kAssignedPdos:
      return arg::Of(kAssignedPdos);
  }
  return arg::Of(kStandard);
}

Value ModeValue(std::uint32_t mode) {
  static constexpr Word kMailbox{"mailbox mode", "mailbox mode"}, kBuffered{"three-buffer mode", "three-buffer mode"},
      kInvalid{"no valid mode", "no valid mode"};
  switch (static_cast<esc::SmMode>(mode)) {
    case esc::SmMode::MAILBOX:
      return arg::Of(kMailbox);
    case esc::SmMode::BUFFERED:
      return arg::Of(kBuffered);
    default:
      return arg::Of(kInvalid);
  }
}

/// Of the master.
Value SmDirectionValue(std::uint32_t direction) {
  const auto value = static_cast<esc::SmDirection>(direction);
  return arg::Number(direction, value == esc::SmDirection::ECAT_WRITES  ? "write"
                                : value == esc::SmDirection::ECAT_READS ? "read"
                                                                        : "invalid");
}

Value FieldValue(Fault::Field field) {
  static constexpr Word kEnable{"enable", "enable bit"}, kMode{"mode", "mode"}, kDirection{"direction", "direction"},
      kStart{"start", "start"}, kLength{"length", "length"};
  switch (field) {
    case Fault::Field::kEnable:
      return arg::Of(kEnable);
    case Fault::Field::kMode:
      return arg::Of(kMode);
    case Fault::Field::kDirection:
      return arg::Of(kDirection);
    case Fault::Field::kStart:
      return arg::Of(kStart);
    case Fault::Field::kLength:
      break;
  }
  return arg::Of(kLength);
}

const FindingKind& KindOf(const std::vector<Fault>& faults) {
  if (faults.size() > 1) return sync_manager_fault::kSeveralFaults;
  const Fault& fault = faults.front();
  switch (fault.field) {
    case Fault::Field::kEnable:
      return sync_manager_fault::kNotEnabled;
    case Fault::Field::kMode:
      return sync_manager_fault::kWrongMode;
    case Fault::Field::kDirection:
      return sync_manager_fault::kWrongDirection;
    case Fault::Field::kStart:
      return sync_manager_fault::kWrongStart;
    case Fault::Field::kLength:
      break;
  }
  return fault.observed == fault.expected ? sync_manager_fault::kNoLength : sync_manager_fault::kWrongLength;
}

void SetLength(Finding& finding, const Fault& fault) {
  if (fault.observed == fault.expected) {
    finding.Set("no_length", arg::Flag());
    return;
  }
  finding.Set("expected_length", arg::Number(fault.expected))
      .Set("at_most", arg::Flag(fault.at_most))
      .Set("length_source", SourceValue(fault.source));
  std::vector<Value> others;
  for (const std::uint32_t other : fault.others) others.push_back(arg::Number(other));
  if (!others.empty()) finding.Set("other_lengths", arg::List(std::move(others)));
}

void SetFault(Finding& finding, const Fault& fault) {
  switch (fault.field) {
    case Fault::Field::kEnable:
      finding.Set("enabled", arg::Number(0))
          .Set("expected_enabled", arg::Number(1))
          .Set("enable_source", SourceValue(fault.source));
      return;
    case Fault::Field::kMode:
      finding.Set("mode", ModeValue(fault.observed))
          .Set("expected_mode", ModeValue(fault.expected))
          .Set("mode_source", SourceValue(fault.source));
      return;
    case Fault::Field::kDirection:
      finding.Set("direction", SmDirectionValue(fault.observed))
          .Set("expected_direction", SmDirectionValue(fault.expected))
          .Set("direction_source", SourceValue(fault.source));
      return;
    case Fault::Field::kStart: {
      finding.Set("expected_start", arg::Hex(fault.expected)).Set("start_source", SourceValue(fault.source));
      std::vector<Value> others;
      for (const std::uint32_t other : fault.others) others.push_back(arg::Hex(other));
      if (!others.empty()) finding.Set("other_starts", arg::List(std::move(others)));
      return;
    }
    case Fault::Field::kLength:
      SetLength(finding, fault);
      return;
  }
}

/// The code with which a slave refuses the transition because of this sync manager; unset if the family does not define
/// which of several it is.
std::optional<std::uint16_t> RefusalCode(const device::AlTransition& row, std::size_t manager) {
  constexpr std::array<std::uint16_t, 4> kOfManager{0x0016, 0x0016, 0x001D, 0x001E};
  const std::vector<std::uint16_t>& codes = row.refusal_codes;
  if (manager < kOfManager.size() && std::ranges::find(codes, kOfManager[manager]) != codes.end()) {
    return kOfManager[manager];
  }
  return codes.size() == 1 ? std::optional(codes.front()) : std::nullopt;
}

}  // namespace

std::optional<KnownSyncManager> SyncManagerOf(const track::SlaveState& state, std::size_t number) {
  if (const auto observed = state.sync_manager(number, Certainty::kObserved)) {
    return KnownSyncManager{*observed, true, state.sync_manager_since[number]};
  }
  if (const auto inferred = state.sync_manager(number, Certainty::kInferred)) {
    return KnownSyncManager{*inferred, false, state.sync_manager_since[number]};
  }
  return std::nullopt;
}

const Word& SyncManagerWord(std::size_t number) {
  static constexpr Word kWords[esc::kMaxSyncManagers] = {
      {"sync-manager-0", "the settings of sync manager 0", true},
      {"sync-manager-1", "the settings of sync manager 1", true},
      {"sync-manager-2", "the settings of sync manager 2", true},
      {"sync-manager-3", "the settings of sync manager 3", true},
      {"sync-manager-4", "the settings of sync manager 4", true},
      {"sync-manager-5", "the settings of sync manager 5", true},
      {"sync-manager-6", "the settings of sync manager 6", true},
      {"sync-manager-7", "the settings of sync manager 7", true},
      {"sync-manager-8", "the settings of sync manager 8", true},
      {"sync-manager-9", "the settings of sync manager 9", true},
      {"sync-manager-10", "the settings of sync manager 10", true},
      {"sync-manager-11", "the settings of sync manager 11", true},
      {"sync-manager-12", "the settings of sync manager 12", true},
      {"sync-manager-13", "the settings of sync manager 13", true},
      {"sync-manager-14", "the settings of sync manager 14", true},
      {"sync-manager-15", "the settings of sync manager 15", true},
  };
  return kWords[number % esc::kMaxSyncManagers];
}

std::uint64_t SettingsKey(std::size_t number, const esc::SyncManager& settings) {
  return std::uint64_t{settings.start} << 40U | std::uint64_t{settings.length} << 24U |
         std::uint64_t{settings.control} << 16U | std::uint64_t{settings.enabled() ? 1U : 0U} << 8U | number;
}

std::uint64_t KeyOfBoth(std::uint64_t one, std::uint64_t other) {
  constexpr std::uint64_t kSpread = 31;
  return WrappingSum(WrappingProduct(one, kSpread), other);
}

bool MayBeSetUnseen(const RuleContext& context, const model::AlRequestJudged& e, const KnownSyncManager& known) {
  return context.network().LikelyMissesBetween(known.since, e.request.frame.number);
}

Finding DescribeFaults(const RuleContext& context, const model::AlRequestJudged& e,
                       const model::SyncManagerDemand& demand, const KnownSyncManager& known,
                       const std::vector<Fault>& faults) {
  const model::AlRequestRecord& request = e.request;
  const device::DeviceDescription& family = *context.slave(e.slave).profile;
  const esc::SyncManager& settings = known.settings;
  Finding finding = Found(KindOf(faults), e.slave, request.frame);
  finding.Set("sync_manager", arg::Number(demand.number))
      .Set("requested", arg::State(request.control.state()))
      .Set("al_control", arg::Hex(request.control.raw))
      .Set("start", arg::Hex(settings.start))
      .Set("length", arg::Number(settings.length))
      .Set("control", arg::Hex(settings.control, 2))
      .Set("off", arg::Flag(!settings.enabled()));
  if (known.since != 0) finding.Set("set_frame", arg::Frame(known.since));
  std::vector<Value> wrong;
  for (const Fault& fault : faults) {
    SetFault(finding, fault);
    wrong.push_back(FieldValue(fault.field));
  }
  finding.Set("wrong", arg::List(std::move(wrong)));
  if (const device::AlTransition* row = request.transition) {
    if (!row->requirement.empty()) finding.Set("requirement", arg::Text(row->requirement));
    if (const auto code = RefusalCode(*row, demand.number)) finding.Set("expected_code", CodeValue(*code, family));
  }
  AddRelated(finding, known.since);
  const bool likely_missed = MayBeSetUnseen(context, e, known);
  const bool certain = known.observed && !request.assumed;
  finding.confidence = certain && !likely_missed ? Confidence::kObserved : Confidence::kInferred;
  if (likely_missed) finding.Add(sync_manager_fault::kMayBeSetUnseen);
  if (!certain) finding.Add(request.assumed ? sync_manager_fault::kOutboundOnly : sync_manager_fault::kSetByBroadcast);
  if (demand.off_in_eeprom && !settings.enabled())
    finding.Add(sync_manager_fault::kOffInEeprom, {{"number", arg::Number(demand.number)}});
  if (!demand.reference.empty()) finding.reference = ReferenceTo(demand.reference);
  return finding;
}

}  // namespace ecaudit
