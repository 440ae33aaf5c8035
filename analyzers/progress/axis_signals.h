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
  kDigitalInputs,       ///< 60FDh: bit 0 is the negative limit switch, bit 1 the positive one, bit 3 the interlock
  kSafetyCommand,       ///< E700h:1: command of the FSoE frame for the drive
};
inline constexpr std::size_t kRoles = 25;
inline constexpr std::array kLimitRoles{
    Role::kMaxTorque,    Role::kPositiveTorque, Role::kNegativeTorque, Role::kMaxVelocity, Role::kMaxMotorSpeed,
    Role::kProfileSpeed, Role::kAcceleration,   Role::kHomingMethod,   Role::kHomingSpeed, Role::kHomingAcceleration};

/// Roles, each at most once.
class RoleSet {
 public:
  constexpr RoleSet() = default;
  constexpr explicit RoleSet(std::span<const Role> roles) {
    for (const Role role : roles) Add(role);
  }
  [[nodiscard]] constexpr bool has(Role role) const { return (bits_ & Bit(role)) != 0; }
  [[nodiscard]] constexpr bool HasOneOf(RoleSet others) const { return (bits_ & others.bits_) != 0; }
  [[nodiscard]] constexpr bool empty() const { return bits_ == 0; }
  constexpr void Add(Role role) { bits_ |= Bit(role); }
  constexpr void Remove(Role role) { bits_ &= ~Bit(role); }
  [[nodiscard]] constexpr RoleSet And(RoleSet others) const {
    RoleSet both;
    both.bits_ = bits_ & others.bits_;
    return both;
  }

 private:
  static_assert(kRoles <= 32);
  [[nodiscard]] static constexpr std::uint32_t Bit(Role role) { return 1U << static_cast<unsigned>(role); }

  std::uint32_t bits_ = 0;
};

/// The object of the first axis that has this role.
[[nodiscard]] std::uint16_t ObjectOf(Role role);
/// The subindex of the first role that this object of the first axis has; 0 where it has none.
[[nodiscard]] std::uint8_t SubindexOf(std::uint16_t index);

/// Values of one axis in one part of the process image, and which of them changed; unset: not mapped there.
class AxisValues {
 public:
  [[nodiscard]] std::optional<std::int64_t> operator[](Role role) const {
    return has(role) ? std::optional(values_[static_cast<std::size_t>(role)]) : std::nullopt;
  }
  [[nodiscard]] bool has(Role role) const { return mapped_.has(role); }
  /// Another value than when all were taken last.
  [[nodiscard]] bool changed(Role role) const { return changed_.has(role); }
  [[nodiscard]] bool changed() const { return !changed_.empty(); }
  [[nodiscard]] RoleSet mapped() const { return mapped_; }
  /// Those that changed and are mapped.
  [[nodiscard]] RoleSet news() const { return changed_.And(mapped_); }
  void Set(Role role, std::int64_t value) {
    std::int64_t& known = values_[static_cast<std::size_t>(role)];
    if (has(role) && known == value) return;
    known = value;
    mapped_.Add(role);
    changed_.Add(role);
  }
  void Unset(Role role) { mapped_.Remove(role); }
  void Merge(const AxisValues& other) {
    for (std::size_t i = 0; i < kRoles; ++i) {
      if (const auto role = static_cast<Role>(i); other.has(role)) Set(role, other.values_[i]);
    }
  }
  /// What is known from them may be another by now, or was forgotten.
  void TakeAgain() { changed_ = mapped_; }
  void Taken() { changed_ = {}; }

 private:
  RoleSet mapped_, changed_;
  std::array<std::int64_t, kRoles> values_{};  ///< of those that are mapped
};

/// Which axis (0 to 7) an object belongs to, and what it is called in the first one; nothing for objects of the device.
[[nodiscard]] std::optional<std::pair<std::uint8_t, std::uint16_t>> AxisOf(std::uint16_t index);

/// The role of an object, and the axis (0 to 7) whose it is; nothing for other objects.
[[nodiscard]] std::optional<std::pair<std::uint8_t, Role>> RoleOf(std::uint16_t index, std::uint8_t subindex);

/// Where the objects of the axes lie in one part of the process image.
class AxisPlaces {
 public:
  /// The places of one axis follow each other.
  struct Axis {
    std::uint8_t number = 0;
    std::size_t first = 0, count = 0;  ///< of its places
  };

  explicit AxisPlaces(const model::ImagePart& part);

  [[nodiscard]] bool empty() const { return places_.empty(); }
  /// Of a servo terminal: its objects are at other indices, and its mode may be in none of them.
  [[nodiscard]] bool terminal() const { return terminal_; }
  /// The axes with a place here.
  [[nodiscard]] std::span<const Axis> axes() const { return axes_; }
  /// Sets the values of an axis as `data` has them; only those that are others than in the data before.
  void Read(const Axis& axis, ByteSpan data, AxisValues& values) {
    Place* const end = places_.data() + axis.first + axis.count;
    for (Place* place = places_.data() + axis.first; place != end; ++place) {
      // Nearly all of them, of every axis in every cycle.
      const bool at_once = place->reach <= data.size();
      if (!at_once && place->end > std::uint64_t{data.size()} * 8) {
        values.Unset(place->role);
        place->known = false;
        continue;
      }
      const std::uint64_t raw =
          at_once ? LoadLittleEndian<std::uint64_t>(data.data() + place->byte) >> place->shift & place->mask
                  : model::ExtractBits(data, std::uint64_t{place->byte} * 8 + place->shift, place->bits);
      if (place->raw == raw && place->known) continue;
      place->known = true;
      place->raw = raw;
      values.Set(place->role, place->has_sign ? SignExtend(raw, place->bits) : static_cast<std::int64_t>(raw));
    }
  }

 private:
  struct Place {
    static constexpr std::uint64_t kNever = ~std::uint64_t{0};

    std::uint8_t axis = 0;
    Role role = Role::kControl;
    bool has_sign = false;
    bool known = false;      ///< in the data before, as `raw`
    std::uint8_t shift = 0;  ///< its first bit in the eight bytes from `byte` on
    std::uint16_t bits = 0;
    std::uint32_t byte = 0;
    std::uint64_t reach = 0;  ///< the byte after these eight; kNever: it does not lie in them
    std::uint64_t mask = 0;
    std::uint64_t end = 0;  ///< the bit after it
    std::uint64_t raw = 0;
  };
  bool terminal_ = false;
  std::vector<Place> places_;  ///< by axis
  std::vector<Axis> axes_;
};

}  // namespace ecaudit::progress
