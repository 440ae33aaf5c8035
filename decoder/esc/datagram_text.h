/// A datagram as one line for people.
#pragma once

#include <string>

#include "decoder/wire/frame_view.h"

namespace ecaudit::esc {

/// What the address and the data of a datagram show; command, station and working counter are elsewhere.
///
///   outbound read      "AL Status - AL Status Code"
///   returned read      "AL Status: PREOP+ERR; AL Status Code: 0x001d invalid output configuration"
///   broadcast read     "AL Status: OP (all slaves ORed)"
///   write              "SM0: 0x1800 1024 bytes, mailbox, ECAT writes, PDI irq, enabled"
///   no slave took part   "AL Status (no answer)", "AL Control: OP (not accepted)"
///   process data       "logical 0x00010000, 34 bytes"
///
/// @param returned the copy that passed the slaves. Where the direction is unknown, a working counter other than 0
/// shows so
/// @return "" for NOP and for a command that does not exist
[[nodiscard]] std::string DescribeDatagram(const wire::DatagramView& datagram, bool returned);

}  // namespace ecaudit::esc
