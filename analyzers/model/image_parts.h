/// in: kinds of datagrams with process data.  out: which slaves have a part in them, and where.
///
/// The parts of a kind are kept, and those of a slave built again once its FMMUs, sync managers or PDOs are others.
/// Where FMMUs and sync managers are not in the capture, an ENI gives the place, also of slaves that only process data
/// reach.
///
/// Source: ETG.2100 (cyclic commands).
#pragma once

#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include "analyzers/model/eni_slaves.h"
#include "analyzers/model/exchange_count.h"
#include "analyzers/model/image_part.h"
#include "analyzers/model/logical_kinds.h"
#include "analyzers/model/profile_choice.h"
#include "analyzers/model/split_signals.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::model {

/// Of all that decides where process data lie.
struct PlacesVersion {
  std::uint64_t mapping = 0;  ///< track::Network::mapping_version()
  std::uint64_t layouts = 0;

  friend bool operator==(const PlacesVersion&, const PlacesVersion&) = default;
};

/// All parts of one kind of datagram.
struct DatagramParts {
  /// Signals of one part that do not lie in one piece.
  struct Split {
    std::size_t part = 0;  ///< number in `parts`
    ImagePart alone;       ///< the part without what needs another datagram
    SplitSignals signals;
  };

  LogicalKind kind;              ///< of a direct one: the slave and the address in its memory
  PlacesVersion version;         ///< what they rest on
  std::vector<ImagePart> parts;  ///< by slave; those of the ENI at the end
  std::vector<Split> splits;
  EniCounts eni;

  void Clear();
  /// Puts the parts of one slave in `fresh` into the place of those here.
  void Replace(SlaveId slave, DatagramParts& fresh);
  /// Marks outputs that share a byte with inputs.
  void FindCovered();
};

class ImageParts {
 public:
  /// @param network, slaves must outlive this
  /// @param choice decides what slaves are that only the ENI names; must outlive this
  /// @param eni null: none; must outlive this
  ImageParts(const track::Network& network, const std::deque<SlaveModel>& slaves, ProfileChoice& choice,
             const device::EniConfig* eni)
      : network_(network), slaves_(slaves), eni_(eni), eni_slaves_(choice, eni) {}

  // What these return is valid until the next call of one of them.

  /// Of a datagram with a logical address.
  [[nodiscard]] DatagramParts& OfLogical(const LogicalKind& kind);
  /// Of one that reads or writes the slave's memory itself.
  [[nodiscard]] DatagramParts& OfMemory(const track::SlaveAccess& access, std::uint16_t length);
  /// The slave's PDOs may be others now. Its FMMUs and sync managers are checked without this call.
  void OnLayoutChanged(SlaveId slave);
  /// True where some slave's data may lie elsewhere since this was asked last.
  [[nodiscard]] bool TakeMoved() { return std::exchange(moved_, false); }
  /// What was done since this was asked last, in slaves that were updated.
  [[nodiscard]] std::uint64_t TakeWork() { return std::exchange(work_, 0); }

 private:
  // What takes about as long as updating a slave does, or how many times as long.
  static constexpr std::uint64_t kLooksPerSlave = 16;
  static constexpr std::uint64_t kMakingPart = 2;
  static constexpr std::size_t kMaxParts = 8'192;  ///< of all kinds but the one at hand

  [[nodiscard]] PlacesVersion version() const { return {network_.mapping_version(), layout_changes_}; }
  [[nodiscard]] bool ChangedSince(const PlacesVersion& version, SlaveId slave) const;
  DatagramParts& Find(const LogicalKind& kind, bool& found);
  void MakeRoom(const DatagramParts& kept);
  void Build(DatagramParts& datagram);
  void Refresh(DatagramParts& datagram);
  void AddSlave(DatagramParts& datagram, SlaveId slave);
  void AddMapped(DatagramParts& datagram, SlaveId slave, device::PdoDirection direction);
  void AddByEni(DatagramParts& datagram);
  void AddByEni(DatagramParts& datagram, std::size_t number, device::PdoDirection direction, std::uint32_t offset);
  void AddMemory(DatagramParts& datagram, SlaveId slave, EscAddress address);
  void Add(DatagramParts& datagram, ImagePart part);
  [[nodiscard]] ImagePart PartOf(SlaveId slave, device::PdoDirection direction) const;
  [[nodiscard]] bool FindModel(ImagePart& part, std::size_t number);

  const track::Network& network_;
  const std::deque<SlaveModel>& slaves_;
  const device::EniConfig* eni_;
  EniSlaves eni_slaves_;
  std::uint64_t layout_changes_ = 0;
  std::vector<std::uint64_t> layout_changed_;  ///< of each slave that ever changed: layout_changes_ after it
  PlacesVersion version_;                      ///< when it was asked last
  bool moved_ = false;                         ///< see TakeMoved()
  std::uint64_t parts_made_ = 0;
  std::uint64_t work_ = 0;  ///< see TakeWork()
  LogicalKinds<DatagramParts> kinds_;
};

}  // namespace ecaudit::model
