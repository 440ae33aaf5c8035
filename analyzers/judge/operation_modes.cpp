#include "analyzers/judge/operation_modes.h"

#include <cstddef>
#include <string>
#include <utility>

#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/esc/dc_registers.h"
#include "decoder/esc/sii.h"
#include "decoder/track/network.h"

namespace ecaudit {
namespace {

constexpr Word kEsi{"esi", "ESI"};
constexpr Word kEeprom{"eeprom", "EEPROM"};

constexpr unsigned kCompared = 0x07;  // cyclic operation, SYNC0, SYNC1
constexpr std::size_t kNamedModes = 6;

esc::SyncActivation WantedBy(const device::DcMode& mode) {
  return esc::AssignActivate{static_cast<std::uint16_t>(mode.assign_activate & 0xFFFFU)}.activation();
}

/// A fixed cycle is given without a factor.
bool HasFixedCycle(const device::DcMode& mode) {
  return mode.cycle_sync0.value_or(0) > 0 && mode.factor_sync0 == 0;
}

}  // namespace

bool OperationModes::from_eeprom() const {
  return source == &kEeprom;
}

OperationModes OperationModesOf(const RuleContext& context, SlaveId slave) {
  const auto& esi = context.slave(slave).profile->esi;
  if (esi && !esi->dc_modes.empty()) return {esi->dc_modes, &kEsi};
  const auto sii = esc::ParseSii(context.network().state(slave).sii.image());
  if (!sii.Complete(esc::SiiCategoryType::DC)) return {};
  OperationModes found{{}, &kEeprom};
  for (const esc::SiiDcMode& entry : sii.dc_modes) {
    device::DcMode mode;
    mode.name = std::string(sii.String(entry.name_string));
    mode.assign_activate = entry.assign_activate;
    mode.cycle_sync0 = entry.cycle0_ns;
    mode.factor_sync0 = entry.sync0_cycle_factor;
    found.modes.push_back(std::move(mode));
  }
  return found;
}

ModeMatch Match(const OperationModes& modes, const sync::SyncSettings& on) {
  const std::optional<std::uint32_t> cycle = on.sync0_cycle_ns;
  ModeMatch match = ModeMatch::kOther;
  for (const device::DcMode& mode : modes.modes) {
    if ((WantedBy(mode).raw & kCompared) != (on.activation.raw & kCompared)) continue;
    if (!HasFixedCycle(mode) || !cycle || *cycle == *mode.cycle_sync0) return ModeMatch::kFits;
    match = ModeMatch::kOtherCycle;
  }
  return match;
}

void SetOffered(Arguments& arguments, const OperationModes& modes) {
  std::vector<Value> offered;
  for (const device::DcMode& mode : modes.modes) {
    if (offered.size() == kNamedModes) break;
    std::string name = mode.name;
    if (HasFixedCycle(mode)) name += (name.empty() ? "" : ", ") + Duration(*mode.cycle_sync0);
    offered.push_back(arg::Code(WantedBy(mode).raw, name, 2));
  }
  arguments.Set("offered", arg::List(std::move(offered)));
  arguments.Set("mode_source", arg::Of(*modes.source));
  if (modes.modes.size() > kNamedModes) {
    arguments.Set("more", arg::Count(modes.modes.size() - kNamedModes, "other"));
  }
}

}  // namespace ecaudit
