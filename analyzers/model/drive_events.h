/// out of model/drive_unit: commands of the control word, states of the status word, and where the two do
/// not fit. Nothing here is text. `axis` is 0 for the first axis of a slave, which most drives have alone.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "decoder/base/ids.h"
#include "decoder/device/drive_profile.h"

namespace ecaudit::model {

inline constexpr std::uint16_t kControlWord = 0x6040;
inline constexpr std::uint16_t kStatusWord = 0x6041;

/// What an object of the first axis (6000h to 67FFh) is called in another one.
[[nodiscard]] constexpr std::uint16_t ObjectOfAxis(std::uint16_t index, std::uint8_t axis) {
  constexpr unsigned kAxisDistance = 0x800;  // ETG.6010
  return static_cast<std::uint16_t>(index + axis * kAxisDistance);
}

/// Likewise for any object: those before 6000h are the device's, and all axes share them.
[[nodiscard]] constexpr std::uint16_t ObjectForAxis(std::uint16_t index, std::uint8_t axis) {
  constexpr std::uint16_t kFirstOfAxis = 0x6000;
  return index < kFirstOfAxis ? index : ObjectOfAxis(index, axis);
}

/// Transitions of the drive state machine by their CiA 402 numbers, in the order in which they are taken.
struct DrivePath {
  static constexpr std::size_t kMax = 8;
  std::array<std::uint8_t, kMax> numbers{};
  std::uint8_t count = 0;

  void Add(std::uint8_t number) {
    if (count < kMax) numbers[count++] = number;
  }
  [[nodiscard]] bool empty() const { return count == 0; }
};

/// The bits of the control word that the state machine looks at changed.
struct DriveCommanded {
  SlaveId slave = kNoSlave;
  std::uint8_t axis = 0;
  FrameRef frame;  ///< the outbound copy where it is captured
  std::optional<std::uint16_t> before;
  std::uint16_t word = 0;
  std::optional<device::DriveState> state;  ///< last shown
  DrivePath path;                           ///< what the drive has to do; empty: nothing, or the state is not known
  bool by_sdo = false;
  bool inferred = false;  ///< that the drive took it
};

/// Bits of the control word changed that start or hold a motion in a mode (4 to 6, 8), or do something by their edge.
struct DriveBits {
  SlaveId slave = kNoSlave;
  std::uint8_t axis = 0;
  FrameRef frame;
  std::uint16_t before = 0;
  std::uint16_t word = 0;
  std::uint16_t changed = 0;        ///< of these bits
  std::optional<std::int8_t> mode;  ///< that the drive works in, as far as it is known
  bool by_sdo = false;
  bool inferred = false;
};

/// The status word shows another state than before.
struct DriveStateChanged {
  SlaveId slave = kNoSlave;
  std::uint8_t axis = 0;
  FrameRef frame;                          ///< the returned copy where it is captured
  std::optional<device::DriveState> from;  ///< last state that was known; unset for the first one
  FrameNo from_last = 0;                   ///< last frame that showed it
  std::optional<device::DriveState> to;    ///< unset: the word fits no state
  std::uint16_t word = 0;
  std::optional<std::uint16_t> word_before;  ///< the last that showed `from`
  DrivePath path;                  ///< how it got there, states passed unseen included; empty when that is not known
  FrameRef command;                ///< control word that asked for it; not seen() when the drive did it by itself
  std::optional<TimeNs> reaction;  ///< from the control word to this status word
  FrameRef settings_since;  ///< last change of control word or mode; not seen(): not known, because of a capture gap
  bool first_zero = false;  ///< `from` rests on a status word of 0, which may mean that no inputs were valid yet
  bool by_sdo = false;
  bool inferred = false;
};

/// The control word asks for a transition that the state machine does not offer in the state shown.
struct DriveIllegalCommand {
  SlaveId slave = kNoSlave;
  std::uint8_t axis = 0;
  FrameRef frame;
  std::uint16_t before = 0;
  std::uint16_t word = 0;
  device::DriveState state = device::DriveState::kNotReadyToSwitchOn;
  FrameNo state_since = 0;
  bool inferred = false;
};

/// The status word went from one state to another although no path of commanded and automatic transitions leads there.
struct DriveIllegalChange {
  SlaveId slave = kNoSlave;
  std::uint8_t axis = 0;
  FrameRef frame;
  device::DriveState from = device::DriveState::kNotReadyToSwitchOn;
  device::DriveState to = device::DriveState::kNotReadyToSwitchOn;
  FrameNo from_last = 0;
  std::uint16_t word_before = 0;  ///< status words
  std::uint16_t word = 0;
  std::uint16_t control = 0;  ///< control word in force
  FrameNo control_since = 0;
  DrivePath missing;  ///< transitions of the shortest way that were not commanded; empty: there is no way at all
  bool inferred = false;
};

/// A commanded transition did not happen within the limit.
struct DriveNoReaction {
  SlaveId slave = kNoSlave;
  std::uint8_t axis = 0;
  FrameRef frame;  ///< status word that is past the limit
  FrameRef command;
  std::uint16_t word = 0;    ///< control word
  std::uint16_t before = 0;  ///< the control word before it
  std::uint8_t transition = 0;
  device::DriveState state = device::DriveState::kNotReadyToSwitchOn;
  std::uint16_t status = 0;
  std::int64_t waited_ns = 0;
  std::int64_t limit_ns = 0;
  bool inferred = false;
};

/// A control word that enables left the master while the drive does not act on it.
struct DriveCommandOutsideOp {
  SlaveId slave = kNoSlave;
  std::uint8_t axis = 0;
  FrameRef frame;
  std::uint16_t word = 0;
  std::uint8_t al_state = 0;
  bool by_sdo = false;
};

/// 6060h was written, or 6061h shows another mode than before.
struct DriveMode {
  SlaveId slave = kNoSlave;
  std::uint8_t axis = 0;
  FrameRef frame;
  bool shown = false;  ///< 6061h
  std::int8_t value = 0;
  bool by_sdo = false;
  bool inferred = false;
};

/// The warning bit of the status word changed.
struct DriveWarning {
  SlaveId slave = kNoSlave;
  std::uint8_t axis = 0;
  FrameRef frame;
  std::uint16_t word = 0;
  bool set = false;
  bool inferred = false;
};

/// What explains the fault the drive is in, or is about to show.
struct DriveFaultExplained {
  enum class Source : std::uint8_t {
    kEmergency,
    kErrorCode,    ///< an object with the present error code or an entry of the history
    kFaultNumber,  ///< an object with the drive's own number
  };
  SlaveId slave = kNoSlave;
  std::uint8_t axis = 0;
  FrameRef frame;
  FrameRef fault;  ///< status word that showed the fault first
  Source source = Source::kEmergency;
  std::uint16_t object = 0;  ///< where the code was read, in the first axis' numbers; 0: emergency
  std::uint32_t code = 0;
};

}  // namespace ecaudit::model
