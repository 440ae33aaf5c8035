#include "analyzers/model/drive_axes.h"

namespace ecaudit::model {
namespace {

constexpr std::uint8_t BitOf(std::uint8_t axis) {
  return static_cast<std::uint8_t>(1U << axis);
}

}  // namespace

std::optional<std::uint8_t> DriveAxes::AxisOfWord(std::uint16_t index, std::uint8_t subindex, unsigned bits) {
  // Devices of modules have other objects there, whose values are at subindex 1 and following (ETG.5001).
  if (subindex != 0 || bits != 16) return std::nullopt;
  for (std::uint8_t axis = 0; axis < kMost; ++axis) {
    if (index == ObjectOfAxis(kControlWord, axis) || index == ObjectOfAxis(kStatusWord, axis)) return axis;
  }
  return std::nullopt;
}

void DriveAxes::SetFamily(const device::DeviceDescription& family) {
  family_ = &family;
  ForEach([&](DriveUnit& unit) { unit.SetFamily(family); });
}

void DriveAxes::SetLimits(const DriveLimits& limits) {
  limits_ = limits;
  ForEach([&](DriveUnit& unit) { unit.SetLimits(limits); });
}

void DriveAxes::Meet(std::uint8_t axis) {
  const auto [unit, is_new] = further_.try_emplace(axis, slave_, al_, sink_, axis);
  if (!is_new) return;
  unit->second.SetLimits(limits_);
  if (family_ != nullptr) unit->second.SetFamily(*family_);
}

void DriveAxes::OnFurther(const ProcessCycle& cycle, std::uint8_t axes) {
  for (std::uint8_t axis = 1; axis < kMost && axes >> axis != 0; ++axis) {
    if ((axes & BitOf(axis)) != 0) Meet(axis);
  }
  for (auto& [axis, unit] : further_) unit.OnCycle(cycle);
}

void DriveAxes::OnSdo(const mailbox::SdoTransfer& transfer) {
  const bool one = transfer.has_object && !transfer.complete_access;
  const auto axis = one ? AxisOfWord(transfer.index, transfer.subindex, transfer.size == 2 ? 16U : 0U) : std::nullopt;
  if (axis.value_or(0) > 0) Meet(*axis);
  ForEach([&](DriveUnit& unit) { unit.OnSdo(transfer); });
}

void DriveAxes::ForgetObject(std::uint16_t index) {
  ForEach([&](DriveUnit& unit) { unit.ForgetObject(index); });
}

void DriveAxes::OnRunBegan() {
  ForEach([](DriveUnit& unit) { unit.OnRunBegan(); });
}

void DriveAxes::OnEmergency(const mailbox::Emergency& emergency) {
  ForEach([&](DriveUnit& unit) { unit.OnEmergency(emergency); });
}

void DriveAxes::Forget() {
  ForEach([](DriveUnit& unit) { unit.Forget(); });
}

const DriveUnit& DriveAxes::axis(std::uint8_t number) const {
  const auto found = further_.find(number);
  return found == further_.end() ? first_ : found->second;
}

bool DriveAxes::seen() const {
  return Any([](const DriveUnit&) { return true; });
}

}  // namespace ecaudit::model
