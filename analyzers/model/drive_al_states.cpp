#include "analyzers/model/drive_al_states.h"

#include <algorithm>

namespace ecaudit::model {

bool DriveAlStates::ActsOnControl() const {
  const StateSet possible = al_.possible();
  if (possible.empty()) return true;
  if (drive_->control_word_in.empty()) return possible.contains(static_cast<std::uint8_t>(esc::AlState::OP));
  return std::any_of(drive_->control_word_in.begin(), drive_->control_word_in.end(),
                     [&](esc::AlState state) { return possible.contains(static_cast<std::uint8_t>(state)); });
}

bool DriveAlStates::SurelyActs() const {
  const StateSet possible = al_.possible();
  StateSet acting;
  if (drive_->control_word_in.empty()) acting = StateSet::Of(static_cast<std::uint8_t>(esc::AlState::OP));
  for (const esc::AlState state : drive_->control_word_in) acting.Add(static_cast<std::uint8_t>(state));
  StateSet either = acting;
  either.Add(possible);
  return either == acting;
}

bool DriveAlStates::SurelyDoesNotAct() const {
  if (drive_->control_word_in.empty()) return false;
  const std::uint8_t state = al_.possible().single();
  if (!esc::IsAlState(state) || !al_.SettledIn(static_cast<esc::AlState>(state))) return false;
  return std::none_of(drive_->control_word_in.begin(), drive_->control_word_in.end(),
                      [&](esc::AlState in) { return static_cast<std::uint8_t>(in) == state; });
}

bool DriveAlStates::ShowsStatus() const {
  const StateSet possible = al_.possible();
  if (possible.empty()) return true;
  if (drive_->status_word_in.empty()) {
    return possible.contains(static_cast<std::uint8_t>(esc::AlState::SAFEOP)) ||
           possible.contains(static_cast<std::uint8_t>(esc::AlState::OP));
  }
  return std::any_of(drive_->status_word_in.begin(), drive_->status_word_in.end(),
                     [&](esc::AlState state) { return possible.contains(static_cast<std::uint8_t>(state)); });
}

}  // namespace ecaudit::model
