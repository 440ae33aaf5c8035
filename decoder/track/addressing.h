/// in: DatagramPair, SlaveAccess.  out: SlaveCount, AddressAssigned; the slave that a datagram means.
///
/// keeps: who is at which position and answers to which address, on whose segment, how many slaves pass a frame on, and
/// how many of them are between the master and the tap.
#pragma once

#include <cstdint>
#include <optional>

#include "decoder/base/event_sink.h"
#include "decoder/bus/slave_set.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/datagram_pair.h"
#include "decoder/track/events.h"
#include "decoder/track/places.h"
#include "decoder/track/segments.h"

namespace ecaudit::track {

class Addressing {
 public:
  explicit Addressing(EventSink& events) : events_(events) {}

  [[nodiscard]] const bus::SlaveSet& slaves() const { return slaves_; }
  /// Slaves on the bus as the last frame with a position counter showed.
  [[nodiscard]] const Known<std::uint16_t>& slave_count() const { return slave_count_; }
  /// Changes whenever other slaves may be on the bus, or a slave may answer to another address.
  [[nodiscard]] std::uint64_t version() const { return version_; }

  /// False for a slave after the last one that answers now, and for one that turned out to be another.
  [[nodiscard]] bool OnBus(SlaveId id) const {
    if (slaves_[id].replaced) return false;
    if (const auto on_line = places_.OnLine(id)) return *on_line;
    const SlavePos* position = slaves_[id].position.if_known();
    const std::uint16_t* count = slave_count_.if_known();
    return position == nullptr || count == nullptr || *position < *count;
  }
  /// The slave that an outbound datagram addresses; kNoSlave when not known (yet).
  [[nodiscard]] SlaveId AddressedBy(const wire::DatagramView& sent) const;
  /// The slave that a datagram for one slave means; kNoSlave when not known.
  /// @param add it took part: an unknown one becomes the next of slaves()
  SlaveId Resolve(const DatagramPair& d, bool add);

  /// Slaves have joined or left, and this one may have moved.
  [[nodiscard]] bool InDoubt(SlaveId id) const { return places_.InDoubt(id); }
  /// Whether a datagram is for the slave at a position that is in doubt.
  [[nodiscard]] bool MayAddressSlave(const DatagramPair& d) const;
  /// It answered at its station address while there were fewer slaves than now.
  [[nodiscard]] bool Stayed(SlaveId id) const { return places_.Stayed(id); }

  /// Whether its place and the station address that it answers to now are both known, so that no other slave of the
  /// list can be it.
  [[nodiscard]] bool IsWhole(SlaveId id) const {
    return slaves_[id].position.if_known() != nullptr && slaves_[id].station_valid;
  }
  /// Whether both may be one slave: one met by its place, the other by its station address only.
  [[nodiscard]] bool MayBeOne(SlaveId a, SlaveId b) const {
    const auto only_placed = [&](SlaveId id) {
      return slaves_[id].position.if_known() != nullptr && !slaves_[id].station_valid;
    };
    const auto only_named = [&](SlaveId id) {
      return slaves_[id].position.if_known() == nullptr && slaves_[id].station_valid;
    };
    if (slaves_[a].replaced || slaves_[b].replaced) return false;
    return (only_placed(a) && only_named(b)) || (only_named(a) && only_placed(b));
  }
  /// A slave answered a datagram that was meant for it alone.
  void OnAnswered(SlaveId id, const DatagramPair& d);
  /// A broadcast answered by all slaves concerns this one, too: nothing shows that it may be on another segment.
  [[nodiscard]] bool Concerns(SlaveId id, const DatagramPair& d) const;
  /// ... of every slave that has answered anything.
  [[nodiscard]] bool ConcernsAll(const DatagramPair& d) const;
  /// Counts the slaves that a datagram with a position counter has passed.
  /// @return the position from which on they may be other slaves than before, where there are more of them now or
  ///         another program counts
  std::optional<std::uint16_t> Count(const DatagramPair& d);
  /// The next of slaves(), although no frame addressed it; kNoSlave when it was met.
  SlaveId Presume(std::optional<SlavePos> position, std::optional<StationAddress> address, FrameNo frame) {
    ++version_;
    return slaves_.AddPresumed(position, address, frame);
  }
  /// Frames are missing from the capture: slaves may have come or gone.
  void ForgetCount(FrameNo frame);

  /// An access to the addresses of a slave, or to the switch that lets it answer to its alias.
  void OnAccess(const SlaveAccess& access);
  [[nodiscard]] static bool Concerns(EscAddress address, std::size_t length) {
    return address <= kAliasEnable && address + length > esc::kStationAddress;
  }
  /// A broadcast wrote to the station addresses of all slaves: no slave is distinguished by them now.
  void ClearStations(const DatagramPair& d);

 private:
  /// Two senders are at work at once where one is seen again within this number of packets, and soon.
  static constexpr FrameNo kTogether = 64;
  static constexpr std::int64_t kTogetherNs = 500'000'000;
  [[nodiscard]] static bool Together(const FrameRef& one, const FrameRef& other);
  static constexpr EscAddress kAliasEnable = 0x0103;  // bit 0 = bit 24 of DL control

  [[nodiscard]] SlavePos PositionSent(std::uint16_t adp) const {
    return static_cast<SlavePos>((0x10000U - adp + upstream_) & 0xFFFFU);
  }
  [[nodiscard]] std::optional<SlavePos> PositionOf(const DatagramPair& d) const;
  [[nodiscard]] SlaveId AtStation(const DatagramPair& d, bool add);
  [[nodiscard]] bool IsInDoubt(SlavePos position) const;
  [[nodiscard]] SlaveId ShownInDoubt(const DatagramPair& d, SlavePos position);
  [[nodiscard]] SlaveId MetByStation(const DatagramPair& d, SlavePos position);
  void PlaceByStation(const DatagramPair& d);
  [[nodiscard]] bool IsCountOf(const DatagramPair& d) const;
  void LearnStation(const SlaveAccess& access, StationAddress address);

  EventSink& events_;
  bus::SlaveSet slaves_;
  Places places_{slaves_};
  std::size_t unplaced_ = 0;  // slaves that were met by station address and may be without a position still
  Known<std::uint16_t> slave_count_;
  Segments segments_;
  std::uint64_t counts_for_ = 0;  // the sender whose frames slave_count_ was learned from ...
  FrameRef counted_;              // ... and the last of them
  std::uint16_t upstream_ = 0;    // slaves between the master and the tap
  std::uint64_t version_ = 0;
};

}  // namespace ecaudit::track
