/// in: registers of sync managers 0 and 1.  out: where the mailboxes of a slave are.
#pragma once

#include <cstdint>

#include "decoder/track/slave_state.h"

namespace ecaudit::track {

/// What a sync manager does for the mailbox.
enum class MailboxUse : std::uint8_t {
  kUnknown,  ///< its configuration was not seen: messages are recognised by their contents
  kOn,
  kOff,   ///< switched off: what looks like a message is one that the slave cannot receive
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

/// The mailbox window as the registers of sync managers 0 and 1 show, as far as known.
[[nodiscard]] MailboxWindow MailboxWindowOf(const SlaveState& state);

}  // namespace ecaudit::track
