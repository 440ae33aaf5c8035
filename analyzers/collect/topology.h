/// in: reads of DL status and error counters.  out: the tree of the bus, and what its links went through.
///
/// Slaves stand by position, which is the order in which a frame is processed: at a slave with several neighbours it
/// goes on at port 3, then 1, then 2, and came in at port 0. So the ports over which frames pass show where the next
/// slave is. Where DL status of a slave was not read, it has neighbours only if nothing else can.
///
/// keeps: kMaxChanges changes a port.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>

#include "analyzers/collect/collector.h"
#include "analyzers/model/bus_model.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/track/access.h"
#include "decoder/track/events.h"

namespace ecaudit {

class Topology final : public Collector {
 public:
  static constexpr std::size_t kMaxChanges = 8;

  /// @param model  must outlive the collector, as must `bus`
  Topology(const model::BusModel& model, EventBus& bus);

  void On(const track::SlaveAccess& access);
  /// After a capture gap there may be another capture.
  void On(const track::CaptureGap& gap);
  void Summarise(AnalysisResult& result) override;

 private:
  static constexpr EscAddress kCounters = 0x0300;
  static constexpr EscAddress kCountersEnd = 0x0314;

  struct Slave {
    TopologyNode node;
    std::optional<std::uint8_t> links;  ///< bits 4-7 of DL status, as last read
    FrameRef links_read;
    std::array<std::optional<std::uint8_t>, kCountersEnd - kCounters> counters{};
    FrameRef counters_read;
  };

  Slave& Get(SlaveId slave);
  void OnDlStatus(const track::SlaveAccess& access);
  static void OnCounters(Slave& slave, const track::SlaveAccess& access);

  const model::BusModel& model_;
  std::deque<Slave> slaves_;
};

/// Gives each node the port at which its frames enter, where a finding states it. Call it when all findings are there.
void TakeEntryPorts(AnalysisResult& result);

/// Finds what is above each node of `topology`, from their ports alone.
void BuildTree(TopologySummary& topology);

}  // namespace ecaudit
