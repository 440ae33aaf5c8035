/// Ways through the drive state machine of a family: which transitions lead from one state to another, and how far a
/// control word wants to go.
#pragma once

#include <cstdint>
#include <optional>

#include "analyzers/model/drive_events.h"
#include "decoder/device/drive_profile.h"

namespace ecaudit::model {

[[nodiscard]] constexpr std::uint32_t TransitionBit(unsigned number) {
  return number < 32 ? 1U << number : 0U;
}

/// Transitions that a drive takes without a command: the automatic ones, those that take torque away (no supply,
/// hardware enable, limit switch), and 15, since faults have other ways to be reset.
inline constexpr std::uint32_t kOwnTransitions =
    TransitionBit(0) | TransitionBit(1) | TransitionBit(5) | TransitionBit(6) | TransitionBit(7) | TransitionBit(8) |
    TransitionBit(9) | TransitionBit(10) | TransitionBit(11) | TransitionBit(12) | TransitionBit(13) |
    TransitionBit(14) | TransitionBit(15);

[[nodiscard]] constexpr bool IsFaultState(device::DriveState state) {
  return state == device::DriveState::kFault || state == device::DriveState::kFaultReactionActive;
}

/// How far a state is on the way to Operation enabled, in the terms of RankOf().
[[nodiscard]] int LevelOf(device::DriveState state);
/// How far the word wants the drive to go: 1 Ready to switch on, 2 Switched on, 3 Operation enabled, 0 none of these.
[[nodiscard]] int RankOf(const device::DriveProfile& drive, std::uint16_t word);

/// The shortest way, empty where the states are the same; nothing where there is none.
/// @param available  transitions that may be taken, a bit each
[[nodiscard]] std::optional<DrivePath> FindDrivePath(const device::DriveProfile& drive, device::DriveState from,
                                                     device::DriveState to, std::uint32_t available);

}  // namespace ecaudit::model
