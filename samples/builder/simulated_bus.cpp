#include "samples/builder/simulated_bus.h"

#include <utility>

namespace ecaudit::samples {
namespace {

constexpr TimeNs kToFirstSlave = 6'000;   // driver and network card of the master
constexpr TimeNs kHopForward = 640;       // processing unit and cable
constexpr TimeNs kHopBack = 260;          // forwarding and cable
constexpr TimeNs kToCapture = 18'000;     // network card, interrupt and driver on the way back
constexpr TimeNs kCaptureJitter = 4'000;  // of the interrupt

}  // namespace

SimulatedSlave& SimulatedBus::Add(SlaveDescription description) {
  slaves_.push_back(std::make_unique<SimulatedSlave>(std::move(description), power_on_));
  reachable_ = slaves_.size();
  UpdateLinks();
  return *slaves_.back();
}

SimulatedSlave& SimulatedBus::Insert(std::size_t position, SlaveDescription description, TimeNs power_on) {
  const auto at = slaves_.begin() + static_cast<std::ptrdiff_t>(position);
  SimulatedSlave& joined = **slaves_.insert(at, std::make_unique<SimulatedSlave>(std::move(description), power_on));
  Heal();
  return joined;
}

void SimulatedBus::Remove(std::size_t position) {
  slaves_.erase(slaves_.begin() + static_cast<std::ptrdiff_t>(position));
  Heal();
}

void SimulatedBus::UpdateLinks() {
  for (std::size_t i = 0; i < slaves_.size(); ++i) {
    slaves_[i]->esc().SetLink(0, i < reachable_ || i > reachable_);
    slaves_[i]->esc().SetLink(1, i + 1 < slaves_.size() && i + 1 != reachable_);
  }
}

void SimulatedBus::BreakBehind(std::size_t count) {
  reachable_ = count;
  UpdateLinks();
}

void SimulatedBus::Heal() {
  BreakBehind(slaves_.size());
}

void SimulatedBus::Advance(TimeNs now) {
  for (const auto& slave : slaves_) slave->Advance(now);
}

SimulatedBus::Result SimulatedBus::Pass(EtherCatFrame frame, TimeNs sent) {
  const auto bytes = static_cast<TimeNs>(EncodePacket(frame, {.minimum_bytes = 60}).size());
  const auto hops = static_cast<TimeNs>(reachable_ == 0 ? 0 : reachable_ - 1);
  const TimeNs first = sent + kToFirstSlave;
  const TimeNs last = first + hops * kHopForward;
  Advance(first);
  for (std::size_t i = 0; i < reachable_; ++i) {
    if (unplugged_ == i) continue;
    const auto behind = static_cast<TimeNs>(i);
    Passage passage{.arrival = first + behind * kHopForward, .back = last + (hops - behind) * kHopBack};
    slaves_[i]->Advance(passage.arrival);
    for (Datagram& datagram : frame.datagrams) slaves_[i]->Process(datagram, passage);
  }
  // Slaves work on what they got before anybody can ask again.
  Advance(last + hops * kHopBack);
  if (reachable_ != 0) frame.source = AfterSlave(frame.source);
  return {std::move(frame), last + hops * kHopBack + bytes * kByteTime + kToCapture + jitter_.Next(kCaptureJitter)};
}

}  // namespace ecaudit::samples
