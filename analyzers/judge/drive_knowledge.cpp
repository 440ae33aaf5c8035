#include "analyzers/judge/drive_knowledge.h"

#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"

namespace ecaudit {

std::string DriveWordsMissing(const model::SlaveModel& slave, bool needs_control) {
  if (!slave.profile->drive) return {};
  const model::DriveUnit& drive = slave.drive;
  const bool control_missing = needs_control && !drive.control_seen();
  if (drive.status_seen() && !control_missing) return {};
  // A family that says when the control word acts is a drive; the standard's table stands in for any slave.
  const bool is_drive = !slave.profile->drive->control_word_in.empty() || drive.seen();
  if (!is_drive) {
    if (slave.identity.vendor_id || slave.process.rx().known() || slave.process.tx().known()) return {};
    return "neither the identity of the slave nor its process data mapping is in the capture, it may be a drive";
  }
  const model::StateSet possible = slave.al.possible();
  const bool active = possible.empty() || slave.al.operated() ||
                      possible.contains(static_cast<std::uint8_t>(esc::AlState::SAFEOP)) ||
                      possible.contains(static_cast<std::uint8_t>(esc::AlState::OP));
  if (!active && slave.inputs.exchanged == 0 && slave.outputs.exchanged == 0) return {};
  return drive.status_seen() ? "no control word (6040h) is in the capture" : "no status word (6041h) is in the capture";
}

}  // namespace ecaudit
