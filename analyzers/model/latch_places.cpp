#include "analyzers/model/latch_places.h"

#include <algorithm>

#include "analyzers/model/process_image.h"

namespace ecaudit::model {
namespace {

using device::LatchEdge;

bool IsAmong(const std::vector<device::ObjectAddress>& positions, std::uint16_t index) {
  return std::any_of(positions.begin(), positions.end(),
                     [index](const device::ObjectAddress& object) { return object.index == index; });
}

/// The object holds a latch position in this family.
bool IsPosition(const device::LatchDescription& latch, std::uint16_t index) {
  return IsAmong(latch.other_positions, index) ||
         std::any_of(latch.edges.begin(), latch.edges.end(),
                     [index](const LatchEdge& edge) { return IsAmong(edge.positions, index); });
}

LatchPart Unknown(bool incomplete) {
  LatchPart part;
  part.used = true;
  part.unknown_layout = true;
  part.incomplete = incomplete;
  return part;
}

}  // namespace

bool LatchPlaces::Holds(const LatchEdge& edge, std::uint16_t index, std::uint8_t subindex) {
  return std::any_of(edge.positions.begin(), edge.positions.end(), [&](const device::ObjectAddress& object) {
    return object.index == index && object.subindex == subindex;
  });
}

bool LatchPlaces::IsStray(const device::LatchDescription& latch, std::uint16_t index) {
  return IsPosition(latch, index) && std::none_of(latch.edges.begin(), latch.edges.end(),
                                                  [index](const LatchEdge& edge) { return Holds(edge, index, 0); });
}

std::optional<std::int64_t> LatchPlaces::Supplied(const device::LatchDescription& latch, const LatchEdge& edge,
                                                  const ProcessCycle& cycle) {
  const ImagePart::Place* own = nullptr;
  const ImagePart::Place* stray = nullptr;
  std::size_t positions = 0;
  for (const ImagePart::Place& place : cycle.part.places) {
    const auto index = static_cast<std::uint16_t>(place.object >> 8U);
    const auto subindex = static_cast<std::uint8_t>(place.object & 0xFFU);
    if (place.bits == 0 || place.bits > 64) continue;
    if (IsPosition(latch, index)) ++positions;
    if (Holds(edge, index, subindex)) own = &place;
    if (IsStray(latch, index)) stray = &place;
  }
  const ImagePart::Place* place = own != nullptr ? own : positions == 1 ? stray : nullptr;
  if (place == nullptr) return std::nullopt;
  return SignExtend(ExtractBits(cycle.data, place->bit, place->bits), place->bits);
}

const LatchPart& LatchPlaces::Of(const ImagePart& part, const device::LatchDescription& latch, std::size_t edges) {
  // For thousands of slaves with an unknown mapping, the same is known.
  if (part.places.empty()) {
    static const LatchPart kWhole = Unknown(false);
    static const LatchPart kCut = Unknown(true);
    return part.incomplete ? kCut : kWhole;
  }
  const auto known =
      std::find_if(parts_.begin(), parts_.end(), [&](const LatchPart& p) { return p.used && p.serial == part.serial; });
  const LatchPart& found = known != parts_.end() ? *known : Learn(part, latch, edges);
  last_[part.direction == device::PdoDirection::kRx ? 0 : 1] = &found;
  return found;
}

LatchPart& LatchPlaces::Learn(const ImagePart& from, const device::LatchDescription& latch, std::size_t edges) {
  if (parts_.empty()) parts_.resize(kParts);
  LatchPart& part = parts_[next_];
  next_ = (next_ + 1) % parts_.size();
  part = {};
  part.used = true;
  part.serial = from.serial;
  part.incomplete = from.incomplete;
  for (const ImagePart::Place& place : from.places) {
    const auto index = static_cast<std::uint16_t>(place.object >> 8U);
    const auto subindex = static_cast<std::uint8_t>(place.object & 0xFFU);
    if (place.bits == 0 || place.bits > 64) continue;
    const LatchPart::Where where{place.bit, place.bits};
    if (from.direction == device::PdoDirection::kRx) {
      if (index == latch.control_object && subindex == 0) part.control = where;
      if (index == kTouchProbeFunction && subindex == 0) part.probe = where;
      continue;
    }
    if (index == latch.status_object && subindex == 0) part.status = where;
    if (IsStray(latch, index)) part.stray_position = true;
    for (std::size_t n = 0; n < edges; ++n) {
      if (!Holds(latch.edges[n], index, subindex)) continue;
      part.positions[n] = where;
      part.any_position = true;
    }
  }
  return part;
}

}  // namespace ecaudit::model
