#include "analyzers/judge/padded_struct.h"

#include <algorithm>

namespace ecaudit {
namespace {

constexpr std::uint32_t RoundedUp(std::uint32_t value, std::uint32_t to) {
  return (value + to - 1) / to * to;
}

}  // namespace

std::optional<PaddedStruct> PaddedStruct::Of(const model::ProcessLayout& layout, std::uint8_t sync_manager) {
  if (!layout.known()) return std::nullopt;
  PaddedStruct made;
  std::uint32_t packed = 0, padded = 0, widest = 1;
  for (const model::Signal& signal : layout.signals) {
    if (signal.sync_manager != sync_manager) continue;
    if (signal.bits % 8 != 0 || signal.bit_offset != packed * 8) return std::nullopt;
    const std::uint32_t bytes = signal.bits / 8U;
    const bool number = !signal.gap() && (bytes == 2 || bytes == 4 || bytes == 8);
    if (!number && !signal.gap() && bytes != 1) return std::nullopt;
    const std::uint32_t alignment = number ? bytes : 1;
    widest = std::max(widest, alignment);
    padded = RoundedUp(padded, alignment);
    made.members_.push_back({packed, padded});
    packed += bytes;
    padded += bytes;
  }
  made.bytes_ = RoundedUp(padded, widest);
  if (made.members_.empty() || made.bytes_ == packed) return std::nullopt;
  return made;
}

std::uint32_t PaddedStruct::PaddingBefore(std::uint32_t bit_offset) const {
  const auto member =
      std::ranges::find_if(members_, [bit_offset](const Member& m) { return m.packed * 8 == bit_offset; });
  return member == members_.end() ? 0 : member->padded - member->packed;
}

}  // namespace ecaudit
