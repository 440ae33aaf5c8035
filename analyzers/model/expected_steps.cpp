#include "analyzers/model/expected_steps.h"

#include <algorithm>

namespace ecaudit::model {

using device::DriveState;

/// What the drive has to do from `from` on, step by step, as long as the word commands it.
void ExpectedSteps::Add(const device::DriveProfile& drive, DriveState from, std::uint16_t before, std::uint16_t word,
                        const FrameRef& frame) {
  if (steps_.empty()) steps_.resize(DrivePath::kMax);
  while (count_ < steps_.size()) {
    const std::uint32_t commanded = drive.Commanded(from, before, word);
    if (commanded == 0) return;
    std::uint8_t number = 0;
    while ((commanded >> number & 1U) == 0) ++number;
    const device::DriveTransition* transition = drive.Find(number);
    if (transition == nullptr) return;
    steps_[count_++] = {number, from, transition->to, frame, before, word};
    from = transition->to;
    before = word;  // the edges are used up
  }
}

DrivePath ExpectedSteps::PathFrom(std::size_t first) const {
  DrivePath path;
  for (std::size_t i = first; i < count_; ++i) path.Add(steps_[i].number);
  return path;
}

DrivePath ExpectedSteps::Begin(const device::DriveProfile& drive, DriveState from, std::uint16_t before,
                               std::uint16_t word, const FrameRef& frame) {
  count_ = 0;
  Add(drive, from, before, word, frame);
  since_ = frame;
  return PathFrom(0);
}

DrivePath ExpectedSteps::GoOn(const device::DriveProfile& drive, std::uint16_t before, std::uint16_t word,
                              const FrameRef& frame) {
  while (count_ > 0 && drive.Commanded(steps_[count_ - 1].to, before, word) == 0) --count_;
  const std::size_t known = count_;
  if (known > 0) Add(drive, steps_[known - 1].to, before, word, frame);
  since_ = frame;
  return PathFrom(known);
}

bool ExpectedSteps::Fulfil(DriveStateChanged& change) {
  if (count_ == 0 || steps_[0].from != *change.from) return false;
  std::size_t step = 0;
  while (step < count_ && steps_[step].to != *change.to) ++step;
  if (step == count_) return false;
  for (std::size_t i = 0; i <= step; ++i) change.path.Add(steps_[i].number);
  change.command = steps_[step].command;
  if (change.command.has_time && change.frame.has_time) change.reaction = change.frame.time - change.command.time;
  std::move(steps_.begin() + static_cast<std::ptrdiff_t>(step) + 1,
            steps_.begin() + static_cast<std::ptrdiff_t>(count_), steps_.begin());
  count_ -= step + 1;
  since_ = change.frame;
  return true;
}

}  // namespace ecaudit::model
