/// out of sync/: what the synchronisation model concludes. Rules turn these into findings; nothing here is text.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "analyzers/sync/time_base.h"
#include "decoder/base/ids.h"
#include "decoder/base/wrapping.h"
#include "decoder/esc/al.h"
#include "decoder/esc/dc_registers.h"

namespace ecaudit::sync {

/// The SYNC unit of a slave was switched on (0x0981).
struct SyncSwitchedOn {
  SlaveId slave = kNoSlave;
  FrameRef frame;
  bool was_off = false;  ///< it is known that it was off before
  esc::SyncActivation activation;
  std::optional<std::uint64_t> start_ns;  ///< 0x0990
  std::optional<std::uint32_t> sync0_cycle_ns;
  /// System time as it was read last, its frame, and how long before (by the stamps, unset where they are poor).
  std::optional<std::uint64_t> read_time_ns;
  FrameRef read_frame;
  std::optional<TimeNs> since_read_ns;
  TimeNs uncertainty_ns = 0;   ///< of since_read_ns
  bool low_half_only = false;  ///< start or time have 32 bit: only their difference modulo 2^32 counts

  /// How far ahead the start lies, by the time that was read; both must be set. Longer times than kFarNs count as that,
  /// so that what is added to it later fits.
  static constexpr TimeNs kFarNs = TimeNs{1} << 62;
  [[nodiscard]] TimeNs Ahead() const {
    if (low_half_only) {
      const auto low = [](std::uint64_t time) { return static_cast<std::uint32_t>(time & 0xFFFFFFFFU); };
      return static_cast<std::int32_t>(WrappingDifference(low(*start_ns), low(*read_time_ns)));
    }
    return std::clamp(static_cast<TimeNs>(WrappingDifference(*start_ns, *read_time_ns)), -kFarNs, kFarNs);
  }
  /// It is certain that no pulse comes before the clock wraps.
  [[nodiscard]] bool StartHadPassed() const {
    return was_off && !activation.auto_activation() && start_ns && read_time_ns && Ahead() < 0;
  }
};

/// The drive reported by SDO how far its PLL is from where it should be (SYNCACT), while in OP with SYNC0 on.
struct PllMeasured {
  SlaveId slave = kNoSlave;
  FrameRef frame;  ///< of the answer
  std::int64_t actual = 0;
  std::optional<std::int64_t> distance, window, threshold;  ///< SYNCDIST, SYNCWND, PLLTHRESH as far as known
  bool inferred = false;  ///< which object is which parameter is known of a sister family only
  /// Unset where the window is not known. The limits themselves are outside.
  [[nodiscard]] std::optional<bool> inside() const {
    if (!distance || !window) return std::nullopt;
    return *distance - *window < actual && actual < *distance + *window;
  }
};

/// A slave in OP got no outputs for longer than it should.
struct OutputGap {
  enum class End : std::uint8_t {
    kOutputs,  ///< outputs came again
    kFell,     ///< none any more: the slave was seen to have left OP by itself
    kRequest,  ///< none any more: the master requested another state
    kCapture,  ///< none any more: the capture ends
  };
  SlaveId slave = kNoSlave;
  FrameRef before;         ///< the last with outputs, or the one that showed OP where none came since
  bool fed_before = true;  ///< `before` brought outputs
  End end = End::kOutputs;
  FrameRef after;  ///< not seen: kFell
  sync::Interval gap;
  std::optional<TimeNs> uncertainty_ns;  ///< unset: the clock cannot be trusted
  TimeNs nominal_ns = 0;                 ///< median distance of such frames, 0 when there were too few
  std::uint64_t nominal_of = 0;          ///< frames it rests on
  std::uint64_t unreturned = 0;          ///< frames with outputs for it that were sent in between and did not return
  /// The slave left OP by itself in the meantime.
  FrameRef fell;
  esc::AlWord fell_to;
  std::optional<std::uint16_t> fell_code;
  std::optional<std::uint16_t> status_word;  ///< 6041h in the frame before, where it is mapped
};

/// A slave is set up again, or the bus is: what was measured of it since the last time is evaluated now or not at all.
struct SlaveRunEnded {
  SlaveId slave = kNoSlave;
};

/// The outputs of a slave come in another rhythm from here on, by other settings, or no more in OP: how they came since
/// the last time is evaluated now or not at all.
struct RateEnded {
  SlaveId slave = kNoSlave;
};

/// SYNC0 intervals of a slave in OP and the frames that fell into them, where it is not one each.
struct SyncSlotMiss {
  SlaveId slave = kNoSlave;
  FrameRef before, frame;
  std::uint64_t empty = 0;  ///< intervals without a frame between the two; 0: both fell into the same interval
  /// Frames from `before` to `frame`, without `before`, where it is certain only of all of them together: they crept
  /// over a pulse. 0: the two follow each other.
  std::uint64_t crept = 0;
  std::uint32_t cycle_ns = 0;
  TimeNs phase_ns = 0;  ///< of `frame`: since the SYNC0 before it
  TimeNs uncertainty_ns = 0;
  bool by_stamps =
      false;  ///< the DC time was in another frame of the cycle; the stamps show how much later this one came
  std::uint64_t unreturned = 0;  ///< as in OutputGap
};

/// Process data of a slave in OP without SYNC0 that came late, early or not at all, for families with a jitter limit.
struct ArrivalOff {
  SlaveId slave = kNoSlave;
  FrameRef before, frame;
  TimeNs deviation_ns = 0;    ///< of `frame` from where the cycles so far put it; positive: late
  std::uint64_t missing = 0;  ///< cycles without process data between the two
  std::uint64_t cycle = 0;    ///< ordinal of the cycle that `frame` counts for
  TimeNs cycle_ns = 0;        ///< mean so far
  sync::TimeBase base = sync::TimeBase::kNone;
  std::optional<TimeNs> uncertainty_ns;
  std::uint64_t unreturned = 0;  ///< as in OutputGap
};

}  // namespace ecaudit::sync
