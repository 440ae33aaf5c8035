/// A rule that could not be evaluated for any slave, for the same reason: one entry instead of one for each.
#pragma once

#include "decoder/base/ids.h"

namespace ecaudit {

/// Stands in NotEvaluable::slave for each slave of the bus. No slave has this id.
inline constexpr SlaveId kEverySlave = kNoSlave - 1;

}  // namespace ecaudit
