#include "decoder/track/slave_mailboxes.h"

namespace ecaudit::track {

void SlaveMailboxes::UpdateWindow(SlaveId slave, const FrameRef& frame) {
  Slave& of = slaves_[slave];
  of.window_version = states_[slave].mapping_version;
  const MailboxWindow window = MailboxWindowOf(states_[slave]);
  // A mailbox that is switched off is remembered where it was.
  const bool whole = of.window == MailboxWindow() ||
                     (window.out_use == MailboxUse::kOn && window.in_use == MailboxUse::kOn) || window == of.window;
  if (!of.tracker && whole) {
    of.window = window;
  } else {
    Need(slave).SetWindow(window, frame);
  }
}

bool SlaveMailboxes::TakesQuietly(Slave& slave, const SlaveAccess& access) {
  return access.broadcast && RepeatRequests::TakesSettings(access, slave.repeat_bit);
}

MailboxTracker& SlaveMailboxes::Need(SlaveId slave) {
  Slave& of = slaves_[slave];
  if (!of.tracker) {
    of.tracker = std::make_unique<MailboxTracker>(slave, events_, &message_bytes_);
    of.tracker->Begin(of.window, of.repeat_bit);
  }
  return *of.tracker;
}

}  // namespace ecaudit::track
