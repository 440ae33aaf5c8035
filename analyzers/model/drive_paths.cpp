#include "analyzers/model/drive_paths.h"

#include <array>

namespace ecaudit::model {

using device::DriveState;

int LevelOf(DriveState state) {
  switch (state) {
    case DriveState::kReadyToSwitchOn:
      return 1;
    case DriveState::kSwitchedOn:
      return 2;
    case DriveState::kOperationEnabled:
      return 3;
    default:
      return 0;
  }
}

int RankOf(const device::DriveProfile& drive, std::uint16_t word) {
  const std::uint32_t commanded = drive.CommandedAnywhere(0, word);
  if ((commanded & (TransitionBit(4) | TransitionBit(16))) != 0) return 3;
  if ((commanded & TransitionBit(3)) != 0) return 2;
  return (commanded & TransitionBit(2)) != 0 ? 1 : 0;
}

std::optional<DrivePath> FindDrivePath(const device::DriveProfile& drive, DriveState from, DriveState to,
                                       std::uint32_t available) {
  constexpr std::size_t kAllStates = 8;
  std::array<std::optional<DrivePath>, kAllStates> reached;
  std::array<DriveState, kAllStates> queue{};
  std::size_t head = 0;
  std::size_t tail = 0;
  const auto slot = [](DriveState state) { return static_cast<std::size_t>(state) % kAllStates; };
  reached[slot(from)] = DrivePath{};
  queue[tail++] = from;
  while (head < tail) {
    const DriveState state = queue[head++];
    for (const device::DriveTransition& transition : drive.transitions) {
      if ((available & TransitionBit(transition.number)) == 0 || reached[slot(transition.to)]) continue;
      const bool fits = transition.from ? *transition.from == state
                                        : transition.to == DriveState::kFaultReactionActive && !IsFaultState(state);
      if (!fits) continue;
      DrivePath path = *reached[slot(state)];
      path.Add(transition.number);
      reached[slot(transition.to)] = path;
      if (transition.to == to) return path;
      queue[tail++] = transition.to;
    }
  }
  return std::nullopt;
}

}  // namespace ecaudit::model
