#include "tests/property/captures.h"

#include <algorithm>
#include <string>
#include <system_error>

namespace ecaudit::test {
namespace {

namespace fs = std::filesystem;

/// An ARP request of nobody, as a host sends at any time.
std::vector<std::uint8_t> Arp() {
  std::vector<std::uint8_t> bytes(60);
  std::fill_n(bytes.begin(), 6, std::uint8_t{0xFF});
  bytes[6] = 0x02;
  bytes[12] = 0x08;
  bytes[13] = 0x06;
  return bytes;
}

}  // namespace

std::vector<fs::path> CapturesIn(const fs::path& folder) {
  std::vector<fs::path> paths;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    const std::string extension = entry.path().extension().string();
    if ((extension != ".pcapng" && extension != ".pcap") || name.starts_with("startup-ok-1slave-") ||
        name.starts_with("garbage-") || name.starts_with("empty-") || name.starts_with("truncated-")) {
      continue;
    }
    paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

capture::ReadStatus RewrittenSource::Next(capture::CapturedFrame& frame) noexcept {
  if (!has_first_) {
    // The packets in front take the stamp of the first one.
    has_first_ = true;
    first_status_ = inner_.Next(first_);
    if (first_status_ == capture::ReadStatus::kFrame) first_bytes_.assign(first_.bytes.begin(), first_.bytes.end());
  }
  if (before_ > 0 && first_status_ == capture::ReadStatus::kFrame) {
    --before_;
    bytes_ = Arp();
    frame = first_;
    frame.number = ++number_;
    frame.bytes = bytes_;
    frame.original_length = static_cast<std::uint32_t>(bytes_.size());
    return capture::ReadStatus::kFrame;
  }
  while (true) {
    capture::ReadStatus status = first_status_;
    if (!first_bytes_.empty()) {
      frame = first_;
      bytes_ = std::move(first_bytes_);
      first_bytes_.clear();
    } else {
      if (ended_) return capture::ReadStatus::kEnd;
      status = inner_.Next(frame);
      if (status != capture::ReadStatus::kFrame) return status;
      bytes_.assign(frame.bytes.begin(), frame.bytes.end());
    }
    if (status != capture::ReadStatus::kFrame) return status;
    if (until_ != 0 && frame.number >= until_) ended_ = true;
    if (until_ != 0 && frame.number > until_) return capture::ReadStatus::kEnd;
    const std::size_t length = bytes_.size();
    if (rewrite_ && !rewrite_(frame, bytes_)) continue;
    frame.original_length = static_cast<std::uint32_t>(frame.original_length + bytes_.size() - length);
    frame.bytes = bytes_;
    frame.number = ++number_;
    return capture::ReadStatus::kFrame;
  }
}

}  // namespace ecaudit::test
