#include "decoder/base/sort_by_key.h"

#include <algorithm>

namespace ecaudit {

std::vector<std::size_t> AscendingOrder(std::span<const std::uint64_t> keys) {
  std::vector<std::size_t> order(keys.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::sort(order,
                    [keys](std::size_t a, std::size_t b) { return keys[a] != keys[b] ? keys[a] < keys[b] : a < b; });
  return order;
}

}  // namespace ecaudit
