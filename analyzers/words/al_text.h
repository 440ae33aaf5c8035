/// Words for AL states and status codes, shared by the rules of the AL state machine.
#pragma once

#include <cstdint>
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
/// Distinguishes requests by the requested state and the state before, to fold repetitions.
[[nodiscard]] std::uint64_t RequestKey(const model::AlRequestRecord& request);
/// Sets {times} and {last_request_frame} where the request was written more than once.
void SetRepetition(Finding& finding, const model::AlRequestRecord& request);

}  // namespace ecaudit
