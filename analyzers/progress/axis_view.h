/// What is known of an axis at one moment, for the checks that look at it.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <optional>

#include "analyzers/progress/axis_records.h"
#include "decoder/base/ids.h"
#include "decoder/base/wrapping.h"
#include "decoder/device/drive_profile.h"

namespace ecaudit::progress {

/// Whether the slave is in OP, where the drive acts on its control word.
enum class InOp : std::uint8_t { kUnknown, kNo, kYes };

/// Whether the master requested OP in this run. kEarlier: after that it requested a lower state.
enum class OpRequest : std::uint8_t { kNever, kEarlier, kNow };

/// What the AL side of the slave means for its drive.
struct SlaveSide {
  InOp in_op = InOp::kUnknown;
  OpRequest op_request = OpRequest::kNever;
  bool leaving = false;  ///< what the master requested last is a state below OP
  bool began = false;    ///< this run was seen from before OP on

  /// As one number: of each part of the process image in each cycle.
  friend bool operator==(const SlaveSide& a, const SlaveSide& b) {
    return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
  }
};

struct SoftwareLimits {
  std::optional<std::int64_t> least, most;  ///< 607Dh:1, 607Dh:2
};

// Bits of the control word.
inline constexpr unsigned kEnableVoltageBit = 1;
inline constexpr unsigned kQuickStopBit = 2;
inline constexpr unsigned kEnableOperationBit = 3;
inline constexpr unsigned kStartBit = 4;  ///< new set point, start homing
inline constexpr unsigned kRelativeBit = 6;
inline constexpr unsigned kResetBit = 7;
inline constexpr unsigned kHaltBit = 8;
// Bits of the status word.
inline constexpr unsigned kVoltageBit = 4;
inline constexpr unsigned kRemoteBit = 9;
inline constexpr unsigned kReachedBit = 10;
inline constexpr unsigned kLimitBit = 11;
inline constexpr unsigned kAcknowledgeBit = 12;  ///< profile position
inline constexpr unsigned kErrorBit = 13;        ///< following error, homing error

inline constexpr std::uint16_t kEnableWord = 0x000F;
// Bits of the digital inputs (60FDh).
inline constexpr std::uint16_t kNegativeSwitch = 0x0001;
inline constexpr std::uint16_t kPositiveSwitch = 0x0002;
/// Of the velocity mode (2): let the ramp run, unlock it, use the reference.
inline constexpr std::uint16_t kRampBits = 0x0070;

inline constexpr std::int8_t kProfilePosition = 1;
inline constexpr std::int8_t kVelocityMode = 2;
inline constexpr std::int8_t kProfileVelocity = 3;
inline constexpr std::int8_t kProfileTorque = 4;
inline constexpr std::int8_t kHoming = 6;
inline constexpr std::int8_t kInterpolated = 7;
inline constexpr std::int8_t kCyclicPosition = 8;
inline constexpr std::int8_t kCyclicVelocity = 9;
inline constexpr std::int8_t kCyclicTorque = 10;

/// What the set point of a mode is; kNone: none (homing), or the mode is of the manufacturer.
[[nodiscard]] constexpr Quantity QuantityOf(std::int8_t mode) {
  switch (mode) {
    case kProfilePosition:
    case kInterpolated:
    case kCyclicPosition:
      return Quantity::kPosition;
    case kVelocityMode:
      return Quantity::kSpeed;
    case kProfileVelocity:
    case kCyclicVelocity:
      return Quantity::kVelocity;
    case kProfileTorque:
    case kCyclicTorque:
      return Quantity::kTorque;
    default:
      return Quantity::kNone;
  }
}

struct AxisView : SlaveSide {
  FrameRef frame;  ///< of the newest value

  std::optional<std::uint16_t> control;  ///< as the master sent it last
  std::uint16_t control_before = 0;      ///< the other value before it, where control_changed
  bool control_changed = false;          ///< in this step, from a value that is known
  bool control_first = false;            ///< in this step, and nothing was known before
  FrameRef control_since;
  bool control_mapped = false;

  std::optional<std::uint16_t> status;
  std::optional<device::DriveState> state, state_before;
  bool state_changed = false;      ///< in this step; state_before is the last one that was known
  bool error_bit_differs = false;  ///< bit 13 has a meaning of the family, which device-fault-bit reports
  unsigned homing_bit = 4;         ///< of the control word: its rising edge starts homing
  FrameRef state_since;

  // FindMode() is due where one of the next four is set.
  std::optional<std::int8_t> mode_by_sdo;   ///< 6060h as a download wrote it last
  std::optional<std::int8_t> mode_mapped;   ///< 6060h in the process data
  std::optional<std::int8_t> mode_shown;    ///< 6061h
  std::optional<std::int8_t> mode_assumed;  ///< by the only set point, of a device without 6060h
  FrameRef mode_since;                      ///< of mode()
  bool mode_seen_to_change = false;         ///< to mode(), in the capture

  std::array<std::optional<std::int64_t>, kQuantityCount> target, actual;  ///< by Quantity, position first
  std::array<bool, kQuantityCount> target_mapped{};
  SoftwareLimits limits;
  std::uint16_t zero_limit = 0;                ///< an object that limits the motion and is 0; 0: none
  bool zero_by_sdo = false;                    ///< it is not in the outputs: its value was written or read by SDO
  std::uint16_t switches = 0;                  ///< 60FDh bits 0 and 1, where it is mapped
  std::optional<std::uint8_t> safety_command;  ///< E700h:1 as the master sent it last, where it is mapped

  AxisMoment before;                  ///< of the step before; frame not seen(): there was none
  std::optional<AxisMoment> earlier;  ///< some 50 ms before

  [[nodiscard]] SlaveSide& side() { return *this; }
  [[nodiscard]] bool enabled() const { return state == device::DriveState::kOperationEnabled; }
  [[nodiscard]] bool Control(unsigned bit) const { return control && (*control >> bit & 1U) != 0; }
  [[nodiscard]] bool Status(unsigned bit) const { return status && (*status >> bit & 1U) != 0; }
  [[nodiscard]] bool Rises(unsigned bit) const {
    return control_changed && Control(bit) && (control_before >> bit & 1U) == 0;
  }
  /// The bit of the control word whose rising edge starts the motion in mode().
  [[nodiscard]] unsigned StartBit() const { return StartBitOf(mode().value_or(0)); }
  [[nodiscard]] unsigned StartBitOf(std::int8_t of_mode) const;
  /// The mode that the master selects. 0 in the process data selects none.
  [[nodiscard]] std::optional<std::int8_t> mode_asked() const {
    return mode_mapped.value_or(0) != 0 ? mode_mapped : mode_by_sdo;
  }
  /// The mode that the drive works in; nothing where neither 6061h nor 6060h reports it.
  [[nodiscard]] const std::optional<std::int8_t>& mode() const { return mode_; }
  void FindMode() {
    mode_ = mode_shown ? mode_shown : mode_asked() ? mode_asked() : mode_mapped ? mode_mapped : mode_assumed;
    quantity_ = mode_ ? QuantityOf(*mode_) : Quantity::kNone;
    if (quantity_ == Quantity::kNone) quantity_ = Quantity::kPosition;
  }
  [[nodiscard]] const std::optional<std::int64_t>& Target(Quantity quantity) const {
    return target[static_cast<std::size_t>(quantity) - 1];
  }
  [[nodiscard]] const std::optional<std::int64_t>& Actual(Quantity quantity) const {
    return actual[static_cast<std::size_t>(quantity) - 1];
  }
  /// The values of now that matter most.
  [[nodiscard]] AxisMoment Moment() const {
    return {frame, control, status, mode_, quantity_, Target(quantity_), Actual(quantity_)};
  }
  [[nodiscard]] AxisLead Lead() const {
    const bool other = earlier && earlier->frame.number != before.frame.number;
    return {before, other ? earlier : std::nullopt};
  }
  /// A record of this moment.
  [[nodiscard]] AxisRecord Record(AxisFact fact, const FrameRef& since, TimeNs lasted = 0) const {
    AxisRecord record;
    record.fact = fact;
    record.since = since;
    record.frame = record.last = frame;
    record.lasted = lasted;
    record.control = control;
    record.status = status;
    record.state = state;
    record.mode = mode();
    record.safety_command = safety_command;
    return record;
  }

 private:
  std::optional<std::int8_t> mode_;
  Quantity quantity_ = Quantity::kPosition;  ///< of Moment()
};

[[nodiscard]] constexpr bool IsFault(std::optional<device::DriveState> state) {
  return state == device::DriveState::kFault || state == device::DriveState::kFaultReactionActive;
}

/// How far a position of 32 bits went, also past its end.
[[nodiscard]] constexpr std::int64_t Apart(std::int64_t from, std::int64_t to) {
  return static_cast<std::int32_t>(
      WrappingDifference(static_cast<std::uint32_t>(to), static_cast<std::uint32_t>(from)));
}
/// At most 2^48 and not less than -2^48, so that differences and multiples of it are numbers too: a capture may hold
/// any value.
[[nodiscard]] constexpr std::int64_t Bounded(std::int64_t value) {
  constexpr std::int64_t kMost = std::int64_t{1} << 48U;
  return value < -kMost ? -kMost : value > kMost ? kMost : value;
}
/// Without its sign, and bounded.
[[nodiscard]] constexpr std::int64_t Magnitude(std::int64_t value) {
  const std::int64_t bounded = Bounded(value);
  return bounded < 0 ? -bounded : bounded;
}
/// A step of the target from where it was to the actual value: nothing is left to move.
[[nodiscard]] constexpr bool StepsToActual(std::int64_t before, std::int64_t target, std::int64_t actual) {
  constexpr std::int64_t kShareOfStep = 20;
  return Magnitude(Apart(target, actual)) * kShareOfStep < Magnitude(Apart(before, target));
}

inline unsigned AxisView::StartBitOf(std::int8_t of_mode) const {
  return of_mode == kHoming ? homing_bit : kStartBit;
}

}  // namespace ecaudit::progress
