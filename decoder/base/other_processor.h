/// in: nothing but the machine.  out: whether a second thread helps with work that is handed over piece by piece.
#pragma once

namespace ecaudit {

/// True when another processor that this process may use gives back within 250 ns what this thread writes. Measured
/// with a thread of its own: half a millisecond, 2 ms if the other thread does not answer, and the time that the system
/// takes to end the thread. What one processor has written comes to another one from cache to cache: between far ones
/// that costs more than the second thread saves, and one that is busy answers late. False where there is only one
/// processor, and where no thread can be had. The answer of the next call may differ.
[[nodiscard]] bool OtherProcessorIsNear() noexcept;

}  // namespace ecaudit
