#include "analyzers/judge/drive_knowledge.h"

#include "analyzers/judge/rule.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"

namespace ecaudit {

std::string DriveWordsMissing(const model::SlaveModel& slave, bool needs_control) {
  if (!slave.profile->drive) return {};
  const bool seen = slave.drives.seen();
  const bool status_missing = slave.drives.Any([](const model::DriveUnit& unit) { return !unit.status_seen(); });
  const bool control_missing =
      needs_control && slave.drives.Any([](const model::DriveUnit& unit) { return !unit.control_seen(); });
  if (seen && !status_missing && !control_missing) return {};
  // A family that says when the control word acts is a drive; the standard's table stands in for any slave.
  const bool is_drive = !slave.profile->drive->control_word_in.empty() || seen;
  if (!is_drive) {
    if (slave.identity.vendor_id || slave.process.rx().known() || slave.process.tx().known()) return {};
    return "neither the identity of the slave nor its process data mapping is in the capture, it may be a drive";
  }
  const model::StateSet possible = slave.al.possible();
  const bool active = possible.empty() || slave.al.operated() ||
                      possible.contains(static_cast<std::uint8_t>(esc::AlState::SAFEOP)) ||
                      possible.contains(static_cast<std::uint8_t>(esc::AlState::OP));
  if (!active && slave.inputs.exchanged == 0 && slave.outputs.exchanged == 0) return {};
  return seen && !status_missing ? "no control word (6040h) is in the capture"
                                 : "no status word (6041h) is in the capture";
}

void NameAxis(Finding& finding, std::uint8_t axis) {
  if (axis == 0) return;
  const std::string name = "Axis " + std::to_string(axis + 1);
  finding.title = name + ": " + finding.title;
  finding.message = name + " (" + ObjectName(model::ObjectOfAxis(model::kControlWord, axis)) + ", " +
                    ObjectName(model::ObjectOfAxis(model::kStatusWord, axis)) + "). " + finding.message;
  finding.evidence.push_back(Number("axis", axis + 1));
}

}  // namespace ecaudit
