/// Puts the fragments of SoE messages of one direction together.
///
/// In:   MailboxMessage (SoE) of one direction in wire order, repeated ones left out.
/// Out:  SoeMessage when whole; given up ones too, marked fragment_error.
/// Keeps: one message of at most kMaxStoredBytes; more is counted.
#pragma once

#include <cstdint>

#include "decoder/base/event_sink.h"
#include "decoder/mailbox/events.h"
#include "decoder/mailbox/message_bytes.h"
#include "decoder/mailbox/soe.h"

namespace ecaudit::mailbox {

class SoeReassembler {
 public:
  static constexpr std::size_t kMaxStoredBytes = 64U << 10U;

  /// @param bytes what all slaves share for messages in the making; null: no common limit
  explicit SoeReassembler(Allowance* bytes = nullptr) : data_(kMaxStoredBytes, bytes) {}

  /// @param request  the outstanding request a response answers, not seen() when there is none
  void OnMessage(const MailboxMessage& message, const FrameRef& request, EventSink& sink);
  /// Gives up an unfinished message.
  void End(EventSink& sink);

 private:
  void Emit(EventSink& sink);

  bool open_ = false;
  std::uint16_t fragments_left_ = 0;
  SoeMessage message_;
  MessageBytes data_;
};

}  // namespace ecaudit::mailbox
