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

/// Neither the standard nor the manual of the family gives the error code of a drive a meaning.
[[nodiscard]] bool IsUnexplained(const device::DeviceDescription& family, std::int64_t code);

/// Whether a fault with this code (603Fh, emergency) can come from the set points or the mode that the drive was given:
/// a code of current (0x23xx), velocity or position control (0x84xx to 0x86xx), or one that gives no reason (generic,
/// or of the manufacturer and not in the list of the family).
[[nodiscard]] bool MayComeOfCommand(const device::DeviceDescription& family, std::int64_t code);

/// Makes keys of findings differ by axis (0 to 7); of the first axis they stay as they are. Bits 56 to 58.
[[nodiscard]] constexpr std::uint64_t AxisKey(std::uint8_t axis) {
  return std::uint64_t{axis} << 56U;
}
/// Sets the axis that the finding is about, if it is not the first one; call it after all the rest is set.
void NameAxis(Finding& finding, std::uint8_t axis);

}  // namespace ecaudit
