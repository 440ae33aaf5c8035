#include "analyzers/collect/frame_layout.h"

#include <algorithm>
#include <string>
#include <tuple>

#include "decoder/track/datagram_pair.h"
#include "decoder/track/network.h"

namespace ecaudit {

FrameLayout::FrameLayout(EventBus& bus) {
  bus.ListenTo<track::LogicalAccess, track::CyclesSkipped>(Stage::kBeforeModel, *this);
}

void FrameLayout::Add(const track::LogicalAccess& access, std::uint64_t count) {
  for (std::size_t tries = 0; tries < used_; ++tries) {
    last_ = last_ + 1 < used_ ? last_ + 1 : 0;
    Datagram& datagram = datagrams_[last_];
    if (datagram.address != access.address || datagram.command != access.command || datagram.length != access.length) {
      continue;
    }
    datagram.count += count;
    return;
  }
  if (used_ == kMost) return;
  last_ = used_;
  datagrams_[used_++] = {access.command, access.address, access.length, count};
}

void FrameLayout::On(const track::CyclesSkipped& skipped) {
  for (std::size_t i = 0; i < skipped.last.size(); ++i) {
    const track::DatagramPair d(skipped.last, i);
    if (wire::IsLogical(d.command())) Add(track::Network::LogicalAccessOf(d), skipped.count);
  }
}

void FrameLayout::Summarise(AnalysisResult& result) {
  std::vector<CyclicDatagram>& out = result.bus.cyclic_datagrams;
  for (std::size_t i = 0; i < used_; ++i) {
    const Datagram& datagram = datagrams_[i];
    if (datagram.count < kOften) continue;
    out.push_back({std::string(wire::Name(datagram.command)), datagram.address, datagram.length, datagram.count});
  }
  std::sort(out.begin(), out.end(), [](const CyclicDatagram& a, const CyclicDatagram& b) {
    return std::tie(a.command, a.logical_address, a.length) < std::tie(b.command, b.logical_address, b.length);
  });
}

}  // namespace ecaudit
