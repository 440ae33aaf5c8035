/// in: process data, SDO transfers and AL states.  out: how far each axis got (axis_watch.h), for rules and report.
///
/// Nothing is published: what is concluded here is asked for at the end.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "analyzers/model/bus_model.h"
#include "analyzers/progress/axis_watch.h"
#include "analyzers/progress/terminal_watch.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/mailbox/events.h"
#include "decoder/pipeline.h"
#include "decoder/track/events.h"

namespace ecaudit::progress {

class ProgressModel {
 public:
  /// Axes of all slaves together; later ones are left out. Many times what a real bus has.
  static constexpr std::size_t kMostAxes = 4096;

  /// Both must outlive this.
  ProgressModel(const model::BusModel& model, EventBus& bus);

  void On(const model::ProcessCycle& cycle);
  void On(const mailbox::SdoTransfer& transfer);
  void On(const model::DriveStateChanged& change);
  void On(const track::AlRequest& request);
  void On(const track::CaptureGap& gap);
  void On(const track::RunBegan& run);
  void On(const ClockSet& set);
  void Finish();

  /// Calls `visit(slave, axis, watch)` for each axis of which a control or status word was seen.
  template <class Visit>
  void ForEachAxis(Visit visit) const {
    for (const auto& [id, watch] : axes_) {
      if (watch.seen()) visit(id.first, id.second, watch);
    }
  }
  /// Calls `visit(slave, watch)` for each channel of a motor terminal that was seen.
  template <class Visit>
  void ForEachMotor(Visit visit) const {
    for (const auto& [id, watch] : motors_) visit(id.first, watch);
  }
  /// Null where nothing of it was seen.
  [[nodiscard]] const AxisWatch* axis(SlaveId slave, std::uint8_t axis) const;

 private:
  using AxisId = std::pair<SlaveId, std::uint8_t>;
  /// One axis in a part of the process image.
  struct Share {
    AxisPlaces::Axis places;
    AxisWatch* watch = nullptr;
    AxisValues values;  ///< of the last frame
  };
  /// One part of the process image that holds words of axes.
  struct Part {
    explicit Part(const model::ImagePart& image) : places(image), motors(image) {}
    AxisPlaces places;
    MotorPlaces motors;
    const device::DeviceDescription* profile = nullptr;  ///< as the watches were looked up
    std::vector<Share> shares;                           ///< empty before the first data
    SlaveSide side;                                      ///< of the last frame
  };

  void TakeMotors(const model::ImagePart& image, const Part& part, ByteSpan data, const FrameRef& frame);
  void Take(const model::ImagePart& image, Part& part, ByteSpan data, const FrameRef& frame);
  void FindWatches(SlaveId slave, Part& part);
  [[nodiscard]] Part& PartOf(const model::ImagePart& image);
  [[nodiscard]] Part& FindPart(const model::ImagePart& image);
  [[nodiscard]] SlaveSide SideOf(SlaveId slave, const model::AlMachine& al) const;
  [[nodiscard]] AxisWatch* Watch(SlaveId slave, std::uint8_t axis);
  [[nodiscard]] SlaveSide& Get(SlaveId slave);
  void ForgetSlave(SlaveId slave);
  [[nodiscard]] FrameRef Steady(FrameRef frame) const;
  void ToCaptureClock(FrameRef& frame) const;

  const model::BusModel& model_;
  std::map<AxisId, AxisWatch> axes_;
  std::map<AxisId, MotorWatch> motors_;  ///< by channel
  std::vector<SlaveSide> slaves_;        ///< by id; in_op is that of its model
  std::vector<ClockSet> clock_sets_;     ///< `by`: all of them together, up to this one
  std::map<std::uint64_t, Part> parts_;  ///< by serial; those without words of axes stay, too
  /// The newest of them: most parts are needed in each cycle.
  struct Recent {
    std::uint64_t serial = 0;
    Part* part = nullptr;
  };
  std::array<Recent, 256> recent_{};
};

}  // namespace ecaudit::progress
