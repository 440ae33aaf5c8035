/// in: several captures of one ring buffer.  out: CapturedFrame, as from one capture.
#pragma once

#include <atomic>
#include <memory>
#include <span>
#include <string>

#include "decoder/base/result.h"
#include "decoder/capture/frame_source.h"

namespace ecaudit::capture {

/// Merges `paths` by time stamp; OpenJoined() of capture_reader.h is this.
///
/// Order: always the packet that is earliest among the next ones of all files. Packets of one file keep their order,
/// even where their stamps go back. With equal stamps the file whose first packet is earlier comes first, then the one
/// named first; so the order of `paths` does not matter for files of one ring buffer. A packet without a stamp follows
/// the packet before it in its file; at the start of a file it comes before everything with a stamp. Numbers: from 1
/// again over all files, as in the file that `mergecap -w all.pcapng FILE...` writes. Interfaces: those with equal
/// name, link type, snap length and resolution are one interface, so that a ring buffer of one interface stays one
/// interface. Its `dropped` is the largest of the files': those counters run from the start of the capture, not of the
/// file. Comments: of packets under their new number; of whole files each text once. Damage: a damaged file ends there
/// and the others go on; at the end Next() returns kDamaged. info().damage is there as soon as the first damage is met:
/// its message names each damaged file (the first ten of them) and counts packets as that file does, `after_frame` is
/// the new number of the last packet before the first damage, `offset` lies in that file. Open files: only those that
/// overlap in time at that moment, and those that cannot be opened twice (pipes).
/// @return one line when `paths` is empty or one of them does not open
Result<std::unique_ptr<FrameSource>> OpenJoinedFiles(std::span<const std::string> paths,
                                                     const std::atomic<bool>* stop = nullptr);

}  // namespace ecaudit::capture
