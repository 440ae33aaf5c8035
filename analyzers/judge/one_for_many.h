/// in: the findings of all rules.  out: what affects many slaves at once is one finding of the bus.
///
/// One pause of the process data is one fault of the master, however many slaves lose their outputs by it. Where so
/// many slaves have the same finding that single lines would hide the cause, the first one speaks for all.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "analyzers/result/finding.h"

namespace ecaudit {

/// From this number on, slaves are reported together.
inline constexpr std::size_t kManySlaves = 8;

/// Joins findings of one rule, severity and title (whatever its figures are) that many slaves have, once each, at about
/// the same time or out of the same cause.
/// @param label  "slave 2 (0x1003)"
/// @param position  2
void JoinSlaves(std::vector<Finding>& findings, const std::function<std::string(SlaveId)>& label,
                const std::function<SlavePos(SlaveId)>& position);

}  // namespace ecaudit
