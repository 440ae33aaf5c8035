/// in: control words and states of a drive.  out: the transitions that are commanded and not shown yet.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "analyzers/model/drive_events.h"
#include "decoder/device/drive_profile.h"

namespace ecaudit::model {

class ExpectedSteps {
 public:
  /// A transition that is commanded and not seen yet.
  struct Step {
    std::uint8_t number = 0;
    device::DriveState from = device::DriveState::kNotReadyToSwitchOn;
    device::DriveState to = device::DriveState::kNotReadyToSwitchOn;
    FrameRef command;
    std::uint16_t before = 0;  ///< control words
    std::uint16_t word = 0;
  };

  [[nodiscard]] bool empty() const { return count_ == 0; }
  [[nodiscard]] const Step& next() const { return steps_[0]; }
  void Clear() { count_ = 0; }

  /// The word commands something in this state: steps expected before are dropped.
  /// @return the transitions that it commands
  DrivePath Begin(const device::DriveProfile& drive, device::DriveState from, std::uint16_t before, std::uint16_t word,
                  const FrameRef& frame);
  /// The word commands nothing in the state shown, which may be older. The word continues after the last step in whose
  /// state it commands something; later steps are dropped.
  /// @return the transitions that it commands
  DrivePath GoOn(const device::DriveProfile& drive, std::uint16_t before, std::uint16_t word, const FrameRef& frame);
  /// The drive takes commanded steps: they are expected no longer, and `change` gets path and command.
  /// @return false where the change is none of the steps
  [[nodiscard]] bool Fulfil(DriveStateChanged& change);

  /// From when on the drive has time for the next step.
  [[nodiscard]] const FrameRef& since() const { return since_; }
  void WaitFrom(const FrameRef& frame) { since_ = frame; }

 private:
  void Add(const device::DriveProfile& drive, device::DriveState from, std::uint16_t before, std::uint16_t word,
           const FrameRef& frame);
  [[nodiscard]] DrivePath PathFrom(std::size_t first) const;

  std::vector<Step> steps_;  // empty until it is needed: most slaves are no drives
  std::size_t count_ = 0;
  FrameRef since_;
};

}  // namespace ecaudit::model
