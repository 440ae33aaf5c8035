/// in: SlaveAccess of one slave.  out: the events of mailbox/events.h.
///
/// keeps: both mailboxes and what they hold unfinished; PendingRequests and the trackers of the protocols keep the rest
/// (MailboxProtocols).
///
/// Puts mailbox messages together from whatever accesses the master uses - the whole mailbox in one datagram, data and
/// last byte apart (TwinCAT), a peek at the length before the rest, several frames - and hands them to the protocols.
///
/// A mailbox is opened by an access to its first byte and closed by one to its last byte that the slave accepted; only
/// then is a message complete (esc-reference 6.2). A write into a full mailbox and a read from an empty one are refused
/// (working counter 0). Where the sync managers' configuration was never seen, messages are recognised by their
/// contents and marked (esc-reference 3.5).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "decoder/base/allowance.h"
#include "decoder/base/event_sink.h"
#include "decoder/mailbox/events.h"
#include "decoder/track/access.h"
#include "decoder/track/doubtful_request.h"
#include "decoder/track/mailbox_box.h"
#include "decoder/track/mailbox_counters.h"
#include "decoder/track/mailbox_protocols.h"
#include "decoder/track/mailbox_window.h"
#include "decoder/track/repeat_requests.h"

namespace ecaudit::track {

class MailboxTracker {
 public:
  /// @param bytes what all slaves share for messages in the making; null: no common limit; else must outlive this
  MailboxTracker(SlaveId slave, EventSink& sink, Allowance* bytes = nullptr)
      : slave_(slave),
        sink_(sink),
        box_bytes_(kBoxBytes, bytes),
        out_(&box_bytes_),
        in_(&box_bytes_),
        repeats_(slave, sink),
        protocols_(slave, counters_, sink, bytes),
        shared_bytes_(bytes) {}
  MailboxTracker(const MailboxTracker&) = delete;
  MailboxTracker& operator=(const MailboxTracker&) = delete;

  /// What was sent to the slave before there was something to track.
  void Begin(const MailboxWindow& window, std::optional<bool> repeat_bit) {
    SetWindow(window, {});
    if (repeat_bit) repeats_.Begin(*repeat_bit);
  }
  /// The configuration valid from now on; nothing happens when it is the same as before. A change of a known one ends
  /// everything that is open.
  void SetWindow(const MailboxWindow& window, const FrameRef& frame);
  /// Whether OnAccess() does anything with such an access.
  [[nodiscard]] static bool Concerns(const SlaveAccess& access);
  /// Any access to this slave, in the order in which they became known; those that do not concern mailboxes are ignored
  /// quickly.
  void OnAccess(const SlaveAccess& access);
  /// A frame was overtaken, and whether the slave took this access is not known: its next message may depend on it.
  /// What became of it follows by OnAccess().
  void OnDoubtful(const SlaveAccess& access);
  /// The slave went to INIT: its mailboxes and counters start again.
  void Reset(const FrameRef& frame);
  /// Frames are missing from the capture: what is open stays unknown.
  void Forget(const FrameRef& frame);
  /// The capture ends.
  void Finish();

  [[nodiscard]] const MailboxCounters& counters() const { return counters_; }

 private:
  /// For the messages in its mailboxes. No other slave can take it away: a message that there is no room for would be
  /// lost.
  static constexpr std::size_t kBoxBytes = 4096;

  void OnWrite(const SlaveAccess& access);
  void OnRead(const SlaveAccess& access);
  void OnRegisters(const SlaveAccess& access);
  void OnEmptyRead(const FrameRef& frame);
  void OnLostRead(const SlaveAccess& access);
  void PublishLostRead(const SlaveAccess& access);
  [[nodiscard]] static bool IsMessage(const MailboxBox& box, mailbox::Direction direction, ByteSpan bytes);
  void OnUnconfiguredWrite(const SlaveAccess& access);
  void OnUnconfiguredRead(const SlaveAccess& access);
  void OnRefusedWrite(const SlaveAccess& access, ByteSpan bytes);
  void OnLateWrite(const SlaveAccess& access, ByteSpan bytes);
  void Assemble(MailboxBox& box, mailbox::Direction direction, const SlaveAccess& access, ByteSpan data);

  [[nodiscard]] bool SettleDoubt(const SlaveAccess& access);
  void ProveRequest(ByteSpan answer, const SlaveAccess& read);
  void Deliver(MailboxBox& box, mailbox::Direction direction, ByteSpan bytes, const SlaveAccess& access);
  void DeliverIncomplete(const SlaveAccess& access);
  [[nodiscard]] mailbox::MailboxMessage Message(const MailboxBox& box, mailbox::Direction direction, ByteSpan bytes,
                                                const SlaveAccess& access) const;
  [[nodiscard]] bool IsRepetition(const MailboxBox& box, const mailbox::MailboxMessage& message,
                                  std::uint64_t hash) const;
  void Count(const mailbox::MailboxMessage& message);
  void EndAll(mailbox::TransferEnd why, const FrameRef& frame);

  /// Where the in mailbox was until it was set otherwise: that a frame was lost is known only some frames later.
  struct LeftWindow {
    EscAddress start = 0;
    std::uint16_t length = 0;
    FrameNo until = 0;

    [[nodiscard]] bool Held(const SlaveAccess& access) const {
      return access.sent.seen() && access.sent.number < until && access.address >= start &&
             access.address < std::uint32_t{start} + length;
    }
  };

  SlaveId slave_;
  EventSink& sink_;
  MailboxWindow window_;
  LeftWindow left_;
  Allowance box_bytes_;
  MailboxBox out_;
  MailboxBox in_;
  RepeatRequests repeats_;
  MailboxCounters counters_;
  MailboxProtocols protocols_;
  Allowance* shared_bytes_;
  std::unique_ptr<DoubtfulRequest> doubtful_;  // null until there is one
  FrameNo proven_ = 0;                         // the frame of the last one that an answer showed to have arrived
};

}  // namespace ecaudit::track
