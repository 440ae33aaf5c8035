/// Names of the values of an enumeration as a table, a row a value.
#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <string_view>

namespace ecaudit {

template <typename Value>
struct Named {
  Value value;
  std::string_view name;
};

/// The name in the row of the value; empty if it has none.
template <typename Value, std::size_t kRows>
[[nodiscard]] constexpr std::string_view NameIn(const Named<Value> (&rows)[kRows], Value value) {
  const auto* row = std::ranges::find(rows, value, &Named<Value>::value);
  return row == std::end(rows) ? std::string_view() : row->name;
}

/// Whether the rows are all values of an enumeration that counts from 0 to `last`, in their order.
template <typename Enum, std::size_t kRows>
[[nodiscard]] constexpr bool NamesAll(const Named<Enum> (&rows)[kRows], Enum last) {
  for (std::size_t i = 0; i < kRows; ++i) {
    if (rows[i].value != static_cast<Enum>(i)) return false;
  }
  return rows[kRows - 1].value == last;
}

}  // namespace ecaudit
