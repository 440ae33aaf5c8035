#include <algorithm>
#include <string_view>

#include "analyzers/judge/refusal/checks.h"
#include "analyzers/judge/refusal/thresholds.h"

namespace ecaudit::refusal {
namespace {

using Modules = model::SlotModules;

constexpr Word kEepromOffered{"eeprom-offered", "the EEPROM is offered to the slave (0x0500)"};
constexpr Word kModules{"modules", "the configured modules (F030h) against the detected ones (F050h)"};

void NameModule(const Case& of, std::string_view name, std::uint32_t ident, Arguments& arguments) {
  const auto& esi = of.model.profile->esi;
  const device::EsiModule* module = esi && esi->slot_rules ? esi->slot_rules->Find(ident) : nullptr;
  if (module != nullptr && !module->name.empty()) arguments.Set(name, arg::Text(module->name));
}

void AddOtherModule(const Case& of, Outcome& found, std::uint8_t slot, const Modules::List::Entry& configured,
                    const Modules::List::Entry& detected) {
  Arguments arguments{{"slot", arg::Number(slot)},
                      {"configured", arg::Hex(configured.ident, 8)},
                      {"configured_object", arg::Object(Modules::kConfigured, slot)},
                      {"configured_frame", arg::Frame(configured.since)},
                      {"detected", arg::Hex(detected.ident, 8)},
                      {"detected_object", arg::Object(Modules::kDetected, slot)},
                      {"detected_frame", arg::Frame(detected.since)}};
  NameModule(of, "configured_name", configured.ident, arguments);
  NameModule(of, "detected_name", detected.ident, arguments);
  found.Wrong(kModuleDiffers, std::move(arguments));
}

}  // namespace

void CheckEepromOwner(const Case& of, Outcome& found) {
  auto owned_by_pdi = of.state.sii.owned_by_pdi();
  if (const auto read = of.state.registers.Value<std::uint8_t>(esc::kEepromConfiguration); !owned_by_pdi && read) {
    owned_by_pdi = (*read & 1U) != 0;
  }
  const FrameNo since = of.model.set_up.eeprom_owner_since();
  if (!owned_by_pdi || !of.Applied(since)) return;
  if (*owned_by_pdi) return found.Right(kEepromOffered);
  if (!of.Counts(since)) return;
  Arguments arguments;
  if (since != 0) arguments.Set("since", arg::Frame(since));
  found.Wrong(kEepromHeld, std::move(arguments));
}

/// A module list is right if all of it is compared: its number of entries (subindex 0), and each of them.
void CheckModules(const Case& of, Outcome& found) {
  if (!of.requested()) return;  // a slave reads its modules when it starts
  const Modules::List& configured = of.model.modules.configured();
  const Modules::List& detected = of.model.modules.detected();
  const bool counts_known =
      configured.count && detected.count && of.Applied(configured.count_since) && of.Applied(detected.count_since);
  const bool counts_differ = counts_known && *configured.count != *detected.count;
  if (counts_differ) {
    found.Wrong(kModuleCountDiffers, {{"configured", arg::Count(*configured.count, "module")},
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
    if (wanted.ident == real.ident || wrong == threshold::kShownModules) continue;
    if (++wrong == 1 && found.reason == nullptr) found.slot = slot;
    AddOtherModule(of, found, slot, wanted, real);
  }
  if (counts_known && !counts_differ && compared == *configured.count && wrong == 0) found.Right(kModules);
}

void CheckModulesSet(const Case& of, Outcome& found) {
  const Modules::List& configured = of.model.modules.configured();
  if (configured.count || !configured.entries.empty() || !of.SetUpIsSeen()) return;
  found.May(kModulesUnset, {{"since", arg::Frame(of.state.set_up_since)}});
}

}  // namespace ecaudit::refusal
