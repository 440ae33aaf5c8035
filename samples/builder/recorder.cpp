#include "samples/builder/recorder.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace ecaudit::samples {

PacketId Recorder::Frame(const EtherCatFrame& frame, TimeNs time, bool returned) {
  Encapsulation with = around;
  with.cooked_outgoing = !returned;
  if (returned) with.minimum_bytes = std::max<std::size_t>(with.minimum_bytes, 60);
  if (with.esl) {
    with.esl->port = returned ? 1 : 0;
    with.esl->time_ns = static_cast<std::uint64_t>(time);
  }
  const PacketId id = Raw(EncodePacket(frame, with), time, returned);
  packets_[id].link_type = LinkTypeNumber(with.link);
  return id;
}

PacketId Recorder::Raw(Bytes bytes, TimeNs time, bool returned) {
  packets_.push_back(
      {.bytes = std::move(bytes), .time = time, .clock_ahead = clock_ahead, .returned = returned, .hidden = paused_});
  return packets_.size() - 1;
}

std::vector<PacketId> Recorder::Order() const {
  std::vector<PacketId> order(packets_.size());
  std::iota(order.begin(), order.end(), PacketId{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](PacketId a, PacketId b) { return packets_[a].time < packets_[b].time; });
  std::erase_if(order, [&](PacketId id) {
    return packets_[id].hidden || (packets_[id].returned ? !style.returned : !style.outbound);
  });
  if (style.drops_every != 0) {
    std::size_t count = 0;
    std::erase_if(order, [&](PacketId) { return ++count % style.drops_every == 0; });
  }
  return order;
}

FrameNo Recorder::Number(PacketId packet) const {
  const std::vector<PacketId> order = Order();
  const auto found = std::find(order.begin(), order.end(), packet);
  return found == order.end() ? 0 : static_cast<FrameNo>(found - order.begin()) + 1;
}

WrittenCapture Recorder::Written() const {
  WrittenCapture capture;
  capture.comment = style.comment;
  capture.interfaces.clear();
  for (int i = 0; i < (style.two_interfaces ? 2 : 1); ++i) {
    WrittenInterface one;
    one.name = style.two_interfaces ? (i == 0 ? "tap-out" : "tap-back") : "eth0";
    one.resolution = style.resolution;
    one.snap_length = style.snap_length;
    if (!packets_.empty()) one.link_type = packets_.front().link_type;
    capture.interfaces.push_back(std::move(one));
  }
  TimeNs last_outbound = 0;
  for (const PacketId id : Order()) {
    const Recorded& from = packets_[id];
    WrittenPacket packet{.bytes = from.bytes, .time = from.time + from.clock_ahead, .comment = from.comment};
    if (!from.returned) last_outbound = packet.time;
    if (style.coarse_step) {
      const TimeNs stamp = from.returned ? last_outbound : packet.time;
      packet.time = stamp / *style.coarse_step * *style.coarse_step;
    }
    if (style.snap_length != 0 && packet.bytes.size() > style.snap_length) {
      packet.original_length = static_cast<std::uint32_t>(packet.bytes.size());
      packet.bytes.resize(style.snap_length);
    }
    packet.interface_index = style.two_interfaces && from.returned ? 1 : 0;
    capture.packets.push_back(std::move(packet));
  }
  return capture;
}

Bytes Recorder::Encode() const {
  const WrittenCapture capture = Written();
  Bytes file = style.format == FileFormat::kPcapNg
                   ? EncodePcapNg(capture, style.byte_order)
                   : EncodePcap(capture, style.format == FileFormat::kPcapNano, style.byte_order);
  file.resize(file.size() - std::min(style.cut_file_by, file.size()));
  return file;
}

Bytes Recorder::Flush() {
  const WrittenCapture capture = Written();
  packets_.clear();
  const bool nanoseconds = style.format == FileFormat::kPcapNano;
  if (!std::exchange(begun_, true)) {
    return style.format == FileFormat::kPcapNg ? EncodePcapNg(capture, style.byte_order)
                                               : EncodePcap(capture, nanoseconds, style.byte_order);
  }
  return style.format == FileFormat::kPcapNg ? EncodePcapNgPackets(capture, style.byte_order)
                                             : EncodePcapPackets(capture, nanoseconds, style.byte_order);
}

}  // namespace ecaudit::samples
