/// in: process data.  out: which datagrams carry them in every cycle.
///
/// keeps: the first kMost of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "analyzers/collect/collector.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/track/events.h"

namespace ecaudit {

class FrameLayout final : public Collector {
 public:
  static constexpr std::size_t kMost = 32;
  /// What was exchanged less often is no cycle.
  static constexpr std::uint64_t kOften = 20;

  explicit FrameLayout(EventBus& bus);

  void On(const track::LogicalAccess& access);
  void Summarise(AnalysisResult& result) override;

 private:
  struct Datagram {
    wire::Command command = wire::Command::NOP;
    std::uint32_t address = 0;
    std::uint16_t length = 0;
    std::uint64_t count = 0;
  };
  std::array<Datagram, kMost> datagrams_{};
  std::size_t used_ = 0;
  std::size_t last_ = 0;  ///< cycles repeat themselves: most often it is the next one
};

}  // namespace ecaudit
