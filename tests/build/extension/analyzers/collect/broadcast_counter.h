/// in: answers to datagrams.  out: TenBroadcasts.  Here only to show how a collector and an event are added.
#pragma once

#include <cstdint>

#include "analyzers/collect/collector.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/track/events.h"

namespace ecaudit {

/// The slaves have answered another ten broadcasts.
struct TenBroadcasts {
  FrameRef frame;
};

class BroadcastCounter final : public Collector {
 public:
  explicit BroadcastCounter(EventBus& bus);

  void On(const track::Answered& answer);
  void Summarise(AnalysisResult& result) override;

 private:
  EventBus& bus_;
  std::uint64_t count_ = 0;
};

}  // namespace ecaudit
