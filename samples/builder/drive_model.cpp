#include "samples/builder/drive_model.h"

#include <algorithm>

namespace ecaudit::samples {
namespace {

// State bits 6, 5, 3-0 of the status word (AKD manual 4.4.3) and bit 4, voltage enabled.
std::uint16_t StatusBits(DriveState state) {
  switch (state) {
    case DriveState::kSwitchOnDisabled:
      return 0x0050;
    case DriveState::kReadyToSwitchOn:
      return 0x0031;
    case DriveState::kSwitchedOn:
      return 0x0033;
    case DriveState::kOperationEnabled:
      return 0x0037;
    case DriveState::kQuickStopActive:
      return 0x0017;
    case DriveState::kFaultReactionActive:
      return 0x001F;
    case DriveState::kFault:
      return 0x0018;
  }
  return 0;
}

constexpr std::uint16_t kRemote = 0x0200;  // always 1 in an AKD
constexpr TimeNs kFaultReaction = 5'000'000;

// Where `control` leads from `state`; transitions 2 to 12, 15 and 16.
DriveState Target(DriveState state, std::uint16_t control, bool reset_edge) {
  using S = DriveState;
  if (state == S::kFaultReactionActive) return state;
  if (state == S::kFault) return reset_edge ? S::kSwitchOnDisabled : state;
  const bool voltage = (control & 0x0002U) != 0;
  const bool no_quick_stop = (control & 0x0004U) != 0;
  if (!voltage) return S::kSwitchOnDisabled;
  if (!no_quick_stop)
    return state == S::kOperationEnabled || state == S::kQuickStopActive ? S::kQuickStopActive : S::kSwitchOnDisabled;
  const bool switch_on = (control & 0x0001U) != 0;
  const bool enable = (control & 0x0008U) != 0;
  switch (state) {
    case S::kSwitchOnDisabled:
      return switch_on ? state : S::kReadyToSwitchOn;
    case S::kReadyToSwitchOn:
      return switch_on ? S::kSwitchedOn : state;
    case S::kSwitchedOn:
      if (!switch_on) return S::kReadyToSwitchOn;
      return enable ? S::kOperationEnabled : state;
    case S::kOperationEnabled:
      if (!switch_on) return S::kReadyToSwitchOn;
      return enable ? state : S::kSwitchedOn;
    case S::kQuickStopActive:
      return switch_on && enable ? S::kOperationEnabled : state;
    default:
      return state;
  }
}

}  // namespace

void DriveModel::RunStates(TimeNs now, bool active, std::uint16_t control) {
  if (fault_at_ != 0 && now >= fault_at_) {
    state_ = DriveState::kFaultReactionActive;
    wanted_ = DriveState::kFault;
    wanted_since_ = fault_at_ + kFaultReaction - reaction_time_;
    fault_at_ = 0;
  }
  if (state_ != DriveState::kFaultReactionActive) {
    const bool edge = (control & 0x0080U) != 0 && (last_control_ & 0x0080U) == 0;
    // A drive that leaves OP switches off.
    const DriveState target = active                         ? Target(state_, control, edge)
                              : state_ == DriveState::kFault ? state_
                                                             : DriveState::kSwitchOnDisabled;
    const bool resetting = state_ == DriveState::kFault && wanted_ == DriveState::kSwitchOnDisabled;
    if (target != wanted_ && !resetting) {
      wanted_ = target;
      wanted_since_ = now;
    }
  }
  if (wanted_ != state_ && now >= wanted_since_ + reaction_time_) state_ = wanted_;
  last_control_ = control;
}

void DriveModel::RunLatches(TimeNs now, bool active, ObjectDictionary& objects) {
  const auto control = active ? objects.Number<std::uint16_t>(0x20A4, 0) : std::uint16_t{0};
  for (std::size_t i = 0; i < armed_.size(); ++i) {
    const bool enabled = (control >> i & 1U) != 0;
    if (enabled && !armed_[i]) armed_[i] = true;
    if (!enabled) {
      armed_[i] = false;
      valid_ = static_cast<std::uint16_t>(valid_ & ~(1U << i));
    }
  }
  if (drops_latched_) valid_ = 0;
  drops_latched_ = false;
  for (const Edge& edge : edges_) {
    const auto bit = static_cast<std::uint16_t>(1U << edge.latch);
    // Only the first edge after the enable bit rose counts.
    if (now < edge.at || !armed_.at(static_cast<std::size_t>(edge.latch)) || (valid_ & bit) != 0) continue;
    valid_ = static_cast<std::uint16_t>(valid_ | bit);
    objects.Set(static_cast<std::uint16_t>(0x20A0 + edge.latch), 0, edge.position);
  }
  std::erase_if(edges_, [now](const Edge& edge) { return now >= edge.at; });
  const unsigned selector = acknowledge_stuck_ ? 0 : control >> 8U & 0x1FU;
  const bool available = selector >= 1 && selector <= 4 && (valid_ >> (selector - 1) & 1U) != 0;
  objects.Set(0x20A5, 0, static_cast<std::uint16_t>(valid_ | (available ? selector << 8U : 0U)));
}

void DriveModel::Run(TimeNs now, bool active, ObjectDictionary& objects) {
  RunStates(now, active, objects.Number<std::uint16_t>(0x6040, 0));
  auto position = objects.Number<std::int32_t>(0x6063, 0);
  const auto command = objects.Number<std::int32_t>(0x60C1, 1);
  objects.Set(0x60F4, 0, std::int32_t{0});
  if (state_ == DriveState::kOperationEnabled) {
    objects.Set(0x60F4, 0, command - position);
    position = command;
  }
  objects.Set(0x6063, 0, position);
  objects.Set(0x6064, 0, position);
  objects.Set(0x6041, 0, static_cast<std::uint16_t>(shown_instead_.value_or(StatusBits(state_)) | kRemote));
  RunLatches(now, active, objects);
}

}  // namespace ecaudit::samples
