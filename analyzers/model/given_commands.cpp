#include "analyzers/model/given_commands.h"

#include <algorithm>

#include "analyzers/model/drive_paths.h"

namespace ecaudit::model {

void GivenCommands::Add(std::uint32_t transitions, std::uint16_t word, const FrameRef& frame) {
  if (count_ > 0) {
    const Command& last = given_[(count_ - 1) % given_.size()];
    if (last.word == word && last.transitions == transitions) return;
  }
  if (given_.empty()) given_.resize(kMost);
  given_[count_ % given_.size()] = {transitions, frame, word};
  ++count_;
}

void GivenCommands::UseUp(const DrivePath& path) {
  if (count_ > given_.size()) used_up_ = std::max(used_up_, count_ - given_.size());
  for (std::uint8_t i = 0; i < path.count; ++i) {
    if ((kOwnTransitions & TransitionBit(path.numbers[i])) != 0) continue;
    for (std::size_t n = used_up_; n < count_; ++n) {
      if ((given_[n % given_.size()].transitions & TransitionBit(path.numbers[i])) == 0) continue;
      used_up_ = n;
      break;
    }
  }
}

GivenCommands::Since GivenCommands::GivenSince(const FrameRef& last, std::int64_t reaction_ns) const {
  const std::size_t kept = std::min(count_, given_.size());
  const std::int64_t begin = last.time - reaction_ns;
  Since since;
  bool reached = false;  // a word from before the window: nothing older matters
  for (std::size_t n = 0; n < kept && !reached; ++n) {
    const std::size_t number = count_ - 1 - n;
    const Command& command = given_[number % given_.size()];
    since.transitions |= command.transitions;
    reached = (used_up_ > 0 && number <= used_up_) ||
              (last.has_time && command.frame.has_time && command.frame.time <= begin);
  }
  since.whole = reached || (history_whole_ && count_ <= given_.size());
  return since;
}

FrameRef GivenCommands::CommandOf(const device::DriveProfile& drive, const DrivePath& path, std::uint32_t given) const {
  const std::size_t kept = std::min(count_, given_.size());
  for (std::size_t n = 0; n < kept; ++n) {
    const Command& command = given_[(count_ - 1 - n) % given_.size()];
    for (std::uint8_t i = 0; i < path.count; ++i) {
      const device::DriveTransition* transition = drive.Find(path.numbers[i]);
      const bool automatic = transition == nullptr || transition->automatic;
      if (!automatic && (command.transitions & given & TransitionBit(path.numbers[i])) != 0) return command.frame;
    }
  }
  return {};
}

}  // namespace ecaudit::model
