/// Mailbox error reply (type 0): the slave could not do anything with a message.
///
///   | type 2, always 1 | detail 2 |
///
/// Source: ETG.1000.4 mailbox error service data; esc-reference 8.3.
#pragma once

#include <cstdint>
#include <string_view>

#include "decoder/base/bytes.h"

namespace ecaudit::mailbox {

struct ErrorReply {
  std::uint16_t type = 0;
  std::uint16_t detail = 0;
  bool too_short = false;  ///< what is missing reads as 0
};

[[nodiscard]] constexpr ErrorReply ParseErrorReply(ByteSpan payload) {
  return {LittleEndian<std::uint16_t>(payload, 0), LittleEndian<std::uint16_t>(payload, 2), payload.size() < 4};
}

/// Detail of a slave that does not know the protocol of a message.
inline constexpr std::uint16_t kUnsupportedProtocol = 2;

/// "the mailbox protocol is not supported" for detail 2; "" for a detail without a meaning.
[[nodiscard]] constexpr std::string_view MailboxErrorText(std::uint16_t detail) {
  constexpr std::string_view kTexts[] = {"",
                                         "the syntax of the mailbox header is wrong",
                                         "the mailbox protocol is not supported",
                                         "the channel field has a wrong value",
                                         "the service is not supported",
                                         "the mailbox header is invalid",
                                         "the mailbox data are too short",
                                         "no more memory in the slave",
                                         "the length of the data is inconsistent",
                                         "the service is already in work"};
  return detail < sizeof(kTexts) / sizeof(kTexts[0]) ? kTexts[detail] : std::string_view();
}

}  // namespace ecaudit::mailbox
