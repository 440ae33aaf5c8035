/// in: how many slaves pass frames on, and which slaves answer at their station addresses.  out: which slave is at a
/// position.
///
/// A station address stays with its slave for as long as that has power (0x0010); a position belongs to the slave that
/// is there. Where slaves join or leave, those after move, and their number alone does not show where that was. From
/// then on a position names no slave, until the slave there shows its address, or is given one.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "decoder/base/ids.h"
#include "decoder/bus/slave_set.h"

namespace ecaudit::track {

class Places {
 public:
  explicit Places(bus::SlaveSet& slaves) : slaves_(slaves) {}

  /// Some slave may have moved.
  [[nodiscard]] bool doubted() const { return in_doubt_ > 0; }
  /// This one may.
  [[nodiscard]] bool InDoubt(SlaveId id) const { return in_doubt_ > 0 && slaves_[id].place_in_doubt; }
  /// Whether one that may have moved is on the line still; empty if nothing shows it.
  [[nodiscard]] std::optional<bool> OnLine(SlaveId id) const;
  /// It answered at its station address while there were fewer slaves than now.
  [[nodiscard]] bool Stayed(SlaveId id) const { return slaves_[id].last_answer > before_; }

  void OnCount(std::uint16_t count, const FrameRef& frame);
  /// A slave answered at its station address.
  /// @return true if that shows more about the slaves on the line
  bool OnAnswer(SlaveId id, FrameNo sent);
  /// The slave at a position where it is in doubt who that is, by the address that it shows, or takes; added where it
  /// is a new one.
  SlaveId NamedAt(SlavePos position, StationAddress station, bool written, FrameNo frame);
  /// This slave is there.
  void Place(SlaveId id, SlavePos position, FrameNo frame);
  /// Its place is known.
  void Settle(SlaveId id);
  /// Addresses are given again: each slave is the one at its place.
  void SettleAll();

 private:
  [[nodiscard]] bool HasAnswered(SlaveId id) const { return slaves_[id].last_answer > changed_.number; }
  [[nodiscard]] bool OnlyBriefly(const FrameRef& frame) const;
  [[nodiscard]] bool AwaitsNewcomers() const { return count_ > settled_count_ + newcomers_; }
  [[nodiscard]] std::vector<SlaveId> InOrder(bool only_answered) const;
  [[nodiscard]] std::vector<SlavePos> FreePlaces() const;
  void SettleInOrder(FrameNo frame);

  bus::SlaveSet& slaves_;
  std::size_t in_doubt_ = 0;         // slaves that may have moved
  bool counted_ = false;             // any number is known
  std::uint16_t count_ = 0;          // of slaves on the line
  std::uint16_t settled_count_ = 0;  // when all places were known
  std::uint32_t newcomers_ = 0;      // new slaves that were met since
  bool named_ = false;               // some slave showed where it is, since
  FrameRef changed_;                 // frame that showed the last change ...
  FrameNo before_ = 0;               // ... and the one before that
  std::size_t answered_ = 0;         // slaves that answered at their addresses since the last change
};

}  // namespace ecaudit::track
