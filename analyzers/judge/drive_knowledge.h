/// Whether the drive rules can evaluate a slave, and which of its axes their findings are about.
#pragma once

#include <cstdint>
#include <optional>

#include "analyzers/model/slave_model.h"
#include "analyzers/result/finding.h"
#include "analyzers/result/reason.h"

namespace ecaudit {

/// Why the status word (or, if `needs_control`, the control word) of a slave that is or may be a drive is not known;
/// empty when it is known of each axis, when the slave is no drive, or when it never exchanged process data.
[[nodiscard]] std::optional<Reason> DriveWordsMissing(const model::SlaveModel& slave, bool needs_control);

/// Makes keys of findings differ by axis (0 to 7); of the first axis they stay as they are. Bits 56 to 58.
[[nodiscard]] constexpr std::uint64_t AxisKey(std::uint8_t axis) {
  return std::uint64_t{axis} << 56U;
}
/// Sets the axis that the finding is about, if it is not the first one; call it after all the rest is set.
void NameAxis(Finding& finding, std::uint8_t axis);

}  // namespace ecaudit
