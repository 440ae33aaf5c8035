/// Packets in memory as a capture::FrameSource, for tests of every stage behind the capture reader.
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "decoder/capture/frame_source.h"

namespace ecaudit::test {

struct Packet {
  std::vector<std::uint8_t> bytes;
  TimeNs time = 0;
  bool has_time = true;
  std::uint16_t link_type = 1;
  std::uint16_t interface_index = 0;
  capture::PacketFlag flag = capture::PacketFlag::kNone;
  std::uint32_t original_length = 0;  ///< 0: as long as `bytes`
};

/// The packet as a reader hands it out; the bytes are those of `packet`.
/// @param number of the frame, from 1
inline capture::CapturedFrame AsCaptured(const Packet& packet, FrameNo number) {
  capture::CapturedFrame frame;
  frame.number = number;
  frame.time = packet.has_time ? packet.time : 0;
  frame.has_time = packet.has_time;
  frame.link_type = packet.link_type;
  frame.interface_index = packet.interface_index;
  frame.flag = packet.flag;
  frame.original_length =
      packet.original_length != 0 ? packet.original_length : static_cast<std::uint32_t>(packet.bytes.size());
  frame.bytes = packet.bytes;
  return frame;
}

/// Hands out copies of `packets`, numbered from 1, then kEnd (or kDamaged when `damage` is set).
class MemorySource final : public capture::FrameSource {
 public:
  explicit MemorySource(std::vector<Packet> packets, capture::CaptureInfo info = {}) : packets_(std::move(packets)) {
    info_ = std::move(info);
    if (info_.path.empty()) info_.path = "memory.pcapng";
    if (info_.format.empty()) info_.format = "pcapng";
    std::size_t interfaces = info_.interfaces.empty() ? 1 : info_.interfaces.size();
    for (const Packet& packet : packets_) interfaces = std::max<std::size_t>(interfaces, packet.interface_index + 1U);
    while (info_.interfaces.size() < interfaces)
      info_.interfaces.push_back({.name = {}, .resolution_ns = 1, .dropped = {}});
  }

  [[nodiscard]] capture::ReadStatus Next(capture::CapturedFrame& frame) noexcept override {
    if (next_ >= packets_.size()) return info_.damage ? capture::ReadStatus::kDamaged : capture::ReadStatus::kEnd;
    const Packet& packet = packets_[next_++];
    frame = AsCaptured(packet, next_);
    info_.packets = next_;
    return capture::ReadStatus::kFrame;
  }
  [[nodiscard]] const capture::CaptureInfo& info() const noexcept override { return info_; }

 private:
  std::vector<Packet> packets_;
  capture::CaptureInfo info_;
  std::size_t next_ = 0;
};

}  // namespace ecaudit::test
