/// Sorts structures by a number of theirs. std::sort would compile a sorting of its own for each structure, which moves
/// its strings in dozens of places; this one sorts numbers, in one place, and moves each structure once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace ecaudit {

/// The places of `keys` in ascending order; equal keys keep theirs.
[[nodiscard]] std::vector<std::size_t> AscendingOrder(std::span<const std::uint64_t> keys);

/// Sorts `rows` by what `key(row)` gives for each; rows of equal keys keep their order.
template <typename Row, typename Key>
void SortByKey(std::vector<Row>& rows, Key key) {
  std::vector<std::uint64_t> keys(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) keys[i] = key(rows[i]);
  const std::vector<std::size_t> order = AscendingOrder(keys);
  std::vector<Row> sorted(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) sorted[i] = std::move(rows[order[i]]);
  rows = std::move(sorted);
}

}  // namespace ecaudit
