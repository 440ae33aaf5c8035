/// Signals whose bits do not lie one after the other in one datagram: several FMMUs map them, or the datagram ends in
/// the middle of them and another one carries the rest.
///
/// in: what one slave and direction have in a datagram.  out: the same bytes with these signals put together after
/// them.
///
/// Bits of several datagrams make a value only where they belong to one exchange: the same frame, or frames that follow
/// each other more closely than half the shortest cycle seen. The datagram with the signal's last logical bit gives it
/// out, since masters send logical addresses in ascending order. Where a part is missing there is no value.
///
/// Source: esc-reference 7 (a logical access may cover part of an FMMU, or several FMMUs).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "analyzers/model/exchange.h"
#include "decoder/base/bytes.h"
#include "decoder/base/ids.h"
#include "decoder/device/pdo_description.h"

namespace ecaudit::model {

/// Bits of a signal, and where they lie in the datagram.
struct SignalPiece {
  std::uint32_t in_signal = 0;
  std::uint32_t in_datagram = 0;
  std::uint32_t bits = 0;
};

struct SplitSignal {
  enum class Role : std::uint8_t {
    kWhole,    ///< all its bits are in this datagram
    kLast,     ///< others are needed, and this datagram has the last bits
    kEarlier,  ///< another datagram has the last bits
  };
  static constexpr unsigned kMaxJoinedBits = 64;  ///< unless kWhole

  std::uint16_t number = 0;  ///< in the layout
  std::uint16_t bits = 0;
  Role role = Role::kWhole;
  std::uint32_t bit = 0;  ///< where it is put together, from the first bit of the datagram; not of kEarlier
  std::vector<SignalPiece> pieces;
};

/// One datagram as it was seen.
struct Sighting {
  SlaveId slave = kNoSlave;
  device::PdoDirection direction = device::PdoDirection::kRx;
  FrameRef sent;
  FrameRef returned;
  Exchange exchange = Exchange::kUnknown;
};

/// The latest bits of each signal that ends in another datagram.
class SignalFragments {
 public:
  void Clear() { fragments_.clear(); }
  void Keep(const SplitSignal& signal, ByteSpan data, const Sighting& where);
  /// Adds to `value` (8 bytes, with the pieces of this datagram in it) what is kept of the rest.
  /// @param cycle_ns  the shortest time between two such datagrams; 0: not known
  /// @return false unless every bit is there and belongs to this exchange
  [[nodiscard]] bool Complete(const SplitSignal& signal, const Sighting& where, TimeNs cycle_ns,
                              std::span<std::uint8_t> value) const;

 private:
  static constexpr std::size_t kMost = 64;  // kept at a time; a slave has one at each end of a datagram
  struct Fragment {
    Sighting where;
    std::uint16_t signal = 0;
    SignalPiece piece;
    std::array<std::uint8_t, 8> value{};
  };
  std::vector<Fragment> fragments_;
  std::size_t next_ = 0;
};

/// The split signals of one slave and direction in one kind of datagram.
class SplitSignals {
 public:
  explicit SplitSignals(std::uint16_t datagram_bytes) : datagram_bytes_(datagram_bytes), bytes_(datagram_bytes) {}

  /// Gives the signal its place after the datagram; it is returned with it.
  const SplitSignal& Add(SplitSignal signal);
  [[nodiscard]] bool empty() const { return signals_.empty(); }

  /// @param data  of the datagram; nothing comes back when it is shorter than this kind of datagram
  /// @param[out] whole  false: signals of the role kLast are not in the result
  /// @return valid until the next call
  [[nodiscard]] ByteSpan Gather(ByteSpan data, const Sighting& where, SignalFragments& fragments, bool& whole);

 private:
  void Measure(const Sighting& where);

  std::size_t datagram_bytes_;
  std::size_t bytes_;  ///< with all signals
  std::vector<SplitSignal> signals_;
  std::vector<std::uint8_t> buffer_;
  FrameRef last_;
  TimeNs cycle_ns_ = 0;
};

}  // namespace ecaudit::model
