/// in: SlaveAccess of one slave.  out: the events of mailbox/events.h.
///
/// Puts mailbox messages together from whatever accesses the master uses - the whole mailbox in one datagram, data and
/// last byte apart (TwinCAT), a peek at the length before the rest, several frames - and hands them to the protocols.
///
/// A mailbox is opened by an access to its first byte and closed by one to its last byte that the slave accepted; only
/// then is a message complete (esc-reference 6.2). A write into a full mailbox and a read from an empty one are refused
/// (working counter 0). Where the sync managers' configuration was never seen, messages are recognised by their
/// contents and marked (esc-reference 3.5).
#pragma once

#include <array>
#include <cstdint>

#include "decoder/base/event_sink.h"
#include "decoder/mailbox/eoe.h"
#include "decoder/mailbox/events.h"
#include "decoder/mailbox/foe.h"
#include "decoder/mailbox/message_bytes.h"
#include "decoder/mailbox/sdo_info.h"
#include "decoder/mailbox/sdo_transfer.h"
#include "decoder/mailbox/soe_reassembler.h"
#include "decoder/track/access.h"
#include "decoder/track/slave_state.h"

namespace ecaudit::track {

/// What a sync manager does for the mailbox.
enum class MailboxUse : std::uint8_t {
  kUnknown,  ///< its configuration was not seen: messages are recognised by their contents
  kOn,
  kOff,   ///< switched off: what looks like a message is one that the slave cannot hear
  kNone,  ///< carries process data: the slave has no mailbox
};

/// Where the mailboxes of a slave are: sync managers 0 (out) and 1 (in).
struct MailboxWindow {
  EscAddress out_start = 0;
  std::uint16_t out_length = 0;  ///< 0 unless kOn
  EscAddress in_start = 0;
  std::uint16_t in_length = 0;  ///< 0 unless kOn
  MailboxUse out_use = MailboxUse::kUnknown;
  MailboxUse in_use = MailboxUse::kUnknown;

  bool operator==(const MailboxWindow&) const = default;
};

/// The mailbox window as the registers of sync managers 0 and 1 say, as far as known.
[[nodiscard]] MailboxWindow MailboxWindowOf(const SlaveState& state);

/// Totals of one slave.
struct MailboxCounters {
  std::uint64_t requests = 0;   ///< messages written, repetitions left out
  std::uint64_t responses = 0;  ///< messages read, repetitions left out
  std::uint64_t refused_writes = 0;
  std::uint64_t empty_reads = 0;  ///< reads refused because the mailbox was empty
  std::uint64_t lost_reads = 0;
  std::uint64_t repeated = 0;  ///< in both directions
  std::uint64_t malformed = 0;
  std::uint64_t error_replies = 0;
  std::uint64_t sdo_aborts = 0;  ///< abort messages of both sides
  std::uint64_t emergencies = 0;
  std::uint64_t unanswered = 0;
};

class MailboxTracker {
 public:
  /// @param bytes what all slaves share for messages in the making; null: no common limit; else must outlive this
  MailboxTracker(SlaveId slave, EventSink& sink, Allowance* bytes = nullptr);

  /// The configuration valid from now on; nothing happens when it is the same as before. A change of a known one ends
  /// everything that is open.
  void SetWindow(const MailboxWindow& window, const FrameRef& frame);
  /// Whether OnAccess() does anything with such an access.
  [[nodiscard]] static bool Concerns(const SlaveAccess& access);
  /// Any access to this slave, in the order in which they became known; those that do not concern mailboxes are ignored
  /// quickly.
  void OnAccess(const SlaveAccess& access);
  /// The slave went to INIT: its mailboxes and counters start again.
  void Reset(const FrameRef& frame);
  /// Frames are missing from the capture: what is open stays unknown.
  void Forget(const FrameRef& frame);
  /// The capture ends.
  void Finish();

  [[nodiscard]] const MailboxCounters& counters() const { return counters_; }

 private:
  /// What kinds of request can wait for an answer side by side.
  enum class Channel : std::uint8_t { kAoE, kEoE, kSdo, kSdoInfo, kFoE, kSoE, kCount };

  struct Pending {
    bool active = false;
    bool read_lost = false;
    Certainty certainty = Certainty::kObserved;
    mailbox::RequestSummary request;
    std::uint64_t polls = 0;
    FrameRef first_poll;
    FrameRef last_poll;
  };

  /// One direction.
  struct Box {
    explicit Box(Allowance* allowance) : bytes(0xFFFF, allowance) {}

    EscAddress start = 0;
    std::uint16_t length = 0;
    MailboxUse use = MailboxUse::kUnknown;
    bool open = false;  // the first byte was accessed, the last not yet
    bool counter_known = false;
    std::uint8_t counter = 0;
    bool has_last = false;  // last message, for recognising repetitions
    std::uint64_t last_hash = 0;
    Acceptance last_acceptance = Acceptance::kAccepted;
    FrameNo last_frame = 0;     // of the newest message, repetitions included
    FrameNo last_original = 0;  // of the newest message, repetitions left out
    Acceptance acceptance = Acceptance::kAccepted;
    FrameRef first;
    EscAddress inferred_start = 0;  // 0: none recognised yet
    mailbox::MessageBytes bytes;    // from the first byte on, without gaps

    [[nodiscard]] std::uint32_t end() const { return static_cast<std::uint32_t>(start) + length; }
  };

  void OnWrite(const SlaveAccess& access);
  void OnRead(const SlaveAccess& access);
  void OnRegisters(const SlaveAccess& access);
  void OnLostRead(const SlaveAccess& access);
  void OnUnconfiguredWrite(const SlaveAccess& access);
  void OnUnconfiguredRead(const SlaveAccess& access);
  void OnRefusedWrite(const SlaveAccess& access, ByteSpan bytes);
  void Arrived(Certainty certainty);
  void OnLateWrite(const SlaveAccess& access, ByteSpan bytes);
  void OnRepeatBit(const SlaveAccess& access);
  void Assemble(Box& box, mailbox::Direction direction, const SlaveAccess& access, ByteSpan data);
  static bool Configure(Box& box, EscAddress start, std::uint16_t length, MailboxUse use);
  void Poll(const FrameRef& frame);

  void Deliver(Box& box, mailbox::Direction direction, ByteSpan bytes, const SlaveAccess& access);
  void DeliverIncomplete(const SlaveAccess& access);
  [[nodiscard]] mailbox::CounterStep StepOf(const Box& box, const mailbox::Header& header) const;
  [[nodiscard]] bool IsRepetition(const Box& box, mailbox::Direction direction, const mailbox::Header& header,
                                  std::uint64_t hash) const;
  void DispatchOut(const mailbox::MailboxMessage& message);
  void DispatchIn(const mailbox::MailboxMessage& message);
  void DispatchCoeOut(const mailbox::MailboxMessage& message);
  void DispatchCoeIn(const mailbox::MailboxMessage& message);
  void DispatchAoe(const mailbox::MailboxMessage& message, const FrameRef& request);
  void DispatchVoe(const mailbox::MailboxMessage& message);
  void OnErrorReply(const mailbox::MailboxMessage& message);

  [[nodiscard]] Pending& pending(Channel channel) { return pending_[static_cast<std::size_t>(channel)]; }
  void Await(Channel channel, const mailbox::MailboxMessage& message);
  void Answered(Channel channel) { pending(channel).active = false; }
  void Unanswered(Pending& pending, mailbox::MailboxUnanswered::End end, const FrameRef& frame);
  [[nodiscard]] const Pending* LatestPending() const;
  void EndAll(mailbox::TransferEnd why, const FrameRef& frame);

  SlaveId slave_;
  EventSink& sink_;
  MailboxWindow window_;
  Box out_;
  Box in_;
  std::array<Pending, static_cast<std::size_t>(Channel::kCount)> pending_;
  mailbox::RequestSummary last_out_;
  bool last_out_answerable_ = false;  // an error reply may still answer it
  bool repeat_bit_known_ = false;
  bool repeat_bit_ = false;
  bool repeat_requested_ = false;  // since the last message read
  bool repeat_acknowledged_ = false;
  bool out_full_ = false;       // last look at the status of the out mailbox
  FrameNo out_full_since_ = 0;  // frame of that look; 0: never looked
  MailboxCounters counters_;
  mailbox::SdoTransferTracker sdo_;
  mailbox::SdoInfoTracker sdo_info_;
  mailbox::FoeTracker foe_;
  mailbox::EoeReassembler eoe_out_;
  mailbox::EoeReassembler eoe_in_;
  mailbox::SoeReassembler soe_out_;
  mailbox::SoeReassembler soe_in_;
};

}  // namespace ecaudit::track
