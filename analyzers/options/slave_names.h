/// What reports call a slave. Positions count from 0, as EtherCAT does; people may count from 1 (--count-from 1).
#pragma once

#include <compare>
#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "decoder/base/ids.h"

namespace ecaudit {

/// Makes every name that contains the number of a slave.
struct SlaveNames {
  bool from_one = false;  ///< the first slave is number 1; its position stays 0 and stands beside the number

  /// "0"; counted from 1 "1". For columns without room for more.
  [[nodiscard]] std::string Number(unsigned position) const;
  /// "S0"; counted from 1 "S1". In names of signals.
  [[nodiscard]] std::string Short(unsigned position) const { return "S" + Number(position); }
  /// "slave 0", "slave 0 (AKD, 0x1001)"; counted from 1 "slave 1 (position 0)", "slave 1 (position 0, AKD, 0x1001)".
  /// @param about  what stands in the brackets; may be empty
  [[nodiscard]] std::string Of(unsigned position, std::string_view about = {}) const;
  /// "slave 2", "slaves 0-3, 7"; counted from 1 "slaves 1-4, 8 (positions 0-3, 7)".
  [[nodiscard]] std::string Of(const std::set<unsigned>& positions) const;
  /// The same without the word: "0-3, 7"; counted from 1 "1-4, 8 (positions 0-3, 7)".
  [[nodiscard]] std::string Ranges(const std::set<unsigned>& positions) const;
  /// "slave 2", "slaves 0, 2 and 5 more"; counted from 1 "slaves 1, 3 (positions 0, 2) and 5 more".
  /// @param most  as many are named
  [[nodiscard]] std::string List(const std::set<unsigned>& positions, std::size_t most) const;
  /// "slaves 0-39"; counted from 1 "slaves 1-40 (positions 0-39)".
  [[nodiscard]] std::string Span(unsigned first, unsigned last) const;
  /// The position of the slave that people call `number`; nothing for a number below the first.
  [[nodiscard]] std::optional<SlavePos> Position(SlavePos number) const;

  auto operator<=>(const SlaveNames&) const = default;
};

/// "0-3, 7": positions in order.
[[nodiscard]] std::string Ranges(const std::set<unsigned>& sorted);

}  // namespace ecaudit
