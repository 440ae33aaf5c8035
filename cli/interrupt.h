/// Ctrl-C and SIGTERM: the work ends early and what was done so far is delivered.
#pragma once

#include <atomic>

namespace ecaudit::system {
class ParentLink;
}

namespace ecaudit::cli {

/// Listens from now on; what came before is forgotten. The second signal ends the program.
void ListenForInterrupt();
/// The same in a worker, whose parent sends the signal.
void ListenForStop(system::ParentLink& parent);
/// Set by the first signal.
[[nodiscard]] std::atomic<bool>& InterruptFlag();

}  // namespace ecaudit::cli
