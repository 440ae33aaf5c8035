/// The longest sequence that two lists have in common: of steps, or of slaves on a bus.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace ecaudit::startup {

/// Pairs of places, ascending on both sides, as many as possible.
/// @param same  (place on the left, place on the right)
template <typename Same>
std::vector<std::pair<std::size_t, std::size_t>> LongestCommon(std::size_t left, std::size_t right, Same&& same) {
  // What both begin or end with needs no table.
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  std::size_t begin = 0;
  while (begin < left && begin < right && same(begin, begin)) {
    pairs.emplace_back(begin, begin);
    ++begin;
  }
  std::size_t tail = 0;
  while (begin + tail < left && begin + tail < right && same(left - 1 - tail, right - 1 - tail)) ++tail;
  const std::size_t rows = left - begin - tail;
  const std::size_t columns = right - begin - tail;
  std::vector<std::uint16_t> table((rows + 1) * (columns + 1), 0);
  const auto at = [&](std::size_t row, std::size_t column) -> std::uint16_t& {
    return table[row * (columns + 1) + column];
  };
  for (std::size_t below = rows; below > 0; --below) {
    const std::size_t row = below - 1;
    for (std::size_t behind = columns; behind > 0; --behind) {
      const std::size_t column = behind - 1;
      at(row, column) = same(begin + row, begin + column) ? static_cast<std::uint16_t>(at(row + 1, column + 1) + 1)
                                                          : std::max(at(row + 1, column), at(row, column + 1));
    }
  }
  for (std::size_t row = 0, column = 0; row < rows && column < columns;) {
    if (same(begin + row, begin + column) && at(row, column) == at(row + 1, column + 1) + 1) {
      pairs.emplace_back(begin + row++, begin + column++);
    } else if (at(row + 1, column) >= at(row, column + 1)) {
      ++row;
    } else {
      ++column;
    }
  }
  for (std::size_t i = tail; i > 0; --i) pairs.emplace_back(left - i, right - i);
  return pairs;
}

}  // namespace ecaudit::startup
