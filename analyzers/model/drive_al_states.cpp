#include "analyzers/model/drive_al_states.h"

#include <algorithm>

namespace ecaudit::model {

void DriveAlStates::SetFamily(const device::DriveProfile* drive) {
  drive_ = drive;
  acts_in_ = shows_in_ = {};
  if (drive == nullptr) return;
  const auto add = [](StateSet& to, const std::vector<esc::AlState>& states) {
    for (const esc::AlState state : states) to.Add(static_cast<std::uint8_t>(state));
  };
  add(acts_in_, drive->control_word_in);
  if (acts_in_.empty()) add(acts_in_, {esc::AlState::OP});
  add(shows_in_, drive->status_word_in);
  if (shows_in_.empty()) add(shows_in_, {esc::AlState::SAFEOP, esc::AlState::OP});
}

bool DriveAlStates::SurelyDoesNotAct() const {
  if (drive_->control_word_in.empty()) return false;
  const std::uint8_t state = al_.possible().single();
  if (!esc::IsAlState(state) || !al_.SettledIn(static_cast<esc::AlState>(state))) return false;
  return std::none_of(drive_->control_word_in.begin(), drive_->control_word_in.end(),
                      [&](esc::AlState in) { return static_cast<std::uint8_t>(in) == state; });
}

}  // namespace ecaudit::model
