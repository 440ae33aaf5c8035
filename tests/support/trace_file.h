/// The packets of a trace as a capture file, for tests of the whole program and for looking at a trace in Wireshark.
#pragma once

#include "samples/builder/frame_builder.h"
#include "tests/support/trace_builder.h"

namespace ecaudit::test {

/// As pcapng: interfaces and packets without time stamp are kept.
[[nodiscard]] samples::Bytes PcapNgOf(const Trace& trace);
/// As pcap with nanoseconds, which has one interface and a stamp for each packet.
[[nodiscard]] samples::Bytes PcapOf(const Trace& trace);

}  // namespace ecaudit::test
