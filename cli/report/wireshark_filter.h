/// Display filters that show a finding's frames in Wireshark.
#pragma once

#include <string>

#include "analyzers/result/finding.h"

namespace ecaudit::report {

/// The frame that shows the finding, then its last repetition and the related frames:
/// "frame.number==760 || frame.number==6762 || frame.number==743". Empty when the finding cites no frame.
[[nodiscard]] std::string WiresharkFilter(const Finding& finding);

}  // namespace ecaudit::report
