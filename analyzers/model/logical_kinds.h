/// Something for each kind of datagram with process data: for each command, address and length.
///
/// A cycle has a few of them, of large machines some dozens; a capture may hold any number. Kinds share places only
/// where more of them fall into one set than it has places for: then the one goes that was asked for longest ago.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "decoder/base/wrapping.h"
#include "decoder/wire/command.h"

namespace ecaudit::model {

struct LogicalKind {
  wire::Command command = wire::Command::NOP;
  std::uint32_t address = 0;
  std::uint16_t length = 0;

  friend bool operator==(const LogicalKind&, const LogicalKind&) = default;
};

/// @tparam Value  default-constructed for a kind that is met
template <class Value>
class LogicalKinds {
 public:
  static constexpr std::size_t kSets = 16;
  static constexpr std::size_t kWays = 8;

  /// Null where there is nothing of this kind.
  [[nodiscard]] Value* Find(const LogicalKind& kind) {
    Set& set = sets_[SetOf(kind)];
    for (std::size_t way = 0; way < kWays; ++way) {
      if (set.used[way] == 0 || set.kinds[way] != kind) continue;
      set.used[way] = ++uses_;
      return &set.values[way];
    }
    return nullptr;
  }
  /// A place for a kind of which there is nothing yet. It holds what another one left there, for its room.
  [[nodiscard]] Value& Take(const LogicalKind& kind) {
    Set& set = sets_[SetOf(kind)];
    std::size_t oldest = 0;
    for (std::size_t way = 1; way < kWays; ++way) {
      if (set.used[way] < set.used[oldest]) oldest = way;
    }
    set.kinds[oldest] = kind;
    set.used[oldest] = ++uses_;
    return set.values[oldest];
  }
  /// Forgets all but one, with what they hold.
  void KeepOnly(const Value& kept) {
    ForEach([&](Value& value, std::uint64_t& used) {
      if (&value == &kept) return;
      value = {};
      used = 0;
    });
  }
  template <class Visit>
  void ForEachValue(Visit visit) {
    ForEach([&](Value& value, std::uint64_t&) { visit(value); });
  }

 private:
  struct Set {
    std::array<LogicalKind, kWays> kinds;
    std::array<std::uint64_t, kWays> used{};  ///< number of the last use; 0: free
    std::array<Value, kWays> values;
  };

  static std::size_t SetOf(const LogicalKind& kind) {
    const std::size_t hash =
        (WrappingProduct(kind.address, 2654435761U) >> 16U) + kind.length * 7U + static_cast<std::size_t>(kind.command);
    return hash % kSets;
  }
  template <class Visit>
  void ForEach(Visit visit) {
    for (Set& set : sets_) {
      for (std::size_t way = 0; way < kWays; ++way) visit(set.values[way], set.used[way]);
    }
  }

  std::array<Set, kSets> sets_;
  std::uint64_t uses_ = 0;
};

}  // namespace ecaudit::model
