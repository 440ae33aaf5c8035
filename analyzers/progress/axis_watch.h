/// in: the values of one axis, by process data and SDO.  out: what was wanted of it, reached and not reached.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "analyzers/progress/axis_signals.h"
#include "analyzers/progress/axis_view.h"
#include "analyzers/progress/command_check.h"
#include "analyzers/progress/enable_check.h"
#include "analyzers/progress/follow_check.h"
#include "analyzers/progress/setpoint_check.h"

namespace ecaudit::progress {

/// Since when something is so, and when it ended; frames not seen(): it is not, or did not.
struct Span {
  FrameRef since, lost;

  void Begin(const FrameRef& frame) {
    if (!holds()) since = frame;
    lost = {};
  }
  void End(const FrameRef& frame) {
    if (holds()) lost = frame;
  }
  [[nodiscard]] bool ever() const { return since.seen(); }
  [[nodiscard]] bool holds() const { return since.seen() && !lost.seen(); }
};

class AxisWatch {
 public:
  void SetDrive(const device::DriveProfile* drive);

  /// @param part  which part of the process image: an axis may lie in several, and one frame may bring them all
  /// @return whether the values were taken: a frame may come late
  bool OnOutputs(const AxisValues& values, std::uint64_t part, const FrameRef& frame, const SlaveSide& slave);
  bool OnInputs(const AxisValues& values, std::uint64_t part, const FrameRef& frame, const SlaveSide& slave);
  /// A completed transfer of an object with a role.
  void OnSdo(Role role, std::int64_t value, bool download, const FrameRef& frame, const SlaveSide& slave);
  /// See EnableCheck.
  void OnFollowedWithoutRemote() { GetChecks().enable.OnFollowedWithoutRemote(records_); }
  void SetLimit(bool most, std::int64_t value) { (most ? now_.limits.most : now_.limits.least) = value; }
  /// It is the axis of a terminal: its only set point shows in which mode it works.
  void SetTerminal() { terminal_ = true; }
  /// Frames are missing, or the bus starts again: what lasts starts again.
  void Forget();
  /// The capture misses frames: what lasts goes on if the first moment after them is like the last one before.
  void ForgetAtGap();
  /// The capture is over.
  void Finish() { TakeCollected(); }

  /// The same values again would change nothing.
  [[nodiscard]] bool still() const {
    return !outputs_changed_ && !words_changed_ && collected_ == nullptr && shifted_ == nullptr &&
           (checks_ == nullptr || !checks_->active());
  }
  [[nodiscard]] const AxisView& now() const { return now_; }
  [[nodiscard]] const AxisRecords& records() const { return records_; }
  /// Calls `visit(frame)` for each frame that the records, rungs and odd bits name.
  template <class Visit>
  void ForEachFrame(Visit visit) {
    records_.ForEachFrame(visit);
    visit(reserved_control_.frame);
    visit(odd_status_.frame);
    for (Span* const span : {&without_fault_, &voltage_, &enabled_, &mode_}) {
      visit(span->since);
      visit(span->lost);
    }
  }
  [[nodiscard]] const EnableCheck& enable() const { return OfChecks().enable; }
  [[nodiscard]] const CommandCheck& command() const { return OfChecks().command; }
  [[nodiscard]] const FollowCheck& follow() const { return OfChecks().follow; }
  /// A control or status word was seen.
  [[nodiscard]] bool seen() const { return control_seen_ || status_seen_; }
  [[nodiscard]] bool control_seen() const { return control_seen_; }
  [[nodiscard]] bool status_seen() const { return status_seen_; }

  /// The first word in OP with bits that the family's list calls reserved; bits 0: there was none.
  struct Reserved {
    std::uint16_t bits = 0;
    std::uint16_t word = 0;
    FrameRef frame;
    std::optional<std::int8_t> mode;  ///< in which the family reserves them; unset: in each
  };
  [[nodiscard]] const Reserved& reserved_control() const { return reserved_control_; }
  /// Likewise the first status word of a state in OP with bits of another level than the manual binds them to.
  [[nodiscard]] const Reserved& odd_status() const { return odd_status_; }

  /// A word was seen while the slave certainly was in OP.
  [[nodiscard]] bool seen_in_op() const { return seen_in_op_; }

  /// What came before the fault whose first status word is in this frame; null: not known.
  [[nodiscard]] const AxisLead* LeadToFault(FrameNo frame) const {
    for (const auto& [first, lead] : faults_) {
      if (first == frame) return &lead;
    }
    return nullptr;
  }

  /// The last change of the digital inputs (60FDh) before something.
  struct InputChange {
    FrameRef frame;
    std::uint32_t before = 0, after = 0;
  };
  /// What came right before or with the status word in this frame, in which the drive left Operation enabled; null:
  /// nothing did.
  [[nodiscard]] const InputChange* InputsAtDrop(FrameNo frame) const {
    for (const auto& [first, change] : drops_) {
      if (first == frame) return &change;
    }
    return nullptr;
  }

  // Of the ladder.
  [[nodiscard]] const Span& without_fault() const { return without_fault_; }
  [[nodiscard]] const Span& voltage() const { return voltage_; }
  [[nodiscard]] const Span& enabled() const { return enabled_; }
  [[nodiscard]] const Span& mode() const { return mode_; }
  [[nodiscard]] bool lost_unasked() const { return lost_unasked_; }
  /// It went from Operation enabled into Fault or Fault reaction active, the last time that it left it.
  [[nodiscard]] bool lost_by_fault() const { return lost_by_fault_; }
  [[nodiscard]] bool voltage_lost_unasked() const { return voltage_lost_unasked_; }
  [[nodiscard]] FrameNo status_frame() const { return status_frame_; }  ///< of the newest status word
  [[nodiscard]] std::optional<std::uint16_t> error_code() const { return error_code_; }

 private:
  struct Checks {
    EnableCheck enable;
    CommandCheck command;
    SetpointCheck setpoint;
    FollowCheck follow;
    [[nodiscard]] bool active() const {
      return enable.active() || command.active() || setpoint.active() || follow.active();
    }
  };
  /// What one frame brings of an axis in several parts, until another frame comes: its values belong together.
  struct Collected {
    AxisValues outputs, inputs;
    FrameRef outputs_frame, inputs_frame;
    SlaveSide slave;
  };
  /// 6061h by SDO differs from the process data, and the inputs that follow have to confirm it.
  struct Shifted {
    AxisRecord record;
    Lasting after;
  };
  /// What was going on before a capture gap.
  struct Paused {
    AxisView before;
    EnableCheck enable;
    CommandCheck command;
  };
  /// The newest frame of one direction.
  struct Newest {
    FrameNo frame = 0;
    std::uint64_t part = 0;
    bool forgotten = true;  ///< since then
    /// An older frame that came late, or the one that was taken last.
    [[nodiscard]] bool IsLate(std::uint64_t of_part, const FrameRef& of) const {
      return of.number < frame || (of.number == frame && part == of_part);
    }
  };
  /// Which values are looked at: those that changed since the frame before, or all of them; or they wait for those of
  /// other parts.
  enum class Look : std::uint8_t { kChanged, kAll, kLater };

  [[nodiscard]] Look LookAt(Newest& newest, std::uint64_t part, const FrameRef& frame);
  void TakeCollected();
  void TakeOutputs(const AxisValues& values, Look look, const FrameRef& frame, const SlaveSide& slave);
  void TakeDigitalInputs(std::int64_t value, const FrameRef& frame);
  void KeepInputsAtDrop(const FrameRef& frame);
  void TakeInputs(const AxisValues& values, Look look, const FrameRef& frame, const SlaveSide& slave);
  [[nodiscard]] Checks& GetChecks();
  [[nodiscard]] const Checks& OfChecks() const;
  void Side(const SlaveSide& slave);
  void TakeLimits(const AxisValues& values);
  /// Which limit is 0 and acts in the mode of now.
  void FindZeroLimit();
  void FollowShown(std::int64_t value, bool download, const FrameRef& frame);
  void ConfirmShown(const FrameRef& frame);
  void TakeControl(std::int64_t word, const FrameRef& frame);
  void TakeStatus(std::int64_t word, const FrameRef& frame);
  void TakeState(std::uint16_t changed, const FrameRef& frame);
  /// The control word does not ask for Operation enabled, or the master takes the slave out of OP.
  [[nodiscard]] bool AsksToStop() const;
  /// It did so shortly before.
  [[nodiscard]] bool AskedToStop(const FrameRef& frame) const;
  void TakeModes(const AxisValues& values, const FrameRef& frame);
  void AssumeMode(const AxisValues& values);
  void Step(const FrameRef& frame);
  void Resume();
  /// Keeps the values of now for the steps that follow ...
  void Remember();
  /// ... and for some time.
  void RememberForLong();

  void NoteReservedOfMode(std::uint16_t word, const FrameRef& frame);
  static void NoteReserved(Reserved& reserved, std::uint16_t mask, std::uint16_t word, const FrameRef& frame);

  const device::DriveProfile* drive_ = nullptr;
  std::uint16_t reserved_control_mask_ = 0;
  Reserved reserved_control_;
  std::uint16_t state_bits_ = 0;              ///< bits of the status word by which states differ
  bool state_known_ = false;                  ///< now_.state is that of now_.status, by this drive_
  std::uint16_t level_mask_ = 0, level_ = 0;  ///< bits of the status word that the manual binds to a level
  std::uint16_t status_bits_ = 0;             ///< all bits of it that this class looks at
  Reserved odd_status_;
  AxisView now_;
  bool terminal_ = false;
  bool seen_in_op_ = false;
  bool control_seen_ = false, status_seen_ = false, status_mapped_ = false;
  bool outputs_changed_ = false;  ///< since the last step
  bool words_changed_ = true;     ///< control, status, mode, AL state: not only positions
  bool way_changed_ = true;       ///< likewise, and of an enabled drive not only bits of its status word
  FrameRef shown_since_;          ///< 6061h of the process data
  Newest newest_outputs_, newest_inputs_;
  std::unique_ptr<Collected> collected_;  ///< of an axis in several parts that one frame brings
  std::unique_ptr<Shifted> shifted_;      ///< null: nothing differs
  std::unique_ptr<Paused> paused_;        ///< null: no capture gap came since the last moment
  std::bitset<kLimitRoles.size()> limit_is_zero_, limit_mapped_;
  std::optional<device::DriveState> last_state_;
  std::optional<std::uint16_t> error_code_;
  bool lost_unasked_ = false, lost_by_fault_ = false, voltage_lost_unasked_ = false;
  FrameNo status_frame_ = 0;
  Span without_fault_, voltage_, enabled_, mode_;
  std::vector<AxisMoment> recent_;  ///< some of the last 50 ms, oldest first
  TimeNs recent_stays_until_ = 0;   ///< the next time at which recent_ becomes another; empty: at once
  std::vector<std::pair<FrameNo, AxisLead>> faults_;  ///< the first ones
  std::optional<std::uint32_t> inputs_;               ///< 60FDh
  InputChange input_change_;
  std::vector<std::pair<FrameNo, InputChange>> drops_;  ///< the first ones
  std::unique_ptr<Checks> checks_;                      ///< null before the first word
  AxisRecords records_;
};

}  // namespace ecaudit::progress
