/// Any bytes as the files of one ring buffer: the input is cut into files at each "JOIN".
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>
#include <sys/mman.h>
#include <unistd.h>
#include <vector>

#include "decoder/capture/capture_reader.h"

namespace {

using ecaudit::capture::CapturedFrame;
using ecaudit::capture::CaptureInfo;
using ecaudit::capture::ReadStatus;

void Check(bool holds) {
  if (!holds) std::abort();
}

/// A file in memory that has a path.
class MemoryFile {
 public:
  explicit MemoryFile(std::string_view content) : fd_(::memfd_create("fuzz", MFD_CLOEXEC)) {
    Check(::write(fd_, content.data(), content.size()) == static_cast<ssize_t>(content.size()));
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { ::close(fd_); }

  [[nodiscard]] std::string path() const { return "/proc/self/fd/" + std::to_string(fd_); }

 private:
  int fd_;
};

/// Packets of each file alone; false when one of them does not open.
bool CountPackets(const std::vector<std::string>& paths, std::uint64_t& packets) {
  for (const std::string& path : paths) {
    auto source = ecaudit::capture::OpenCapture(path);
    if (!source) return false;
    CapturedFrame frame;
    while ((*source)->Next(frame) == ReadStatus::kFrame) ++packets;
  }
  return true;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::string_view kSeparator = "JOIN";
  constexpr std::size_t kMaxFiles = 5;
  const std::string input(data, data + size);
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= input.size() && parts.size() < kMaxFiles;) {
    const std::size_t end = std::min(input.find(kSeparator, begin), input.size());
    parts.push_back(input.substr(begin, end - begin));
    begin = end + kSeparator.size();
  }
  std::vector<std::unique_ptr<MemoryFile>> files;
  std::vector<std::string> paths;
  for (const std::string& part : parts) {
    files.push_back(std::make_unique<MemoryFile>(part));
    paths.push_back(files.back()->path());
  }

  std::uint64_t expected = 0;
  const bool all_open = CountPackets(paths, expected);
  auto opened = ecaudit::capture::OpenJoined(paths);
  Check(opened.has_value() == all_open);
  if (opened) {
    ecaudit::capture::FrameSource& source = **opened;
    const CaptureInfo& info = source.info();
    CapturedFrame frame;
    std::uint64_t number = 0;
    unsigned sum = 0;
    ReadStatus status = ReadStatus::kFrame;
    while ((status = source.Next(frame)) == ReadStatus::kFrame) {
      Check(frame.number == ++number && info.packets == number);
      Check(frame.interface_index < info.interfaces.size());
      Check(frame.link_type == info.interfaces[frame.interface_index].link_type);
      for (const std::uint8_t byte : frame.bytes) sum += byte;
    }
    Check(number == expected);
    Check(info.damage.has_value() == (status == ReadStatus::kDamaged));
    Check(info.comments.size() <= 1000);
    volatile unsigned keep = sum;
    static_cast<void>(keep);
  }
  return 0;
}
