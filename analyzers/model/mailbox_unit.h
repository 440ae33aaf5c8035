/// in: accesses to one slave.  out: Predicted (model_events.h): whether the slave must take an access to its mailboxes.
///
/// A mailbox takes a write only when it is empty, and gives a read only when it is full; the sync manager answers
/// otherwise with working counter 0 (esc-reference 6.2). The slave empties the one and fills the other whenever it
/// likes, so only two things can be foretold: an out mailbox that was seen empty takes the next message, and an in
/// mailbox that was seen full gives its message.
#pragma once

#include <cstdint>

#include "analyzers/model/model_events.h"
#include "decoder/base/event_sink.h"
#include "decoder/track/access.h"
#include "decoder/track/mailbox_tracker.h"
#include "decoder/track/slave_state.h"

namespace ecaudit::model {

class MailboxUnit {
 public:
  /// @param state, sink must outlive this
  MailboxUnit(SlaveId slave, const track::SlaveState& state, EventSink& sink)
      : slave_(slave), state_(state), sink_(sink) {}

  /// Any access to the slave; `state` already contains what it wrote or read.
  void OnAccess(const track::SlaveAccess& access);
  /// The slave may have reset its mailboxes: a state was requested, or changed.
  void Forget();

 private:
  void LearnStatus(const track::SlaveAccess& access);
  void CheckWrite(const track::SlaveAccess& access);
  void CheckRead(const track::SlaveAccess& access);
  /// An access to the first byte of a mailbox that is known to be ready for it must be taken.
  void CompareOpening(const track::SlaveAccess& access);

  SlaveId slave_;
  const track::SlaveState& state_;
  EventSink& sink_;
  track::MailboxWindow window_;
  std::uint32_t window_version_ = 0xFFFFFFFF;
  bool out_empty_ = false;  ///< seen empty, and nothing written since
  bool in_full_ = false;    ///< seen full, and nothing read since
  FrameNo last_use_ = 0;    ///< frame that used one of the mailboxes last, as sent
};

}  // namespace ecaudit::model
