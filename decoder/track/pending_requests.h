/// in: requests and answers of one slave, looks into its mailboxes.  out: MailboxAnswered,
/// MailboxUnanswered, MailboxStuck.
///
/// keeps: one request for each kind that can wait side by side with the others, and the latest one of all.
#pragma once

#include <array>
#include <cstdint>

#include "decoder/base/event_sink.h"
#include "decoder/mailbox/events.h"
#include "decoder/track/mailbox_counters.h"

namespace ecaudit::track {

/// What kinds of request can wait for an answer side by side.
enum class MailboxChannel : std::uint8_t { kAoE, kEoE, kSdo, kSdoInfo, kFoE, kSoE, kCount };

class PendingRequests {
 public:
  /// @param counters, sink must outlive this
  PendingRequests(SlaveId slave, MailboxCounters& counters, EventSink& sink)
      : slave_(slave), counters_(counters), sink_(sink) {}

  struct Request {
    bool active = false;
    bool read_lost = false;
    Certainty certainty = Certainty::kObserved;
    mailbox::RequestSummary request;
    std::uint64_t polls = 0;
    FrameRef first_poll;
    FrameRef last_poll;
    std::uint32_t parts = 0;  ///< of the answer, which is not whole yet
    FrameRef last_part;
    FrameRef since;  ///< the last part, or the request, by the clock as it was set since then
  };

  /// The master wrote something that an error reply may answer.
  void Wrote(const mailbox::MailboxMessage& message);
  /// Something was written to the out mailbox, or may have been, be it readable or not.
  void Filled();
  /// What was written to the out mailbox before this frame is not known.
  void BeginAfterGap(const FrameRef& frame) { gap_ = frame; }
  void Await(MailboxChannel channel, const mailbox::MailboxMessage& message);
  /// The request waits no longer. @param by  the message that answers it; not seen(): the master ended it
  void Answered(MailboxChannel channel, const FrameRef& by = {});
  /// A part of the answer came, and more is to follow: the wait for that begins.
  void AnsweredInPart(MailboxChannel channel, const FrameRef& part);
  /// The slave sent a message of this protocol: it has it.
  void HasAnswered(mailbox::Protocol protocol) {
    answered_ |= 1U << static_cast<unsigned>(protocol);
    ReportStuck(false);
  }
  /// Frame of the request that waits, not seen() when none does.
  [[nodiscard]] FrameRef Waiting(MailboxChannel channel) const {
    const Request& r = requests_[static_cast<std::size_t>(channel)];
    return r.active ? r.request.frame : FrameRef{};
  }
  /// The request that was written last, of those that wait; null: none does.
  [[nodiscard]] const Request* Latest() const;
  /// Counter of the request that an answer would echo.
  [[nodiscard]] std::uint8_t LatestCounter() const;

  /// What an error reply with this counter answers.
  struct ErrorAnswer {
    mailbox::RequestSummary request;                  ///< not seen() when it is not known
    MailboxChannel channel = MailboxChannel::kCount;  ///< of the request that waited; kCount: none did
  };
  /// The request waits no longer.
  /// @param detail  of the error reply: an unsupported protocol is never one that the slave supports
  [[nodiscard]] ErrorAnswer OnErrorReply(std::uint8_t counter, std::uint16_t detail);

  /// The master looked for an answer and the mailbox was empty.
  void Poll(const FrameRef& frame);
  /// The master looked whether the out mailbox is full.
  /// @param mailbox it is known to be one
  void SawOutMailbox(bool full, bool mailbox, const FrameRef& frame);
  /// A read sent in this frame never returned: it may have taken an answer.
  /// @return the request it belongs to, not seen() when there is none
  mailbox::RequestSummary OnLostRead(FrameNo sent);
  /// The request in `frame` turns out to have reached the slave.
  void Arrived(FrameNo frame, Certainty certainty);
  /// Nothing is waited for any more.
  void End(mailbox::TransferEnd why, const FrameRef& frame);

 private:
  Request& Of(MailboxChannel channel) { return requests_[static_cast<std::size_t>(channel)]; }
  /// The out mailbox is full no more, or of something else.
  void ReportStuck(bool reset);
  void Unanswered(Request& request, mailbox::MailboxUnanswered::End end, const FrameRef& frame);

  SlaveId slave_;
  MailboxCounters& counters_;
  EventSink& sink_;
  std::array<Request, static_cast<std::size_t>(MailboxChannel::kCount)> requests_;
  mailbox::RequestSummary last_;
  bool last_answerable_ = false;  // an error reply may still answer it
  unsigned answered_ = 0;         // protocols that the slave speaks, a bit each
  bool out_full_ = false;         // last read of the status of the out mailbox
  FrameNo out_full_since_ = 0;    // frame of that look; 0: never looked
  FrameRef gap_;                  // nothing was written since; not seen(): that is not known
  bool filled_ = false;           // what stands in it may be what the capture shows
  mailbox::MailboxStuck stuck_;   // looks that found it full, of what the capture does not hold
};

}  // namespace ecaudit::track
