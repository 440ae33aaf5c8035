#include "decoder/track/mapping_cache.h"

namespace ecaudit::track {

void MappingCache::Add() {
  mappings_.emplace_back();
  Changed(static_cast<SlaveId>(mappings_.size() - 1));
}

void MappingCache::Changed(SlaveId slave) {
  ++version_;
  if (slave < mappings_.size()) mappings_[slave].changed = version_;
}

const KnownFmmus& MappingCache::Decode(SlaveId id, const SlaveState& state) const {
  Mapping& mapping = mappings_[id];
  mapping.decoded = mapping.changed;
  mapping.fmmus.any = false;
  bool unseen = false;
  mapping.fmmus.active.clear();
  for (std::size_t n = 0; n < esc::kMaxFmmus; ++n) {
    const auto fmmu = state.fmmu(n, Certainty::kInferred);
    unseen = unseen || state.MayMapUnseen(n);
    if (!fmmu) continue;
    mapping.fmmus.any = true;
    if (fmmu->active()) mapping.fmmus.active.push_back({static_cast<std::uint8_t>(n), *fmmu});
  }
  mapping.fmmus.all = !unseen && (mapping.fmmus.any || state.fmmu_count() == 0);
  for (std::size_t n = 0; n < esc::kMaxSyncManagers; ++n) {
    mapping.fmmus.managers[n] = state.sync_manager(n, Certainty::kInferred);
  }
  return mapping.fmmus;
}

}  // namespace ecaudit::track
