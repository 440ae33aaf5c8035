/// The distributed clocks of one slave and of the bus: plain data for the writers.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "decoder/base/ids.h"

namespace ecaudit {

/// A write of the master to the unit of one slave, in order.
struct DcStep {
  FrameRef frame;
  EscAddress address = 0;
  std::uint16_t length = 0;
  std::uint64_t value = 0;  ///< the first 8 bytes written, little endian
  bool broadcast = false;
  bool refused = false;  ///< the slave did not take it (register not implemented)
};

/// Where process-data frames arrive between two SYNC0 pulses of one slave, while it is in OP.
struct SyncPhase {
  std::uint64_t frames = 0;
  std::uint32_t cycle_ns = 0;
  /// Time from the last SYNC0 to the end of the frame at this slave.
  double mean_us = 0, min_us = 0, max_us = 0, stddev_us = 0;
  /// Least time to the SYNC0 before or after, and its frame.
  double margin_us = 0;
  FrameRef margin_frame;
  std::uint64_t empty_intervals = 0;   ///< between two pulses no frame
  std::uint64_t double_intervals = 0;  ///< two or more
  double uncertainty_us = 0;
  std::vector<std::uint64_t> histogram;  ///< equal parts of the cycle, the first begins at SYNC0
};

/// The drive's own measurement of its synchronisation, where SDO reads showed it; in the drive's unit.
struct PllSummary {
  std::optional<std::int64_t> distance, window;  ///< SYNCDIST, SYNCWND
  std::optional<std::int64_t> threshold;         ///< PLLTHRESH, cycles
  std::uint64_t reads = 0;                       ///< of SYNCACT
  std::int64_t actual_last = 0;                  ///< meaningless without reads
  std::uint64_t outside = 0;                     ///< reads outside the window in OP
};

/// A clock whose 0x092C is within this has settled.
inline constexpr std::uint32_t kClockSettledNs = 1000;

struct DcSummary {
  bool reference = false;                                        ///< its clock is the one that is distributed or read
  std::array<std::optional<std::uint32_t>, 4> receive_times_ns;  ///< 0x0900-0x090C, raw
  std::optional<std::uint64_t> receive_time_core_ns;             ///< 0x0918
  FrameNo latched_frame = 0;                                     ///< last read of them
  std::optional<std::int64_t> offset_ns;                         ///< 0x0920
  std::optional<std::uint32_t> delay_ns;                         ///< 0x0928
  std::uint64_t difference_reads = 0;                            ///< of 0x092C
  std::uint32_t difference_last_ns = 0, difference_max_ns = 0;   ///< magnitudes; meaningless without reads
  FrameNo difference_max_frame = 0;
  FrameRef difference_above;  ///< the first read above kClockSettledNs; seen() false: none since the slave was set up
  FrameRef settled;           ///< after it: the first read from which on none is above; seen() false: still above
  std::optional<std::uint16_t> speed_counter_start;
  std::optional<std::int16_t> speed_counter_difference;
  std::optional<std::uint8_t> assignment;  ///< 0x0980 at the end of the capture
  std::optional<std::uint8_t> activation;  ///< 0x0981 at the end of the capture
  /// As the SYNC unit was switched on last.
  FrameRef activated;
  std::optional<std::uint8_t> activated_with;
  std::optional<std::uint64_t> start_time_ns;
  std::optional<std::uint32_t> sync0_cycle_ns, sync1_cycle_ns;
  std::array<std::optional<std::uint8_t>, 2> latch_control, latch_status;
  std::array<std::optional<std::uint64_t>, 4>
      latch_times_ns;  ///< latch 0 positive, negative, latch 1 positive, negative
  std::vector<DcStep> configuration;
  std::uint64_t configuration_left_out = 0;
  std::optional<SyncPhase> phase;
  std::optional<PllSummary> pll;
};

/// The distribution of the system time on the bus.
struct BusDcSummary {
  SlaveId reference = kNoSlave;
  std::uint64_t samples = 0;        ///< times read from the reference clock
  std::uint64_t distributions = 0;  ///< frames with ARMW or FRMW of 0x0910 that it answered, or with BWR
  FrameRef first, last;             ///< of these
  double longest_gap_us = 0;        ///< between two of them, by the capture's stamps
  FrameRef longest_gap_end;
  /// Clocks that were above kClockSettledNs: how many settled, how many did not, and the last that did.
  std::uint64_t settled_clocks = 0, unsettled_clocks = 0;
  SlaveId settled_last = kNoSlave;
  FrameRef settled;
};

}  // namespace ecaudit
