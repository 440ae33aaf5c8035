/// What to do about AL status codes that are about the slave itself, not about a setting of the master.
#pragma once

#include <cstdint>

#include "analyzers/result/finding.h"

namespace ecaudit {

/// Sets {code_advice}, one or two sentences without the last full stop, if there is any for the code.
void SetCodeAdvice(Finding& finding, std::uint16_t code);
/// A slave with this code follows no request until it is switched off and on.
[[nodiscard]] bool DemandsRestart(std::uint16_t code);
/// The state that a slave with this code demands first; 0: none.
[[nodiscard]] std::uint8_t DemandedState(std::uint16_t code);

}  // namespace ecaudit
