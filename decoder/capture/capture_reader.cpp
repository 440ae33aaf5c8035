#include "decoder/capture/capture_reader.h"

#include <array>
#include <string_view>
#include <utility>

#include "decoder/base/text.h"
#include "decoder/capture/capture_stream.h"
#include "decoder/capture/pcap_source.h"
#include "decoder/capture/pcapng_source.h"

namespace ecaudit::capture {
namespace {

constexpr std::uint32_t kSectionHeaderType = 0x0A0D0D0A;  // the same in both byte orders

struct OtherFormat {
  std::string_view magic;
  std::string_view what;
};

/// Files that people hand to a capture reader by mistake, and what to do with them.
constexpr std::array kOtherFormats{
    OtherFormat{"GMBU", "it is a Microsoft Network Monitor file; 'editcap -F pcapng' converts it"},
    OtherFormat{"RTSS", "it is a Microsoft Network Monitor file; 'editcap -F pcapng' converts it"},
    OtherFormat{"snoop", "it is a snoop file; 'editcap -F pcapng' converts it"},
    OtherFormat{"BZh", "it is bzip2-compressed; only gzip and zstd are read"},
    OtherFormat{"\xFD"
                "7zXZ",
                "it is xz-compressed; only gzip and zstd are read"},
    OtherFormat{"\x04\x22\x4D\x18", "it is lz4-compressed; only gzip and zstd are read"},
    OtherFormat{"PK\x03\x04", "it is a zip archive; unpack it first"},
};

std::string WhyNot(ByteSpan head, const std::string& name) {
  const std::string start = DisplayName(name) + " is not a capture: ";
  for (const OtherFormat& format : kOtherFormats) {
    const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
    if (text.starts_with(format.magic)) return start + std::string(format.what);
  }
  return start + "neither pcap nor pcapng";
}

}  // namespace

std::string DisplayName(const std::string& name) {
  return name == "-" ? "standard input" : Printable(name);
}

std::string StreamDamage(const InputStream& stream, FrameNo last_frame) {
  if (last_frame == 0) return stream.error() + ", before the first packet";
  return stream.error() + ", after packet " + std::to_string(last_frame);
}

std::string FormatName(const char* container, Compression compression) {
  std::string name = container;
  if (compression == Compression::kGzip) name += "+gzip";
  if (compression == Compression::kZstd) name += "+zstd";
  return name;
}

Result<std::unique_ptr<FrameSource>> OpenCaptureStream(std::unique_ptr<InputStream> stream, const std::string& name) {
  const ByteSpan head = stream->Peek(8);
  if (!stream->error().empty() && head.size() < 8) return Error{DisplayName(name) + ": " + stream->error()};
  if (head.empty()) return Error{DisplayName(name) + " is empty, not a capture"};
  if (Fits(head, 0, 4) && LittleEndian<std::uint32_t>(head, 0) == kSectionHeaderType) {
    return OpenPcapng(std::move(stream), name);
  }
  if (IsPcap(head)) return OpenPcap(std::move(stream), name);
  return Error{WhyNot(Slice(head, 0, 8), name)};
}

Result<std::unique_ptr<FrameSource>> OpenCaptureFromMemory(ByteSpan bytes, const std::string& name,
                                                           std::uint64_t decompressed_limit) {
  return OpenCaptureStream(InputStream::FromMemory(bytes, decompressed_limit), name);
}

Result<std::unique_ptr<FrameSource>> OpenCapture(const std::string& path, const std::atomic<bool>* stop) {
  Result<std::unique_ptr<InputStream>> stream = InputStream::Open(path, InputStream::kDefaultDecompressedLimit, stop);
  if (!stream) return stream.error();
  return OpenCaptureStream(std::move(*stream), path);
}

}  // namespace ecaudit::capture
