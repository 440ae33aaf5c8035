#include "analyzers/judge/wkc/counter_habits.h"

#include <algorithm>
#include <utility>

#include "analyzers/judge/wkc/thresholds.h"

namespace ecaudit::wkc {
namespace {

/// A mailbox counts while a message lies in it, and one buffer if it was filled or emptied.
bool CountsNowAndThen(const model::LogicalExpectation& expected) {
  return std::ranges::any_of(expected.shares, [](const model::LogicalShare& share) {
    return share.mailbox_only || share.inputs_one_buffer || share.outputs_one_buffer;
  });
}

}  // namespace

std::uint64_t KeyOf(const track::LogicalAccess& access) {
  return static_cast<std::uint64_t>(access.address) << 16U ^ static_cast<std::uint64_t>(access.length) << 4U ^
         static_cast<std::uint64_t>(access.command);
}

const CounterHabits::Habit* CounterHabits::HabitOf(const track::LogicalAccess& access) const {
  const std::uint64_t key = KeyOf(access);
  const Habit& habit = habits_[key % habits_.size()];
  return habit.key == key ? &habit : nullptr;
}

bool CounterHabits::WasRight(const track::LogicalAccess& access, std::uint64_t mapping_version) const {
  const Habit* const habit = HabitOf(access);
  return habit != nullptr && habit->times >= threshold::kRightFrames && habit->right_for == mapping_version;
}

bool CounterHabits::HeldAtLeast(const track::LogicalAccess& access, std::uint16_t least) const {
  const Habit* const habit = HabitOf(access);
  return habit != nullptr && habit->wkc >= least && habit->times >= threshold::kHeldFrames;
}

std::optional<Drop> CounterHabits::Follow(const track::LogicalAccess& access, const model::CounterRange& range,
                                          std::uint64_t mapping_version) {
  const std::uint64_t key = KeyOf(access);
  Habit& habit = habits_[key % habits_.size()];
  if (habit.key != key) {
    habit = {key, access.wkc, 1, access.frame().number, {}};
    return std::nullopt;
  }
  if (access.wkc == habit.wkc) {
    ++habit.times;
    const bool right = range.most > 0 && access.wkc == range.least && access.wkc == range.most;
    habit.right_for = right ? std::optional(mapping_version) : std::nullopt;
    return SettleEarly(access, habit);
  }
  if (access.wkc > habit.wkc || habit.times < threshold::kHabitFrames) {
    FollowEarly(access, habit);
    return std::nullopt;
  }
  return Drop{key, habit.wkc, access.wkc, habit.times, 1, habit.since, access.frame(), access.frame()};
}

std::optional<Drop> CounterHabits::FollowAll(const track::LogicalAccess& access,
                                             const model::LogicalExpectation& expected, std::uint16_t most) {
  const std::uint64_t key = KeyOf(access);
  Habit& habit = habits_[key % habits_.size()];
  if (habit.key == key && access.wkc == habit.wkc) {
    ++habit.times;
    return std::nullopt;
  }
  const bool all_counted = habit.key == key && habit.times >= threshold::kHabitFrames && habit.wkc == most;
  if (!all_counted || access.wkc > habit.wkc || CountsNowAndThen(expected)) {
    habit = {key, access.wkc, 1, access.frame().number, {}};
    return std::nullopt;
  }
  return Drop{key, habit.wkc, access.wkc, habit.times, 1, habit.since, access.frame(), access.frame()};
}

/// A drop within the first frames of a habit. Which of both values is the right one shows only later: the lower one
/// lasts although no request explains it, or the counter returns to the higher one.
void CounterHabits::FollowEarly(const track::LogicalAccess& access, Habit& habit) {
  Drop& drop = early_[habit.key % early_.size()];
  const FrameRef frame = access.frame();
  if (access.wkc > habit.wkc) {
    const bool open = drop.key == habit.key && drop.count > 0;
    const bool back = open && access.wkc == drop.before && habit.wkc == drop.wkc;
    if (!back) drop = {};
    habit = {habit.key, access.wkc, back ? drop.times + 1 : 1, back ? drop.since : frame.number, {}};
    return;
  }
  // The share of inputs alone may be that of a mailbox, which counts only while a message lies in it.
  const bool of_outputs =
      access.command == wire::Command::LWR || (access.command == wire::Command::LRW && habit.wkc > access.wkc + 1);
  const bool held = habit.times >= threshold::kRightFrames && of_outputs;
  drop = held ? Drop{habit.key, habit.wkc, access.wkc, habit.times, 1, habit.since, frame, frame} : Drop{};
  habit = {habit.key, access.wkc, 1, frame.number, {}};
}

/// The counter stays the same.
std::optional<Drop> CounterHabits::SettleEarly(const track::LogicalAccess& access, Habit& habit) {
  Drop& drop = early_[habit.key % early_.size()];
  if (drop.key != habit.key || drop.count == 0) return std::nullopt;
  const bool lasts = habit.wkc == drop.wkc;
  if (lasts) {
    ++drop.count;
    drop.last = access.frame();
  }
  if (habit.times < threshold::kHabitFrames) return std::nullopt;
  const Drop settled = std::exchange(drop, {});
  // The higher value is what the slaves count if all take part.
  if (lasts) habit = {habit.key, settled.before, threshold::kHabitFrames, settled.since, {}};
  return settled;
}

}  // namespace ecaudit::wkc
