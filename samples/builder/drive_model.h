/// A drive behind the process data: DS402 state machine (AKD manual 4.4) and external latches (4.11). It works on the
/// objects of the dictionary: 6040h, 60C1h:1, 20A4h in; 6041h, 6063h, 60F4h, 20A0h-20A3h, 20A5h out.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "decoder/base/ids.h"
#include "samples/builder/object_dictionary.h"

namespace ecaudit::samples {

enum class DriveState : std::uint8_t {
  kSwitchOnDisabled,
  kReadyToSwitchOn,
  kSwitchedOn,
  kOperationEnabled,
  kQuickStopActive,
  kFaultReactionActive,
  kFault,
};

class DriveModel {
 public:
  /// One pass of the drive: reads the commanded objects, writes the actual ones.
  /// @param active  the slave is in OP; else the control word is not looked at
  void Run(TimeNs now, bool active, ObjectDictionary& objects);

  /// A state change becomes visible this long after its command.
  void set_reaction_time(TimeNs ns) { reaction_time_ = ns; }
  /// At `at` the drive goes through fault reaction to fault.
  void FaultAt(TimeNs at) { fault_at_ = at; }
  /// An edge at a latch input: latch 0-3 = 1 rising, 1 falling, 2 rising, 2 falling.
  void LatchEdgeAt(TimeNs at, int latch, std::int32_t position) { edges_.push_back({at, latch, position}); }
  /// What latches have captured is gone with the next pass, although they are still armed.
  void DropLatched() { drops_latched_ = true; }
  /// True: the acknowledge of the latch status word does not follow the selector.
  void set_latch_acknowledge_stuck(bool stuck) { acknowledge_stuck_ = stuck; }
  /// The state bits that the status word shows instead of those of its state, until it is told otherwise.
  void ShowInstead(std::optional<std::uint16_t> bits) { shown_instead_ = bits; }
  [[nodiscard]] DriveState state() const { return state_; }

 private:
  struct Edge {
    TimeNs at = 0;
    int latch = 0;
    std::int32_t position = 0;
  };

  void RunStates(TimeNs now, bool active, std::uint16_t control);
  void RunLatches(TimeNs now, bool active, ObjectDictionary& objects);

  DriveState state_ = DriveState::kSwitchOnDisabled;
  DriveState wanted_ = DriveState::kSwitchOnDisabled;
  TimeNs wanted_since_ = 0;
  TimeNs reaction_time_ = 2'000'000;
  TimeNs fault_at_ = 0;
  std::uint16_t last_control_ = 0;
  std::optional<std::uint16_t> shown_instead_;
  std::vector<Edge> edges_;
  std::array<bool, 4> armed_{};
  std::uint16_t valid_ = 0;
  bool acknowledge_stuck_ = false;
  bool drops_latched_ = false;
};

}  // namespace ecaudit::samples
