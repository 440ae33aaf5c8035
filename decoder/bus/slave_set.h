/// The slaves on the bus: positions, station addresses and aliases, as the accesses show them.
///
/// Unknown stays unknown: a slave met by its station address in a running bus has no position until a
/// position-addressed access shows it. Reports number such slaves by ascending address and mark them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "decoder/base/ids.h"
#include "decoder/base/known.h"

namespace ecaudit::bus {

struct SlaveAddress {
  Known<SlavePos> position;
  /// Slaves have come or gone since its place was seen, and nothing shows yet whether it has moved.
  bool place_in_doubt = false;
  SlavePos order = 0;             ///< its last place, also where another slave has that now: slaves keep their order
  FrameNo last_answer = 0;        ///< sent last of what it answered at its station address
  Known<StationAddress> station;  ///< stays as last known when a broadcast clears the addresses
  bool station_valid = false;     ///< the slave answers to `station` now
  Known<StationAddress> alias;
  bool alias_enabled = false;  ///< the master lets it answer to `alias` too (0x0100 bit 24; off after power-on)
  /// Most likely one slave with another one that is kept: met by its station address, or by its position, before both
  /// showed. This one counts for nothing any more.
  bool replaced = false;
  SlaveId successor = kNoSlave;  ///< the one that is kept
};

/// What AssignStation() found out.
struct Assignment {
  SlaveId slave = kNoSlave;
  SlaveId other = kNoSlave;  ///< another slave that answers to the same address now; kNoSlave: none
};

/// Which slave answers to each of the 65,536 station addresses. Masters give a few that lie close together: only those
/// 256 around one that was given ever take room.
class StationTable {
 public:
  StationTable() { pages_.emplace_back().fill(kNoSlave); }

  [[nodiscard]] SlaveId operator[](StationAddress address) const {
    return pages_[page_of_[address / kPage]][address % kPage];
  }
  void Set(StationAddress address, SlaveId id) {
    std::uint16_t& page = page_of_[address / kPage];
    if (page == kUnassigned) {
      page = static_cast<std::uint16_t>(pages_.size());
      pages_.emplace_back().fill(kNoSlave);
    }
    pages_[page][address % kPage] = id;
  }

 private:
  static constexpr std::size_t kPage = 256;
  static constexpr std::uint16_t kUnassigned = 0;  ///< the page of all addresses of which none was given

  std::array<std::uint16_t, 65536 / kPage> page_of_{};
  std::vector<std::array<SlaveId, kPage>> pages_;
};

class SlaveSet {
 public:
  /// More slaves than any segment has; later ones are not modelled, so that a hostile capture cannot exhaust memory.
  static constexpr std::size_t kMaxSlaves = 2048;

  [[nodiscard]] std::size_t size() const { return slaves_.size(); }
  /// How often a slave beyond kMaxSlaves was met.
  [[nodiscard]] std::uint64_t left_out() const { return left_out_; }
  [[nodiscard]] const SlaveAddress& operator[](SlaveId id) const { return slaves_[id]; }

  /// kNoSlave when not known (yet).
  [[nodiscard]] SlaveId AtPosition(SlavePos position) const;
  /// By configured station address, else by alias of a slave whose master enabled it.
  [[nodiscard]] SlaveId AtStation(StationAddress address) const;

  /// The slave there, added when it is new; kNoSlave when kMaxSlaves is reached.
  SlaveId AddAtPosition(SlavePos position, FrameNo frame);
  SlaveId AddAtStation(StationAddress address, FrameNo frame);
  /// One that is known to be there although no frame addressed it. kNoSlave: a slave at this place is known already.
  SlaveId AddPresumed(std::optional<SlavePos> position, std::optional<StationAddress> address, FrameNo frame);

  /// The slave at `position` has taken, or reported, the station address. A slave that was only known by that address
  /// becomes the one at the position.
  Assignment AssignAtPosition(SlavePos position, StationAddress address, FrameNo frame);
  /// The same for a slave that is already identified.
  Assignment AssignStation(SlaveId id, StationAddress address, FrameNo frame);
  /// Slaves that are met by their station addresses, and never where they are, have the places that no other slave has,
  /// in the order of their addresses, as masters give them: where all `count` slaves of the bus are met, and not
  /// before. Who was met at such a place without its address is the same slave.
  /// @return whether some were placed
  bool PlaceByStation(std::uint16_t count, FrameNo frame);
  void LearnAlias(SlaveId id, StationAddress alias, FrameNo frame);
  /// The only slave with this alias, whether or not it answers to it; kNoSlave: none, or several.
  [[nodiscard]] SlaveId OnlyWithAlias(StationAddress alias) const;
  void NoteAnswer(SlaveId id, FrameNo sent) { slaves_[id].last_answer = sent; }

  /// Slaves have come or gone: each slave that is known by its station address may have moved. The others are the ones
  /// at their place.
  /// @return how many places are in doubt
  std::size_t DoubtPlaces();
  void SettlePlace(SlaveId id) { slaves_[id].place_in_doubt = false; }
  /// The slave is at `place`; the place of the slave that was there is unknown.
  void MoveTo(SlaveId id, const Known<SlavePos>& place);
  /// The place of the slave is unknown.
  void Displace(SlaveId id, FrameNo frame);
  void EnableAlias(SlaveId id, bool enabled);
  /// A broadcast wrote the same address to all slaves (masters write 0 when they scan): no slave is distinguished by it
  /// now.
  void ClearStations(FrameNo frame);

 private:
  SlaveId Add();
  [[nodiscard]] bool IsUnplaced(SlaveId id) const;
  void Replace(SlaveId id, SlaveId successor);
  void PlaceAt(SlaveId id, SlavePos position, FrameNo frame);
  void LeaveStation(SlaveId id, StationAddress address);

  std::vector<SlaveAddress> slaves_;
  std::vector<SlaveId> by_position_;
  StationTable by_station_;
  std::size_t aliases_enabled_ = 0;
  std::uint64_t left_out_ = 0;
};

}  // namespace ecaudit::bus
