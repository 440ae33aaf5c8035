/// in: process data and SDO transfers of one drive.  out: DriveCommanded, DriveStateChanged, ... (drive_events.h).
///
/// Replays the drive state machine of the family's manual (CiA 402, by older name DS402): the control word (6040h)
/// commands transitions, by level or by edge, and the drive takes some by itself; the status word (6041h) shows where
/// it is. The status word that comes back with a control word is older than it, and between two status words several
/// states may have been passed.
///
/// Source: CIA402, state machine; the manuals' chapter 4.4.
#pragma once

#include <cstdint>
#include <optional>

#include "analyzers/model/doubtful_command.h"
#include "analyzers/model/drive_al_states.h"
#include "analyzers/model/drive_events.h"
#include "analyzers/model/drive_faults.h"
#include "analyzers/model/drive_modes.h"
#include "analyzers/model/drive_places.h"
#include "analyzers/model/drive_words.h"
#include "analyzers/model/expected_steps.h"
#include "analyzers/model/given_commands.h"
#include "decoder/base/event_sink.h"
#include "decoder/device/device_description.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::model {

struct ImagePart;
struct ProcessCycle;

/// How long a commanded transition may take (configurable; CiA 402 gives no figure).
struct DriveLimits {
  std::int64_t reaction_ns = 1'000'000'000;
  std::int64_t leaving_operation_ns = 10'000'000'000;  ///< from Operation enabled: the axis may have to stop first
};

class DriveUnit {
 public:
  /// @param al AL state of the slave; @param sink receives the conclusions; both must outlive the unit
  /// @param axis  0 to 7: which axis of the slave it is
  DriveUnit(SlaveId slave, const AlMachine& al, EventSink& sink, std::uint8_t axis = 0)
      : slave_(slave),
        al_(al),
        sink_(sink),
        axis_(axis),
        al_states_(al),
        places_(axis),
        modes_(slave, sink, axis),
        faults_(slave, sink, axis),
        doubtful_(sink) {}

  /// The family's state machine; may change when the identity becomes known. A family that is no drive switches it off.
  void SetFamily(const device::DeviceDescription& family);
  void SetLimits(const DriveLimits& limits) { limits_ = limits; }

  /// @return axes whose control or status word lies in these process data, a bit each
  std::uint8_t OnCycle(const ProcessCycle& cycle);
  void OnSdo(const mailbox::SdoTransfer& transfer);
  /// A download of this object may have been done or not.
  void ForgetObject(std::uint16_t index);
  /// The bus is initialised again: devices may have been without power.
  void OnRunBegan();
  void OnEmergency(const mailbox::Emergency& emergency);
  /// Frames are missing from the capture: commands and states among them.
  void Forget();

  // What is known now, for the report and for rules that report where they could not evaluate.

  /// True when the family has a drive state machine and a control or status word was seen.
  [[nodiscard]] bool seen() const { return control_.seen() || status_.seen(); }
  [[nodiscard]] const DriveControl& control() const { return control_; }
  [[nodiscard]] const DriveStatus& status() const { return status_; }
  [[nodiscard]] const DriveModes& modes() const { return modes_; }
  [[nodiscard]] std::uint8_t axis() const { return axis_; }
  /// State changes that were not evaluated since earlier control words may be missing.
  [[nodiscard]] std::uint64_t unjudged_changes() const { return unjudged_; }
  /// Frames of the process data have no time stamps: limits were not evaluated.
  [[nodiscard]] bool without_time() const { return without_time_; }
  /// It was commanded to go on, and nothing shows whether it is in an AL state in which it does.
  [[nodiscard]] bool may_not_act() const { return unsure_ && !expected_.empty(); }
  /// A command that looks illegal and is not decided when the capture ends: nothing came that makes it legal.
  [[nodiscard]] std::optional<DriveIllegalCommand> undecided_command() const {
    return doubtful_.Undecided(StatusesNeeded());
  }

 private:
  template <bool kWhole>
  [[nodiscard]] bool RepeatInputs(const ProcessCycle& cycle, const DrivePart& part);
  template <bool kWhole>
  [[nodiscard]] bool OutputsRepeat(const ProcessCycle& cycle, const DrivePart& part, bool done) const;
  template <bool kWhole>
  [[nodiscard]] bool Repeat(const ProcessCycle& cycle, const DrivePart& part);
  std::uint8_t Take(const ProcessCycle& cycle, const DrivePart& part);
  void TakeInputs(const ProcessCycle& cycle, const DrivePart& part);
  void TakeOutputs(const ProcessCycle& cycle, const DrivePart& part);
  void OnControlWords(const ProcessCycle& cycle, const DrivePart& part, bool done);
  [[nodiscard]] bool AskedLongAfterInputs(const mailbox::SdoTransfer& transfer) const;
  void OnMode(std::int8_t value, bool shown, const FrameRef& frame, bool by_sdo, bool inferred);

  void OnControlSent(std::uint16_t word, const FrameRef& frame, bool by_sdo);
  void OnControlTaken(std::uint16_t word, const FrameRef& frame, bool by_sdo, bool inferred);
  void Command(std::optional<std::uint16_t> before, std::uint16_t word, const FrameRef& frame, bool by_sdo);
  /// What was commanded so far is not waited for.
  void ExpectNothing();
  void ForgetCommands();
  /// Status words that must show the same state before a command counts as refused.
  [[nodiscard]] unsigned StatusesNeeded() const { return status_.by_sdo ? 1 : 2; }

  void OnStatus(std::uint16_t word, const FrameRef& frame, bool by_sdo, bool inferred);
  void OnChange(DriveStateChanged change);
  [[nodiscard]] bool Explain(DriveStateChanged& change);
  void OnUnexplained(const DriveStateChanged& change);
  void CheckLimits(const FrameRef& frame);

  SlaveId slave_;
  const AlMachine& al_;
  EventSink& sink_;
  const device::DeviceDescription* family_ = nullptr;
  const device::DriveProfile* drive_ = nullptr;  ///< null: no drive
  DriveLimits limits_;
  std::uint8_t axis_;
  DriveAlStates al_states_;
  DrivePlaces places_;
  DriveControl control_;
  DriveStatus status_;
  DriveModes modes_;
  DriveFaults faults_;
  GivenCommands given_;
  ExpectedSteps expected_;
  DoubtfulCommand doubtful_;
  FrameRef settings_since_;  ///< last change of control word or mode requested; not seen(): not known
  bool after_gap_ = false;   ///< no status word was taken since frames were missing
  /// It may not have acted when its status word was seen last: the time limits wait for that.
  bool unsure_ = false;
  bool without_time_ = false;
  std::uint64_t unjudged_ = 0;
};

}  // namespace ecaudit::model
