/// in: process data and SDO transfers of one drive.  out: DriveCommanded, DriveStateChanged, ... (drive_events.h).
///
/// Replays the drive state machine of the family's manual (CiA 402, by older name DS402): the control word (6040h)
/// commands transitions, by level or by edge, and the drive takes some by itself; the status word (6041h) shows where
/// it is. The status word that comes back with a control word is older than it, and between two status words several
/// states may have been passed.
///
/// Source: CIA402, state machine; the manuals' chapter 4.4.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "analyzers/model/al_machine.h"
#include "analyzers/model/drive_events.h"
#include "analyzers/model/still_cycle.h"
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
      : slave_(slave), al_(al), sink_(sink), axis_(axis) {}

  /// The family's state machine; may change when the identity becomes known. A family that is no drive switches it off.
  void SetFamily(const device::DeviceDescription& family);
  void SetLimits(const DriveLimits& limits) { limits_ = limits; }

  /// @param watched gets the words on which being still rests
  Still OnCycle(const ProcessCycle& cycle, StillCycle& watched);
  /// A cycle like one that left the unit at Still::kCounts.
  void Repeat(const ProcessCycle& cycle);
  /// Repeat() was not called so often.
  void OnSkipped(std::uint64_t count) {
    if (!state_ && is_without_state_) without_state_.words += count;
  }
  void OnSdo(const mailbox::SdoTransfer& transfer);
  /// A download of this object may have been done or not.
  void ForgetObject(std::uint16_t index);
  /// The bus is initialised anew: devices may have been without power.
  void OnRunBegan();
  void OnEmergency(const mailbox::Emergency& emergency);
  /// Frames are missing from the capture: commands and states among them.
  void Forget();

  // What is known now, for the report and for rules that say where they could not judge.

  /// True when the family has a drive state machine and a control or status word was seen.
  [[nodiscard]] bool seen() const { return control_seen_ || status_seen_; }
  [[nodiscard]] bool status_seen() const { return status_seen_; }
  [[nodiscard]] bool control_seen() const { return control_seen_; }
  [[nodiscard]] std::optional<device::DriveState> state() const { return state_; }
  [[nodiscard]] std::optional<std::uint16_t> status_word() const { return status_; }
  [[nodiscard]] std::optional<std::uint16_t> control_word() const { return control_; }
  [[nodiscard]] std::optional<std::int8_t> mode_requested() const { return mode_requested_; }
  [[nodiscard]] std::optional<std::int8_t> mode_shown() const { return mode_shown_; }
  [[nodiscard]] bool status_by_sdo() const { return status_by_sdo_; }
  [[nodiscard]] std::uint8_t axis() const { return axis_; }
  /// Axes whose control or status word lies in these process data, a bit each.
  [[nodiscard]] std::uint8_t AxesIn(const ProcessCycle& cycle);
  /// Several mapped copies of 6040h differed, so that the command was not known.
  [[nodiscard]] std::uint64_t ambiguous_controls() const { return ambiguous_; }
  /// State changes that were not judged since earlier control words may be missing.
  [[nodiscard]] std::uint64_t unjudged_changes() const { return unjudged_; }
  /// Frames of the process data have no time stamps: limits were not judged.
  [[nodiscard]] bool without_time() const { return without_time_; }
  /// It was told to go on, and nothing shows whether it is in an AL state in which it does.
  [[nodiscard]] bool may_not_act() const { return unsure_ && expected_count_ > 0; }
  /// A command that looks illegal and is not decided when the capture ends: nothing came that makes it legal.
  [[nodiscard]] std::optional<DriveIllegalCommand> undecided_command() const;
  /// The last run of status words that fit no state of the family.
  struct WithoutState {
    FrameRef first, last;
    std::uint64_t words = 0;  ///< 0: there was none
    std::uint16_t word = 0;   ///< the first of them
    std::optional<device::DriveState> before;
    FrameNo before_last = 0;  ///< last frame that showed the state before
    bool inferred = false;
  };
  [[nodiscard]] const WithoutState& without_state() const { return without_state_; }

 private:
  struct Place {
    std::uint32_t bit = 0;
    std::uint16_t bits = 0;
  };
  /// Where the objects of the state machine lie in one kind of datagram.
  struct Places {
    std::uint64_t serial = 0;  ///< of the part; 0: unused
    bool known = false;        ///< at least one object is mapped
    std::uint8_t axes = 0;     ///< whose control or status word is, a bit each
    std::uint8_t controls = 0;
    std::array<Place, 4> control{};
    std::optional<Place> status, mode, mode_shown, error_code;
    std::uint16_t error_object = 0;  ///< which object error_code is, in the first axis' numbers
  };
  /// A transition that is commanded and not seen yet.
  struct Expected {
    std::uint8_t number = 0;
    device::DriveState from = device::DriveState::kNotReadyToSwitchOn;
    device::DriveState to = device::DriveState::kNotReadyToSwitchOn;
    FrameRef command;
    std::uint16_t before = 0;
    std::uint16_t word = 0;
  };
  struct GivenCommand {
    std::uint32_t transitions = 0;
    FrameRef frame;
    std::uint16_t word = 0;
  };
  struct Candidate {
    DriveIllegalCommand command;
    unsigned statuses = 0;    ///< status words since that show the same state
    bool going_down = false;  ///< Shutdown followed: it may be the first step of a switch-off sequence
  };

  const Places& PlacesOf(const ImagePart& part);
  [[nodiscard]] Still InputsRepeat(const Places& places, ByteSpan data, StillCycle& watched) const;
  [[nodiscard]] Still OutputsRepeat(const Places& places, ByteSpan data, bool done, StillCycle& watched) const;
  Still OnInputs(const ProcessCycle& cycle, const Places& places, StillCycle& watched);
  Still OnOutputs(const ProcessCycle& cycle, const Places& places, StillCycle& watched);
  void OnControlWords(const ProcessCycle& cycle, const Places& places, bool done);
  [[nodiscard]] bool AskedLongAfterInputs(const mailbox::SdoTransfer& transfer) const;
  [[nodiscard]] bool ActsOnControl() const;
  [[nodiscard]] bool SurelyActs() const;
  [[nodiscard]] bool ShowsStatus() const;
  [[nodiscard]] int Rank(std::uint16_t word) const;
  /// The mapped object holds the present error code.
  /// @param object  index and subindex, as in ImagePart::Place
  [[nodiscard]] bool MapsErrorCode(std::uint32_t object, std::uint16_t bits) const;
  /// What the object is called in the first axis' numbers; 0: it is another axis'.
  [[nodiscard]] std::uint16_t InFirstAxis(std::uint16_t index) const;

  void OnControlSent(std::uint16_t word, const FrameRef& frame, bool by_sdo);
  void OnControlTaken(std::uint16_t word, const FrameRef& frame, bool by_sdo, bool inferred);
  void OnControlMaybeTaken(std::uint16_t word, const FrameRef& frame);
  void Command(std::optional<std::uint16_t> before, std::uint16_t word, const FrameRef& frame, bool by_sdo, bool rises);
  void FollowCandidate(std::uint16_t word);
  void ConfirmCandidate();
  [[nodiscard]] unsigned StatusesNeeded() const;
  void AddGiven(std::uint32_t transitions, std::uint16_t word, const FrameRef& frame);
  void Expect(device::DriveState from, std::uint16_t before, std::uint16_t word, const FrameRef& frame);

  void OnStatus(std::uint16_t word, const FrameRef& frame, bool by_sdo, bool inferred);
  void CountWithoutState(const FrameRef& frame);
  void OnState(std::optional<device::DriveState> to, const FrameRef& frame, bool inferred);
  void JudgeChange(DriveStateChanged& change);
  [[nodiscard]] bool WasExpected(DriveStateChanged& change);
  [[nodiscard]] FrameRef CommandOf(const DrivePath& path, std::uint32_t given) const;
  void TellIllegal(const DriveStateChanged& change, std::uint32_t given);
  void CheckLimits(const FrameRef& frame);
  void OnFault(const FrameRef& frame);
  /// @param object  where the code was read, in the first axis' numbers; 0: emergency
  void Explain(DriveFaultExplained::Source source, std::uint16_t object, std::uint32_t code, const FrameRef& frame);
  void OnFaultObject(const mailbox::SdoTransfer& transfer, const FrameRef& frame);
  void OnMode(std::int8_t value, bool shown, const FrameRef& frame, bool by_sdo, bool inferred);
  [[nodiscard]] std::optional<DrivePath> FindPath(device::DriveState from, device::DriveState to,
                                                  std::uint32_t available) const;
  void UseUp(const DrivePath& path);
  [[nodiscard]] std::uint32_t GivenSince(const FrameRef& last, bool& all) const;

  SlaveId slave_;
  const AlMachine& al_;
  EventSink& sink_;
  const device::DeviceDescription* family_ = nullptr;
  const device::DriveProfile* drive_ = nullptr;  ///< null: no drive
  DriveLimits limits_;
  std::uint8_t axis_;
  std::uint16_t control_mask_ = 0;  ///< bits of the control word that command transitions

  // Empty until they are needed: most slaves are no drives.
  static constexpr std::size_t kPlaces = 4;
  std::vector<Places> places_;
  std::size_t next_places_ = 0;

  // Control word.
  bool control_seen_ = false;
  bool control_mapped_ = false;
  std::optional<std::uint16_t> sent_;     ///< as the master sent it last
  std::optional<std::uint16_t> control_;  ///< as the drive took it last
  FrameRef control_since_;
  FrameRef settings_since_;  ///< last change of control word or mode requested; not seen(): not known
  bool control_inferred_ = false;
  bool acts_ = false;           ///< the drive acted on control_
  bool unsure_ = false;         ///< maybe not, when its status word was seen last: what it was told waits for that
  bool history_whole_ = false;  ///< no control word that may still act was given before the first one seen
  FrameRef first_control_;
  std::uint64_t ambiguous_ = 0;
  static constexpr std::size_t kGiven = 8;
  std::vector<GivenCommand> given_;  ///< the newest, a ring
  std::size_t given_count_ = 0;      ///< ever given
  std::size_t used_up_ = 0;          ///< of these: the drive took what they command, and they command nothing more
  std::vector<Expected> expected_;
  std::size_t expected_count_ = 0;
  FrameRef expected_since_;
  std::optional<Candidate> candidate_;

  // Status word.
  bool status_seen_ = false;
  bool status_mapped_ = false;
  bool status_by_sdo_ = false;
  std::optional<std::uint16_t> status_;
  std::optional<device::DriveState> state_;       ///< as shown now; unset: the word fits none
  std::optional<device::DriveState> last_state_;  ///< last that was known
  bool last_was_zero_ = false;
  bool behind_hole_ = false;  ///< no status word since frames were missing
  FrameRef state_since_;
  WithoutState without_state_;
  bool is_without_state_ = false;
  FrameRef status_last_;      ///< last status word
  FrameRef last_state_seen_;  ///< last status word that showed last_state_
  std::uint16_t last_state_word_ = 0;
  bool without_time_ = false;
  std::uint64_t unjudged_ = 0;

  // Modes, warning, fault.
  std::optional<std::int8_t> mode_requested_, mode_shown_;
  std::array<bool, 2> mode_of_run_before_{};  ///< 6060h, 6061h: to be told again
  std::optional<std::uint16_t> error_code_;   ///< as the inputs show it
  std::uint16_t error_object_ = 0;
  FrameRef fault_;  ///< status word that showed the fault the drive is in; not seen(): it is in none
  std::optional<mailbox::EmergencyData> emergency_;  ///< last one that tells a fault
  FrameRef emergency_frame_;
};

}  // namespace ecaudit::model
