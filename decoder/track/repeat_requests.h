/// in: accesses to the repeat bits of sync manager 1.  out: MailboxRepeatRequest.
///
/// keeps: the bit that the master set last, and whether the slave has to give an answer once more.
#pragma once

#include <optional>

#include "decoder/base/event_sink.h"
#include "decoder/mailbox/events.h"
#include "decoder/track/access.h"

namespace ecaudit::track {

class RepeatRequests {
 public:
  /// @param sink must outlive this
  RepeatRequests(SlaveId slave, EventSink& sink) : slave_(slave), sink_(sink) {}

  /// The bit stood so when the slave got its settings.
  void Begin(bool bit) {
    bit_ = bit;
    bit_known_ = true;
  }
  /// Settings are no request: they only show the value of the bit.
  /// @param bit  how it stands then
  /// @return whether the access is nothing else: one that leaves the bit alone, or settings
  static bool TakesSettings(const SlaveAccess& access, std::optional<bool>& bit);
  /// The master may toggle the bit.
  void OnWrite(const SlaveAccess& access);
  /// The slave may show that the answer is back.
  void OnRead(const SlaveAccess& access);
  /// A message was read, or will never come.
  void End() { requested_ = false; }
  /// Since the last message read.
  [[nodiscard]] bool requested() const { return requested_; }

 private:
  SlaveId slave_;
  EventSink& sink_;
  bool bit_known_ = false;
  bool bit_ = false;
  bool requested_ = false;
  bool acknowledged_ = false;
};

}  // namespace ecaudit::track
