/// The parts of a profile's page that are long lists: drive states and commands, EEPROM, fieldbus parameters, and in
/// full also objects, emergencies and the bits of words.
#pragma once

#include "cli/report/layout.h"
#include "decoder/device/device_description.h"

namespace ecaudit::cli {

/// Appends a section for each part that the profile documents.
/// @param full  also the sections with a row for each object, code and bit
void AppendDetailSections(const device::DeviceDescription& profile, bool full, report::TextBuilder& text);

}  // namespace ecaudit::cli
