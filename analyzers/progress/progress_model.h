/// in: process data, SDO transfers and AL states.  out: how far each axis got (axis_watch.h), for rules and report.
///
/// Cycles like the one before are read as they pass (track::LogicalRepeated): a set point changes in each of them.
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
#include "analyzers/wiring/event_bus.h"
#include "decoder/mailbox/events.h"
#include "decoder/track/events.h"

namespace ecaudit::progress {

class ProgressModel {
 public:
  /// Axes of all slaves together; later ones are left out. Many times what a real bus has.
  static constexpr std::size_t kMostAxes = 4096;

  /// Both must outlive this.
  ProgressModel(const model::BusModel& model, EventBus& bus);

  void On(const model::ProcessCycle& cycle);
  void On(const track::LogicalRepeated& repeated);
  void On(const track::RepetitionEnds& end);
  void On(const mailbox::SdoTransfer& transfer);
  void On(const track::AlRequest& request);
  void On(const track::CaptureGap& gap);
  void On(const track::RunBegan& run);

  /// Calls `visit(slave, axis, watch)` for each axis of which a control or status word was seen.
  template <class Visit>
  void ForEachAxis(Visit visit) const {
    for (const auto& [id, watch] : axes_) {
      if (watch.seen()) visit(id.first, id.second, watch);
    }
  }
  /// Null where nothing of it was seen.
  [[nodiscard]] const AxisWatch* axis(SlaveId slave, std::uint8_t axis) const;

 private:
  using AxisId = std::pair<SlaveId, std::uint8_t>;
  /// What is known of a slave besides its model.
  struct Slave {
    bool op_requested = false;
    bool began = false;  ///< its way to OP was seen in this run
  };
  /// One part of the process image that holds words of axes, in one kind of datagram.
  struct Part {
    const model::ImagePart* part = nullptr;
    const AxisPlaces* places = nullptr;
    std::vector<AxisWatch*> watches;  ///< of its axes
    std::vector<std::uint64_t> bits;  ///< of the last frame
    [[nodiscard]] bool still() const {
      return std::all_of(watches.begin(), watches.end(), [](const AxisWatch* watch) { return watch->still(); });
    }
  };
  /// A kind of datagram that repeats.
  struct Repeating {
    wire::Command command = wire::Command::NOP;
    std::uint32_t address = 0;
    std::uint16_t length = 0;
    std::vector<Part> parts;
  };

  void Take(const model::ImagePart& part, const AxisPlaces& places, ByteSpan data, const FrameRef& frame);
  [[nodiscard]] const AxisPlaces& PlacesOf(const model::ImagePart& part);
  [[nodiscard]] Repeating& RepeatingOf(const track::LogicalAccess& access);
  [[nodiscard]] SlaveSide SideOf(SlaveId slave) const;
  [[nodiscard]] AxisWatch* Watch(SlaveId slave, std::uint8_t axis);
  [[nodiscard]] Slave& Get(SlaveId slave);
  void ForgetSlave(SlaveId slave);

  const model::BusModel& model_;
  std::map<AxisId, AxisWatch> axes_;
  std::vector<Slave> slaves_;                   ///< by id
  std::map<std::uint64_t, AxisPlaces> places_;  ///< by serial of the part; those without words of axes stay, too
  /// The newest of them: most parts are asked for in each cycle.
  struct Recent {
    std::uint64_t serial = 0;
    const AxisPlaces* places = nullptr;
  };
  std::array<Recent, 256> recent_{};
  std::vector<Repeating> repeating_;
};

}  // namespace ecaudit::progress
