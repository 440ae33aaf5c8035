/// in: process data and SDO transfers of one slave.  out: the events of drive_events.h, for each axis.
///
/// ETG.6010: the objects of each further axis of a drive are 800h after those of the axis before (6041h, 6841h, 7041h,
/// ...), for eight axes. Each axis is a state machine of its own; its unit is made when its control or status word is
/// seen.
#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "analyzers/model/drive_unit.h"

namespace ecaudit::model {

class DriveAxes {
 public:
  static constexpr std::uint8_t kMost = 8;

  /// The axis whose control or status word it is, 0 to 7; nothing for other objects.
  /// @param index, subindex, bits of an object as it is mapped or transferred
  [[nodiscard]] static std::optional<std::uint8_t> AxisOfWord(std::uint16_t index, std::uint8_t subindex,
                                                              unsigned bits);

  /// As DriveUnit's.
  DriveAxes(SlaveId slave, const AlMachine& al, EventSink& sink)
      : slave_(slave), al_(al), sink_(sink), first_(slave, al, sink) {}

  void SetFamily(const device::DeviceDescription& family);
  void SetLimits(const DriveLimits& limits);

  void OnCycle(const ProcessCycle& cycle) {
    const std::uint8_t axes = first_.OnCycle(cycle);
    if (axes > 1 || !further_.empty()) OnFurther(cycle, axes);
  }
  void OnSdo(const mailbox::SdoTransfer& transfer);
  void ForgetObject(std::uint16_t index);
  void OnRunBegan();
  /// No message names its axis: all receive it.
  void OnEmergency(const mailbox::Emergency& emergency);
  void Forget();

  /// Of an axis that was seen, or the first one.
  [[nodiscard]] const DriveUnit& axis(std::uint8_t number) const;
  [[nodiscard]] bool seen() const;
  /// Whether `holds` for any axis that was seen.
  template <class Holds>
  [[nodiscard]] bool Any(Holds holds) const {
    if (first_.seen() && holds(first_)) return true;
    for (const auto& [axis, unit] : further_) {
      if (unit.seen() && holds(unit)) return true;
    }
    return false;
  }
  /// Calls `visit(unit)` for each axis that was seen, in their order.
  template <class Visit>
  void ForEachSeen(Visit visit) const {
    (void)Any([&visit](const DriveUnit& unit) {
      visit(unit);
      return false;
    });
  }

 private:
  template <class Visit>
  void ForEach(Visit visit) {
    visit(first_);
    for (auto& [axis, unit] : further_) visit(unit);
  }
  /// @param axes whose control or status word lies in these process data: the first is bit 0
  void OnFurther(const ProcessCycle& cycle, std::uint8_t axes);
  /// Makes the unit of a further axis, where there is none yet.
  void Meet(std::uint8_t axis);

  SlaveId slave_;
  const AlMachine& al_;
  EventSink& sink_;
  const device::DeviceDescription* family_ = nullptr;
  DriveLimits limits_;
  DriveUnit first_;
  std::map<std::uint8_t, DriveUnit> further_;  ///< by axis; few drives have any
};

}  // namespace ecaudit::model
