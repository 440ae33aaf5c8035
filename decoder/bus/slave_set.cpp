#include "decoder/bus/slave_set.h"

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
  if (slaves_.size() >= kMaxSlaves) return kNoSlave;
  slaves_.emplace_back();
  return static_cast<SlaveId>(slaves_.size() - 1);
}

SlaveId SlaveSet::AddAtPosition(SlavePos position, FrameNo frame) {
  if (const SlaveId known = AtPosition(position); known != kNoSlave) return known;
  if (position >= kMaxSlaves) return kNoSlave;
  const SlaveId id = Add();
  if (id == kNoSlave) return id;
  PlaceAt(id, position, frame);
  return id;
}

void SlaveSet::PlaceAt(SlaveId id, SlavePos position, FrameNo frame) {
  if (position >= by_position_.size()) by_position_.resize(static_cast<std::size_t>(position) + 1, kNoSlave);
  by_position_[position] = id;
  slaves_[id].position = Known<SlavePos>::Observed(position, frame);
}

SlaveId SlaveSet::AddAtStation(StationAddress address, FrameNo frame) {
  if (const SlaveId known = AtStation(address); known != kNoSlave) return known;
  const SlaveId id = Add();
  if (id == kNoSlave) return id;
  slaves_[id].station = Known<StationAddress>::Observed(address, frame);
  slaves_[id].station_valid = true;
  by_station_[address] = id;
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
    // A slave that was only ever met by this address may be this very one; with a position of its own it is another.
    if (slaves_[holder].position.if_known() != nullptr) {
      result.other = holder;
    } else {
      slaves_[holder].station_valid = false;
      slaves_[holder].replaced = slave.position.if_known() != nullptr;
    }
  }
  slave.station = Known<StationAddress>::Observed(address, frame);
  slave.station_valid = address != 0;
  if (address != 0) by_station_[address] = id;
  return result;
}

/// `id` does not answer to `address` any more; another slave that was given the same one still does.
void SlaveSet::LeaveStation(SlaveId id, StationAddress address) {
  if (by_station_[address] != id) return;
  by_station_[address] = kNoSlave;
  for (std::size_t i = 0; i < slaves_.size(); ++i) {
    const StationAddress* station = slaves_[i].station.if_known();
    if (i != id && slaves_[i].station_valid && station != nullptr && *station == address) {
      by_station_[address] = static_cast<SlaveId>(i);
    }
  }
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

void SlaveSet::ClearStations(FrameNo /*frame*/) {
  for (SlaveAddress& slave : slaves_) {
    const StationAddress* station = slave.station.if_known();
    if (station != nullptr) by_station_[*station] = kNoSlave;
    slave.station_valid = false;
  }
}

}  // namespace ecaudit::bus
