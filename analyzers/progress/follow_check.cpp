#include "analyzers/progress/follow_check.h"

namespace ecaudit::progress {
namespace {

constexpr TimeNs kErrorNs = 20'000'000;
constexpr TimeNs kLimitNs = 200'000'000;
constexpr TimeNs kStillNs = 500'000'000;
constexpr TimeNs kRampNs = 1'000'000'000;
/// Below, an axis need not move: friction, and units that are smaller than what it can resolve.
constexpr std::int64_t kLeastTravel = 500;
constexpr std::int64_t kShare = 20;

bool HasFollowingError(std::int8_t mode) {
  return mode == kProfilePosition || mode == kCyclicPosition || mode == kCyclicVelocity;
}

}  // namespace

void FollowCheck::Forget() {
  const FrameRef follows = follows_;
  *this = {};
  follows_ = follows;
}

void FollowCheck::Restart(std::int64_t target, std::int64_t actual) {
  target_ = target;
  actual_ = actual;
}

void FollowCheck::Step(const AxisView& now, AxisRecords& out) {
  const bool enabled = now.enabled() && now.in_op != InOp::kNo;
  if (enabled != enabled_ || now.mode() != mode_) {
    restart_ = true;
    still_.Reset();
    wrong_way_.Reset();
    slow_.Reset();
  }
  enabled_ = enabled;
  mode_ = now.mode();
  if (!enabled_ || !mode_) {
    error_.Reset();
    limit_.Reset();
    return;
  }
  Bits(now, out);
  switch (*mode_) {
    case kCyclicPosition:
    case kInterpolated:
    case kProfilePosition:
      Position(now, out);
      return;
    case kCyclicVelocity:
    case kProfileVelocity:
    case kVelocityMode:
      Velocity(now, out);
      return;
    default:
      return;
  }
}

void FollowCheck::Bits(const AxisView& now, AxisRecords& out) {
  const bool homing = *mode_ == kHoming;
  const bool error = (homing || HasFollowingError(*mode_)) && now.Status(kErrorBit);
  if (const TimeNs held = error_.Hold(error, now.frame); held >= kErrorNs && error_.Tell()) {
    AxisRecord record = now.Record(homing ? AxisFact::kHomingError : AxisFact::kFollowingError, error_.since(), held);
    if (now.Target(Quantity::kPosition)) record.a = *now.Target(Quantity::kPosition);
    if (now.Actual(Quantity::kPosition)) record.b = *now.Actual(Quantity::kPosition);
    out.Add(record);
  }
}

void FollowCheck::Position(const AxisView& now, AxisRecords& out) {
  const auto& target = now.Target(Quantity::kPosition);
  const auto& actual = now.Actual(Quantity::kPosition);
  if (!target || !actual) return;
  if (restart_) {
    restart_ = false;
    Restart(*target, *actual);
    start_target_ = *target;
    start_actual_ = *actual;
  }
  const bool profile = *mode_ == kProfilePosition;
  // The drive makes the way in profile position, and takes the target by the edge only.
  const bool held_back = profile && (!now.Control(kStartBit) || now.Control(kHaltBit));
  const std::int64_t travel = profile && now.Control(kRelativeBit) ? 0 : Apart(target_, *target);
  const std::int64_t moved = Apart(actual_, *actual);
  const bool far = Magnitude(travel) >= kLeastTravel;
  const bool still = far && Magnitude(moved) * kShare < Magnitude(travel);
  const bool wrong = far && moved != 0 && (moved > 0) != (travel > 0) && Magnitude(moved) * 2 > Magnitude(travel);
  if (const TimeNs held = still_.Hold(still && !held_back, now.frame);
      held >= (profile ? kRampNs : kStillNs) && still_.Tell()) {
    AxisRecord record = now.Record(AxisFact::kStandsStill, still_.since(), held);
    record.quantity = Quantity::kPosition;
    record.a = travel;
    record.b = moved;
    record.inferred = false;
    record.fault = now.Status(kLimitBit);
    out.Add(record);
  }
  if (const TimeNs held = wrong_way_.Hold(wrong && !profile, now.frame); held >= kStillNs && wrong_way_.Tell()) {
    AxisRecord record = now.Record(AxisFact::kWrongWay, wrong_way_.since(), held);
    record.quantity = Quantity::kPosition;
    record.a = travel;
    record.b = moved;
    out.Add(record);
  }
  const bool together = Magnitude(moved) * kShare >= Magnitude(travel) && (travel == 0 || (moved >= 0) == (travel > 0));
  if (!still && !wrong && together) Restart(*target, *actual);
  if (!follows_.seen()) {
    const std::int64_t all = Apart(start_target_, *target);
    const std::int64_t made = Apart(start_actual_, *actual);
    if (Magnitude(all) >= 20 && (all > 0) == (made > 0) && Magnitude(made) * 2 > Magnitude(all)) follows_ = now.frame;
  }
}

void FollowCheck::Velocity(const AxisView& now, AxisRecords& out) {
  const auto& target = now.Target(Quantity::kVelocity);
  const auto& actual = now.Actual(Quantity::kVelocity);
  if (!target || !actual) return;
  const bool halted = *mode_ != kCyclicVelocity && now.Control(kHaltBit);
  const bool asked = Magnitude(*target) >= 10 && !halted;
  const bool slow = asked && Magnitude(*actual) * kShare < Magnitude(*target);
  if (asked && !slow && (*actual > 0) == (*target > 0) && !follows_.seen()) follows_ = now.frame;
  if (const TimeNs held = slow_.Hold(slow, now.frame); held >= kRampNs && slow_.Tell()) {
    AxisRecord record = now.Record(AxisFact::kStandsStill, slow_.since(), held);
    record.quantity = Quantity::kVelocity;
    record.a = *target;
    record.b = *actual;
    record.fault = now.Status(kLimitBit);
    out.Add(record);
  }
  const bool wrong =
      asked && *actual != 0 && (*actual > 0) != (*target > 0) && Magnitude(*actual) * 2 > Magnitude(*target);
  if (const TimeNs held = wrong_way_.Hold(wrong, now.frame); held >= kRampNs && wrong_way_.Tell()) {
    AxisRecord record = now.Record(AxisFact::kWrongWay, wrong_way_.since(), held);
    record.quantity = Quantity::kVelocity;
    record.a = *target;
    record.b = *actual;
    out.Add(record);
  }
}

}  // namespace ecaudit::progress
