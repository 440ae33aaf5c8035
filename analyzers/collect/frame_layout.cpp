#include "analyzers/collect/frame_layout.h"

#include <algorithm>
#include <string>
#include <tuple>

namespace ecaudit {

FrameLayout::FrameLayout(EventBus& bus) {
  bus.ListenTo<track::LogicalAccess>(Stage::kBeforeModel, *this);
}

void FrameLayout::On(const track::LogicalAccess& access) {
  for (std::size_t tries = 0; tries < used_; ++tries) {
    last_ = last_ + 1 < used_ ? last_ + 1 : 0;
    Datagram& datagram = datagrams_[last_];
    if (datagram.address != access.address || datagram.command != access.command || datagram.length != access.length) {
      continue;
    }
    ++datagram.count;
    return;
  }
  if (used_ == kMost) return;
  last_ = used_;
  datagrams_[used_++] = {access.command, access.address, access.length, 1};
}

void FrameLayout::Summarise(AnalysisResult& result) {
  std::vector<CyclicDatagram>& out = result.bus.cyclic_datagrams;
  for (std::size_t i = 0; i < used_; ++i) {
    const Datagram& datagram = datagrams_[i];
    if (datagram.count < kOften) continue;
    out.push_back({std::string(wire::Name(datagram.command)), datagram.address, datagram.length, datagram.count});
  }
  std::ranges::sort(out, [](const CyclicDatagram& a, const CyclicDatagram& b) {
    return std::tie(a.command, a.logical_address, a.length) < std::tie(b.command, b.logical_address, b.length);
  });
}

}  // namespace ecaudit
