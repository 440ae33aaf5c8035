#include "decoder/track/addressing.h"

#include "decoder/base/time.h"
#include "decoder/bus/direction.h"

namespace ecaudit::track {
namespace {

/// The station address that the one slave which answered has, or is given.
std::optional<StationAddress> StationShown(const DatagramPair& d) {
  if (!d.CoversByte(esc::kStationAddress + 1) || d.address() > esc::kStationAddress) return std::nullopt;
  const ByteSpan data = wire::Writes(d.command()) ? d.written() : d.read();
  return LittleEndian<std::uint16_t>(data, static_cast<std::size_t>(esc::kStationAddress - d.address()));
}

std::optional<StationAddress> AliasShown(const DatagramPair& d) {
  if (d.address() > esc::kStationAlias || !d.CoversByte(esc::kStationAlias + 1)) return std::nullopt;
  const ByteSpan data = Slice(d.read(), static_cast<std::size_t>(esc::kStationAlias - d.address()), 2);
  return data.empty() ? std::nullopt : std::optional(LittleEndian<std::uint16_t>(data, 0));
}

/// Slaves answered a broadcast read of this frame, and none of them before it was captured on its way out.
bool HasUncountedRead(const bus::BusTransaction& transaction) {
  for (std::size_t i = 0; i < transaction.size(); ++i) {
    const DatagramPair d(transaction, i);
    if (!wire::IsBroadcast(d.command()) || !wire::Reads(d.command()) || !d.has_sent) continue;
    if (d.sent().wkc() == 0 && d.wkc() != 0) return true;
  }
  return false;
}

}  // namespace

SlaveId Addressing::AddressedBy(const wire::DatagramView& sent) const {
  if (wire::IsNodeAddressed(sent.command())) return slaves_.AtStation(sent.adp());
  const SlavePos position = PositionSent(sent.adp());
  return IsInDoubt(position) ? kNoSlave : slaves_.AtPosition(position);
}

bool Addressing::Together(const FrameRef& one, const FrameRef& other) {
  const bool soon = !one.has_time || !other.has_time || Elapsed(one.time, other.time) <= kTogetherNs;
  return other.number - one.number <= kTogether && soon;
}

std::optional<std::uint16_t> Addressing::Count(const DatagramPair& d) {
  if (d.any.circulating()) return std::nullopt;  // it may have passed slaves twice
  std::uint16_t count = 0;
  if (wire::IsBroadcast(d.command())) {
    // An outbound copy that slaves have passed was tapped after them, and each of them counts a read. What a master
    // sends in this field is its own affair.
    const bool may_be = d.has_sent && d.transaction.sent->mac_bit() && d.sent().adp() != 0;
    const bool tapped_after_slaves = may_be && (d.sent().wkc() != 0 || d.sent().adp() == upstream_);
    // What slaves refuse looks alike either way.
    if (may_be && !tapped_after_slaves && !HasUncountedRead(d.transaction)) return std::nullopt;
    if (tapped_after_slaves) upstream_ = d.sent().adp();
    count = static_cast<std::uint16_t>(d.any.adp() - (d.has_sent && !tapped_after_slaves ? d.sent().adp() : 0));
  } else if (d.has_sent) {
    count = static_cast<std::uint16_t>(d.any.adp() - d.sent().adp() + upstream_);
  } else {
    return std::nullopt;
  }
  if (count > bus::SlaveSet::kMaxSlaves) return std::nullopt;  // a damaged or made-up counter
  const std::uint16_t* before = slave_count_.if_known();
  const wire::FrameView& frame = d.transaction.any();
  const std::uint64_t sender = frame.sender();
  if (sender == counts_for_) counted_ = frame.ref();
  if (before != nullptr && *before == count && sender == counts_for_) return std::nullopt;  // nearly always
  segments_.OnCounted(sender);
  if (before != nullptr && *before == count) return std::nullopt;
  // At the other end of a redundant line frames pass no slave, or those beyond a break. The end with more of them
  // counts.
  const bool other_end = before != nullptr && sender != counts_for_ && (count == 0 || Together(counted_, frame.ref()));
  if (other_end && count < *before) return std::nullopt;
  if (other_end) before = nullptr;
  // Another program, perhaps at another line: what it counts first is no change.
  const bool other_program = before != nullptr && sender != counts_for_ && counts_for_ != 0;
  counts_for_ = sender;
  counted_ = frame.ref();
  const SlaveCount event{count, before != nullptr ? *before : std::uint16_t{0}, before == nullptr || other_program,
                         d.transaction.returned_ref()};
  slave_count_ = Known<std::uint16_t>::Observed(count, event.frame.number);
  if (!other_program) places_.OnCount(count, event.frame);
  ++version_;
  events_.Publish(event);
  if (other_program) return std::uint16_t{0};
  if (event.first || event.count < event.previous) return std::nullopt;
  return event.previous;
}

void Addressing::ForgetCount(FrameNo frame) {
  slave_count_.Forget(frame);
  ++version_;
}

std::optional<SlavePos> Addressing::PositionOf(const DatagramPair& d) const {
  if (d.has_sent) return PositionSent(d.sent().adp());
  // Only the returned copy: each slave added one, so the slave count leads back to what was sent.
  if (const std::uint16_t* count = slave_count_.if_known()) return static_cast<SlavePos>(*count - d.any.adp());
  return std::nullopt;
}

SlaveId Addressing::Resolve(const DatagramPair& d, bool add) {
  if (wire::IsNodeAddressed(d.command())) return AtStation(d, add);
  const std::optional<SlavePos> position = PositionOf(d);
  if (!position) return kNoSlave;
  // The distribution of the time shows that a slave is there; other accesses show which one, unless there is one
  // slave only.
  if (d.command() == wire::Command::ARMW && slave_count_.value_or(0) != 1) add = false;
  // The time itself shows whether another slave gives it.
  if (d.command() != wire::Command::ARMW && IsInDoubt(*position)) {
    return add ? ShownInDoubt(d, *position) : kNoSlave;
  }
  const SlaveId known = slaves_.AtPosition(*position);
  if (known != kNoSlave || !add) return known;
  PlaceByStation(d);
  if (const SlaveId placed = slaves_.AtPosition(*position); placed != kNoSlave) return placed;
  if (const SlaveId met = MetByStation(d, *position); met != kNoSlave) return met;
  const std::uint16_t* count = slave_count_.if_known();
  if (count != nullptr && *position >= *count) return kNoSlave;  // beyond the last slave
  return slaves_.AddAtPosition(*position, d.transaction.any().ref().number);
}

SlaveId Addressing::AtStation(const DatagramPair& d, bool add) {
  const SlaveId known = slaves_.AtStation(d.any.adp());
  // Address 0 is what all slaves have while a master renumbers them: it names no slave.
  if (known != kNoSlave || !add || d.any.adp() == 0) return known;
  ++unplaced_;
  const FrameNo frame = d.transaction.any().ref().number;
  // Whom another program counted are not the slaves of this bus, as far as anything shows.
  if (slave_count_.if_known() != nullptr && !IsCountOf(d)) ForgetCount(frame);
  const SlaveId added = slaves_.AddAtStation(d.any.adp(), frame);
  // One of those at a position may have this address.
  if (unplaced_ < slaves_.size()) PlaceByStation(d);
  return added;
}

/// No slave is known to be there, and one may have moved there.
bool Addressing::IsInDoubt(SlavePos position) const {
  if (!places_.doubted()) return false;
  const SlaveId there = slaves_.AtPosition(position);
  return there == kNoSlave || places_.InDoubt(there);
}

bool Addressing::MayAddressSlave(const DatagramPair& d) const {
  if (!wire::IncrementsAdp(d.command()) || wire::IsBroadcast(d.command())) return false;
  if (d.command() == wire::Command::ARMW || !places_.doubted()) return false;
  const std::optional<SlavePos> position = PositionOf(d);
  return position && IsInDoubt(*position);
}

/// Who is there, where this access shows it.
SlaveId Addressing::ShownInDoubt(const DatagramPair& d, SlavePos position) {
  const bool one_answered = d.wkc() == 1 || d.wkc() == 3;
  if (!one_answered) return kNoSlave;
  const FrameNo frame = d.transaction.any().ref().number;
  if (const auto station = StationShown(d); station && *station != 0) {
    ++version_;
    return places_.NamedAt(position, *station, wire::Writes(d.command()), frame);
  }
  const auto alias = AliasShown(d);
  const SlaveId known = alias && *alias != 0 ? slaves_.OnlyWithAlias(*alias) : kNoSlave;
  if (known == kNoSlave || !places_.InDoubt(known)) return kNoSlave;
  ++version_;
  places_.Place(known, position, frame);
  return known;
}

void Addressing::OnAnswered(SlaveId id, const DatagramPair& d) {
  if (wire::IsNodeAddressed(d.command()) && places_.OnAnswer(id, d.transaction.first_ref().number)) ++version_;
  if (segments_.OnAnswered(id, d.transaction.any().sender())) ++version_;
}

bool Addressing::Concerns(SlaveId id, const DatagramPair& d) const {
  return d.transaction.other_end || d.transaction.joined || segments_.MayConcern(id, d.transaction.any().sender());
}

bool Addressing::ConcernsAll(const DatagramPair& d) const {
  return d.transaction.other_end || d.transaction.joined || segments_.MayConcernAll(d.transaction.any().sender());
}

/// The slaves were counted by who sent this: another program may count those of another bus.
bool Addressing::IsCountOf(const DatagramPair& d) const {
  const std::uint64_t sender = d.transaction.any().sender();
  return sender == counts_for_ || segments_.HasCounted(sender) || d.transaction.other_end || d.transaction.joined;
}

void Addressing::PlaceByStation(const DatagramPair& d) {
  const std::uint16_t* count = slave_count_.if_known();
  if (count == nullptr || unplaced_ == 0 || places_.doubted() || !IsCountOf(d)) return;
  if (slaves_.PlaceByStation(*count, d.transaction.any().ref().number)) ++version_;
}

/// A slave that was met by its station address in the running bus: an access by position to that address shows where it
/// is.
SlaveId Addressing::MetByStation(const DatagramPair& d, SlavePos position) {
  const StationAddress address = StationShown(d).value_or(0);
  const SlaveId met = address != 0 ? slaves_.AtStation(address) : kNoSlave;
  if (met == kNoSlave || slaves_[met].position.if_known() != nullptr) return kNoSlave;
  ++version_;
  return slaves_.AssignAtPosition(position, address, d.transaction.any().ref().number).slave;
}

void Addressing::OnAccess(const SlaveAccess& access) {
  const ByteSpan enable = !access.written.empty()
                              ? access.Covered(access.done() ? access.written : ByteSpan{}, kAliasEnable, 1)
                              : access.Covered(access.read, kAliasEnable, 1);
  if (!enable.empty() && !(access.broadcast && access.written.empty())) {
    slaves_.EnableAlias(access.slave, (enable[0] & 1U) != 0);
  }
  if (access.broadcast) return;
  // By position it is reported in this way only where it is known who that is.
  const bool by_position = wire::IncrementsAdp(access.command) && access.command != wire::Command::ARMW;
  if (by_position && access.done()) places_.Settle(access.slave);
  const ByteSpan written = access.done() ? access.Covered(access.written, esc::kStationAddress, 2) : ByteSpan{};
  const ByteSpan station = !written.empty() ? written : access.Covered(access.read, esc::kStationAddress, 2);
  if (!station.empty()) LearnStation(access, LittleEndian<std::uint16_t>(station, 0));
  if (const ByteSpan alias = access.Covered(access.read, esc::kStationAlias, 2); !alias.empty()) {
    slaves_.LearnAlias(access.slave, LittleEndian<std::uint16_t>(alias, 0), access.frame().number);
  }
}

void Addressing::LearnStation(const SlaveAccess& access, StationAddress address) {
  const bus::SlaveAddress& known = slaves_[access.slave];
  const StationAddress* before = known.station.if_known();
  if (before != nullptr && *before == address && known.station_valid) return;
  ++version_;
  const FrameNo frame = access.frame().number;
  const SlavePos* position = known.position.if_known();
  const bus::Assignment assigned = position != nullptr ? slaves_.AssignAtPosition(*position, address, frame)
                                                       : slaves_.AssignStation(access.slave, address, frame);
  const bool shared = assigned.other != kNoSlave && OnBus(assigned.other);
  events_.Publish(AddressAssigned{access.slave, access.frame(), address, shared ? assigned.other : kNoSlave});
}

void Addressing::ClearStations(const DatagramPair& d) {
  PlaceByStation(d);
  places_.SettleAll();
  slaves_.ClearStations(d.transaction.any().ref().number);
  ++version_;
}

}  // namespace ecaudit::track
