/// Any bytes as a capture file: pcap, pcapng, plain or compressed, whatever they look like; also with the clocks of two
/// interfaces compared.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "decoder/bus/aligned_source.h"
#include "decoder/capture/capture_stream.h"

namespace {

using ecaudit::capture::CapturedFrame;
using ecaudit::capture::CaptureInfo;
using ecaudit::capture::FrameSource;
using ecaudit::capture::ReadStatus;

/// What every source promises, whatever the file.
void Check(bool holds) {
  if (!holds) std::abort();
}

void ReadAll(FrameSource& source) {
  const CaptureInfo& info = source.info();
  CapturedFrame frame;
  std::uint64_t frames = 0;
  std::uint64_t last_number = 0;
  unsigned sum = 0;
  ReadStatus status = ReadStatus::kFrame;
  while ((status = source.Next(frame)) == ReadStatus::kFrame) {
    Check(frame.number > last_number);
    last_number = frame.number;
    Check(info.packets == ++frames);
    Check(frame.interface_index < info.interfaces.size());
    Check(frame.link_type == info.interfaces[frame.interface_index].link_type);
    Check(frame.has_time || frame.time == 0);
    for (const std::uint8_t byte : frame.bytes) sum += byte;
  }
  Check(info.damage.has_value() == (status == ReadStatus::kDamaged));
  Check(!info.damage || (!info.damage->message.empty() && info.damage->after_frame >= last_number));
  Check(info.comments.size() <= 1000);
  for (const auto& interface : info.interfaces) Check(interface.resolution_ns > 0);
  Check(source.Next(frame) == status);
  Check(source.bytes_read() <= source.bytes_total());
  volatile unsigned keep = sum;  // the bytes are really read
  static_cast<void>(keep);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::uint64_t kDecompressedLimit = 4U << 20U;
  const auto open = [&] { return ecaudit::capture::OpenCaptureFromMemory({data, size}, "input", kDecompressedLimit); };
  auto opened = open();
  if (!opened) {
    Check(!opened.error().message.empty());
    return 0;
  }
  ReadAll(**opened);
  auto aligned = ecaudit::bus::OpenAligned(open);
  Check(aligned.has_value());
  ReadAll(**aligned);
  return 0;
}
