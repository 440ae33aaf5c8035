#include "tests/support/trace_builder.h"

#include <algorithm>
#include <utility>

namespace ecaudit::test {
namespace {

std::uint16_t AdpOfPosition(std::uint16_t position) {
  return static_cast<std::uint16_t>(0x10000U - position);
}

TraceDatagram Make(Cmd command, std::uint16_t adp, std::uint16_t ado, Bytes sent, Bytes returned) {
  TraceDatagram d;
  d.command = command;
  d.adp = adp;
  d.ado = ado;
  d.sent = std::move(sent);
  d.returned = std::move(returned);
  return d;
}

TraceDatagram MakeRead(Cmd command, std::uint16_t adp, std::uint16_t ado, Bytes returned) {
  Bytes zeros(returned.size(), 0);
  return Make(command, adp, ado, std::move(zeros), std::move(returned));
}

TraceDatagram MakeWrite(Cmd command, std::uint16_t adp, std::uint16_t ado, Bytes sent) {
  Bytes returned = sent;
  return Make(command, adp, ado, std::move(sent), std::move(returned));
}

std::uint16_t Low(std::uint32_t logical) {
  return static_cast<std::uint16_t>(logical & 0xFFFFU);
}
std::uint16_t High(std::uint32_t logical) {
  return static_cast<std::uint16_t>(logical >> 16U);
}

// The working counter if every slave meant takes part (esc-reference 2.1).
std::uint16_t FullWkc(Cmd command, std::uint16_t slaves) {
  const bool both = samples::CmdReads(command) && samples::CmdWrites(command);
  switch (command) {
    case Cmd::NOP:
      return 0;
    case Cmd::ARMW:
    case Cmd::FRMW:
      return slaves;
    case Cmd::BRD:
    case Cmd::BWR:
    case Cmd::BRW:
    case Cmd::LRD:
    case Cmd::LWR:
    case Cmd::LRW:
      return static_cast<std::uint16_t>(both ? 3 * slaves : slaves);
    default:
      return both ? 3 : 1;
  }
}

}  // namespace

TraceFrame& TraceFrame::Aprd(std::uint16_t position, std::uint16_t ado, Bytes returned) {
  return Add(MakeRead(Cmd::APRD, AdpOfPosition(position), ado, std::move(returned)));
}
TraceFrame& TraceFrame::Apwr(std::uint16_t position, std::uint16_t ado, Bytes sent) {
  return Add(MakeWrite(Cmd::APWR, AdpOfPosition(position), ado, std::move(sent)));
}
TraceFrame& TraceFrame::Aprw(std::uint16_t position, std::uint16_t ado, Bytes sent, Bytes returned) {
  return Add(Make(Cmd::APRW, AdpOfPosition(position), ado, std::move(sent), std::move(returned)));
}
TraceFrame& TraceFrame::Fprd(std::uint16_t station, std::uint16_t ado, Bytes returned) {
  return Add(MakeRead(Cmd::FPRD, station, ado, std::move(returned)));
}
TraceFrame& TraceFrame::Fpwr(std::uint16_t station, std::uint16_t ado, Bytes sent) {
  return Add(MakeWrite(Cmd::FPWR, station, ado, std::move(sent)));
}
TraceFrame& TraceFrame::Fprw(std::uint16_t station, std::uint16_t ado, Bytes sent, Bytes returned) {
  return Add(Make(Cmd::FPRW, station, ado, std::move(sent), std::move(returned)));
}
TraceFrame& TraceFrame::Brd(std::uint16_t ado, Bytes returned) {
  return Add(MakeRead(Cmd::BRD, 0, ado, std::move(returned)));
}
TraceFrame& TraceFrame::Bwr(std::uint16_t ado, Bytes sent) {
  return Add(MakeWrite(Cmd::BWR, 0, ado, std::move(sent)));
}
TraceFrame& TraceFrame::Brw(std::uint16_t ado, Bytes sent, Bytes returned) {
  return Add(Make(Cmd::BRW, 0, ado, std::move(sent), std::move(returned)));
}
TraceFrame& TraceFrame::Lrd(std::uint32_t logical, Bytes returned) {
  return Add(MakeRead(Cmd::LRD, Low(logical), High(logical), std::move(returned)));
}
TraceFrame& TraceFrame::Lwr(std::uint32_t logical, Bytes sent) {
  return Add(MakeWrite(Cmd::LWR, Low(logical), High(logical), std::move(sent)));
}
TraceFrame& TraceFrame::Lrw(std::uint32_t logical, Bytes sent, Bytes returned) {
  return Add(Make(Cmd::LRW, Low(logical), High(logical), std::move(sent), std::move(returned)));
}
TraceFrame& TraceFrame::Armw(std::uint16_t position, std::uint16_t ado, Bytes returned) {
  return Add(MakeRead(Cmd::ARMW, AdpOfPosition(position), ado, std::move(returned)));
}
TraceFrame& TraceFrame::Frmw(std::uint16_t station, std::uint16_t ado, Bytes returned) {
  return Add(MakeRead(Cmd::FRMW, station, ado, std::move(returned)));
}
TraceFrame& TraceFrame::Nop(Bytes data) {
  return Add(MakeWrite(Cmd::NOP, 0, 0, std::move(data)));
}

TraceFrame& TraceFrame::Add(TraceDatagram datagram) {
  const std::size_t length = std::max(datagram.sent.size(), datagram.returned.size());
  datagram.sent.resize(length, 0);
  datagram.returned.resize(length, 0);
  datagrams_.push_back(std::move(datagram));
  return *this;
}
TraceFrame& TraceFrame::Raw(Bytes packet) {
  raw_ = std::move(packet);
  return *this;
}

TraceFrame& TraceFrame::Wkc(std::uint16_t wkc) {
  if (!datagrams_.empty()) datagrams_.back().wkc = wkc;
  return *this;
}
TraceFrame& TraceFrame::Index(std::uint8_t index) {
  if (!datagrams_.empty()) datagrams_.back().index = index;
  return *this;
}
TraceFrame& TraceFrame::ReturnedAdp(std::uint16_t adp) {
  if (!datagrams_.empty()) datagrams_.back().returned_adp = adp;
  return *this;
}
TraceFrame& TraceFrame::SentIrq(std::uint16_t irq) {
  if (!datagrams_.empty()) datagrams_.back().sent_irq = irq;
  return *this;
}

TraceFrame& TraceFrame::Irq(std::uint16_t irq) {
  if (!datagrams_.empty()) datagrams_.back().irq = irq;
  return *this;
}
TraceFrame& TraceFrame::Circulating() {
  if (!datagrams_.empty()) datagrams_.back().circulating = true;
  return *this;
}

TraceFrame& TraceFrame::Lost() {
  copies_ = Copies::kOutbound;
  return *this;
}
TraceFrame& TraceFrame::ReturnedOnly() {
  copies_ = Copies::kReturned;
  return *this;
}
TraceFrame& TraceFrame::Twice() {
  twice_ = true;
  return *this;
}
TraceFrame& TraceFrame::NoTime() {
  has_time_ = false;
  return *this;
}
TraceFrame& TraceFrame::Rtt(TimeNs ns) {
  rtt_ = ns;
  return *this;
}
TraceFrame& TraceFrame::Cut(std::size_t bytes) {
  cut_ = bytes;
  return *this;
}
TraceFrame& TraceFrame::Mark(std::string name) {
  mark_ = std::move(name);
  return *this;
}

Trace& Trace::Slaves(std::uint16_t count) {
  settings_.slaves_ = count;
  return *this;
}
Trace& Trace::Direction(Copies copies) {
  settings_.copies_ = copies;
  return *this;
}
Trace& Trace::Mac(samples::MacAddress mac) {
  settings_.mac_ = mac;
  return *this;
}
Trace& Trace::Around(samples::Encapsulation around) {
  settings_.around_ = std::move(around);
  return *this;
}
Trace& Trace::NoTime(bool without) {
  settings_.has_time_ = !without;
  return *this;
}

TraceFrame& Trace::New(TimeNs at) {
  settings_.at_ = at;
  frames_.push_back(settings_);
  return frames_.back();
}
TraceFrame& Trace::At(std::int64_t us) {
  return New(us * 1000);
}
TraceFrame& Trace::After(std::int64_t us) {
  return New((frames_.empty() ? 0 : settings_.at_) + us * 1000);
}

struct Trace::Placed {
  TimeNs at = 0;
  Packet packet;
  const TraceFrame* frame = nullptr;
  bool returned = false;
};

std::vector<Trace::Placed> Trace::Place() const {
  std::vector<Placed> placed;
  std::uint8_t next_index = 0;
  // Indices of datagrams without idx=, so that the returned copy and a RETURN line carry the same ones.
  std::map<const TraceFrame*, std::vector<std::uint8_t>> indices;

  const auto index_list = [&](const TraceFrame& frame) -> const std::vector<std::uint8_t>& {
    auto [found, added] = indices.try_emplace(&frame);
    if (added) {
      for (const TraceDatagram& d : frame.datagrams_) found->second.push_back(d.index.value_or(next_index));
      ++next_index;
    }
    return found->second;
  };

  const auto add = [&](const TraceFrame& settings, const TraceFrame& content, TimeNs at, bool returned) {
    Placed one;
    one.at = at;
    one.frame = &content;
    one.returned = returned;
    Packet& packet = one.packet;
    if (content.raw_) {
      packet.bytes = *content.raw_;
    } else {
      samples::EtherCatFrame ethercat;
      ethercat.source = returned ? samples::AfterSlave(content.mac_) : content.mac_;
      const std::vector<std::uint8_t>& list = index_list(content);
      for (std::size_t i = 0; i < content.datagrams_.size(); ++i) {
        const TraceDatagram& from = content.datagrams_[i];
        samples::Datagram& d = ethercat.datagrams.emplace_back();
        d.command = from.command;
        d.index = list[i];
        d.adp = from.adp;
        d.ado = from.ado;
        d.data = returned ? from.returned : from.sent;
        d.wkc = from.sent_wkc;
        d.irq = from.sent_irq;
        if (returned) {
          const std::uint16_t passed = samples::CmdCountsSlaves(from.command) ? content.slaves_ : std::uint16_t{0};
          d.adp = from.returned_adp.value_or(static_cast<std::uint16_t>(from.adp + passed));
          const std::uint16_t full = static_cast<std::uint16_t>(from.sent_wkc + FullWkc(from.command, content.slaves_));
          d.wkc = from.wkc.value_or(content.default_wkc_.value_or(full));
          d.irq = from.irq;
          d.circulating = from.circulating;
        }
      }
      samples::Encapsulation around = content.around_;
      around.cooked_outgoing = !returned;
      if (returned) around.minimum_bytes = std::max<std::size_t>(around.minimum_bytes, 60);
      packet.bytes = samples::EncodePacket(ethercat, around);
      packet.link_type = samples::LinkTypeNumber(around.link);
    }
    if (settings.cut_ != 0 && settings.cut_ < packet.bytes.size()) {
      packet.original_length = static_cast<std::uint32_t>(packet.bytes.size());
      packet.bytes.resize(settings.cut_);
    }
    packet.has_time = settings.has_time_;
    packet.time = kTraceStart + at - (at % settings.resolution_);
    packet.interface_index = settings.two_interfaces_ && returned ? 1 : 0;
    placed.push_back(std::move(one));
  };

  for (const TraceFrame& frame : frames_) {
    if (!frame.return_of_.empty()) {
      const auto original = std::find_if(frames_.begin(), frames_.end(),
                                         [&](const TraceFrame& f) { return f.mark_ == frame.return_of_; });
      if (original != frames_.end()) add(frame, *original, frame.at_, true);
      continue;
    }
    if (frame.copies_ == Copies::kNone) {
      (void)index_list(frame);  // the master numbered it all the same
      continue;
    }
    if (frame.copies_ != Copies::kReturned || frame.raw_) add(frame, frame, frame.at_, false);
    if (frame.copies_ == Copies::kOutbound || frame.raw_) continue;
    add(frame, frame, frame.at_ + frame.rtt_, true);
    if (frame.twice_) add(frame, frame, frame.at_ + frame.rtt_ + 1000, true);
  }
  std::stable_sort(placed.begin(), placed.end(), [](const Placed& a, const Placed& b) { return a.at < b.at; });
  return placed;
}

std::vector<Packet> Trace::Packets() const {
  std::vector<Packet> packets;
  for (Placed& placed : Place()) packets.push_back(std::move(placed.packet));
  return packets;
}

std::unique_ptr<MemorySource> Trace::Source() const {
  capture::CaptureInfo info;
  const bool two = std::any_of(frames_.begin(), frames_.end(), [](const TraceFrame& f) { return f.two_interfaces_; });
  const TimeNs resolution = frames_.empty() ? 1 : frames_.front().resolution_;
  for (int i = 0; i < (two ? 2 : 1); ++i) {
    capture::Interface one;
    one.resolution_ns = resolution;
    if (!frames_.empty()) one.link_type = samples::LinkTypeNumber(frames_.front().around_.link);
    info.interfaces.push_back(std::move(one));
  }
  return std::make_unique<MemorySource>(Packets(), std::move(info));
}

FrameNo Trace::Find(std::string_view name, bool returned) const {
  FrameNo number = 0;
  for (const Placed& placed : Place()) {
    ++number;
    if (placed.frame->mark_ == name && placed.returned == returned) return number;
  }
  return 0;
}

}  // namespace ecaudit::test
