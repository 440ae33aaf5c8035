#include "decoder/track/event_field_tracker.h"

namespace ecaudit::track {

void EventFieldTracker::Apply(const bus::BusTransaction& transaction) {
  const wire::FrameView& frame = *transaction.returned;
  unsigned bits = 0;
  bool all_read = false;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    all_read = all_read || frame[i].command() == wire::Command::BRD || frame[i].command() == wire::Command::BRW;
    const bool has_sent = transaction.sent != nullptr && i < transaction.sent->size();
    bits |= frame[i].irq() & ~(has_sent ? unsigned{(*transaction.sent)[i].irq()} : 0U);
  }
  if (bits != run_.bits) {
    const EventFieldRun before = run_;
    run_ = {static_cast<std::uint16_t>(bits), 0, frame.ref(), frame.ref(), false};
    events_.Publish(EventFieldChanged{before, run_.bits, frame.ref()});
  }
  ++run_.frames;
  run_.last = frame.ref();
  run_.all_read = all_read;
}

}  // namespace ecaudit::track
