/// The drive state machine (CiA 402, by older name DS402) as a family's manual describes it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "decoder/device/al_description.h"
#include "decoder/device/latch_description.h"
#include "decoder/device/object_bits.h"
#include "decoder/device/object_dictionary.h"

namespace ecaudit::device {

enum class DriveState : std::uint8_t {
  kNotReadyToSwitchOn,
  kSwitchOnDisabled,
  kReadyToSwitchOn,
  kSwitchedOn,
  kOperationEnabled,
  kQuickStopActive,
  kFaultReactionActive,
  kFault,
};

/// "Switched on"
[[nodiscard]] std::string_view DriveStateName(DriveState state);

/// A state is shown when (status word & mask) == value.
struct StatusPattern {
  std::uint16_t mask = 0;
  std::uint16_t value = 0;
  std::string note;
  [[nodiscard]] bool Matches(std::uint16_t status_word) const { return (status_word & mask) == value; }
};

struct DriveStateRow {
  DriveState state = DriveState::kNotReadyToSwitchOn;
  StatusPattern printed;            ///< as in the manual
  std::vector<StatusPattern> also;  ///< accepted besides, with the reason
  bool enabled = false;             ///< the power stage is enabled in it
  /// The bit of the control word whose rising edge leaves the state by the description in the manual, where the table
  /// of commands prints a level.
  std::optional<std::uint8_t> edge_bit;
  std::string meaning;
  std::string note;
  std::string source;
};

/// One edge of the state diagram, by its CiA 402 number.
struct DriveTransition {
  std::uint8_t number = 0;
  /// Unset for transition 0 (power-on) and 13 (from every state with a fault).
  std::optional<DriveState> from;
  DriveState to = DriveState::kNotReadyToSwitchOn;
  bool automatic = false;  ///< the drive goes there by itself
  bool optional = false;   ///< not every drive has it
  Basis basis = Basis::kPrinted;
  std::string note;
  std::string source;
};

/// What the control word must look like to command transitions. Bits that the manual marks irrelevant are outside
/// `mask`.
struct DriveCommand {
  std::string name;
  std::vector<std::uint8_t> transitions;
  bool automatic = false;     ///< listed in the manual, though the drive does it by itself
  std::uint16_t mask = 0;     ///< bits that matter
  std::uint16_t value = 0;    ///< their levels; after the edge, for bits that need one
  std::uint16_t rising = 0;   ///< bits that must have been 0 before
  std::uint16_t falling = 0;  ///< bits that must have been 1 before
  std::string variant;        ///< "a", "b" where the manual has two rows for one transition
  std::string printed;        ///< bits 7, 3, 2, 1, 0 as printed where read otherwise ("1XXXX"); else empty
  std::string note;
  std::string source;

  /// @param before control word before the change, @param after control word now
  [[nodiscard]] bool Matches(std::uint16_t before, std::uint16_t after) const {
    return (after & mask) == value && (before & rising) == 0 && (before & falling) == falling;
  }
};

/// What one edge of one control word bit does (Pilz).
struct EdgeAction {
  bool rising = false;
  std::uint8_t bit = 0;
  std::string action;
  std::string condition;
  std::string note;
  std::string source;
};

/// One bit of the control word or status word.
struct WordBit {
  std::uint8_t bit = 0;
  std::string name;
  std::string meaning;
  std::optional<std::uint8_t> level;  ///< the manual binds the bit to this level
  BitSign sign = BitSign::kNone;      ///< of the status word: 1 shows it, beside the states
  std::uint16_t reserved = 0;         ///< the bit as a mask if the manual calls it reserved; else 0
  std::string note;
  std::string source;
};

/// Control word bits 4 to 6 in one mode of operation.
struct ModeBits {
  std::int8_t mode = 0;
  std::string name;
  std::string bit4;
  std::string bit5;
  std::string bit6;
  std::uint16_t reserved = 0;  ///< those of the three bits that the manual calls reserved in this mode
  std::string note;
  std::string source;
};

/// A value of 6060h.
struct OperationMode {
  std::int8_t value = 0;
  std::string name;
  std::optional<std::int32_t> opmode;          ///< DRV.OPMODE that goes with it
  std::optional<std::int32_t> cmdsource;       ///< DRV.CMDSOURCE that goes with it
  std::optional<std::int32_t> printed_opmode;  ///< where print is read otherwise
  std::optional<std::uint8_t> start_bit;  ///< of the control word: its rising edge starts the motion; unset: as CiA 402
  std::vector<ObjectAddress> setpoints;   ///< its set point is one of these objects; empty: not documented, or none
  std::string note;
  std::string source;
};

/// What a value of a fault object is.
enum class FaultValue : std::uint8_t {
  kErrorCode,      ///< the error code of the present fault
  kErrorHistory,   ///< an entry of the error history; its lower 16 bits are the error code
  kFaultNumber,    ///< the drive's own number: with `prefix` the `id` of an emergency code
  kWarningNumber,  ///< likewise of a warning
};

/// "error code", as in profiles.
[[nodiscard]] std::string_view FaultValueName(FaultValue kind);

/// An object from which the master can read the reason of a fault.
struct FaultObject {
  std::uint16_t index = 0;  ///< of the first axis
  std::uint8_t subindex = 0;
  std::uint8_t last_subindex = 0;
  FaultValue kind = FaultValue::kErrorCode;
  std::uint8_t bits = 16;  ///< values of another length are ignored
  std::string prefix;      ///< "F" where fault number 401 is called F401
  Basis basis = Basis::kPrinted;
  std::string note;
  std::string source;

  [[nodiscard]] bool Holds(std::uint16_t at_index, std::uint8_t at_subindex) const {
    return index == at_index && at_subindex >= subindex && at_subindex <= last_subindex;
  }
};

struct DriveProfile {
  std::vector<DriveStateRow> states;  ///< in the order in which patterns are tried
  std::vector<DriveTransition> transitions;
  std::vector<DriveCommand> commands;
  std::vector<EdgeAction> edge_actions;
  std::vector<WordBit> control_bits;
  std::vector<WordBit> status_bits;
  std::vector<ModeBits> mode_bits;
  std::vector<OperationMode> modes;
  bool modes_complete = false;  ///< the manual lists all supported modes
  /// The vendor's names of the parameters in OperationMode::opmode and ::cmdsource.
  std::string opmode_parameter, cmdsource_parameter;
  /// AL states in which the drive acts on the control word and updates the status word; empty: not documented.
  std::vector<esc::AlState> control_word_in;
  std::vector<esc::AlState> status_word_in;
  /// Those of the standard and the family's own, each object in one row.
  std::vector<FaultObject> fault_objects;
  /// Objects of CiA 402 with their standard names and types, sorted by (index, subindex).
  std::vector<DictionaryObject> objects;
  std::string note;
  std::string source;

  /// The state a status word shows; nothing when it fits no pattern.
  [[nodiscard]] std::optional<DriveState> StateOf(std::uint16_t status_word) const;
  /// The bits of the status word by which states differ.
  [[nodiscard]] std::uint16_t StateBits() const;
  /// Null where the manual does not describe it.
  [[nodiscard]] const DriveStateRow* FindState(DriveState state) const;
  /// The word shows a state in which the power stage is enabled.
  [[nodiscard]] bool ShowsEnabled(std::uint16_t status_word) const;
  /// Bit n set: transition n leaves `state` and the change of the control word commands it. 0: nothing to do, which is
  /// also what a control word that keeps the present state gives (see CommandedAnywhere()).
  [[nodiscard]] std::uint32_t Commanded(DriveState state, std::uint16_t before, std::uint16_t after) const;
  /// Bit n set: the control word commands transition n in the state that transition n leaves.
  [[nodiscard]] std::uint32_t CommandedAnywhere(std::uint16_t before, std::uint16_t after) const;
  /// A transition from one state to the other, or null. Transition 13 is found from every state but the fault states.
  [[nodiscard]] const DriveTransition* Find(DriveState from, DriveState to) const;
  [[nodiscard]] const DriveTransition* Find(std::uint8_t number) const;
  [[nodiscard]] const OperationMode* FindMode(std::int8_t value) const;
  /// The row of this object, or null if it holds no reason of a fault.
  [[nodiscard]] const FaultObject* FindFaultObject(std::uint16_t index, std::uint8_t subindex) const;
};

}  // namespace ecaudit::device
