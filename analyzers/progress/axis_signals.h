/// in: process data of a slave.  out: the values of CiA 402 that matter for one axis, whatever the drive.
///
/// Source: CIA402, object dictionary; ETG.6010 (further axes 800h apart).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "analyzers/model/process_image.h"
#include "decoder/base/bytes.h"

namespace ecaudit::progress {

/// What an object means for its axis.
enum class Role : std::uint8_t {
  kControl,         ///< 6040h
  kMode,            ///< 6060h
  kTargetPosition,  ///< 607Ah, 60C1h:1
  kTargetVelocity,  ///< 60FFh
  kTargetTorque,    ///< 6071h
  kTargetSpeed,     ///< 6042h, of the velocity mode (2): another unit than 60FFh
  kStatus,          ///< 6041h
  kModeShown,       ///< 6061h
  kPosition,        ///< 6064h
  kVelocity,        ///< 606Ch, in the unit of 60FFh
  kTorque,          ///< 6077h
  kSpeed,           ///< 6044h, in the unit of 6042h
  kErrorCode,       ///< 603Fh
  // Limits in the outputs: where they are 0 the axis cannot move.
  kMaxTorque,       ///< 6072h
  kPositiveTorque,  ///< 60E0h
  kNegativeTorque,  ///< 60E1h
  kMaxVelocity,     ///< 607Fh
  kMaxMotorSpeed,   ///< 6080h
  kProfileSpeed,    ///< 6081h, of profile position
  kAcceleration,    ///< 6083h, of profile modes
  // Likewise of homing.
  kHomingMethod,        ///< 6098h: 0 is none
  kHomingSpeed,         ///< 6099h:1
  kHomingAcceleration,  ///< 609Ah
  kDigitalInputs,       ///< 60FDh: bit 0 is the negative limit switch, bit 1 the positive one
};
inline constexpr std::size_t kRoles = 24;
inline constexpr std::array kLimitRoles{
    Role::kMaxTorque,    Role::kPositiveTorque, Role::kNegativeTorque, Role::kMaxVelocity, Role::kMaxMotorSpeed,
    Role::kProfileSpeed, Role::kAcceleration,   Role::kHomingMethod,   Role::kHomingSpeed, Role::kHomingAcceleration};

/// The object of the first axis that has this role.
[[nodiscard]] std::uint16_t ObjectOf(Role role);
/// The subindex of the first role that this object of the first axis has; 0 where it has none.
[[nodiscard]] std::uint8_t SubindexOf(std::uint16_t index);

/// Values of one axis in one direction of one frame; unset: not mapped there.
class AxisValues {
 public:
  [[nodiscard]] std::optional<std::int64_t> operator[](Role role) const {
    return has(role) ? std::optional(values_[static_cast<std::size_t>(role)]) : std::nullopt;
  }
  [[nodiscard]] bool has(Role role) const { return (mapped_ & Bit(role)) != 0; }
  void Set(Role role, std::int64_t value) {
    values_[static_cast<std::size_t>(role)] = value;
    mapped_ |= Bit(role);
  }
  void Merge(const AxisValues& other) {
    for (std::size_t i = 0; i < kRoles; ++i) {
      if (const auto role = static_cast<Role>(i); other.has(role)) Set(role, other.values_[i]);
    }
  }

 private:
  static_assert(kRoles <= 32);
  [[nodiscard]] static constexpr std::uint32_t Bit(Role role) { return 1U << static_cast<unsigned>(role); }

  std::uint32_t mapped_ = 0;
  std::array<std::int64_t, kRoles> values_{};  ///< of those that are mapped
};

/// Which axis (0 to 7) an object belongs to, and what it is called in the first one; nothing for objects of the device.
[[nodiscard]] std::optional<std::pair<std::uint8_t, std::uint16_t>> AxisOf(std::uint16_t index);

/// The role of an object, and the axis (0 to 7) whose it is; nothing for other objects.
[[nodiscard]] std::optional<std::pair<std::uint8_t, Role>> RoleOf(std::uint16_t index, std::uint8_t subindex);

/// Where the objects of the axes lie in one part of the process image.
class AxisPlaces {
 public:
  explicit AxisPlaces(const model::ImagePart& part);

  [[nodiscard]] std::uint64_t serial() const { return serial_; }
  [[nodiscard]] bool empty() const { return places_.empty(); }
  /// Of a servo terminal: its objects are at other indices, and its mode may be in none of them.
  [[nodiscard]] bool terminal() const { return terminal_; }
  /// Takes the bits of all places into `bits`; returns whether they are the same as there before.
  [[nodiscard]] bool Repeats(ByteSpan data, std::vector<std::uint64_t>& bits) const;
  /// Calls `visit(axis)` for each axis with a place here.
  template <class Visit>
  void ForEachAxis(Visit visit) const {
    for (std::size_t i = 0; i < places_.size(); ++i) {
      if (i == 0 || places_[i].axis != places_[i - 1].axis) visit(places_[i].axis);
    }
  }
  /// Calls `visit(axis, values)` for each axis with a place here; `bits` as Repeats() took them from data of `bytes`.
  template <class Visit>
  void Read(std::span<const std::uint64_t> bits, std::size_t bytes, Visit visit) const {
    for (std::size_t i = 0; i < places_.size();) {
      const std::uint8_t axis = places_[i].axis;
      AxisValues values;
      for (; i < places_.size() && places_[i].axis == axis; ++i) {
        const Place& place = places_[i];
        if (std::uint64_t{place.bit} + place.bits > std::uint64_t{bytes} * 8) continue;
        values.Set(place.role, place.has_sign ? SignExtend(bits[i], place.bits) : static_cast<std::int64_t>(bits[i]));
      }
      visit(axis, values);
    }
  }

 private:
  struct Place {
    std::uint8_t axis = 0;
    Role role = Role::kControl;
    bool has_sign = false;
    std::uint16_t bits = 0;
    std::uint32_t bit = 0;
  };
  std::uint64_t serial_ = 0;
  bool terminal_ = false;
  std::vector<Place> places_;  ///< by axis
};

}  // namespace ecaudit::progress
