#include "cli/anonymize/mapped_mailboxes.h"

#include <span>

#include "decoder/wire/command.h"

namespace ecaudit::cli::anonymize {
namespace {

/// Copies what of the write falls into the memory at `base`.
void Take(const wire::DatagramView& datagram, std::size_t base, std::span<std::uint8_t> memory) {
  const std::size_t begin = datagram.ado();
  const ByteSpan data = datagram.data();
  for (std::size_t i = 0; i < data.size(); ++i) {
    const std::size_t address = begin + i;
    if (address >= base && address < base + memory.size()) memory[address - base] = data[i];
  }
}

}  // namespace

void MappedMailboxes::Subscribe(const wire::DatagramView& datagram, std::uint32_t slave) {
  if (!wire::Writes(datagram.command())) return;
  const std::size_t end = std::size_t{datagram.ado()} + datagram.data().size();
  if (datagram.ado() >= esc::kSyncManagerBase + sizeof(Units::managers) || end <= esc::kFmmuBase) return;
  changed_ = true;
  const auto take = [&datagram](Units& units) {
    Take(datagram, esc::kFmmuBase, units.fmmus);
    Take(datagram, esc::kSyncManagerBase, units.managers);
  };
  if (wire::IsBroadcast(datagram.command())) {
    for (auto& [number, units] : units_) take(units);
  } else if (units_.size() < kMostSlaves || units_.contains(slave)) {
    take(units_[slave]);
  }
}

void MappedMailboxes::FindMapped() {
  changed_ = false;
  mapped_.clear();
  for (const auto& [slave, units] : units_) {
    for (std::size_t m = 0; m < esc::kMaxSyncManagers; ++m) {
      const ByteSpan bytes = ByteSpan(units.managers).subspan(m * esc::kSyncManagerBytes, esc::kSyncManagerBytes);
      const auto manager = esc::SyncManager::Decode(bytes);
      if (!manager || !manager->mailbox() || manager->length < mailbox::kHeaderBytes) continue;
      for (std::size_t f = 0; f < esc::kMaxFmmus; ++f) {
        const auto fmmu = esc::Fmmu::Decode(ByteSpan(units.fmmus).subspan(f * esc::kFmmuBytes, esc::kFmmuBytes));
        if (!fmmu || !fmmu->active() || !fmmu->byte_aligned() || manager->start < fmmu->physical_start) continue;
        const std::uint32_t offset = static_cast<std::uint32_t>(manager->start) - fmmu->physical_start;
        if (offset + manager->length > fmmu->length) continue;
        const auto direction = fmmu->reads() ? mailbox::Direction::kIn : mailbox::Direction::kOut;
        mapped_.push_back({{slave, direction, 0, manager->length}, std::uint64_t{fmmu->logical_start} + offset});
      }
    }
  }
}

std::vector<MappedMailboxes::Place> MappedMailboxes::In(const wire::DatagramView& datagram) {
  if (changed_) FindMapped();
  const std::uint64_t first = datagram.logical_address();
  const std::uint64_t last = first + datagram.data().size();
  std::vector<Place> places;
  for (const Mapped& mapped : mapped_) {
    if (mapped.logical < first || mapped.logical + mapped.place.length > last) continue;
    places.push_back(mapped.place);
    places.back().begin = static_cast<std::size_t>(mapped.logical - first);
  }
  return places;
}

}  // namespace ecaudit::cli::anonymize
