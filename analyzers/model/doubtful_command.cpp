#include "analyzers/model/doubtful_command.h"

#include "analyzers/model/drive_paths.h"

namespace ecaudit::model {

void DoubtfulCommand::Begin(const DriveIllegalCommand& command) {
  command_ = command;
  statuses_ = 0;
  going_down_ = false;
}

void DoubtfulCommand::OnWord(const device::DriveProfile& drive, std::uint16_t word, unsigned needed) {
  if (!command_) return;
  const int rank = RankOf(drive, word);
  const bool disables = RankOf(drive, command_->word) == 2 &&
                        (drive.CommandedAnywhere(command_->before, command_->word) & TransitionBit(5)) != 0;
  if (disables && rank == 1) {
    going_down_ = true;
  } else if (going_down_ && rank == 0) {
    command_.reset();
  } else {
    Confirm(needed);
  }
}

void DoubtfulCommand::OnState(const device::DriveProfile& drive, device::DriveState state,
                              std::optional<std::uint16_t> control, std::uint16_t mask) {
  if (!command_ || going_down_) return;
  const std::uint16_t word = command_->word;
  const bool in_force = control && ((*control ^ word) & mask) == 0;
  if (LevelOf(state) >= RankOf(drive, word) || (in_force && drive.Commanded(state, word, word) != 0)) command_.reset();
}

void DoubtfulCommand::OnSameState(const FrameRef& frame, std::int64_t reaction_ns, unsigned needed) {
  if (!command_) return;
  ++statuses_;
  const FrameRef& given = command_->frame;
  const bool late = frame.has_time && given.has_time && frame.time - given.time > reaction_ns;
  if (late && !going_down_) Confirm(needed);
}

void DoubtfulCommand::Confirm(unsigned needed) {
  if (statuses_ >= needed) sink_.Publish(*command_);
  command_.reset();
}

std::optional<DriveIllegalCommand> DoubtfulCommand::Undecided(unsigned needed) const {
  if (!command_ || statuses_ < needed || going_down_) return std::nullopt;
  return command_;
}

}  // namespace ecaudit::model
