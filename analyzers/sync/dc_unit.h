/// in: accesses to the distributed-clock unit 0x0900-0x09FF of one slave.  out: how it is set up (esc-reference 10).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "analyzers/result/dc_summary.h"
#include "decoder/esc/dc_registers.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/esc/register_image.h"
#include "decoder/track/access.h"

namespace ecaudit::sync {

/// The SYNC unit as it stood when it was switched on.
struct SyncSettings {
  FrameRef frame;        ///< that wrote 0x0981, or was the first to show it
  bool written = false;  ///< it was written in this frame, else read
  bool was_off = false;  ///< it is known to have been off before
  esc::SyncActivation activation;
  std::optional<std::uint64_t> start_ns;  ///< 0x0990
  bool start_is_64_bit = false;           ///< else only its low half counts: no more is known, or used by the slave
  std::optional<std::uint32_t> sync0_cycle_ns, sync1_cycle_ns;
  bool start_had_passed = false;  ///< when it was switched on: no pulse comes before the clock wraps
};

/// SYNC0 or SYNC1 was on at the end of a run, and the master had not switched it off when it set the clock for the next
/// one.
struct SyncLeftOn {
  FrameNo on = 0;  ///< the frame that switched it on in the run before, or was the first to show it
  bool on_written = false;
  FrameNo clock_set = 0;  ///< the first write to time, offset or delay while it was on; 0: none yet
  FrameNo off = 0;        ///< the frame that switched it off at last; 0: none did
};

class DcUnit {
 public:
  /// Later steps are counted only.
  static constexpr std::size_t kMaxSteps = 64;
  static constexpr std::size_t kMaxBroadcasts = 12;  ///< of these steps: every slave has the same

  enum class Change : std::uint8_t { kNone, kSwitchedOn, kSwitchedOff };

  /// The slave is met: broadcasts before have left this in its registers.
  void Meet(const esc::RegisterImage& registers);
  /// @param registers the slave's registers, this access included
  /// @return whether the SYNC unit was switched on or off by it
  Change On(const track::SlaveAccess& access, const esc::RegisterImage& registers);

  /// Some register of the unit was read or written by the slave's own address, and it took part.
  [[nodiscard]] bool present() const { return present_; }
  /// 0x0981; unset while nothing shows it.
  [[nodiscard]] const std::optional<esc::SyncActivation>& activation() const { return activation_; }
  /// The last frame that wrote another value to 0x0981 or 0x09A0, or a value while it was unknown; 0: none did.
  [[nodiscard]] FrameNo activation_changed() const { return activation_changed_; }
  [[nodiscard]] FrameNo cycle_changed() const { return cycle_changed_; }
  /// Before the last change of 0x0981: whether it was known.
  [[nodiscard]] bool activation_was_known() const { return was_known_; }
  /// Set while SYNC0 or SYNC1 is being generated.
  [[nodiscard]] const std::optional<SyncSettings>& active() const { return active_; }
  /// SYNC0 is one of those that are.
  [[nodiscard]] bool generates_sync0() const { return active_ && active_->activation.sync0(); }
  /// The clock was past the start time when SYNC was switched on.
  void StartHadPassed();
  /// Cycle of SYNC0 while its pulses can be counted: it is on, and when it began is known. 0: they cannot.
  [[nodiscard]] std::uint32_t pulse_cycle_ns() const { return pulse_cycle_ns_; }
  /// The settings of the last time it was on, since the slave was set up.
  [[nodiscard]] const std::optional<SyncSettings>& last_active() const { return last_active_; }
  /// The same, of whichever run.
  [[nodiscard]] const std::optional<SyncSettings>& activated() const { return activated_; }
  /// Set where the clock was set while the pulses of the run before went on.
  [[nodiscard]] std::optional<SyncLeftOn> left_on() const {
    return left_on_ && left_on_->clock_set != 0 ? left_on_ : std::nullopt;
  }
  /// SYNC0 cycle written by this slave's own address: frame; seen() false when it never was, or was set to 0 since.
  [[nodiscard]] const FrameRef& cycle_configured() const { return cycle_configured_; }
  /// Another SYNC0 cycle that was written while SYNC was on, and not taken back since.
  struct CycleRewritten {
    FrameRef frame;
    std::uint32_t ns = 0;
  };
  [[nodiscard]] const std::optional<CycleRewritten>& cycle_rewritten() const { return cycle_rewritten_; }
  /// Last own read of the system time, and its frame.
  [[nodiscard]] const std::optional<std::uint64_t>& own_time() const { return own_time_; }
  /// What the upper halves of its times hold is known to count. A clock of 32 bit answers reads of 64 with 0 there, and
  /// takes no notice of what is written.
  [[nodiscard]] bool IsWide(const esc::RegisterImage& registers) const {
    const auto features = registers.Value<std::uint8_t>(esc::kEscFeatures);
    return features ? esc::HasWideClock(*features) : upper_half_used_;
  }
  [[nodiscard]] bool own_time_is_64_bit() const { return own_time_wide_; }
  [[nodiscard]] const FrameRef& own_time_frame() const { return own_time_frame_; }
  /// Offset or delay was written by the slave's own address.
  [[nodiscard]] bool adjusted() const { return adjusted_; }

  /// Magnitude of 0x092C as it was read last.
  [[nodiscard]] std::optional<std::uint32_t> last_difference_ns() const {
    return difference_reads_ > 0 ? std::optional(difference_last_) : std::nullopt;
  }
  /// The last read of 0x092C since the slave was set up, and since its offset was written.
  struct Difference {
    std::uint32_t ns = 0;
    FrameNo frame = 0;
    FrameNo offset_written = 0;  ///< the last write to 0x0920 to 0x092B since the slave was set up; 0: none
  };
  [[nodiscard]] std::optional<Difference> difference() const {
    if (difference_frame_ == 0 || difference_frame_ < offset_written_) return std::nullopt;
    return Difference{difference_last_, difference_frame_, offset_written_};
  }
  /// Something of the unit was read or configured by the slave's own address.
  [[nodiscard]] bool touched() const { return present_ || latched_.seen() || activated_; }

  /// Whether the slave takes this write is not known.
  void Doubt(const track::SlaveAccess& access);
  /// The slave is set up again: what SYNC0 does is unknown until it is written or read.
  void BeginAnew();
  /// The capture misses packets: what was off may have been switched on in them.
  void OnGap() {
    if (activation_ && !activation_->active()) activation_.reset();
  }
  /// The slave reached OP: what was left on before hindered nothing.
  void ReachedOp() { left_on_.reset(); }

  [[nodiscard]] DcSummary Summary(const esc::RegisterImage& registers) const;

 private:
  void Remember(const track::SlaveAccess& access);
  void OnRead(const track::SlaveAccess& access);
  void OnWrite(const track::SlaveAccess& access, const esc::RegisterImage& registers);
  void OnDifference(const track::SlaveAccess& access);
  void SawOwnTime(std::uint64_t time, bool wide, const FrameRef& frame);
  Change OnActivation(const track::SlaveAccess& access, const esc::RegisterImage& registers);
  Change Activate(const track::SlaveAccess& access, esc::SyncActivation now, bool written,
                  const esc::RegisterImage& registers);
  void FindPulses();
  [[nodiscard]] SyncSettings SettingsIn(const esc::RegisterImage& registers) const;

  bool present_ = false;
  bool adjusted_ = false;
  bool was_known_ = false;
  std::uint32_t pulse_cycle_ns_ = 0;  ///< follows from active_ and activation_
  FrameNo activation_changed_ = 0, cycle_changed_ = 0;
  std::optional<std::uint32_t> cycle_;  ///< 0x09A0 after the last access to it
  std::optional<esc::SyncActivation> activation_;
  std::optional<SyncSettings> active_, last_active_;
  std::optional<SyncLeftOn> left_on_;
  // For reports: as they were last, whichever run that was.
  std::optional<SyncSettings> activated_;
  std::optional<esc::SyncActivation> told_activation_;
  FrameRef cycle_configured_;
  std::optional<CycleRewritten> cycle_rewritten_;
  std::optional<std::uint64_t> own_time_;
  bool own_time_wide_ = false;    ///< all of it was read
  bool upper_half_used_ = false;  ///< once it was not 0
  FrameRef own_time_frame_;
  std::array<std::optional<std::uint32_t>, 4> receive_times_;
  std::optional<std::uint64_t> receive_time_core_;
  FrameRef latched_;
  std::uint64_t difference_reads_ = 0;
  std::uint32_t difference_last_ = 0, difference_max_ = 0;
  FrameRef difference_max_frame_;
  FrameNo difference_frame_ = 0, offset_written_ = 0;  ///< of the last read and write since the slave was set up
  FrameRef difference_above_, settled_;
  std::vector<DcStep> steps_;
  std::uint64_t steps_left_out_ = 0;
};

}  // namespace ecaudit::sync
