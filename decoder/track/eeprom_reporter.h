/// in: what the EEPROM interfaces of the slaves show.  out: EepromRead, EepromWrite, EepromError, IdentityLearned.
#pragma once

#include "decoder/base/event_sink.h"
#include "decoder/track/events.h"
#include "decoder/track/sii_tracker.h"
#include "decoder/track/slave_states.h"

namespace ecaudit::track {

class EepromReporter final : public SiiListener {
 public:
  EepromReporter(EventSink& events, const SlaveStates& states) : events_(events), states_(states) {}

  void OnEepromRead(const EepromRead& event) override;
  void OnEepromWrite(const EepromWrite& event) override { events_.Publish(event); }
  void OnEepromError(const EepromError& event) override { events_.Publish(event); }

 private:
  EventSink& events_;
  const SlaveStates& states_;
};

}  // namespace ecaudit::track
