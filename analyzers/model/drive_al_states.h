/// in: the AL state of the slave and the family's manual.  out: whether the drive acts on its control word and keeps
/// its status word up to date.
#pragma once

#include "analyzers/model/al_machine.h"
#include "decoder/device/drive_profile.h"

namespace ecaudit::model {

class DriveAlStates {
 public:
  explicit DriveAlStates(const AlMachine& al) : al_(al) {}

  void SetFamily(const device::DriveProfile* drive);

  // SetFamily() gave a drive.

  /// In one of the states that the slave may be in.
  [[nodiscard]] bool ActsOnControl() const {
    const StateSet possible = al_.possible();
    return possible.empty() || possible.Meets(acts_in_);
  }
  /// In each of them: a request of OP may take seconds.
  [[nodiscard]] bool SurelyActs() const { return al_.possible().IsWithin(acts_in_); }
  /// The manual of the family lists the states in which it acts, and the AL state is known and none of these.
  [[nodiscard]] bool SurelyDoesNotAct() const;
  [[nodiscard]] bool ShowsStatus() const {
    const StateSet possible = al_.possible();
    return possible.empty() || possible.Meets(shows_in_);
  }

 private:
  const AlMachine& al_;
  const device::DriveProfile* drive_ = nullptr;
  StateSet acts_in_, shows_in_;
};

}  // namespace ecaudit::model
