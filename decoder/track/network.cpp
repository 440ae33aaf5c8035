#include "decoder/track/network.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "decoder/base/time.h"
#include "decoder/esc/register_addresses.h"

namespace ecaudit::track {
namespace {

constexpr EscAddress kAliasEnable = 0x0103;  // bit 0 = bit 24 of DL control
constexpr EscAddress kMappingFirst = 0x0600;
constexpr EscAddress kMappingEnd = 0x0880;

bool CoversByte(EscAddress address, std::size_t length, EscAddress byte) {
  return address <= byte && static_cast<std::size_t>(byte - address) < length;
}

/// The first 16 bit of `data`, or its only byte (old masters access AL registers with a length of 1); 0 when empty.
std::uint16_t WordOrByte(ByteSpan data) {
  if (data.size() >= 2) return LittleEndian<std::uint16_t>(data, 0);
  return LittleEndian<std::uint8_t>(data, 0);
}

}  // namespace

/// One datagram with both its copies.
struct Network::Datagram {
  const bus::BusTransaction& transaction;
  std::size_t ordinal;
  wire::DatagramView any;  // returned copy if captured, else the outbound one
  bool has_sent;
  bool has_returned;

  [[nodiscard]] wire::Command command() const { return any.command(); }
  [[nodiscard]] EscAddress address() const { return any.ado(); }
  [[nodiscard]] wire::DatagramView sent() const { return (*transaction.sent)[ordinal]; }
  [[nodiscard]] bool assumed() const { return transaction.assumed; }
  [[nodiscard]] std::uint16_t wkc() const { return has_returned ? any.wkc() : std::uint16_t{0}; }
  /// What the master wrote. Slaves leave the data of pure writes alone, so the returned copy will do.
  [[nodiscard]] ByteSpan written() const {
    if (!wire::Writes(command())) return {};
    if (has_sent) return sent().data();
    return wire::Reads(command()) ? ByteSpan{} : any.data();
  }
  [[nodiscard]] ByteSpan read() const { return wire::Reads(command()) && has_returned ? any.data() : ByteSpan{}; }

  [[nodiscard]] SlaveAccess Access(SlaveId slave, Acceptance acceptance) const {
    SlaveAccess access;
    access.slave = slave;
    access.sent = transaction.sent_ref();
    access.returned = transaction.returned_ref();
    access.command = command();
    access.datagram = any.ordinal();
    access.address = address();
    access.written = written();
    if (acceptance == Acceptance::kAccepted) access.read = read();
    access.acceptance = acceptance;
    access.broadcast = wire::IsBroadcast(command());
    return access;
  }
};

std::optional<esc::SyncManager> SlaveState::sync_manager(std::size_t n, Certainty at_least) const {
  // Status and PDI control belong to the slave; unknown ones read as 0 and do not matter here.
  const EscAddress at = esc::SyncManagerAddress(n);
  if (registers.CertaintyOf(static_cast<EscAddress>(at + 6), 1) < at_least || registers.CertaintyOf(at, 5) < at_least) {
    return std::nullopt;
  }
  std::array<std::uint8_t, esc::kSyncManagerBytes> bytes{};
  registers.Read(at, bytes);
  return esc::SyncManager::Decode(bytes);
}

std::optional<esc::Fmmu> SlaveState::fmmu(std::size_t n, Certainty at_least) const {
  const EscAddress at = esc::FmmuAddress(n);
  // The last byte first: most units of most slaves were never touched, and all are asked for after each change of one.
  if (registers.CertaintyOf(static_cast<EscAddress>(at + 12), 1) < at_least) return std::nullopt;
  if (registers.CertaintyOf(at, 13) < at_least) return std::nullopt;
  std::array<std::uint8_t, esc::kFmmuBytes> bytes{};
  registers.Read(at, bytes);
  return esc::Fmmu::Decode(bytes);
}

void Network::OnSent(const wire::FrameView& frame) {
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const wire::DatagramView d = frame[i];
    const wire::Command c = d.command();
    if (wire::IsLogical(c) || !wire::Writes(c) || c == wire::Command::ARMW || c == wire::Command::FRMW ||
        !CoversByte(d.ado(), d.length(), esc::kAlControl)) {
      continue;
    }
    const std::size_t at = static_cast<std::size_t>(esc::kAlControl - d.ado());
    const ByteSpan data = Slice(d.data(), at, 2);
    const esc::AlWord control{WordOrByte(data)};
    if (wire::IsBroadcast(c)) {
      for (std::size_t s = 0; s < slaves_.size(); ++s) {
        if (OnBus(static_cast<SlaveId>(s))) events_.OnAlRequestSent(static_cast<SlaveId>(s), frame.ref(), control);
      }
    } else {
      const SlaveId slave = wire::IsNodeAddressed(c)
                                ? slaves_.AtStation(d.adp())
                                : slaves_.AtPosition(static_cast<SlavePos>(0U - d.adp() + upstream_));
      if (slave != kNoSlave) events_.OnAlRequestSent(slave, frame.ref(), control);
    }
  }
}

void Network::FollowEventField(const bus::BusTransaction& transaction) {
  if (transaction.returned == nullptr) return;
  const wire::FrameView& frame = *transaction.returned;
  unsigned bits = event_field_.bits;
  for (std::size_t i = 0; i < frame.size(); ++i) bits |= frame[i].irq();
  if (bits == 0) {
    ++event_field_.frames;
  } else {
    ApplyEventField(transaction);
  }
}

void Network::ApplyEventField(const bus::BusTransaction& transaction) {
  const wire::FrameView& frame = *transaction.returned;
  unsigned bits = 0;
  bool all_read = false;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    all_read = all_read || frame[i].command() == wire::Command::BRD || frame[i].command() == wire::Command::BRW;
    const bool has_sent = transaction.sent != nullptr && i < transaction.sent->size();
    bits |= frame[i].irq() & ~(has_sent ? unsigned{(*transaction.sent)[i].irq()} : 0U);
  }
  if (bits != event_field_.bits) {
    const EventFieldRun before = event_field_;
    event_field_ = {static_cast<std::uint16_t>(bits), 0, frame.ref(), frame.ref(), false};
    events_.On(EventFieldChanged{before, event_field_.bits, frame.ref()});
  }
  ++event_field_.frames;
  event_field_.last = frame.ref();
  event_field_.all_read = all_read;
}

void Network::OnTransaction(const bus::BusTransaction& transaction) {
  const FrameRef& first = transaction.first_ref();
  if (transaction.hole != bus::Hole::kNone) {
    if (first.has_time && last_.has_time && ClockJumps(last_.time, first.time)) {
      BeginRecording(first);
    } else {
      OnHole(first, transaction.hole == bus::Hole::kCertain);
    }
  }
  if (first.has_time) last_ = first;
  FollowEventField(transaction);
  for (std::size_t i = 0; i < transaction.size(); ++i) {
    const Datagram d{transaction, i, transaction.any()[i], transaction.sent != nullptr && i < transaction.sent->size(),
                     transaction.returned != nullptr};
    if (!wire::IsDefined(d.any.command_byte())) continue;
    if (wire::IsLogical(d.command())) {
      OnLogical(d);
      continue;
    }
    if (d.has_returned && wire::IncrementsAdp(d.command())) CountSlaves(d);
    if (wire::IsBroadcast(d.command())) {
      OnBroadcast(d);
    } else if (d.command() != wire::Command::NOP) {
      OnAddressed(d);
    }
  }
}

void Network::CountSlaves(const Datagram& d) {
  if (d.any.circulating()) return;  // it may have passed slaves twice
  std::uint16_t count = 0;
  if (wire::IsBroadcast(d.command())) {
    // Masters send broadcasts with 0. An outbound copy that already counted some was tapped behind that many slaves.
    const bool tapped_behind_slaves = d.has_sent && d.transaction.sent->mac_bit() && d.sent().adp() != 0;
    if (tapped_behind_slaves) upstream_ = d.sent().adp();
    count = static_cast<std::uint16_t>(d.any.adp() - (d.has_sent && !tapped_behind_slaves ? d.sent().adp() : 0));
  } else if (d.has_sent) {
    count = static_cast<std::uint16_t>(d.any.adp() - d.sent().adp() + upstream_);
  } else {
    return;
  }
  if (count > bus::SlaveSet::kMaxSlaves) return;  // a damaged or made-up counter
  const std::uint16_t* before = slave_count_.if_known();
  if (before != nullptr && *before == count) return;
  const bool first = before == nullptr;
  const std::uint16_t before_count = first ? std::uint16_t{0} : *before;
  const SlaveCount event{count, before_count, first, d.transaction.returned_ref()};
  slave_count_ = Known<std::uint16_t>::Observed(count, event.frame.number);
  ++states_version_;
  events_.On(event);
  if (!first && count > before_count) ForgetReturning(before_count, event.frame);
}

/// Slaves that were away may come back after a power cycle, and new ones have taken no broadcast so far.
void Network::ForgetReturning(std::uint16_t first_position, const FrameRef& frame) {
  everyone_ = SlaveState();
  ++states_version_;
  for (std::size_t s = 0; s < slaves_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    const SlavePos* position = slaves_[id].position.if_known();
    if (position == nullptr || *position < first_position) continue;
    Forget(id, frame);
  }
}

/// The slave may have been switched off, or set up anew.
void Network::Forget(SlaveId id, const FrameRef& frame) {
  SlaveState& state = states_[id];
  if (std::exchange(state.presumed, false)) --presumed_;
  state.registers.Clear();
  state.sii.Forget();
  if (mailboxes_[id]) mailboxes_[id]->Forget(frame);
  ++state.mapping_version;
  MappingChanged(id);
  ++states_version_;
  state.al_status_code.Forget(frame.number);
  if (state.al_status.if_known() == nullptr) return;
  state.al_status.Forget(frame.number);
  events_.On(AlStateForgotten{id, frame});
}

/// In frames that the capture misses the master may have done anything. In OP it does nothing mostly: what is known of
/// slaves in OP is presumed until the capture shows them again.
void Network::OnHole(const FrameRef& frame, bool certain) {
  events_.On(CaptureHole{frame, certain});
  if (!certain) return;
  everyone_ = SlaveState();
  slave_count_.Forget(frame.number);
  ++states_version_;
  for (std::size_t s = 0; s < states_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    SlaveState& state = states_[id];
    const esc::AlWord* status = state.al_status.if_known();
    if (!state.presumed && status != nullptr && status->raw == static_cast<std::uint16_t>(esc::AlState::OP)) {
      state.presumed = true;
      ++presumed_;
      if (mailboxes_[s]) mailboxes_[s]->Forget(frame);
    } else if (!slaves_[id].replaced) {
      Forget(id, frame);
    }
  }
}

/// In between anything may have happened, for any time.
void Network::BeginRecording(const FrameRef& frame) {
  events_.On(CaptureHole{frame, true});
  events_.On(RunBegan{frame, RunBegan::Reason::kClock});
  run_in_use_ = false;
  everyone_ = SlaveState();
  slave_count_.Forget(frame.number);
  ++states_version_;
  for (std::size_t s = 0; s < states_.size(); ++s) Forget(static_cast<SlaveId>(s), frame);
}

/// Masters that start set all slaves back, whatever these were doing.
void Network::FollowRun(const Datagram& d) {
  if (!run_in_use_ || (!d.assumed() && d.wkc() == 0)) return;
  const ByteSpan written = d.written();
  const auto covered = [&](EscAddress at) {
    return CoversByte(d.address(), written.size(), at) ? Slice(written, static_cast<std::size_t>(at - d.address()), 2)
                                                       : ByteSpan{};
  };
  const ByteSpan control = covered(esc::kAlControl);
  const ByteSpan station = covered(esc::kStationAddress);
  const bool init =
      !control.empty() && esc::AlWord{WordOrByte(control)}.state() == static_cast<int>(esc::AlState::INIT);
  if (!init && (station.size() < 2 || WordOrByte(station) != 0)) return;
  run_in_use_ = false;
  events_.On(RunBegan{d.transaction.first_ref(), RunBegan::Reason::kInitialised});
}

/// The capture shows whether what is presumed of this slave still holds.
void Network::Presume(SlaveId id, bool still_so, const FrameRef& frame) {
  if (!states_[id].presumed) return;
  if (!still_so) {
    Forget(id, frame);
    return;
  }
  states_[id].presumed = false;
  --presumed_;
}

void Network::PresumeAll(bool still_so, const FrameRef& frame) {
  for (std::size_t s = 0; s < states_.size() && presumed_ > 0; ++s) Presume(static_cast<SlaveId>(s), still_so, frame);
}

void Network::FollowLogical(const Datagram& d) {
  const std::uint32_t address = d.any.logical_address();
  Habit& habit = habits_[(address >> 8U ^ address ^ static_cast<std::uint32_t>(d.command())) % habits_.size()];
  const bool same = habit.command == d.command() && habit.address == address && habit.length == d.any.length();
  if (presumed_ > 0) PresumeAll(same && d.wkc() > 0 && d.wkc() == habit.wkc, d.transaction.first_ref());
  habit = {d.command(), address, d.any.length(), d.wkc()};
}

bool Network::OnBus(SlaveId id) const {
  if (slaves_[id].replaced) return false;
  const SlavePos* position = slaves_[id].position.if_known();
  const std::uint16_t* count = slave_count_.if_known();
  return position == nullptr || count == nullptr || *position < *count;
}

std::optional<SlavePos> Network::PositionOf(const Datagram& d) const {
  if (d.has_sent) return static_cast<SlavePos>(0U - d.sent().adp() + upstream_);
  // Only the returned copy: each slave added one, so the slave count leads back to what was sent.
  if (const std::uint16_t* count = slave_count_.if_known()) return static_cast<SlavePos>(*count - d.any.adp());
  return std::nullopt;
}

SlaveId Network::Resolve(const Datagram& d, bool add) {
  if (wire::IsNodeAddressed(d.command())) {
    const SlaveId known = slaves_.AtStation(d.any.adp());
    // Address 0 is what all slaves have while a master renumbers them: it names nobody.
    if (known != kNoSlave || !add || d.any.adp() == 0) return known;
    const SlaveId id = slaves_.AddAtStation(d.any.adp(), d.transaction.any().ref().number);
    Meet(id, d.transaction.any().ref());
    return id;
  }
  const std::optional<SlavePos> position = PositionOf(d);
  if (!position) return kNoSlave;
  const SlaveId known = slaves_.AtPosition(*position);
  if (known != kNoSlave || !add) return known;
  if (CoversByte(d.address(), d.any.length(), esc::kStationAddress + 1) && d.address() <= esc::kStationAddress) {
    // A slave that was met by this station address in the running bus: now its position shows.
    const ByteSpan data = wire::Writes(d.command()) ? d.written() : d.read();
    const auto address =
        LittleEndian<std::uint16_t>(data, static_cast<std::size_t>(esc::kStationAddress - d.address()));
    const SlaveId met = address != 0 ? slaves_.AtStation(address) : kNoSlave;
    if (met != kNoSlave && slaves_[met].position.if_known() == nullptr) {
      ++states_version_;
      return slaves_.AssignAtPosition(*position, address, d.transaction.any().ref().number).slave;
    }
  }
  const std::uint16_t* count = slave_count_.if_known();
  if (count != nullptr && *position >= *count) return kNoSlave;  // behind the last slave: nobody
  const SlaveId id = slaves_.AddAtPosition(*position, d.transaction.any().ref().number);
  Meet(id, d.transaction.any().ref());
  return id;
}

void Network::Meet(SlaveId id, const FrameRef& frame) {
  if (id == kNoSlave || id < states_.size()) return;
  ++states_version_;
  states_.emplace_back().registers.Limit(register_pages_);
  states_.back() = everyone_;
  states_.back().sii = SiiAssembler(id, &eeprom_pages_);
  mailboxes_.emplace_back();
  window_versions_.push_back(0);
  mappings_.emplace_back();
  MappingChanged(id);
  events_.On(SlaveFound{id, frame});
}

void Network::OnLogical(const Datagram& d) {
  LogicalAccess access;
  access.command = d.command();
  access.address = d.any.logical_address();
  access.sent = d.transaction.sent_ref();
  access.returned = d.transaction.returned_ref();
  if (d.has_sent) access.sent_data = d.sent().data();
  if (d.has_returned) access.returned_data = d.any.data();
  access.length = d.any.length();
  access.wkc = d.wkc();
  access.circulating = d.has_returned && d.any.circulating();
  access.assumed = d.assumed();
  if (d.has_returned) FollowLogical(d);
  events_.On(access);
  if (mapped_version_ != mapping_version_) FindMappedMailboxes();
  if (!mapped_mailboxes_.empty() && wire::Reads(d.command())) ReadMailboxesThroughFmmus(d);
}

Answered Network::AnswerOf(const Datagram& d, SlaveId slave) const {
  Answered answer;
  answer.command = d.command();
  answer.adp = d.has_sent ? d.sent().adp() : wire::IsBroadcast(d.command()) ? std::uint16_t{0} : d.any.adp();
  answer.address = d.address();
  answer.length = d.any.length();
  answer.wkc = d.wkc();
  answer.circulating = d.any.circulating();
  if (wire::IncrementsAdp(d.command())) {
    if (const std::uint16_t* count = slave_count_.if_known()) answer.slaves_passed = *count;
  }
  answer.slave = slave;
  answer.sent = d.transaction.sent_ref();
  answer.returned = d.transaction.returned_ref();
  if (d.has_sent) answer.sent_data = d.sent().data();
  if (d.has_returned) answer.returned_data = d.any.data();
  return answer;
}

void Network::OnBroadcast(const Datagram& d) {
  if (wire::Writes(d.command())) FollowRun(d);
  const std::uint16_t* count = slave_count_.if_known();
  if (d.has_returned || (d.assumed() && wire::Writes(d.command()))) {
    events_.On(AnswerOf(d, kNoSlave));
  }
  if (wire::Writes(d.command())) {
    Acceptance acceptance = Acceptance::kUnknown;
    if (d.assumed()) {
      acceptance = Acceptance::kAssumed;
    } else if (d.wkc() == 0) {
      acceptance = Acceptance::kRefused;
    } else if (count != nullptr && d.wkc() == *count * (d.command() == wire::Command::BRW ? 3 : 1)) {
      acceptance = Acceptance::kAccepted;
    }
    const SlaveAccess to_all = d.Access(kNoSlave, acceptance);
    if (to_all.address < esc::RegisterImage::kSize && acceptance != Acceptance::kRefused) {
      Learn(everyone_, to_all, to_all.written, CertaintyOfWrite(to_all));
    }
    for (std::size_t s = 0; s < slaves_.size(); ++s) {
      if (OnBus(static_cast<SlaveId>(s))) Apply(d.Access(static_cast<SlaveId>(s), acceptance));
    }
    if (CoversByte(d.address(), d.any.length(), esc::kStationAddress) && acceptance != Acceptance::kRefused) {
      slaves_.ClearStations(d.transaction.any().ref().number);
      ++states_version_;
    }
  }
  if (d.command() == wire::Command::BRD && d.has_returned && d.wkc() != 0 &&
      CoversByte(d.address(), d.any.length(), esc::kAlStatus)) {
    ReadAlStatusOfAll(d);
  }
}

/// The result is the OR of all slaves. One state bit and everybody counted: all are in that state. A state that is not
/// in the result is the state of nobody who counted.
void Network::ReadAlStatusOfAll(const Datagram& d) {
  const std::uint16_t* count = slave_count_.if_known();
  if (count == nullptr || d.wkc() != *count) return;
  if (d.has_sent) {
    // Bits that the master sent set would be taken for answers.
    const ByteSpan sent = d.sent().data();
    if (std::any_of(sent.begin(), sent.end(), [](std::uint8_t b) { return b != 0; })) return;
  }
  const ByteSpan data = Slice(d.any.data(), static_cast<std::size_t>(esc::kAlStatus - d.address()));
  const std::uint8_t status = data[0];
  const std::uint8_t seen = status & 0x0FU;
  const bool one_state = std::has_single_bit(static_cast<unsigned>(seen));
  const bool error = (status & 0x10U) != 0;
  const FrameRef frame = d.transaction.returned_ref();
  if (poll_.version == states_version_ && poll_.status == status &&
      events_.OnAlPoll(frame, esc::AlWord{seen}, poll_.slaves)) {
    return;
  }
  if (presumed_ > 0) PresumeAll(!error && seen == static_cast<std::uint8_t>(esc::AlState::OP), frame);
  poll_.version = 0;
  poll_.slaves.clear();
  bool all_same = true;
  SlaveId only = kNoSlave;  // the one slave on the bus, where its place or its being alone tells which that is
  if (*count == 1) {
    only = slaves_.AtPosition(0);
    if (only == kNoSlave && slaves_.size() == 1) only = 0;
  }
  for (std::size_t s = 0; s < slaves_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    if (!OnBus(id)) continue;
    const esc::AlWord* before = states_[id].al_status.if_known();
    if (id == only) {
      const auto code = data.size() >= 6 ? std::optional(LittleEndian<std::uint16_t>(data, 4)) : std::nullopt;
      ApplyAlStatus(id, frame, WordOrByte(data), code, true);
      all_same = false;  // a single slave tells more than its state
    } else if (one_state && !error) {
      // Bits above the error bit are an OR of all: they say nothing of this slave.
      const bool same = before != nullptr && before->state() == seen && !before->bit4();
      if (same) {
        poll_.slaves.push_back(id);
        events_.On(AlStatusRead{id, frame, *before, *before, std::nullopt, true});
      } else {
        all_same = false;
        ApplyAlStatus(id, frame, seen, std::nullopt, true);
      }
    } else if (one_state) {
      // The state is certain, whose error bit it is, is not.
      if (before == nullptr || before->state() != seen) ApplyAlStatus(id, frame, seen, std::nullopt, false);
      all_same = false;
    } else if (before != nullptr && (before->state() & ~status & 0x0FU) != 0) {
      states_[id].al_status.Forget(frame.number);
      states_[id].al_status_code.Forget(frame.number);
      ++states_version_;
      events_.On(AlStateForgotten{id, frame});
    }
  }
  if (all_same && one_state && !error) {
    poll_.version = states_version_;
    poll_.status = status;
  }
}

void Network::OnAddressed(const Datagram& d) {
  const wire::Command c = d.command();
  // ARMW and FRMW read at the addressed slave and write at all others; who of them takes it, the counter cannot say.
  const bool reads_here = wire::Reads(c);
  const bool writes_here = wire::Writes(c) && c != wire::Command::ARMW && c != wire::Command::FRMW;
  const std::uint16_t wkc = d.wkc();
  const bool took_part = d.assumed() || wkc != 0;
  const SlaveId slave = Resolve(d, took_part);
  if (d.has_returned) {
    events_.On(AnswerOf(d, slave));
  }
  if (slave == kNoSlave) return;

  Acceptance acceptance = took_part ? Acceptance::kAccepted : Acceptance::kRefused;
  if (d.assumed()) acceptance = Acceptance::kAssumed;
  SlaveAccess access = d.Access(slave, acceptance);
  if (!writes_here) access.written = {};
  if (!reads_here) access.read = {};
  if (d.has_returned && reads_here && writes_here && wkc != 3) {
    // Read counts 1, write counts 2 (esc-reference 2.1).
    if ((wkc & 1U) == 0) access.read = {};
    if ((wkc & 2U) == 0) access.written = {};
  }
  const bool one_slave = c != wire::Command::ARMW && c != wire::Command::FRMW;
  if (one_slave && wkc > (reads_here && writes_here ? 3 : 1)) {
    // More than one slave answered, or the counter is damaged: what was read may come from another one.
    access.read = {};
  }
  if (!one_slave && d.has_returned && access.acceptance == Acceptance::kAccepted) {
    // The others may have counted without the reader. Changed data prove that it did, and so does a full count.
    const std::uint16_t* count = slave_count_.if_known();
    const ByteSpan sent = d.has_sent ? d.sent().data() : access.read;
    const bool changed = !std::equal(sent.begin(), sent.end(), access.read.begin(), access.read.end());
    if (!changed && (count == nullptr || wkc != *count)) return;
  }
  Apply(access);
}

Certainty Network::CertaintyOfWrite(const SlaveAccess& access) {
  if (access.acceptance == Acceptance::kAccepted) return Certainty::kObserved;
  if (access.acceptance == Acceptance::kAssumed) return Certainty::kInferred;
  // Masters blank all FMMUs and sync managers by broadcast, also those that a slave does not have. Who did not take the
  // zeros has no such unit: it maps nothing either way.
  const bool blanks = access.broadcast && access.returned.seen() && access.address >= kMappingFirst &&
                      access.address + access.written.size() <= kMappingEnd &&
                      std::all_of(access.written.begin(), access.written.end(), [](std::uint8_t b) { return b == 0; });
  return blanks ? Certainty::kInferred : Certainty::kUnknown;
}

void Network::Learn(SlaveState& state, const SlaveAccess& access, ByteSpan bytes, Certainty certainty) {
  const bool is_read = bytes.data() == access.read.data();
  const bool touches_mapping = access.address < kMappingEnd && access.address + bytes.size() > kMappingFirst;
  // Reading the mapping area again changes nothing that could be derived from it.
  if (touches_mapping &&
      !(is_read && state.registers.CertaintyOf(access.address, bytes.size()) == Certainty::kObserved)) {
    for (std::size_t n = 0; n < esc::kMaxFmmus; ++n) {
      const EscAddress at = esc::FmmuAddress(n);
      if (access.address < at + esc::kFmmuBytes && access.address + bytes.size() > at) {
        state.fmmu_since[n] = access.frame().number;
      }
    }
    for (std::size_t n = 0; n < esc::kMaxSyncManagers; ++n) {
      const EscAddress at = esc::SyncManagerAddress(n);
      if (access.address < at + esc::kSyncManagerBytes && access.address + bytes.size() > at) {
        state.sync_manager_since[n] = access.frame().number;
      }
    }
    ++state.mapping_version;
    MappingChanged(access.slave);
  }
  state.registers.Write(access.address, bytes, certainty);
}

bool Network::LearnedSince(FrameNo sent, SlaveId slave, EscAddress address, std::size_t length) const {
  return std::any_of(recent_.begin(), recent_.end(), [&](const Recent& r) {
    return r.slave == slave && r.sent > sent && r.address <= address &&
           static_cast<std::size_t>(address - r.address) + length <= r.length;
  });
}

void Network::Apply(const SlaveAccess& access) {
  SlaveState& state = states_[access.slave];
  const bool in_registers = access.address < esc::RegisterImage::kSize;
  // A master that sets up a slave has taken it out of OP.
  if (state.presumed && !access.written.empty() && access.address < kMappingEnd &&
      access.address + access.written.size() > esc::kAlControl) {
    Presume(access.slave, false, access.frame());
  }
  if (in_registers) {
    const std::size_t length = std::max(access.written.size(), access.read.size());
    const FrameNo sent = (access.sent.seen() ? access.sent : access.returned).number;
    // A command that does both reads first: what came back is what was there before.
    if (!access.read.empty()) Learn(state, access, access.read, Certainty::kObserved);
    if (!access.written.empty() && access.acceptance != Acceptance::kRefused) {
      // Losses show late: a repetition of the same write may have arrived since.
      const bool late = access.acceptance == Acceptance::kUnknown && !access.returned.seen() &&
                        LearnedSince(sent, access.slave, access.address, length);
      if (!late) Learn(state, access, access.written, CertaintyOfWrite(access));
    }
    if (access.acceptance == Acceptance::kAccepted && length > 0) {
      recent_[next_recent_] = {sent, access.slave, access.address, static_cast<std::uint16_t>(length)};
      next_recent_ = (next_recent_ + 1) % recent_.size();
    }
  }
  events_.OnAccess(access);
  if (window_versions_[access.slave] != state.mapping_version) UpdateMailboxWindow(access.slave, access.frame());
  TrackMailbox(access);
  if (!in_registers) return;
  if (access.address < esc::kEepromEnd &&
      access.address + std::max(access.written.size(), access.read.size()) > esc::kEepromConfiguration) {
    state.sii.OnAccess(access, this);
  }

  if (access.address <= kAliasEnable &&
      access.address + std::max(access.written.size(), access.read.size()) > esc::kStationAddress) {
    ApplyAddressing(access);
  }
  const std::size_t control_at = static_cast<std::size_t>(esc::kAlControl - access.address);
  if (CoversByte(access.address, access.written.size(), esc::kAlControl)) {
    const ByteSpan control = Slice(access.written, control_at, 2);
    const bool leaves_init = esc::AlWord{WordOrByte(control)}.state() > static_cast<std::uint8_t>(esc::AlState::INIT);
    run_in_use_ = run_in_use_ || (leaves_init && access.acceptance != Acceptance::kRefused);
    events_.On(AlRequest{access.slave, access.sent, access.returned, esc::AlWord{WordOrByte(control)},
                         access.acceptance, access.broadcast});
    if (access.done() && esc::AlWord{WordOrByte(control)}.state() == static_cast<std::uint8_t>(esc::AlState::INIT)) {
      if (mailboxes_[access.slave]) mailboxes_[access.slave]->Reset(access.frame());
    }
  }
  if (access.broadcast) return;
  if (CoversByte(access.address, access.read.size(), esc::kAlStatus)) {
    const ByteSpan status = Slice(access.read, static_cast<std::size_t>(esc::kAlStatus - access.address));
    std::optional<std::uint16_t> code;
    if (status.size() >= 6) code = LittleEndian<std::uint16_t>(status, 4);
    ApplyAlStatus(access.slave, access.frame(), WordOrByte(status), code, true);
  } else if (const ByteSpan code = access.Covered(access.read, esc::kAlStatusCode, 2); !code.empty()) {
    const auto value = LittleEndian<std::uint16_t>(code, 0);
    state.al_status_code = Known<std::uint16_t>::Observed(value, access.frame().number);
    events_.On(AlStatusCodeRead{access.slave, access.frame(), value});
  }
}

void Network::ApplyAlStatus(SlaveId slave, const FrameRef& frame, std::uint16_t status,
                            std::optional<std::uint16_t> code, bool error_bit_known) {
  SlaveState& state = states_[slave];
  if (state.presumed) Presume(slave, status == static_cast<std::uint16_t>(esc::AlState::OP), frame);
  AlStatusRead event{slave, frame, esc::AlWord{status}, std::nullopt, code, error_bit_known};
  if (const esc::AlWord* before = state.al_status.if_known()) event.before = *before;
  if (event.changed()) {
    run_in_use_ = run_in_use_ || event.status.state() > static_cast<std::uint8_t>(esc::AlState::INIT);
    const bool other_state = event.before && event.before->state() != event.status.state();
    if (other_state && event.status.state() == static_cast<std::uint8_t>(esc::AlState::INIT)) {
      if (mailboxes_[slave]) mailboxes_[slave]->Reset(frame);
    }
    state.al_status = Known<esc::AlWord>::Observed(esc::AlWord{status}, frame.number);
    ++states_version_;
  }
  if (code) state.al_status_code = Known<std::uint16_t>::Observed(*code, frame.number);
  events_.On(event);
}

void Network::ApplyAddressing(const SlaveAccess& access) {
  const ByteSpan enable = !access.written.empty()
                              ? access.Covered(access.done() ? access.written : ByteSpan{}, kAliasEnable, 1)
                              : access.Covered(access.read, kAliasEnable, 1);
  if (!enable.empty() && !(access.broadcast && access.written.empty())) {
    slaves_.EnableAlias(access.slave, (enable[0] & 1U) != 0);
  }
  if (access.broadcast) return;
  const FrameNo frame = access.frame().number;
  const bool done = access.done();
  const ByteSpan station_written = done ? access.Covered(access.written, esc::kStationAddress, 2) : ByteSpan{};
  const ByteSpan station_read = access.Covered(access.read, esc::kStationAddress, 2);
  const ByteSpan station = !station_written.empty() ? station_written : station_read;
  if (!station.empty()) {
    const auto address = LittleEndian<std::uint16_t>(station, 0);
    const bus::SlaveAddress& known = slaves_[access.slave];
    const StationAddress* before = known.station.if_known();
    if (before == nullptr || *before != address || !known.station_valid) {
      ++states_version_;
      const SlavePos* position = known.position.if_known();
      const bus::Assignment assigned = position != nullptr ? slaves_.AssignAtPosition(*position, address, frame)
                                                           : slaves_.AssignStation(access.slave, address, frame);
      const bool shared = assigned.other != kNoSlave && OnBus(assigned.other);
      events_.On(AddressAssigned{access.slave, access.frame(), address, shared ? assigned.other : kNoSlave});
    }
  }
  if (const ByteSpan alias = access.Covered(access.read, esc::kStationAlias, 2); !alias.empty()) {
    slaves_.LearnAlias(access.slave, LittleEndian<std::uint16_t>(alias, 0), frame);
  }
}

void Network::OnEepromRead(const EepromRead& event) {
  events_.On(event);
  // Words 8-15: vendor, product code, revision, serial number (esc-reference 11.1).
  if (event.address >= 16 || event.address + event.words.size() <= 8) return;
  const esc::SiiImage& image = states_[event.slave].sii.image();
  IdentityLearned identity;
  identity.slave = event.slave;
  identity.frame = event.frame;
  identity.source = IdentityLearned::Source::kEeprom;
  identity.vendor_id = image.DoubleWord(8);
  identity.product_code = image.DoubleWord(10);
  identity.revision = image.DoubleWord(12);
  identity.serial = image.DoubleWord(14);
  if (identity.vendor_id || identity.product_code) events_.On(identity);
}

void Network::OnEepromWrite(const EepromWrite& event) {
  events_.On(event);
}
void Network::OnEepromError(const EepromError& event) {
  events_.On(event);
}

void Network::UpdateMailboxWindow(SlaveId slave, const FrameRef& frame) {
  window_versions_[slave] = states_[slave].mapping_version;
  const MailboxWindow window = MailboxWindowOf(states_[slave]);
  if (mailboxes_[slave] || window != MailboxWindow()) NeedMailbox(slave).SetWindow(window, frame);
}

MailboxTracker& Network::NeedMailbox(SlaveId slave) {
  auto& mailbox = mailboxes_[slave];
  if (!mailbox) mailbox = std::make_unique<MailboxTracker>(slave, events_, &message_bytes_);
  return *mailbox;
}

/// Slaves without a mailbox, and those of which only the AL state is polled, need no tracker.
void Network::TrackMailbox(const SlaveAccess& access) {
  if (mailboxes_[access.slave] || MailboxTracker::Concerns(access)) NeedMailbox(access.slave).OnAccess(access);
}

/// @param slave kNoSlave: what a broadcast leaves in slaves that are met later
void Network::MappingChanged(SlaveId slave) {
  ++mapping_version_;
  if (slave < mappings_.size()) mappings_[slave].changed = mapping_version_;
}

const KnownFmmus& Network::Decode(SlaveId id) const {
  Mapping& mapping = mappings_[id];
  mapping.decoded = mapping.changed;
  mapping.fmmus.any = false;
  mapping.fmmus.active.clear();
  for (std::size_t n = 0; n < esc::kMaxFmmus; ++n) {
    const auto fmmu = states_[id].fmmu(n, Certainty::kInferred);
    if (!fmmu) continue;
    mapping.fmmus.any = true;
    if (fmmu->active()) mapping.fmmus.active.push_back({static_cast<std::uint8_t>(n), *fmmu});
  }
  return mapping.fmmus;
}

void Network::FindMappedMailboxes() {
  const auto before = [](const MappedMailbox& mapped, SlaveId id) { return mapped.slave < id; };
  for (std::size_t s = 0; s < mappings_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    if (mappings_[s].changed <= mapped_version_) continue;
    std::erase_if(mapped_mailboxes_, [id](const MappedMailbox& mapped) { return mapped.slave == id; });
    const MailboxWindow window = MailboxWindowOf(states_[s]);
    if (window.in_use != MailboxUse::kOn) continue;
    auto at = std::lower_bound(mapped_mailboxes_.begin(), mapped_mailboxes_.end(), id, before);
    for (const auto& [number, fmmu] : fmmus(id).active) {
      if (fmmu.reads() && fmmu.byte_aligned() && fmmu.physical_start < window.in_start + window.in_length &&
          fmmu.physical_end() > window.in_start) {
        at = mapped_mailboxes_.insert(at, {id, fmmu}) + 1;
      }
    }
  }
  mapped_version_ = mapping_version_;
}

/// A master may read mailboxes together with the process data. The working counter is shared, so whether this slave
/// gave something shows only in the data: they differ from what was sent.
void Network::ReadMailboxesThroughFmmus(const Datagram& d) {
  for (const MappedMailbox& mapped : mapped_mailboxes_) {
    const std::uint32_t first = d.any.logical_address();
    const esc::BitRange overlap = mapped.fmmu.Overlap(first, d.any.length());
    if (overlap.empty() || !d.has_sent || !d.has_returned) continue;
    const auto offset = static_cast<std::size_t>(overlap.first / 8 - first);
    const std::size_t length = static_cast<std::size_t>(overlap.count / 8);
    const ByteSpan sent = Slice(d.sent().data(), offset, length);
    const ByteSpan returned = Slice(d.any.data(), offset, length);
    if (std::equal(sent.begin(), sent.end(), returned.begin(), returned.end())) continue;
    SlaveAccess access;
    access.slave = mapped.slave;
    access.sent = d.transaction.sent_ref();
    access.returned = d.transaction.returned_ref();
    access.command = d.command();
    access.datagram = d.any.ordinal();
    access.address =
        static_cast<EscAddress>(mapped.fmmu.physical_start + (overlap.first / 8 - mapped.fmmu.logical_start));
    access.read = returned;
    access.acceptance = Acceptance::kAccepted;
    Apply(access);
  }
}

void Network::Finish() {
  for (std::size_t s = 0; s < states_.size(); ++s) {
    states_[s].sii.Finish(this);
    if (mailboxes_[s]) mailboxes_[s]->Finish();
  }
}

/// What it wrote to registers is unknown until a slave shows it. The access itself is told when its end is known.
void Network::OnDoubtful(const wire::FrameView& sent) {
  const bus::BusTransaction transaction{&sent, nullptr, false};
  for (std::size_t i = 0; i < sent.size(); ++i) {
    const Datagram d{transaction, i, sent[i], true, false};
    const wire::Command c = d.command();
    if (!wire::IsDefined(d.any.command_byte()) || wire::IsLogical(c) || !wire::Writes(c) || c == wire::Command::ARMW ||
        c == wire::Command::FRMW || d.address() >= esc::RegisterImage::kSize) {
      continue;
    }
    const auto doubt = [&](SlaveId slave) {
      const SlaveAccess access = d.Access(slave, Acceptance::kUnknown);
      Learn(states_[slave], access, access.written, Certainty::kUnknown);
      if (window_versions_[slave] != states_[slave].mapping_version) UpdateMailboxWindow(slave, access.frame());
    };
    if (wire::IsBroadcast(c)) {
      for (std::size_t s = 0; s < slaves_.size(); ++s) doubt(static_cast<SlaveId>(s));
    } else if (const SlaveId slave = Resolve(d, false); slave != kNoSlave) {
      doubt(slave);
    }
  }
}

void Network::OnLost(const wire::FrameView& sent, bus::Loss loss, bool followed_by_other) {
  if (loss != bus::Loss::kUndecided) events_.On(FrameLost{sent, loss, followed_by_other});
  // Whether the slaves got it, nobody knows: what it wrote is unknown from here on.
  const bus::BusTransaction transaction{&sent, nullptr, false};
  for (std::size_t i = 0; i < sent.size(); ++i) {
    const Datagram d{transaction, i, sent[i], true, false};
    const wire::Command c = d.command();
    if (!wire::IsDefined(d.any.command_byte()) || wire::IsLogical(c) || c == wire::Command::ARMW ||
        c == wire::Command::FRMW) {
      continue;
    }
    // A lost read only matters where reading changes something: it may have emptied a mailbox.
    if (!wire::Writes(c) && (wire::IsBroadcast(c) || d.address() < esc::RegisterImage::kSize)) continue;
    if (wire::IsBroadcast(c)) {
      for (std::size_t s = 0; s < slaves_.size(); ++s) {
        if (OnBus(static_cast<SlaveId>(s))) Apply(d.Access(static_cast<SlaveId>(s), Acceptance::kUnknown));
      }
    } else if (const SlaveId slave = Resolve(d, false); slave != kNoSlave) {
      Apply(d.Access(slave, Acceptance::kUnknown));
    }
  }
}

void Network::OnDuplicate(const wire::FrameView& returned, FrameNo original) {
  events_.On(FrameDuplicated{returned, original});
}

void Network::OnUnusable(const wire::FrameView& frame, bus::Unusable reason, bool own_master) {
  events_.On(FrameUnusable{frame, reason, own_master});
}

}  // namespace ecaudit::track
