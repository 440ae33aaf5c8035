/// What a drive received and showed before it jumped or faulted, as a note of the finding.
#pragma once

#include <cstdint>

#include "analyzers/progress/axis_records.h"
#include "analyzers/result/finding.h"
#include "decoder/device/device_description.h"

namespace ecaudit {

/// For the notes of a rule that calls AddLead().
inline constexpr NoteKind kLeadNote{
    .name = "before",
    .text =
        "Before it ({at}): control word {control}[, status word {status}][, mode {mode}][, target "
        "{target_object:number} = {target}][ ({target_change} in {span})][, actual value {actual_object:number} = "
        "{actual}][ ({actual_change} in {span})]."};

/// Adds the note, if the capture holds the moment before.
void AddLead(Finding& finding, const progress::AxisLead& lead, const device::DeviceDescription& family,
             std::uint8_t axis);

}  // namespace ecaudit
