/// The parts of a profile's page about mailbox, process data, drive, synchronisation and latch.
#pragma once

#include "cli/report/layout.h"
#include "decoder/device/device_description.h"

namespace ecaudit::cli {

/// Appends a section for each part that the profile documents.
void AppendProcessSections(const device::DeviceDescription& profile, report::TextBuilder& text);

}  // namespace ecaudit::cli
