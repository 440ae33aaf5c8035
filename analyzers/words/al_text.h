/// Words for AL states and status codes, shared by the rules of the AL state machine.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "analyzers/model/model_events.h"
#include "analyzers/result/finding.h"
#include "decoder/device/device_description.h"

namespace ecaudit {

/// "0x001d invalid output configuration": the family's name for the code, else the standard's.
[[nodiscard]] std::string CodeText(std::uint16_t code, const device::DeviceDescription& family);
/// The same as a value of a finding.
[[nodiscard]] Value CodeValue(std::uint16_t code, const device::DeviceDescription& family);
/// True when the profile has no AL table of its own: the EtherCAT standard applies.
[[nodiscard]] bool FollowsStandard(const device::DeviceDescription& family);
/// Sets {manual} where a manual states what is allowed; without it the EtherCAT standard does:
/// "[{!manual}The EtherCAT standard][The manual ({manual})] does not allow this."
void SetManual(Finding& finding, const device::DeviceDescription& family);
/// Sets {known_cause} where the family's manual has one for slaves that change to the state of `status` by themselves
/// with this code.
/// @param before  the state that they leave; unset: any
void SetKnownCause(Finding& finding, const device::DeviceDescription& family, std::optional<esc::AlWord> before,
                   esc::AlWord status, std::uint16_t code);
/// Distinguishes requests by the requested state and the state before, to fold repetitions.
[[nodiscard]] std::uint64_t RequestKey(const model::AlRequestRecord& request);
/// Sets {times} and {last_request_frame} where the request was written more than once.
void SetRepetition(Finding& finding, const model::AlRequestRecord& request);

}  // namespace ecaudit
