/// in: an axis, moment by moment.  out: what starts its motion and never comes, although a motion is wanted.
///
/// Wanting a motion: the set point of some mode changes while the axis is enabled, and not as a copy of the actual
/// value; in a mode that is not known one that goes on. Homing that is selected may wait for an operator. What starts
/// later after all was only waited for.
///
/// Source: CIA402, modes of operation: profile position (bits 4, 5, 12), homing (bit 4), halt (bit 8).
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "analyzers/progress/axis_view.h"
#include "analyzers/progress/lasting.h"

namespace ecaudit::progress {

class CommandCheck {
 public:
  void Step(const AxisView& now, AxisRecords& out);
  void Forget();
  /// As EnableCheck's.
  [[nodiscard]] bool active() const {
    return Lasting::AnyActive(start_missing_, start_stands_, unacknowledged_, halt_, ramp_bits_, overwritten_, no_mode_,
                              not_mapped_);
  }
  /// More changes of the set points add nothing new.
  [[nodiscard]] bool settled() const;

  /// The first moment at which the enabled axis was commanded to move; not seen(): it never was.
  [[nodiscard]] const FrameRef& commanded() const { return commanded_; }
  /// The last moment at which it was.
  [[nodiscard]] const FrameRef& last_commanded() const { return last_commanded_; }
  /// Where settled(): nothing changed but values.
  void GoesOn(const AxisView& now);
  /// A motion was wanted, whether or not anything started it.
  [[nodiscard]] bool wanted() const { return wanted_; }
  /// Set points do not reach the drive as objects of CiA 402.
  [[nodiscard]] bool without_setpoint() const { return without_setpoint_; }

 private:
  struct Setpoint {
    std::optional<std::int64_t> last;
    std::uint64_t changes = 0;  ///< while enabled in this mode
    FrameRef changed;           ///< last
    FrameRef first_changed;     ///< since enabled
  };

  void FollowSetpoints(const AxisView& now);
  void FollowPosition(const AxisView& now);
  [[nodiscard]] bool IsCopy(const AxisView& now, std::int64_t target) const;
  void BeginEnabled();
  /// The axis is commanded, since then at the latest.
  void Goes(const FrameRef& since, const FrameRef& frame);
  [[nodiscard]] Quantity Moving() const;
  void Start(const AxisView& now, std::int8_t mode, AxisRecords& out);
  void Handshake(const AxisView& now, AxisRecords& out);
  [[nodiscard]] bool Stands(const AxisView& now) const;
  [[nodiscard]] bool Rests(const AxisView& now, Quantity moving) const;
  void RampBits(const AxisView& now, AxisRecords& out);
  void Halt(const AxisView& now, std::int8_t mode, AxisRecords& out);
  void Mode(const AxisView& now, AxisRecords& out);
  [[nodiscard]] const Setpoint& Of(Quantity quantity) const {
    return setpoints_[static_cast<std::size_t>(quantity) - 1];
  }

  std::array<Setpoint, kQuantityCount> setpoints_;
  std::array<std::optional<std::int64_t>, 3>
      positions_;  ///< actual values, newest first, each other than the one before
  std::optional<std::int64_t> target_from_, actual_from_;  ///< positions when it was enabled in this mode
  bool ramp_seen_ = false;                                 ///< velocity mode: bits 4 to 6 were 1 since it was enabled
  std::optional<std::int8_t> mode_;
  bool enabled_ = false;
  bool enabling_seen_ = false;
  std::uint64_t starts_ = 0;      ///< edges of bit 4 in this mode, while enabled
  std::uint64_t all_starts_ = 0;  ///< in the capture
  FrameRef last_start_;
  bool never_without_halt_ = false;  ///< since it was enabled
  bool acknowledged_before_ = false;
  bool waits_acknowledge_ = false;
  Lasting start_missing_, start_stands_, unacknowledged_, halt_, ramp_bits_, overwritten_, no_mode_, not_mapped_;
  FrameRef commanded_, last_commanded_;
  bool goes_ = false;  ///< the axis is commanded now
  bool wanted_ = false;
  bool without_setpoint_ = false;
};

}  // namespace ecaudit::progress
