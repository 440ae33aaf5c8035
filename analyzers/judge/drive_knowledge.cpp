#include "analyzers/judge/drive_knowledge.h"

#include <algorithm>

#include "analyzers/judge/rule.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/objects/relatives.h"
#include "analyzers/words/what.h"

namespace ecaudit {

std::optional<Reason> DriveWordsMissing(const model::SlaveModel& slave, bool needs_control) {
  if (!slave.profile->drive) return {};
  const bool seen = slave.drives.seen();
  const bool status_missing = slave.drives.Any([](const model::DriveUnit& unit) { return !unit.status().seen(); });
  const bool control_missing =
      needs_control && slave.drives.Any([](const model::DriveUnit& unit) { return !unit.control().seen(); });
  if (seen && !status_missing && !control_missing) return {};
  // A family that states when the control word acts is a drive; the standard's table serves for any slave.
  const bool is_drive = !slave.profile->drive->control_word_in.empty() || seen;
  if (!is_drive) {
    if (slave.identity.vendor_id || slave.process.rx().known() || slave.process.tx().known()) return {};
    return Reason::Of(ReasonCode::kNotInCapture, what::kIdentityAndMapping);
  }
  const model::StateSet possible = slave.al.possible();
  const bool active = possible.empty() || slave.al.operated() ||
                      possible.contains(static_cast<std::uint8_t>(esc::AlState::SAFEOP)) ||
                      possible.contains(static_cast<std::uint8_t>(esc::AlState::OP));
  if (!active && slave.inputs.exchanged == 0 && slave.outputs.exchanged == 0) return {};
  return Reason::Of(ReasonCode::kNotInCapture, seen && !status_missing ? what::kControlWord : what::kStatusWord);
}

bool IsUnexplained(const device::DeviceDescription& family, std::int64_t code) {
  constexpr std::int64_t kGeneric = 0x10, kSpecific = 0xFF;
  const std::int64_t group = code >> 8U;
  if (group > kGeneric && group != kSpecific) return false;
  const bool has_numbers = family.drive && std::ranges::any_of(family.drive->fault_objects, [](const auto& object) {
                             return object.kind == device::FaultValue::kFaultNumber;
                           });
  const events::EmergencyInfo info = events::FindEmergency(&family, static_cast<std::uint16_t>(code));
  const bool listed = info.code != nullptr && info.code->code == info.code->last_code;
  return !listed && !has_numbers;
}

bool MayComeOfCommand(const device::DeviceDescription& family, std::int64_t code) {
  constexpr std::int64_t kCurrent = 0x23, kVelocity = 0x84, kPosition = 0x86;
  const std::int64_t group = code >> 8U;
  return group == kCurrent || (group >= kVelocity && group <= kPosition) || IsUnexplained(family, code);
}

void NameAxis(Finding& finding, std::uint8_t axis) {
  finding.axis = axis;
}

}  // namespace ecaudit
