/// Values of the distributed-clock unit 0x0900-0x09FF with their units (esc-reference 4.10, 10).
#pragma once

#include <cstdint>

#include "decoder/base/ids.h"
#include "decoder/base/wrapping.h"

namespace ecaudit::esc {

/// System time 0 of distributed clocks, 2000-01-01 00:00 UTC, as nanoseconds since 1970.
inline constexpr TimeNs kDcEpoch = 946'684'800'000'000'000;

/// System time (64 bit, ns since 2000) as ns since 1970; times after 2262 do not fit and are clamped.
[[nodiscard]] constexpr TimeNs DcToUnixTime(std::uint64_t system_time_ns) {
  constexpr std::uint64_t kMost = static_cast<std::uint64_t>(INT64_MAX - kDcEpoch);
  return kDcEpoch + static_cast<TimeNs>(system_time_ns < kMost ? system_time_ns : kMost);
}

/// 0x0008, the low byte: whether the slave has distributed clocks.
[[nodiscard]] constexpr bool HasClock(std::uint8_t features) {
  return (features & 0x04U) != 0;
}
/// 0x0008, the low byte: whether the clock has 64 bit.
[[nodiscard]] constexpr bool HasWideClock(std::uint8_t features) {
  return (features & 0x08U) != 0;
}

/// The 64-bit time next to `near` whose low half is `low`: ESCs with 32-bit clocks wrap every 4.29 s.
/// @param near any estimate less than 2.1 s off, ns
[[nodiscard]] constexpr std::uint64_t UnwrapDcTime(std::uint32_t low, std::uint64_t near) {
  const auto delta = static_cast<std::int32_t>(WrappingDifference(low, static_cast<std::uint32_t>(near)));
  return WrappingSum(near, static_cast<std::uint64_t>(static_cast<std::int64_t>(delta)));
}

/// 0x092C: mean distance of the local copy of the system time from the received one. What bit 31 means differs between
/// the manuals (esc-reference 10.4), so the magnitude alone is to be evaluated.
struct TimeDifference {
  std::uint32_t raw = 0;
  [[nodiscard]] constexpr std::uint32_t magnitude_ns() const { return raw & 0x7FFFFFFFU; }
  /// Local copy smaller than the received time by Beckhoff section II v2.7, greater or equal by newer sources.
  [[nodiscard]] constexpr bool bit31() const { return (raw & 0x80000000U) != 0; }
};

/// 0x0930: 15 bits; ESCs take 0x0080-0x3FFF.
[[nodiscard]] constexpr std::uint16_t SpeedCounterStart(std::uint16_t raw) {
  return raw & 0x7FFFU;
}
/// 0x0932: deviation of the local clock period, two's complement, no unit.
[[nodiscard]] constexpr std::int16_t SpeedCounterDifference(std::uint16_t raw) {
  return static_cast<std::int16_t>(raw);
}

/// 0x0980: who owns the SYNC and latch units.
struct CyclicUnitControl {
  std::uint8_t raw = 0;
  [[nodiscard]] constexpr bool sync_by_pdi() const { return (raw & 0x01U) != 0; }
  [[nodiscard]] constexpr bool latch0_by_pdi() const { return (raw & 0x10U) != 0; }
  [[nodiscard]] constexpr bool latch1_by_pdi() const { return (raw & 0x20U) != 0; }
};

/// 0x0981: what the SYNC unit does.
struct SyncActivation {
  std::uint8_t raw = 0;
  [[nodiscard]] constexpr bool active() const { return (raw & 0x01U) != 0; }
  [[nodiscard]] constexpr bool sync0() const { return (raw & 0x02U) != 0; }
  [[nodiscard]] constexpr bool sync1() const { return (raw & 0x04U) != 0; }
  [[nodiscard]] constexpr bool auto_activation() const { return (raw & 0x08U) != 0; }
  [[nodiscard]] constexpr bool extends_start_time() const { return (raw & 0x10U) != 0; }
  [[nodiscard]] constexpr bool checks_start_time() const { return (raw & 0x20U) != 0; }
  [[nodiscard]] constexpr bool near_future() const { return (raw & 0x40U) != 0; }
  [[nodiscard]] constexpr bool debug_pulse() const { return (raw & 0x80U) != 0; }
};

/// The AssignActivate word of EEPROM, ESI and ENI: low byte to 0x0980, high byte to 0x0981.
struct AssignActivate {
  std::uint16_t raw = 0;
  [[nodiscard]] constexpr CyclicUnitControl control() const { return {static_cast<std::uint8_t>(raw & 0xFFU)}; }
  [[nodiscard]] constexpr SyncActivation activation() const { return {static_cast<std::uint8_t>(raw >> 8U)}; }
};

/// 0x0984.
struct ActivationStatus {
  std::uint8_t raw = 0;
  [[nodiscard]] constexpr bool sync0_pending() const { return (raw & 0x01U) != 0; }
  [[nodiscard]] constexpr bool sync1_pending() const { return (raw & 0x02U) != 0; }
  [[nodiscard]] constexpr bool start_time_implausible() const { return (raw & 0x04U) != 0; }
};

/// 0x0982 holds units of 10 ns; 0 is the acknowledge mode.
[[nodiscard]] constexpr std::uint32_t PulseLengthNs(std::uint16_t raw) {
  return std::uint32_t{raw} * 10;
}

/// 0x09A8 and 0x09A9.
struct LatchControl {
  std::uint8_t raw = 0;
  [[nodiscard]] constexpr bool positive_single() const { return (raw & 0x01U) != 0; }
  [[nodiscard]] constexpr bool negative_single() const { return (raw & 0x02U) != 0; }
};

/// 0x09AE and 0x09AF.
struct LatchStatus {
  std::uint8_t raw = 0;
  [[nodiscard]] constexpr bool positive_event() const { return (raw & 0x01U) != 0; }
  [[nodiscard]] constexpr bool negative_event() const { return (raw & 0x02U) != 0; }
  [[nodiscard]] constexpr bool pin() const { return (raw & 0x04U) != 0; }
};

/// One step of the watchdogs: (0x0400 + 2) periods of 25 MHz, ns.
[[nodiscard]] constexpr std::int64_t WatchdogTickNs(std::uint16_t divider) {
  return (std::int64_t{divider} + 2) * 40;
}
/// Time of a watchdog (0x0410 or 0x0420) with the divider 0x0400, ns; 0 is off.
[[nodiscard]] constexpr std::int64_t WatchdogNs(std::uint16_t divider, std::uint16_t steps) {
  return WatchdogTickNs(divider) * steps;
}
/// Value of 0x0400 after power-on: steps of 100 us.
inline constexpr std::uint16_t kDefaultWatchdogDivider = 2498;

}  // namespace ecaudit::esc
