/// keeps: totals of what went through the mailboxes of one slave.
#pragma once

#include <cstdint>

namespace ecaudit::track {

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

}  // namespace ecaudit::track
