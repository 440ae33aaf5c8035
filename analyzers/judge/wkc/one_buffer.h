/// in: one working counter.  out: whether a slave whose sync managers of process data have one buffer counted for them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "analyzers/judge/rule_context.h"
#include "decoder/track/events.h"

namespace ecaudit::wkc {

/// The part of a slave in one datagram that is open: it counts only if its application has filled the buffer of its
/// inputs, or emptied that of its outputs, since the last datagram.
struct OneBufferUse {
  struct Way {
    std::optional<std::uint8_t> manager;  ///< sync manager with one buffer; empty: this part is not open
    bool counted = false;
  };
  SlaveId slave = kNoSlave;
  std::array<Way, 2> ways;  ///< outputs, inputs
};

/// @return empty if the sum does not show it: slaves are unknown or not in OP, or several have one buffer
[[nodiscard]] std::optional<OneBufferUse> UseOfOneBuffer(const RuleContext& context,
                                                         const track::LogicalAccess& access);

/// The capture shows that SYNC0 is off in that slave (0x0981).
[[nodiscard]] bool IsSync0Off(const RuleContext& context, SlaveId slave);

}  // namespace ecaudit::wkc
