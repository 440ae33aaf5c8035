/// Opens capture files of any supported container as a FrameSource.
#pragma once

#include <atomic>
#include <memory>
#include <span>
#include <string>

#include "decoder/base/result.h"
#include "decoder/capture/frame_source.h"

namespace ecaudit::capture {

/// Opens one capture: pcap (micro- and nanoseconds, both byte orders), pcapng, plain or gzip- or zstd-compressed.
///
/// @param path  a file, or "-" for standard input
/// @return a source at the first packet; or one line with the reason ("no such file: x.pcap", "x.txt is not a
/// capture").
///         A file that is damaged after its header opens, and reports the damage where it is reached.
/// @param stop  once it is set the source ends, also where a pipe gives nothing; null: never
Result<std::unique_ptr<FrameSource>> OpenCapture(const std::string& path, const std::atomic<bool>* stop = nullptr);

/// Opens several files of one ring buffer as one capture, packets merged by time stamp and numbered again from 1;
/// packets without a stamp keep the place they have in their file. joined_source.h describes it exactly: equal stamps,
/// interfaces, comments, and damage, which ends only the file that has it. `stop` as for OpenCapture().
Result<std::unique_ptr<FrameSource>> OpenJoined(std::span<const std::string> paths,
                                                const std::atomic<bool>* stop = nullptr);

}  // namespace ecaudit::capture
