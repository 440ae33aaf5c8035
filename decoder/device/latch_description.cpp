#include "decoder/device/latch_description.h"

#include <algorithm>
#include <bit>

namespace ecaudit::device {
namespace {

std::uint8_t Field(std::uint16_t word, std::uint16_t mask) {
  if (mask == 0) return 0;
  return static_cast<std::uint8_t>((word & mask) >> std::countr_zero(mask));
}

}  // namespace

std::uint8_t LatchDescription::Selector(std::uint16_t control_word) const {
  return Field(control_word, selector_mask);
}

std::uint8_t LatchDescription::Acknowledge(std::uint16_t status_word) const {
  return Field(status_word, acknowledge_mask);
}

const LatchEdge* LatchDescription::FindSelector(std::uint8_t selector) const {
  const auto it = std::ranges::find(edges, selector, &LatchEdge::selector);
  return it == edges.end() ? nullptr : &*it;
}

}  // namespace ecaudit::device
