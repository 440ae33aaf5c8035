/// in: nothing but the machine.  out: whether a second thread helps with work that is handed over piece by piece.
#pragma once

namespace ecaudit {

/// True when another processor takes up within kNearNs, there and back, what this thread writes; measured, in less than
/// kMostNs. What one processor has written comes to another one from cache to cache: between far ones (another die, or
/// virtual ones anywhere) that costs more than the second thread saves, and one that is busy answers late.
[[nodiscard]] bool OtherProcessorIsNear() noexcept;

}  // namespace ecaudit
