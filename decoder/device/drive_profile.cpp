#include "decoder/device/drive_profile.h"

#include <algorithm>
#include <array>

#include "decoder/base/names.h"

namespace ecaudit::device {

std::string_view DriveStateName(DriveState state) {
  static constexpr std::array<std::string_view, 8> kNames = {
      "Not ready to switch on", "Switch on disabled", "Ready to switch on",    "Switched on",
      "Operation enabled",      "Quick stop active",  "Fault reaction active", "Fault"};
  const auto index = static_cast<std::size_t>(state);
  return index < kNames.size() ? kNames[index] : std::string_view("?");
}

std::string_view FaultValueName(FaultValue kind) {
  static constexpr Named<FaultValue> kNames[] = {
      {FaultValue::kErrorCode, "error code"},
      {FaultValue::kErrorHistory, "error history"},
      {FaultValue::kFaultNumber, "fault number"},
      {FaultValue::kWarningNumber, "warning number"},
  };
  static_assert(NamesAll(kNames, FaultValue::kWarningNumber));
  return NameIn(kNames, kind);
}

std::optional<DriveState> DriveProfile::StateOf(std::uint16_t status_word) const {
  for (const DriveStateRow& row : states) {
    if (row.printed.Matches(status_word)) return row.state;
  }
  // What a manual prints comes before what is accepted besides.
  for (const DriveStateRow& row : states) {
    for (const StatusPattern& pattern : row.also) {
      if (pattern.Matches(status_word)) return row.state;
    }
  }
  return std::nullopt;
}

std::uint16_t DriveProfile::StateBits() const {
  unsigned bits = 0;
  for (const DriveStateRow& row : states) {
    bits |= row.printed.mask;
    for (const StatusPattern& pattern : row.also) bits |= pattern.mask;
  }
  return static_cast<std::uint16_t>(bits);
}

const DriveStateRow* DriveProfile::FindState(DriveState state) const {
  for (const DriveStateRow& row : states) {
    if (row.state == state) return &row;
  }
  return nullptr;
}

bool DriveProfile::ShowsEnabled(std::uint16_t status_word) const {
  const std::optional<DriveState> state = StateOf(status_word);
  const DriveStateRow* row = state ? FindState(*state) : nullptr;
  return row != nullptr && row->enabled;
}

std::uint32_t DriveProfile::CommandedAnywhere(std::uint16_t before, std::uint16_t after) const {
  std::uint32_t numbers = 0;
  for (const DriveCommand& command : commands) {
    if (command.automatic || !command.Matches(before, after)) continue;
    for (const std::uint8_t number : command.transitions) {
      if (number < 32) numbers |= 1U << number;
    }
  }
  return numbers;
}

std::uint32_t DriveProfile::Commanded(DriveState state, std::uint16_t before, std::uint16_t after) const {
  std::uint32_t leaving = 0;
  for (const DriveTransition& transition : transitions) {
    if (transition.from == state && transition.number < 32) leaving |= 1U << transition.number;
  }
  return CommandedAnywhere(before, after) & leaving;
}

const DriveTransition* DriveProfile::Find(DriveState from, DriveState to) const {
  for (const DriveTransition& transition : transitions) {
    if (transition.to != to) continue;
    const bool from_any_but_fault = !transition.from && transition.to == DriveState::kFaultReactionActive &&
                                    from != DriveState::kFaultReactionActive && from != DriveState::kFault;
    if (transition.from == from || from_any_but_fault) return &transition;
  }
  return nullptr;
}

const DriveTransition* DriveProfile::Find(std::uint8_t number) const {
  const auto it = std::ranges::find(transitions, number, &DriveTransition::number);
  return it == transitions.end() ? nullptr : &*it;
}

const OperationMode* DriveProfile::FindMode(std::int8_t value) const {
  const auto it = std::ranges::find(modes, value, &OperationMode::value);
  return it == modes.end() ? nullptr : &*it;
}

const FaultObject* DriveProfile::FindFaultObject(std::uint16_t index, std::uint8_t subindex) const {
  const auto it =
      std::ranges::find_if(fault_objects, [&](const FaultObject& object) { return object.Holds(index, subindex); });
  return it == fault_objects.end() ? nullptr : &*it;
}

}  // namespace ecaudit::device
