/// in: BusTransaction.  out: EventFieldChanged.
///
/// keeps: the run of frames that came back with the same ECAT event field.
#pragma once

#include "decoder/base/event_sink.h"
#include "decoder/bus/transaction.h"
#include "decoder/track/events.h"

namespace ecaudit::track {

class EventFieldTracker {
 public:
  explicit EventFieldTracker(EventSink& events) : events_(events) {}

  /// The run of frames that lasts until now.
  [[nodiscard]] const EventFieldRun& run() const { return run_; }

  /// Nearly all frames of nearly all captures come back with a field of 0, as the one before did: these only count.
  void OnTransaction(const bus::BusTransaction& transaction) {
    if (transaction.returned == nullptr) return;
    const wire::FrameView& frame = *transaction.returned;
    unsigned bits = run_.bits;
    for (std::size_t i = 0; i < frame.size(); ++i) bits |= frame[i].irq();
    if (bits == 0) {
      ++run_.frames;
    } else {
      Apply(transaction);
    }
  }

 private:
  void Apply(const bus::BusTransaction& transaction);

  EventSink& events_;
  EventFieldRun run_;
};

}  // namespace ecaudit::track
