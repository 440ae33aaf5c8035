/// Whether the drive rules can judge a slave.
#pragma once

#include <string>

#include "analyzers/model/slave_model.h"

namespace ecaudit {

/// Why the status word (or, if `needs_control`, the control word) of a slave that is or may be a drive is not known;
/// empty when it is known, when the slave is no drive, or when it never exchanged process data.
[[nodiscard]] std::string DriveWordsMissing(const model::SlaveModel& slave, bool needs_control);

}  // namespace ecaudit
