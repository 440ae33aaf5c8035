/// Whether a slave exchanged process data.
#pragma once

#include <cstdint>

namespace ecaudit::model {

enum class Exchange : std::uint8_t {
  kYes,       ///< the working counter leaves no other explanation
  kInferred,  ///< it fits, given the states of the slaves; or nothing can be known (outbound-only capture)
  kNo,        ///< the slave did not count
  kUnknown,   ///< some slaves counted, or the frame did not return
};

}  // namespace ecaudit::model
