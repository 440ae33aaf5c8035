/// What a profile states, compared with itself; for profile_check.cpp.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "decoder/base/json.h"
#include "decoder/device/device_description.h"

namespace ecaudit::device {

/// @param path  "al.transitions[3]"
using ReportProblem = std::function<void(const std::string& path, std::string what)>;

/// Rows of a list that repeat what an earlier row states.
/// @return their paths, in the order of the document
std::vector<std::string> RowsThatStandTwice(JsonValue root, const ReportProblem& report);

/// Contradictions, states that cannot be reached, lengths that do not fit, citations of nothing.
/// @param description  what was read, with what it inherits; null: it could not be read
void CheckConsistency(JsonValue root, const DeviceDescription* description, const ReportProblem& report);

}  // namespace ecaudit::device
