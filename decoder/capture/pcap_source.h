/// in: the bytes of a classic pcap file.  out: CapturedFrame.
#pragma once

#include <memory>
#include <string>

#include "decoder/base/result.h"
#include "decoder/capture/frame_source.h"
#include "decoder/capture/input_stream.h"

namespace ecaudit::capture {

/// True when `head` (4 bytes or more) begins like a pcap file of any kind that libpcap reads.
[[nodiscard]] bool IsPcap(ByteSpan head);

/// Reads a pcap file: micro- or nanoseconds, both byte orders, the variants that libpcap knows. libpcap evaluates the
/// file header; the packets are read in place, many at a time, as libpcap would read them (its loop copies each twice).
///
/// info().interfaces[0] is filled from the start; link_type is the LINKTYPE_ number in the file.
/// Seconds count from 1970 to 2106 (unsigned, as Wireshark reads them).
/// @param name  the file in messages and in info().path
/// @return one line when the file header is cut or not valid
Result<std::unique_ptr<FrameSource>> OpenPcap(std::unique_ptr<InputStream> stream, const std::string& name);

}  // namespace ecaudit::capture
