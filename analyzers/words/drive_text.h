/// Words for the drive state machine (CiA 402), shared by its rules, the report and the event lines.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analyzers/model/drive_events.h"
#include "analyzers/result/argument.h"
#include "decoder/device/device_description.h"

namespace ecaudit {

/// "transition 3", "transitions 13 and 14"; empty for none.
[[nodiscard]] std::string PathText(const model::DrivePath& path);
/// "Shutdown", "Switch on, Enable operation": what the transitions are called as commands; where there are none, what
/// the word would command in another state. "no command" when the family's table has nothing for it.
[[nodiscard]] std::string CommandName(const device::DriveProfile& drive, const model::DrivePath& path,
                                      std::optional<std::uint16_t> before, std::uint16_t word);
/// "Switch on, Enable operation (control word 0x000f, transitions 3 and 4)".
[[nodiscard]] std::string CommandText(const device::DriveProfile& drive, const model::DriveCommanded& event);
/// "bit 4 rises: new setpoint (control word 0x001f)"; what each bit is called in the mode, or does by its edge.
[[nodiscard]] std::string EdgesText(const device::DriveProfile& drive, const model::DriveBits& event);
/// "Ready to switch on -> Switched on (status word 0x0233, transition 3)".
[[nodiscard]] std::string StateChangeText(const model::DriveStateChanged& event);
/// "Fault"; "unknown".
[[nodiscard]] std::string StateText(std::optional<device::DriveState> state);
/// As a value of a finding; "unknown" has the code of that name.
[[nodiscard]] Value StateValue(std::optional<device::DriveState> state);
/// The mode with its name, where the family has one.
[[nodiscard]] Value ModeValue(const device::DeviceDescription& family, std::int8_t value);
/// "process data" or "SDO": how a word came.
[[nodiscard]] Value WayValue(bool by_sdo);
/// "7 (Interpolated position)"; the bare number where the family has no name for it.
[[nodiscard]] std::string ModeText(const device::DriveProfile& drive, std::int8_t value);
/// "emergency 0x7305 F401 Failed to set feedback type", "object 1003h: 0x7305 ...".
[[nodiscard]] std::string FaultText(const device::DeviceDescription& family, const model::DriveFaultExplained& event);
/// Names of the bits that are set; control word bits 4 to 6 as the mode of operation calls them.
[[nodiscard]] std::vector<std::string> SetBits(const std::vector<device::WordBit>& bits, std::uint16_t word,
                                               const device::ModeBits* mode = nullptr);
/// Null when the family does not list the mode.
[[nodiscard]] const device::ModeBits* BitsOfMode(const device::DriveProfile& drive, std::optional<std::int8_t> mode);
/// "3.2 ms"; "" without a value.
[[nodiscard]] std::string MillisecondsText(std::optional<TimeNs> duration);

}  // namespace ecaudit
