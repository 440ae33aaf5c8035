#include "analyzers/progress/axis_signals.h"

#include <algorithm>
#include <tuple>

#include "analyzers/model/terminal_objects.h"

namespace ecaudit::progress {
namespace {

struct RoleRow {
  std::uint16_t index;
  std::uint8_t subindex;
  Role role;
};

/// Of several objects with one role in a part the first row counts.
constexpr std::array kRoleRows{
    RoleRow{0x6040, 0, Role::kControl},        RoleRow{0x6060, 0, Role::kMode},
    RoleRow{0x607A, 0, Role::kTargetPosition}, RoleRow{0x60C1, 1, Role::kTargetPosition},
    RoleRow{0x60FF, 0, Role::kTargetVelocity}, RoleRow{0x6042, 0, Role::kTargetSpeed},
    RoleRow{0x6071, 0, Role::kTargetTorque},   RoleRow{0x6041, 0, Role::kStatus},
    RoleRow{0x6061, 0, Role::kModeShown},      RoleRow{0x6064, 0, Role::kPosition},
    RoleRow{0x606C, 0, Role::kVelocity},       RoleRow{0x6044, 0, Role::kSpeed},
    RoleRow{0x6077, 0, Role::kTorque},         RoleRow{0x603F, 0, Role::kErrorCode},
    RoleRow{0x6072, 0, Role::kMaxTorque},      RoleRow{0x60E0, 0, Role::kPositiveTorque},
    RoleRow{0x60E1, 0, Role::kNegativeTorque}, RoleRow{0x607F, 0, Role::kMaxVelocity},
    RoleRow{0x6080, 0, Role::kMaxMotorSpeed},  RoleRow{0x6081, 0, Role::kProfileSpeed},
    RoleRow{0x6083, 0, Role::kAcceleration},   RoleRow{0x6098, 0, Role::kHomingMethod},
    RoleRow{0x6099, 1, Role::kHomingSpeed},    RoleRow{0x609A, 0, Role::kHomingAcceleration},
    RoleRow{0x60FD, 0, Role::kDigitalInputs},  RoleRow{0xE700, 1, Role::kSafetyCommand},
};

constexpr std::uint16_t kFirstOfAxes = 0x6000;
constexpr std::uint16_t kPastAxes = 0xA000;
constexpr std::uint16_t kAxisDistance = 0x800;
constexpr std::uint32_t kSafetyObject = 0xE70001;  // of the device, by ETG.5120: object and subindex

bool IsSigned(Role role) {
  return role != Role::kControl && role != Role::kStatus && role < Role::kErrorCode;
}

}  // namespace

std::uint16_t ObjectOf(Role role) {
  for (const RoleRow& row : kRoleRows) {
    if (row.role == role) return row.index;
  }
  return 0;
}

std::uint8_t SubindexOf(std::uint16_t index) {
  for (const RoleRow& row : kRoleRows) {
    if (row.index == index) return row.subindex;
  }
  return 0;
}

std::optional<std::pair<std::uint8_t, std::uint16_t>> AxisOf(std::uint16_t index) {
  if (index < kFirstOfAxes || index >= kPastAxes) return std::nullopt;
  const auto axis = static_cast<std::uint8_t>((index - kFirstOfAxes) / kAxisDistance);
  return std::pair(axis, static_cast<std::uint16_t>(index - axis * kAxisDistance));
}

std::optional<std::pair<std::uint8_t, Role>> RoleOf(std::uint16_t index, std::uint8_t subindex) {
  const auto axis = AxisOf(index);
  if (!axis) return std::nullopt;
  for (const RoleRow& row : kRoleRows) {
    if (row.index == axis->second && row.subindex == subindex) return std::pair(axis->first, row.role);
  }
  return std::nullopt;
}

AxisPlaces::AxisPlaces(const model::ImagePart& part) {
  const model::TerminalObjects terminal(part);
  terminal_ = !terminal.empty();
  // A terminal with an FSoE frame is no axis.
  const bool is_axis = std::any_of(part.places.begin(), part.places.end(), [](const model::ImagePart::Place& place) {
    return place.object == ObjectOf(Role::kControl) * 0x100U;
  });
  for (const model::ImagePart::Place& place : part.places) {
    const std::uint32_t object = terminal.InCia402(place.object, place.bits);
    const auto role = object == kSafetyObject && is_axis
                          ? std::optional(std::pair(std::uint8_t{0}, Role::kSafetyCommand))
                          : RoleOf(static_cast<std::uint16_t>(object >> 8U), static_cast<std::uint8_t>(object));
    if (!role || place.bits == 0 || place.bits > 64) continue;
    const bool taken = std::any_of(places_.begin(), places_.end(), [&](const Place& other) {
      return other.axis == role->first && other.role == role->second;
    });
    if (taken) continue;
    const auto shift = static_cast<std::uint8_t>(place.bit % 8);
    places_.push_back({.axis = role->first,
                       .role = role->second,
                       .has_sign = IsSigned(role->second),
                       .shift = shift,
                       .bits = place.bits,
                       .byte = place.bit / 8,
                       .reach = shift + place.bits <= 64 ? std::uint64_t{place.bit} / 8 + 8 : Place::kNever,
                       .mask = ~std::uint64_t{0} >> (64U - place.bits),
                       .end = std::uint64_t{place.bit} + place.bits});
  }
  std::stable_sort(places_.begin(), places_.end(), [](const Place& a, const Place& b) { return a.axis < b.axis; });
  for (std::size_t i = 0; i < places_.size(); ++i) {
    if (axes_.empty() || axes_.back().number != places_[i].axis) axes_.push_back({places_[i].axis, i, 0});
    ++axes_.back().count;
  }
}

}  // namespace ecaudit::progress
