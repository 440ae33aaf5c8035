#include "decoder/device/pdo_description.h"

#include <algorithm>

namespace ecaudit::device {

std::uint32_t PdoContent::bits() const {
  std::uint32_t sum = 0;
  for (const PdoEntry& entry : entries) sum += entry.bits;
  return sum;
}

const PdoContent* PdoDescription::FindFixed(std::uint16_t index) const {
  const auto it = std::ranges::lower_bound(fixed, index, {}, &PdoContent::index);
  return it != fixed.end() && it->index == index ? &*it : nullptr;
}

bool PdoDescription::IsAssignable(PdoDirection direction, std::uint16_t index) const {
  const bool listed = std::ranges::any_of(selectable, [&](const SelectablePdo& pdo) {
    return pdo.direction == direction && pdo.index == index && !pdo.example_only;
  });
  if (listed || !flexible) return listed;
  const auto& free = direction == PdoDirection::kRx ? flexible->rx_pdos : flexible->tx_pdos;
  return std::ranges::find(free, index) != free.end();
}

const CyclicObject* PdoDescription::FindCyclic(PdoDirection direction, std::uint16_t index,
                                               std::uint8_t subindex) const {
  const auto it = std::ranges::find_if(cyclic, [&](const CyclicObject& object) {
    return object.direction == direction && object.index == index && object.subindex == subindex;
  });
  return it == cyclic.end() ? nullptr : &*it;
}

}  // namespace ecaudit::device
