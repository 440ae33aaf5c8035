/// in: SlaveAccess of all slaves.  out: the events of mailbox/events.h.
///
/// keeps: a MailboxTracker for each slave that has something to track, and what all of them may keep together.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "decoder/base/allowance.h"
#include "decoder/base/event_sink.h"
#include "decoder/track/mailbox_tracker.h"
#include "decoder/track/slave_states.h"

namespace ecaudit::track {

class SlaveMailboxes {
 public:
  SlaveMailboxes(EventSink& events, const SlaveStates& states) : events_(events), states_(states) {}

  /// One more slave, after the others.
  void Add() { slaves_.emplace_back(); }
  /// The sync managers of the slave may be others than at the last call.
  void FollowWindow(SlaveId slave, const FrameRef& frame) {
    if (slaves_[slave].window_version != states_[slave].mapping_version) UpdateWindow(slave, frame);
  }
  /// Slaves without a mailbox, and those of which only the AL state is polled, need no tracker.
  void OnAccess(const SlaveAccess& access) {
    Slave& slave = slaves_[access.slave];
    if (slave.tracker) {
      slave.tracker->OnAccess(access);
    } else if (MailboxTracker::Concerns(access) && !TakesQuietly(slave, access)) {
      Need(access.slave).OnAccess(access);
    }
  }
  /// A frame was overtaken: see MailboxTracker::OnDoubtful().
  void OnDoubtful(const SlaveAccess& access) {
    if (slaves_[access.slave].tracker || MailboxTracker::Concerns(access)) Need(access.slave).OnDoubtful(access);
  }
  /// The slave went to INIT.
  void Reset(SlaveId slave, const FrameRef& frame) {
    if (slaves_[slave].tracker) slaves_[slave].tracker->Reset(frame);
  }
  /// Frames are missing from the capture.
  void Forget(SlaveId slave, const FrameRef& frame) {
    if (slaves_[slave].tracker) slaves_[slave].tracker->Forget(frame);
  }
  /// The capture ends.
  void Finish(SlaveId slave) {
    if (slaves_[slave].tracker) slaves_[slave].tracker->Finish();
  }

 private:
  struct Slave {
    std::unique_ptr<MailboxTracker> tracker;  // null until there is something to track
    std::uint32_t window_version = 0;         // mapping version of the state that its window rests on
    // With which it will begin: broadcasts give a window to thousands of slaves that never get a message.
    MailboxWindow window;
    std::optional<bool> repeat_bit;
  };

  /// A broadcast that gives sync manager 1 its settings only shows with which repeat bit the slave begins.
  /// @return whether that was all
  static bool TakesQuietly(Slave& slave, const SlaveAccess& access);

  void UpdateWindow(SlaveId slave, const FrameRef& frame);
  MailboxTracker& Need(SlaveId slave);

  static constexpr std::size_t kMessageBytes = std::size_t{8}
                                               << 20U;  // a capture could make thousands of slaves keep it

  EventSink& events_;
  const SlaveStates& states_;
  Allowance message_bytes_{kMessageBytes};
  std::vector<Slave> slaves_;
};

}  // namespace ecaudit::track
