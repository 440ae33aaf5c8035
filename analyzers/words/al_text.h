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
/// True when the profile brings no AL table of its own.
[[nodiscard]] bool JudgedByStandard(const device::DeviceDescription& family);
/// "The EtherCAT standard", "The manual of Kollmorgen AKD, manual ...": what the slave is judged by, to begin a
/// sentence.
[[nodiscard]] std::string LawText(const device::DeviceDescription& family);
/// "INIT", "INIT or PREOP": the states a slave may be in; "an unknown state" for the empty set.
[[nodiscard]] std::string StatesText(model::StateSet states);
/// "PREOP to SAFEOP", or "SAFEOP" when the state before is not known.
[[nodiscard]] std::string TransitionText(const model::AlRequestRecord& request);
/// "SAFEOP (AL Control 0x0014)".
[[nodiscard]] std::string RequestText(const model::AlRequestRecord& request);
/// Distinguishes requests by what they ask and where from, to fold repetitions.
[[nodiscard]] std::uint64_t RequestKey(const model::AlRequestRecord& request);
/// Sets {times} and {last_request_frame} where the request was written more than once.
void SetRepetition(Finding& finding, const model::AlRequestRecord& request);
/// " (written 4 times up to frame 812)", empty when it was written once.
[[nodiscard]] std::string RepetitionText(const model::AlRequestRecord& request);

}  // namespace ecaudit
