#include "decoder/track/slave_mailboxes.h"

namespace ecaudit::track {

void SlaveMailboxes::UpdateWindow(SlaveId slave, const FrameRef& frame) {
  slaves_[slave].window_version = states_[slave].mapping_version;
  const MailboxWindow window = MailboxWindowOf(states_[slave]);
  if (slaves_[slave].tracker || window != MailboxWindow()) Need(slave).SetWindow(window, frame);
}

MailboxTracker& SlaveMailboxes::Need(SlaveId slave) {
  auto& tracker = slaves_[slave].tracker;
  if (!tracker) tracker = std::make_unique<MailboxTracker>(slave, events_, &message_bytes_);
  return *tracker;
}

}  // namespace ecaudit::track
