/// What operator new has handed out in this program. Linking allocations.cpp replaces it.
#pragma once

#include <cstdint>

namespace ecaudit::perf {

struct Allocations {
  std::uint64_t count = 0;  ///< since the program began
  std::int64_t live = 0;    ///< bytes not given back yet
  std::int64_t peak = 0;    ///< most of them at once since ForgetPeak()
};

[[nodiscard]] Allocations CountedAllocations();
void ForgetPeak();

}  // namespace ecaudit::perf
