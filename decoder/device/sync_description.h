/// How a family synchronises to the master, and what it tolerates.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "decoder/base/ids.h"
#include "decoder/device/latch_description.h"
#include "decoder/device/sourced.h"

namespace ecaudit::device {

/// Permitted jitter for a range of cycle times.
struct JitterLimit {
  std::optional<TimeNs> cycle_min;  ///< inclusive; unset: from 0
  std::optional<TimeNs> cycle_max;  ///< inclusive; unset: without end
  TimeNs jitter = 0;
  /// True: the manual gives no figure for this range; a finding that rests on it is at most a warning.
  bool undocumented = false;
  std::string note;
  std::string source;
};

/// A row of the manual in words.
struct SyncParameter {
  std::string parameter;
  std::string object;  ///< "0x60C2:1", "ESC 0x09A0", or empty
  std::string unit;
  std::string meaning;
  std::string default_value;
  std::string limit;
  std::string note;
  std::string source;
};

/// A parameter of the drive that its synchronisation depends on.
struct DriveParameter {
  std::string keyword;                  ///< its name in the vendor's tool: "FBUS.SYNCDIST"
  std::optional<ObjectAddress> object;  ///< where SDO reads and writes it; unset: not by SDO, as far as is known
  /// The family's own manual prints no dictionary; a sister family has the parameter in this object.
  bool object_inferred = false;
  std::uint32_t on_bits = 0;   ///< it is a switch: on while all of these are 1; 0: not by bits
  std::uint32_t off_bits = 0;  ///< likewise off while one of these is 1
  std::string note;
  std::string source;

  /// What it switches is on. Without bits of its own any value but 0 is.
  [[nodiscard]] bool IsOn(std::int64_t value) const {
    const auto bits = static_cast<std::uint64_t>(value);
    if (on_bits != 0) return (bits & on_bits) == on_bits;
    return off_bits != 0 ? (bits & off_bits) == 0 : value != 0;
  }
  /// The value nearest to `value` that switches it on.
  [[nodiscard]] std::int64_t OnValue(std::int64_t value) const {
    if (IsOn(value)) return value;
    const auto bits = static_cast<std::uint64_t>(value);
    if (on_bits != 0) return static_cast<std::int64_t>(bits | on_bits);
    return off_bits != 0 ? static_cast<std::int64_t>(bits & ~std::uint64_t{off_bits}) : 1;
  }
};

struct SyncDescription {
  Sourced<TimeNs> cycle_base;  ///< the cycle must be a multiple of this
  Sourced<TimeNs> cycle_min;   ///< shortest cycle
  /// The master sets the cycle by 60C2h; false: by the SYNC0 cycle register only.
  Sourced<bool> cycle_by_60c2;
  Sourced<std::uint32_t> pll_range_ppm;  ///< largest mean deviation of the cycle the drive can follow
  Sourced<TimeNs> pll_step;              ///< largest correction per real-time task period
  std::vector<JitterLimit> jitter;
  /// Synchronisation is lost at this many consecutive events outside the permitted jitter.
  Sourced<std::uint32_t> lost_after_jitter;
  /// Synchronisation is lost when more process-data frames than this are missing while the drive is enabled.
  Sourced<std::uint32_t> lost_after_missing;
  std::vector<std::string> lost_faults;    ///< "F125"
  std::vector<std::string> lost_warnings;  ///< "n17"
  std::string source_with_dc;              ///< what the drive synchronises to with distributed clocks
  std::string source_without_dc;           ///< and without
  /// The drive's own cycle as a multiple of cycle_base: FBUS.SAMPLEPERIOD, PTBASE.
  std::optional<DriveParameter> cycle_count;
  /// Locked while SYNCDIST - SYNCWND < SYNCACT < SYNCDIST + SYNCWND in PLLTHRESH consecutive cycles; all in one unit,
  /// which the manuals do not print.
  std::optional<DriveParameter> sync_distance, sync_actual, sync_window, pll_threshold;
  /// Switches the supervision of the synchronisation.
  std::optional<DriveParameter> supervision;
  /// Switches the PLL of the drive: with distributed clocks it has to be on.
  std::optional<DriveParameter> pll_switch;
  std::vector<SyncParameter> parameters;  ///< all rows of the manual
  std::string note;
  std::string source;

  /// Those of the parameters above that the family has.
  [[nodiscard]] std::vector<const DriveParameter*> DriveParameters() const;
  /// The limit for a cycle time, or null when the family documents none.
  [[nodiscard]] const JitterLimit* FindJitter(TimeNs cycle) const;
};

}  // namespace ecaudit::device
