#include "decoder/bus/slave_set.h"

#include <algorithm>

namespace ecaudit::bus {

SlaveId SlaveSet::AtPosition(SlavePos position) const {
  return position < by_position_.size() ? by_position_[position] : kNoSlave;
}

SlaveId SlaveSet::AtStation(StationAddress address) const {
  if (by_station_[address] != kNoSlave) return by_station_[address];
  if (address == 0 || aliases_enabled_ == 0) return kNoSlave;
  for (std::size_t i = 0; i < slaves_.size(); ++i) {
    const StationAddress* alias = slaves_[i].alias.if_known();
    if (slaves_[i].alias_enabled && alias != nullptr && *alias == address) return static_cast<SlaveId>(i);
  }
  return kNoSlave;
}

SlaveId SlaveSet::Add() {
  if (slaves_.size() >= kMaxSlaves) {
    ++left_out_;
    return kNoSlave;
  }
  slaves_.emplace_back();
  return static_cast<SlaveId>(slaves_.size() - 1);
}

SlaveId SlaveSet::AddAtPosition(SlavePos position, FrameNo frame) {
  if (const SlaveId known = AtPosition(position); known != kNoSlave) return known;
  if (position >= kMaxSlaves) {
    ++left_out_;
    return kNoSlave;
  }
  const SlaveId id = Add();
  if (id == kNoSlave) return id;
  PlaceAt(id, position, frame);
  return id;
}

void SlaveSet::PlaceAt(SlaveId id, SlavePos position, FrameNo frame) {
  if (position >= by_position_.size()) by_position_.resize(static_cast<std::size_t>(position) + 1, kNoSlave);
  by_position_[position] = id;
  slaves_[id].position = Known<SlavePos>::Observed(position, frame);
  slaves_[id].order = position;
}

void SlaveSet::Displace(SlaveId id, FrameNo frame) {
  const SlavePos* position = slaves_[id].position.if_known();
  if (position != nullptr && AtPosition(*position) == id) by_position_[*position] = kNoSlave;
  slaves_[id].position.Forget(frame);
}

void SlaveSet::MoveTo(SlaveId id, const Known<SlavePos>& place) {
  const SlavePos* position = place.if_known();
  if (position == nullptr || *position >= kMaxSlaves) return;
  if (const SlaveId there = AtPosition(*position); there != kNoSlave && there != id) Displace(there, place.since());
  Displace(id, place.since());
  PlaceAt(id, *position, place.since());
  slaves_[id].position = place;
}

std::size_t SlaveSet::DoubtPlaces() {
  std::size_t doubted = 0;
  for (SlaveAddress& slave : slaves_) {
    const bool placed = slave.place_in_doubt || slave.position.if_known() != nullptr;
    slave.place_in_doubt = placed && slave.station_valid && !slave.replaced;
    doubted += slave.place_in_doubt ? 1U : 0U;
  }
  return doubted;
}

SlaveId SlaveSet::AddPresumed(std::optional<SlavePos> position, std::optional<StationAddress> address, FrameNo frame) {
  const bool known = (position && AtPosition(*position) != kNoSlave) || (address && AtStation(*address) != kNoSlave);
  if (known || (!position && !address)) return kNoSlave;
  const SlaveId id = address ? AddAtStation(*address, frame) : AddAtPosition(*position, frame);
  if (id == kNoSlave) return id;
  if (address) slaves_[id].station = Known<StationAddress>::Inferred(*address, frame);
  if (!address) slaves_[id].position = Known<SlavePos>::Inferred(*position, frame);
  return id;
}

SlaveId SlaveSet::AddAtStation(StationAddress address, FrameNo frame) {
  if (const SlaveId known = AtStation(address); known != kNoSlave) return known;
  const SlaveId id = Add();
  if (id == kNoSlave) return id;
  slaves_[id].station = Known<StationAddress>::Observed(address, frame);
  slaves_[id].station_valid = true;
  by_station_.Set(address, id);
  return id;
}

Assignment SlaveSet::AssignAtPosition(SlavePos position, StationAddress address, FrameNo frame) {
  SlaveId id = AtPosition(position);
  if (id == kNoSlave) {
    const SlaveId met = by_station_[address];
    if (met != kNoSlave && slaves_[met].position.if_known() == nullptr && position < kMaxSlaves) {
      PlaceAt(met, position, frame);
      id = met;
    } else {
      id = AddAtPosition(position, frame);
    }
  }
  return id == kNoSlave ? Assignment{} : AssignStation(id, address, frame);
}

Assignment SlaveSet::AssignStation(SlaveId id, StationAddress address, FrameNo frame) {
  Assignment result{id, kNoSlave};
  SlaveAddress& slave = slaves_[id];
  const StationAddress* before = slave.station.if_known();
  if (before != nullptr && slave.station_valid && *before != address) LeaveStation(id, *before);
  const SlaveId holder = by_station_[address];
  if (address != 0 && holder != kNoSlave && holder != id) {
    // A slave that was only ever met by this address may be this very one; seen at a position of its own it is another.
    if (slaves_[holder].position.if_observed() != nullptr && !slaves_[holder].place_in_doubt) {
      result.other = holder;
    } else {
      slaves_[holder].station_valid = false;
      if (slave.position.if_known() != nullptr) Replace(holder, id);
    }
  }
  slave.station = Known<StationAddress>::Observed(address, frame);
  slave.station_valid = address != 0;
  if (address != 0) by_station_.Set(address, id);
  return result;
}

/// `id` does not answer to `address` any more; another slave that was given the same one still does.
void SlaveSet::LeaveStation(SlaveId id, StationAddress address) {
  if (by_station_[address] != id) return;
  by_station_.Set(address, kNoSlave);
  for (std::size_t i = 0; i < slaves_.size(); ++i) {
    const StationAddress* station = slaves_[i].station.if_known();
    if (i != id && slaves_[i].station_valid && station != nullptr && *station == address) {
      by_station_.Set(address, static_cast<SlaveId>(i));
    }
  }
}

bool SlaveSet::IsUnplaced(SlaveId id) const {
  return !slaves_[id].replaced && slaves_[id].position.if_known() == nullptr &&
         slaves_[id].station.if_known() != nullptr;
}

void SlaveSet::Replace(SlaveId id, SlaveId successor) {
  slaves_[id].replaced = true;
  slaves_[id].successor = successor;
}

bool SlaveSet::PlaceByStation(std::uint16_t count, FrameNo frame) {
  std::vector<SlaveId> unplaced;
  std::size_t placed = 0;
  std::vector<SlavePos> free;
  for (SlavePos p = 0; p < count && p < kMaxSlaves; ++p) {
    const SlaveId there = AtPosition(p);
    const bool named = there != kNoSlave && slaves_[there].station.if_known() != nullptr;
    named ? static_cast<void>(++placed) : free.push_back(p);
  }
  for (std::size_t i = 0; i < slaves_.size(); ++i) {
    if (IsUnplaced(static_cast<SlaveId>(i))) unplaced.push_back(static_cast<SlaveId>(i));
  }
  if (unplaced.empty() || placed + unplaced.size() != count) return false;
  std::sort(unplaced.begin(), unplaced.end(),
            [&](SlaveId a, SlaveId b) { return *slaves_[a].station.if_known() < *slaves_[b].station.if_known(); });
  for (std::size_t i = 0; i < unplaced.size(); ++i) {
    if (const SlaveId nameless = AtPosition(free[i]); nameless != kNoSlave) Replace(nameless, unplaced[i]);
    PlaceAt(unplaced[i], free[i], frame);
    slaves_[unplaced[i]].position = Known<SlavePos>::Inferred(free[i], frame);
  }
  return true;
}

void SlaveSet::EnableAlias(SlaveId id, bool enabled) {
  SlaveAddress& slave = slaves_[id];
  if (slave.alias_enabled == enabled) return;
  slave.alias_enabled = enabled;
  enabled ? ++aliases_enabled_ : --aliases_enabled_;
}

void SlaveSet::LearnAlias(SlaveId id, StationAddress alias, FrameNo frame) {
  slaves_[id].alias = Known<StationAddress>::Observed(alias, frame);
}

SlaveId SlaveSet::OnlyWithAlias(StationAddress alias) const {
  SlaveId only = kNoSlave;
  for (std::size_t i = 0; i < slaves_.size(); ++i) {
    const StationAddress* known = slaves_[i].alias.if_observed();
    if (slaves_[i].replaced || known == nullptr || *known != alias) continue;
    if (only != kNoSlave) return kNoSlave;
    only = static_cast<SlaveId>(i);
  }
  return only;
}

void SlaveSet::ClearStations(FrameNo /*frame*/) {
  for (SlaveAddress& slave : slaves_) {
    const StationAddress* station = slave.station.if_known();
    if (station != nullptr) by_station_.Set(*station, kNoSlave);
    slave.station_valid = false;
  }
}

}  // namespace ecaudit::bus
