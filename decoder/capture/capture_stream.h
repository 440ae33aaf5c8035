/// Opens a capture that is not a named file: memory, a pipe, a descriptor.
#pragma once

#include <memory>
#include <string>

#include "decoder/base/result.h"
#include "decoder/capture/frame_source.h"
#include "decoder/capture/input_stream.h"

namespace ecaudit::capture {

/// Finds out what `stream` holds and opens it; see OpenCapture().
/// @param name  of the file in messages and in info().path
Result<std::unique_ptr<FrameSource>> OpenCaptureStream(std::unique_ptr<InputStream> stream, const std::string& name);

/// Opens a whole capture file that lies in memory; `bytes` must outlive the source.
/// @param decompressed_limit  see InputStream
Result<std::unique_ptr<FrameSource>> OpenCaptureFromMemory(
    ByteSpan bytes, const std::string& name = "memory",
    std::uint64_t decompressed_limit = InputStream::kDefaultDecompressedLimit);

/// `name` as messages show it: "standard input" for "-", without control characters.
[[nodiscard]] std::string DisplayName(const std::string& name);

/// What failed underneath, and where: "the gzip data end early, after packet 811".
[[nodiscard]] std::string StreamDamage(const InputStream& stream, FrameNo last_frame);

/// "pcap" or "pcapng", with "+gzip" or "+zstd" after it.
[[nodiscard]] std::string FormatName(const char* container, Compression compression);

}  // namespace ecaudit::capture
