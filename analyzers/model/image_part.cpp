#include "analyzers/model/image_part.h"

#include "decoder/esc/bit_copy.h"

namespace ecaudit::model {

std::uint64_t ExtractAnyBits(ByteSpan data, std::uint64_t bit, unsigned count) {
  if (count == 0 || count > 64 || bit + count > std::uint64_t{data.size()} * 8) return 0;
  const std::size_t first = static_cast<std::size_t>(bit / 8);
  const unsigned shift = static_cast<unsigned>(bit % 8);
  const std::size_t bytes = (shift + count + 7) / 8;
  std::uint64_t value = UnsignedOf(data.subspan(first, bytes)) >> shift;
  if (bytes > 8) value |= std::uint64_t{data[first + 8]} << (64 - shift);
  return count == 64 ? value : value & ((std::uint64_t{1} << count) - 1);
}

const ImagePart::Place* ImagePart::Find(std::uint16_t index, std::uint8_t subindex) const {
  const std::uint32_t object = std::uint32_t{index} << 8U | subindex;
  for (const Place& place : places) {
    if (place.object == object) return &place;
  }
  return nullptr;
}

std::optional<std::uint64_t> ProcessCycle::Value(const ImagePart::Place& place) const {
  if (!has_data() || place.bits > 64) return std::nullopt;
  return ExtractBits(data, place.bit, place.bits);
}

std::optional<std::uint64_t> ProcessCycle::Value(std::uint16_t index, std::uint8_t subindex) const {
  const ImagePart::Place* place = part.Find(index, subindex);
  return place == nullptr ? std::nullopt : Value(*place);
}

void ProcessCycle::AppendRaw(std::vector<std::uint8_t>& out) const {
  if (!has_data()) return;
  const std::size_t begin = out.size();
  out.resize(begin + (part.bits + 7) / 8);
  std::uint64_t to = std::uint64_t{begin} * 8;
  for (const BitRun& run : part.runs) {
    if (!esc::CopyBits(data, run.in_datagram, out, to, run.bits)) return;
    to += run.bits;
  }
}

}  // namespace ecaudit::model
