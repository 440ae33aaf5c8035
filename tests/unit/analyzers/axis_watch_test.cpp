// One axis, value by value: what is concluded does not depend on bits that a drive toggles in each cycle.
#include "analyzers/progress/axis_watch.h"

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "decoder/device/profile_registry.h"

namespace ecaudit::progress {
namespace {

constexpr std::uint16_t kEnabled = 0x0237;
constexpr std::uint16_t kReached = 1U << kReachedBit;
constexpr TimeNs kCycleNs = 1'000'000;

/// An axis in OP whose outputs and inputs come in turn.
class Axis {
 public:
  explicit Axis(std::uint16_t toggled) : toggled_(toggled) {
    watch_.SetDrive(&*device::BuiltinProfile("generic")->drive);
  }

  void Cycle(std::uint16_t control, std::uint16_t status, std::int8_t mode, Role setpoint, std::int64_t target,
             Role value, std::int64_t actual) {
    SlaveSide side;
    side.in_op = InOp::kYes;
    side.op_request = OpRequest::kNow;
    side.began = true;
    AxisValues outputs;
    outputs.Set(Role::kControl, control);
    outputs.Set(setpoint, target);
    watch_.OnOutputs(outputs, 1, Next(), side);
    AxisValues inputs;
    inputs.Set(Role::kStatus, ++cycles_ % 2 == 0 ? status : status ^ toggled_);
    inputs.Set(Role::kModeShown, mode);
    inputs.Set(value, actual);
    watch_.OnInputs(inputs, 2, Next(), side);
  }
  void Enable() {
    constexpr std::array<std::pair<std::uint16_t, std::uint16_t>, 4> kSteps{
        {{0x0006, 0x0250}, {0x0007, 0x0231}, {0x000F, 0x0233}, {0x000F, kEnabled}}};
    for (const auto& [control, status] : kSteps) {
      Cycle(control, status, kProfileVelocity, Role::kTargetVelocity, 0, Role::kVelocity, 0);
    }
  }
  /// The capture misses this number of cycles.
  void Gap(FrameNo cycles) {
    watch_.ForgetAtGap();
    frames_ += 2 * cycles;
  }
  [[nodiscard]] const AxisWatch& watch() const { return watch_; }

 private:
  FrameRef Next() {
    ++frames_;
    return {frames_, static_cast<TimeNs>(frames_) * kCycleNs / 2, true};
  }

  std::uint16_t toggled_;
  AxisWatch watch_;
  FrameNo frames_ = 0;
  std::uint64_t cycles_ = 0;
};

std::vector<std::pair<AxisFact, FrameNo>> FactsOf(const AxisWatch& watch) {
  std::vector<std::pair<AxisFact, FrameNo>> facts;
  for (const AxisRecord& record : watch.records()) facts.emplace_back(record.fact, record.last.number);
  return facts;
}

/// A velocity axis that moves, is halted, goes on, and is asked for a speed that it does not reach.
void Drive(Axis& axis) {
  axis.Enable();
  for (int i = 1; i <= 100; ++i) {
    axis.Cycle(0x000F, kEnabled, kProfileVelocity, Role::kTargetVelocity, 10 * i, Role::kVelocity, 10 * i);
  }
  for (int i = 0; i < 100; ++i) {
    axis.Cycle(0x010F, kEnabled, kProfileVelocity, Role::kTargetVelocity, 1000, Role::kVelocity, 0);
  }
}

void Stall(Axis& axis) {
  for (int i = 0; i < 3000; ++i) {
    axis.Cycle(0x000F, kEnabled, kProfileVelocity, Role::kTargetVelocity, 1000 + i % 2, Role::kVelocity, 0);
  }
}

TEST(AxisWatch, AHaltedAxisIsNotCommanded) {
  for (const std::uint16_t toggled : {std::uint16_t{0}, kReached}) {
    Axis axis(toggled);
    Drive(axis);
    EXPECT_EQ(axis.watch().command().last_commanded().number, 2U * (4 + 100)) << "toggled bits " << toggled;
  }
}

TEST(AxisWatch, BitsThatADriveTogglesChangeNothing) {
  Axis steady(0);
  Axis toggling(kReached);
  for (Axis* const axis : {&steady, &toggling}) {
    Drive(*axis);
    Stall(*axis);
  }
  EXPECT_EQ(steady.watch().command().commanded(), toggling.watch().command().commanded());
  EXPECT_EQ(steady.watch().command().last_commanded(), toggling.watch().command().last_commanded());
  EXPECT_EQ(steady.watch().command().wanted(), toggling.watch().command().wanted());
  EXPECT_FALSE(FactsOf(steady.watch()).empty());
  EXPECT_EQ(FactsOf(steady.watch()), FactsOf(toggling.watch()));
}

/// Enable operation without the quick stop bit: the drive stays in Switch on disabled.
void AskWithoutQuickStop(Axis& axis, int cycles, std::uint16_t control = 0x000B) {
  for (int i = 0; i < cycles; ++i) {
    axis.Cycle(control, 0x0250, kProfileVelocity, Role::kTargetVelocity, 0, Role::kVelocity, 0);
  }
}

TEST(AxisWatch, WhatLastsGoesOnAfterAShortGap) {
  Axis axis(0);
  AskWithoutQuickStop(axis, 10, 0x0002);
  AskWithoutQuickStop(axis, 50);
  axis.Gap(3);
  AskWithoutQuickStop(axis, 2000);
  ASSERT_FALSE(axis.watch().records().begin() == axis.watch().records().end());
  EXPECT_EQ(axis.watch().records().begin()->fact, AxisFact::kControlBitMissing);
  EXPECT_EQ(axis.watch().records().begin()->since.number, 21U) << "before the gap";
}

/// In a longer gap, or where the control word is another one, much may have happened.
TEST(AxisWatch, WhatMayHaveEndedInAGapBeginsAnew) {
  Axis longer(0);
  AskWithoutQuickStop(longer, 10, 0x0002);
  AskWithoutQuickStop(longer, 50);
  longer.Gap(500);
  AskWithoutQuickStop(longer, 2000);
  Axis other(0);
  AskWithoutQuickStop(other, 10, 0x0002);
  AskWithoutQuickStop(other, 50);
  other.Gap(3);
  AskWithoutQuickStop(other, 2000, 0x001B);
  for (const Axis* axis : {&longer, &other}) {
    for (const AxisRecord& record : axis->watch().records()) {
      EXPECT_FALSE(record.fact == AxisFact::kControlBitMissing && record.since.number <= 120) << "across the gap";
    }
  }
}

}  // namespace
}  // namespace ecaudit::progress
