/// in: accesses to one mailbox of a slave.  out: whole messages.
///
/// keeps: where the mailbox is, the message in the making, and the hash by which a repetition of the last one is
/// recognised.
#pragma once

#include <cstdint>
#include <optional>

#include "decoder/mailbox/events.h"
#include "decoder/mailbox/message_bytes.h"
#include "decoder/track/access.h"
#include "decoder/track/mailbox_window.h"

namespace ecaudit::track {

struct MailboxBox {
  explicit MailboxBox(Allowance* allowance) : bytes(0xFFFF, allowance) {}

  EscAddress start = 0;
  std::uint16_t length = 0;
  MailboxUse use = MailboxUse::kUnknown;
  bool open = false;      ///< the first byte was accessed, the last not yet
  bool answered = false;  ///< since then the slave gave a message: perhaps the answer to this one
  bool counter_known = false;
  std::uint8_t counter = 0;
  bool has_last = false;  ///< last message, for recognising repetitions
  std::uint64_t last_hash = 0;
  Acceptance last_acceptance = Acceptance::kAccepted;
  FrameNo last_frame = 0;                                       ///< of the newest message, repetitions included
  FrameNo last_original = 0;                                    ///< of the newest message, repetitions left out
  mailbox::Protocol last_protocol = mailbox::Protocol::kError;  ///< of the newest message
  std::uint64_t refused_hash = 0;                               ///< of the message that the slave did not take last
  std::uint32_t refusals = 0;                                   ///< how often it did not take that one
  Acceptance acceptance = Acceptance::kAccepted;
  FrameRef first;
  EscAddress inferred_start = 0;  ///< 0: none recognised yet
  mailbox::MessageBytes bytes;    ///< from the first byte on, without gaps

  [[nodiscard]] std::uint32_t end() const { return static_cast<std::uint32_t>(start) + length; }
  /// The access touches the mailbox.
  [[nodiscard]] bool Overlaps(std::uint32_t address, std::size_t count) const {
    return address < end() && address + count > start;
  }
  /// @return another mailbox than before, which was in use
  bool Configure(EscAddress new_start, std::uint16_t new_length, MailboxUse new_use);
  /// A message in the making begins with this access.
  void Begin(const FrameRef& frame, Acceptance of);
  /// Adds an accepted access to the message in the making.
  /// @return the message, when the last byte was accessed; valid until the next call
  std::optional<ByteSpan> Add(const SlaveAccess& access, ByteSpan data);
  [[nodiscard]] mailbox::CounterStep StepOf(const mailbox::Header& header) const;
  /// The bytes are those of the last message, by their hash.
  [[nodiscard]] bool SameAsLast(ByteSpan message) const;
  /// The slave did not take this message.
  void Refused(ByteSpan message);
  /// A message is whole.
  void Delivered(const mailbox::MailboxMessage& message, std::uint64_t hash);
  /// What comes next has nothing to do with what was before.
  void End() {
    open = counter_known = has_last = false;
    refusals = 0;
  }
};

/// Distinguishes two messages; collisions only make a repetition out of a message that follows a repeat request. What
/// follows a message in the mailbox does not count.
[[nodiscard]] std::uint64_t HashOfMessage(ByteSpan bytes);

}  // namespace ecaudit::track
