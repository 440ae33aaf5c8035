/// Any bytes as a capture file, through the whole analysis into every report.
#include <cstddef>
#include <cstdint>

#include "decoder/capture/capture_stream.h"
#include "tests/fuzz/whole_analysis.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::uint64_t kDecompressedLimit = 1U << 20U;
  constexpr std::uint64_t kLeastRecord = 12;  // journal entries of pcapng have numbers, too
  auto opened = ecaudit::capture::OpenCaptureFromMemory({data, size}, "in\x1b[2Jput\xff", kDecompressedLimit);
  if (opened) ecaudit::fuzz::AnalyseAndReport(**opened, size, kDecompressedLimit / kLeastRecord);
  return 0;
}
