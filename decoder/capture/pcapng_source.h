/// in: the bytes of a pcapng file.  out: CapturedFrame.
///
/// Our own reader, because libpcap hides what we need of this format: the interface of a packet, its direction flags,
/// the comments, the drop counters, and files with different interfaces. Source: draft-ietf-opsawg-pcapng ("PCAP Next
/// Generation (pcapng) Capture File Format").
#pragma once

#include <memory>
#include <string>

#include "decoder/base/result.h"
#include "decoder/capture/frame_source.h"
#include "decoder/capture/input_stream.h"

namespace ecaudit::capture {

/// Reads a pcapng file after its block type 0x0A0D0D0A.
///
/// Numbers: each enhanced, simple and obsolete packet block is one frame, whatever its link type, as Wireshark counts.
/// Wireshark also numbers journal entries, sysdig events and custom blocks: they take their number but give no frame,
/// so numbers may have gaps there. Interfaces: numbered from 0 over all sections, in the order of their descriptions.
/// Dropped packets of an interface: the last statistics block's counters (if_drop + os_drop, which run from the start
/// of the capture), or the sum of the packets' own drop counts (epb_dropcount, drops of obsolete packet blocks) if
/// larger. Blocks of other types are passed over. A block that is inconsistent (length, trailing length, interface,
/// captured length) is damage: reading ends there, since nothing after it can be trusted.
/// @param name  the file in messages and in info().path
/// @return one line when the first section header is no valid one
Result<std::unique_ptr<FrameSource>> OpenPcapng(std::unique_ptr<InputStream> stream, const std::string& name);

}  // namespace ecaudit::capture
