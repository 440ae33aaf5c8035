#include "tests/property/wire_packets.h"

#include <algorithm>
#include <array>
#include <deque>
#include <map>

#include "decoder/capture/capture_reader.h"
#include "decoder/wire/command.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::test {
namespace {

constexpr std::uint64_t kDirectionBit = std::uint64_t{1} << 41U;
constexpr std::uint16_t kSystemTime = 0x0910;

/// Of senders of which both kinds of addresses are seen the bit tells the direction.
std::map<std::uint64_t, bool> SendersWithBothAddresses(const std::vector<Packet>& packets) {
  std::map<std::uint64_t, unsigned> seen;
  for (const Packet& packet : packets) {
    const capture::CapturedFrame frame = AsCaptured(packet, 1);
    const wire::FrameView view = wire::FrameView::Parse(frame);
    if (view.empty()) continue;
    seen[view.source_mac() & ~kDirectionBit] |= view.mac_bit() ? 2U : 1U;
  }
  std::map<std::uint64_t, bool> both;
  for (const auto& [mac, bits] : seen) both[mac] = bits == 3;
  return both;
}

struct Sent {
  std::uint32_t number = 0;
  std::size_t packet = 0;
};

/// How many frames a master sends before the first of them is back: what nearly all frames show that are the only ones
/// of their key under way.
class Depth {
 public:
  void Add(std::uint32_t later) { ++counts_[std::min<std::size_t>(later, counts_.size() - 1)]; }
  [[nodiscard]] std::uint32_t value() const {
    std::uint64_t all = 0;
    for (const std::uint64_t count : counts_) all += count;
    std::uint64_t up_to = 0;
    for (std::uint32_t i = 0; i < counts_.size(); ++i) {
      up_to += counts_[i];
      if (up_to * 1000 >= all * 995) return i;
    }
    return 0;
  }

 private:
  std::array<std::uint64_t, 256> counts_{};
};

class Numberer {
 public:
  explicit Numberer(const std::vector<Packet>& packets) : both_(SendersWithBothAddresses(packets)) {}

  std::vector<std::uint32_t> Run(const std::vector<Packet>& packets, std::uint32_t depth) {
    depth_ = depth;
    std::vector<std::uint32_t> frames;
    frames.reserve(packets.size());
    for (const Packet& packet : packets) frames.push_back(Number(packet, frames.size()));
    return frames;
  }
  [[nodiscard]] std::uint32_t depth() const { return shown_.value(); }
  [[nodiscard]] bool all_known() const { return all_known_; }

 private:
  std::uint32_t Number(const Packet& packet, std::size_t at) {
    const capture::CapturedFrame frame = AsCaptured(packet, 1);
    const wire::FrameView view = wire::FrameView::Parse(frame);
    if (view.empty() || view.kind() != wire::FrameKind::kEtherCat) {
      if (view.kind() == wire::FrameKind::kMalformed && view.mac_bit()) all_known_ = false;
      return kNoFrame;
    }
    std::deque<Sent>& open = open_[view.key()];
    while (!open.empty() && next_ - open.front().number > depth_ + 1) open.pop_front();
    const bool by_bit = both_.at(view.source_mac() & ~kDirectionBit);
    // Masters send working counters of 0.
    bool counted = false;
    for (std::size_t i = 0; i < view.size(); ++i) counted = counted || view[i].wkc() > 0;
    const bool returned = by_bit ? view.mac_bit() : counted || !open.empty();
    if (returned) return Returned(view, open, by_bit);
    // The frame before once more, while that is still under way.
    const bool again = by_bit && !open.empty() && open.back().number + 1 == next_ && at > 0;
    const std::uint32_t number = again ? open.back().number : next_++;
    if (!again) open.push_back({number, at});
    return number;
  }

  std::uint32_t Returned(const wire::FrameView& view, std::deque<Sent>& open, bool by_bit) {
    auto last = last_.find(view.key());
    if (open.empty()) {
      // Once more what came back before, or its outbound copy is missing.
      if (last != last_.end() && next_ - last->second <= depth_ + 8) return last->second;
      if (!last_.empty()) all_known_ = false;
      return by_bit ? next_++ : kNoFrame;
    }
    const Sent sent = open.front();
    if (open.size() == 1) shown_.Add(next_ - 1 - sent.number);
    open.pop_front();
    last_[view.key()] = sent.number;
    return sent.number;
  }

  std::map<std::uint64_t, bool> both_;
  std::map<std::uint64_t, std::deque<Sent>> open_;  // by key, oldest first
  std::map<std::uint64_t, std::uint32_t> last_;     // by key: the frame that came back last
  std::uint32_t next_ = 0;
  std::uint32_t depth_ = 0;
  bool all_known_ = true;
  Depth shown_;
};

}  // namespace

std::optional<WireCapture> LoadCapture(const std::filesystem::path& path) {
  auto source = capture::OpenCapture(path.string());
  if (!source) return std::nullopt;
  WireCapture capture;
  capture.name = path.filename().string();
  capture::CapturedFrame frame;
  while ((*source)->Next(frame) == capture::ReadStatus::kFrame) {
    capture.packets.push_back({.bytes = {frame.bytes.begin(), frame.bytes.end()},
                               .time = frame.time,
                               .has_time = frame.has_time,
                               .link_type = frame.link_type,
                               .interface_index = frame.interface_index,
                               .flag = frame.flag,
                               .original_length = frame.original_length});
    const wire::FrameView view = wire::FrameView::Parse(frame);
    capture.cut = capture.cut || frame.original_length > frame.bytes.size();
    capture.has_esl = capture.has_esl || view.esl().present;
    capture.has_udp = capture.has_udp || view.encapsulation() == wire::Encapsulation::kUdp;
  }
  capture.info = (*source)->info();
  return capture;
}

std::optional<EtherCatPart> FindEtherCat(const Packet& packet) {
  const capture::CapturedFrame frame = AsCaptured(packet, 1);
  const wire::FrameView view = wire::FrameView::Parse(frame);
  if (view.empty() || view.kind() != wire::FrameKind::kEtherCat) return std::nullopt;
  EtherCatPart part;
  for (const std::uint16_t offset : view.offsets()) part.datagrams.push_back(offset);
  part.header = part.datagrams.front() - 2;
  part.plain = packet.link_type == 1 && part.header == 14 && !view.esl().present;
  for (std::size_t i = 0; i < view.size(); ++i) {
    part.cyclic = part.cyclic || wire::IsLogical(view[i].command());
    part.has_time = part.has_time || (!wire::IsLogical(view[i].command()) && view[i].ado() == kSystemTime);
  }
  return part;
}

NumberedPackets NumberFrames(const std::vector<Packet>& packets) {
  // First with more patience than any master needs, to see how much this one does.
  constexpr std::uint32_t kPatience = 12;
  Numberer patient(packets);
  (void)patient.Run(packets, kPatience);
  Numberer numberer(packets);
  NumberedPackets numbered{packets, numberer.Run(packets, patient.depth())};
  numbered.all_known = numberer.all_known();
  return numbered;
}

}  // namespace ecaudit::test
