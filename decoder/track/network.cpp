#include "decoder/track/network.h"

#include <utility>

#include "decoder/esc/register_addresses.h"

namespace ecaudit::track {
namespace {

/// ARMW and FRMW read at the addressed slave and write at all others.
bool ReadsOneWritesOthers(wire::Command command) {
  return command == wire::Command::ARMW || command == wire::Command::FRMW;
}

/// Where it is in SAFEOP, that is no new set-up.
bool AsksForProcessData(const SlaveAccess& access) {
  const ByteSpan control = access.Covered(access.written, esc::kAlControl, 1);
  return !control.empty() && access.written.size() <= 2 &&
         esc::AlWord{control[0]}.state() >= static_cast<std::uint8_t>(esc::AlState::SAFEOP);
}

/// What one slave gave and took, as far as the working counter of a returned datagram shows it.
void KeepWhatCounted(const DatagramPair& d, SlaveAccess& access) {
  const bool one_slave = !ReadsOneWritesOthers(d.command());
  const bool reads = wire::Reads(d.command());
  const bool writes = wire::Writes(d.command()) && one_slave;
  const std::uint16_t wkc = d.wkc();
  if (!writes) access.written = {};
  if (!reads) access.read = {};
  if (d.has_returned && reads && writes && wkc != 3) {
    // Read counts 1, write counts 2 (esc-reference 2.1).
    if ((wkc & 1U) == 0) access.read = {};
    if ((wkc & 2U) == 0) access.written = {};
  }
  if (one_slave && wkc > (reads && writes ? 3 : 1)) {
    // More than one slave answered, or the counter is damaged: what was read may come from another one.
    access.read = {};
  }
}

}  // namespace

void Network::OnTransaction(const bus::BusTransaction& transaction) {
  if (!presumed_.empty()) MeetPresumed(transaction.any().ref());
  const FrameRef& first = transaction.first_ref();
  if (transaction.gap != bus::GapBefore::kNone) {
    if (runs_.IsOtherRecording(first)) {
      gaps_.OnOtherRecording(first);
      runs_.BeginRecording(first);
    } else {
      gaps_.OnGap(transaction.after_gap(), runs_.last(), transaction.gap);
    }
  }
  for (const wire::FrameView* copy : {transaction.sent, transaction.returned}) {
    if (copy != nullptr) states_.work().Allow(copy->bytes().size());
  }
  runs_.OnFrame(first);
  event_field_.OnTransaction(transaction);
  for (std::size_t i = 0; i < transaction.size(); ++i) {
    const DatagramPair d(transaction, i);
    if (!wire::IsDefined(d.any.command_byte())) continue;
    if (wire::IsLogical(d.command())) {
      OnLogical(d);
      continue;
    }
    if (d.has_returned && wire::IncrementsAdp(d.command())) {
      OnCounted(d);
    }
    if (wire::IsBroadcast(d.command())) {
      OnBroadcast(d);
    } else if (d.command() != wire::Command::NOP) {
      OnAddressed(d);
    }
  }
}

void Network::OnCounted(const DatagramPair& d) {
  const std::uint64_t version = addressing_.version();
  const std::optional<std::uint16_t> before = addressing_.Count(d);
  // Another number: each of them may have moved.
  if (addressing_.version() != version) states_.work().Take(states_.size());
  if (before) gaps_.OnReturnFrom(*before, d.transaction.returned_ref());
}

void Network::Meet(SlaveId id, const FrameRef& frame) {
  states_.Add();
  mailboxes_.Add();
  mappings_.Add();
  events_.Publish(SlaveFound{id, frame});
  al_.OnMet(id);
}

void Network::MeetPresumed(const FrameRef& frame) {
  for (const Presumed& presumed : std::exchange(presumed_, {})) {
    const SlaveId id = addressing_.Presume(presumed.position, presumed.station, frame.number);
    if (id != kNoSlave && id >= states_.size()) Meet(id, frame);
  }
}

LogicalAccess Network::LogicalAccessOf(const DatagramPair& d) {
  const wire::DatagramView& sent = d.sent();
  return {
      .command = d.command(),
      .address = d.any.logical_address(),
      .sent = d.transaction.sent_ref(),
      .returned = d.transaction.returned_ref(),
      .sent_data = d.has_sent ? sent.data() : ByteSpan{},
      .returned_data = d.has_returned ? d.any.data() : ByteSpan{},
      .length = d.any.length(),
      .wkc = d.wkc(),
      .sent_wkc = d.has_sent ? sent.wkc() : std::uint16_t{0},
      .circulating = d.has_returned && d.any.circulating(),
      .assumed = d.assumed(),
  };
}

void Network::OnLogical(const DatagramPair& d) {
  const LogicalAccess access = LogicalAccessOf(d);
  if (d.has_returned) gaps_.OnLogical(d);
  events_.Publish(access);
  states_.work().TakeForData(access.told, access.length);
  const auto& mapped_mailboxes = mapped_mailboxes_.Now();
  if (mapped_mailboxes.empty() || !wire::Reads(d.command())) return;
  for (const MappedMailboxes::Mapped& mapped : mapped_mailboxes) {
    if (const auto read = mapped.Read(d)) Apply(*read);
  }
}

Answered Network::AnswerOf(const DatagramPair& d, SlaveId slave) const {
  const wire::DatagramView& sent = d.sent();
  const std::uint16_t* count = wire::IncrementsAdp(d.command()) ? slave_count().if_known() : nullptr;
  // What is sent at the other end of a redundant line.
  const bool passed_no_slave = count != nullptr && wire::IsBroadcast(d.command()) && d.has_sent && d.has_returned &&
                               sent.adp() == 0 && d.any.adp() == 0;
  return {
      .command = d.command(),
      .adp = d.has_sent                       ? sent.adp()
             : wire::IsBroadcast(d.command()) ? std::uint16_t{0}
                                              : d.any.adp(),
      .address = d.address(),
      .length = d.any.length(),
      .wkc = d.wkc(),
      .sent_wkc = d.has_sent ? sent.wkc() : std::uint16_t{0},
      .circulating = d.any.circulating(),
      .slaves_passed = passed_no_slave    ? std::optional<std::uint16_t>(0)
                       : count != nullptr ? std::optional(*count)
                                          : std::nullopt,
      .slave = slave,
      .sent = d.transaction.sent_ref(),
      .returned = d.transaction.returned_ref(),
      .sent_data = d.has_sent ? sent.data() : ByteSpan{},
      .returned_data = d.has_returned ? d.any.data() : ByteSpan{},
  };
}

void Network::OnBroadcast(const DatagramPair& d) {
  if (wire::Writes(d.command())) runs_.OnBroadcastWrite(d);
  if (d.has_returned || (d.assumed() && wire::Writes(d.command()))) events_.Publish(AnswerOf(d, kNoSlave));
  if (wire::Writes(d.command())) WriteToAll(d);
  if (d.command() == wire::Command::BRD && d.has_returned && d.wkc() != 0 && d.CoversByte(esc::kAlStatus)) {
    al_.OnBroadcastRead(d);
  }
}

void Network::WriteToAll(const DatagramPair& d) {
  const std::uint16_t* count = slave_count().if_known();
  Acceptance acceptance = Acceptance::kUnknown;
  if (d.assumed()) {
    acceptance = Acceptance::kAssumed;
  } else if (d.wkc() == 0) {
    acceptance = Acceptance::kRefused;
  } else if (count != nullptr && d.wkc() == *count * (d.command() == wire::Command::BRW ? 3 : 1)) {
    acceptance = Acceptance::kAccepted;
  }
  if (d.address() < esc::RegisterImage::kSize && acceptance != Acceptance::kRefused) {
    states_.LearnForLater(d.Access(kNoSlave, acceptance));
  }
  ApplyToAll(d, acceptance);
  al_.OnBroadcastRequest(d, acceptance);
  if (d.CoversByte(esc::kStationAddress) && acceptance != Acceptance::kRefused) {
    gaps_.OnStationsCleared(d.transaction.any().ref());
    addressing_.ClearStations(d);
  }
}

void Network::OnAddressed(const DatagramPair& d) {
  const bool took_part = d.assumed() || d.wkc() != 0;
  const SlaveId slave = Resolve(d, took_part);
  if (d.has_returned) events_.Publish(AnswerOf(d, slave));
  if (slave == kNoSlave) {
    if (took_part && addressing_.MayAddressSlave(d)) OnUnknownSlave(d);
    return;
  }

  Acceptance acceptance = took_part ? Acceptance::kAccepted : Acceptance::kRefused;
  if (d.assumed()) acceptance = Acceptance::kAssumed;
  SlaveAccess access = d.Access(slave, acceptance);
  KeepWhatCounted(d, access);
  if (ReadsOneWritesOthers(d.command()) && d.has_returned && access.acceptance == Acceptance::kAccepted) {
    // The others may have counted without the reader. Changed data prove that it did, and so does a full count.
    const std::uint16_t* count = slave_count().if_known();
    const ByteSpan sent = d.has_sent ? d.sent().data() : access.read;
    const bool changed = !SameBytes(sent, access.read);
    // Where slaves have left, the others may be all that count.
    const bool all = count != nullptr && d.wkc() == *count && !addressing_.InDoubt(slave);
    if (!changed && !all) return;
  }
  if (access.acceptance == Acceptance::kAccepted) addressing_.OnAnswered(slave, d);
  Apply(access);
}

/// Slaves joined or left, and nothing shows which one is at this position: any of those that may have moved.
void Network::OnUnknownSlave(const DatagramPair& d) {
  if (d.has_returned) events_.Publish(PlaceUnknown{d.transaction.first_ref()});
  if (!wire::Writes(d.command()) && d.address() < esc::RegisterImage::kSize) return;
  states_.work().Take(states_.size());
  for (std::size_t s = 0; s < states_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    if (addressing_.InDoubt(id)) Apply(d.Access(id, Acceptance::kUnknown));
  }
}

void Network::ApplyToAll(const DatagramPair& d, Acceptance acceptance) {
  states_.work().Take(states_.size());
  for (std::size_t s = 0; s < states_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    if (OnBus(id)) Apply(d.Access(id, acceptance));
  }
}

void Network::Apply(const SlaveAccess& access) {
  const bool in_registers = access.address < esc::RegisterImage::kSize;
  const auto touches = [&](EscAddress first, EscAddress end) {
    return access.address < end && access.address + access.length() > first;
  };
  // A master that sets up a slave has taken it out of OP.
  if (!access.written.empty() && access.address < kMappingEnd &&
      access.address + access.written.size() > esc::kAlControl) {
    gaps_.Presume(access.slave, AsksForProcessData(access) ? CaptureGaps::Still::kMapped : CaptureGaps::Still::kNo,
                  access.frame());
  }
  gaps_.OnAccess(access);
  if (in_registers) states_.Learn(access);
  events_.Publish(access);
  mailboxes_.FollowWindow(access.slave, access.frame());
  mailboxes_.OnAccess(access);
  if (!in_registers) return;
  if (touches(esc::kEepromConfiguration, esc::kEepromEnd)) states_[access.slave].sii.OnAccess(access, &eeprom_);
  if (Addressing::Concerns(access.address, access.length())) addressing_.OnAccess(access);
  if (AlTracker::Concerns(access.address, access.length())) al_.OnAccess(access);
}

void Network::Finish() {
  for (std::size_t s = 0; s < states_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    states_[id].sii.Finish(&eeprom_);
    mailboxes_.Finish(id);
  }
}

/// What it wrote to registers is unknown until a slave shows it. The access itself is reported when its end is known.
void Network::OnDoubtful(const wire::FrameView& sent) {
  const bus::BusTransaction transaction{&sent, nullptr, false};
  for (std::size_t i = 0; i < sent.size(); ++i) {
    const DatagramPair d(transaction, i);
    const wire::Command c = d.command();
    if (!wire::IsDefined(d.any.command_byte()) || wire::IsLogical(c) || ReadsOneWritesOthers(c)) continue;
    if (d.address() >= esc::RegisterImage::kSize) {
      if (wire::IsBroadcast(c)) continue;
      if (const SlaveId slave = Resolve(d, false); slave != kNoSlave) {
        mailboxes_.OnDoubtful(d.Access(slave, Acceptance::kUnknown));
      }
      continue;
    }
    if (!wire::Writes(c)) continue;
    const auto doubt = [&](SlaveId slave) {
      const SlaveAccess access = d.Access(slave, Acceptance::kUnknown);
      states_.Doubt(access);
      events_.Publish(WriteDoubtful{access});
      mailboxes_.FollowWindow(slave, access.frame());
    };
    if (wire::IsBroadcast(c)) {
      states_.work().Take(states_.size());
      for (std::size_t s = 0; s < states_.size(); ++s) doubt(static_cast<SlaveId>(s));
    } else if (const SlaveId slave = Resolve(d, false); slave != kNoSlave) {
      doubt(slave);
    }
  }
}

void Network::OnLost(const wire::FrameView& sent, bus::Loss loss, bool followed_by_other) {
  if (loss != bus::Loss::kUndecided) {
    const FrameLost lost{sent, loss, followed_by_other};
    events_.Publish(lost);
    states_.work().TakeForData(lost.told, sent.bytes().size());
  }
  // It is unknown whether the slaves received it: what it wrote is unknown from here on.
  const bus::BusTransaction transaction{&sent, nullptr, false};
  for (std::size_t i = 0; i < sent.size(); ++i) {
    const DatagramPair d(transaction, i);
    const wire::Command c = d.command();
    if (!wire::IsDefined(d.any.command_byte()) || wire::IsLogical(c) || ReadsOneWritesOthers(c)) continue;
    // A lost read only matters where reading changes something: it may have emptied a mailbox.
    if (!wire::Writes(c) && (wire::IsBroadcast(c) || d.address() < esc::RegisterImage::kSize)) continue;
    if (wire::IsBroadcast(c)) {
      ApplyToAll(d, Acceptance::kUnknown);
    } else if (const SlaveId slave = Resolve(d, false); slave != kNoSlave) {
      Apply(d.Access(slave, Acceptance::kUnknown));
    } else if (addressing_.MayAddressSlave(d)) {
      OnUnknownSlave(d);
    }
  }
}

void Network::OnDuplicate(const wire::FrameView& returned, FrameNo original) {
  events_.Publish(FrameDuplicated{returned, original});
}

void Network::OnRepeated(const bus::RepeatedFrame& repeated) {
  events_.Publish(FrameRepeated{repeated});
}

void Network::OnUnusable(const wire::FrameView& frame, bus::Unusable reason, bool own_master) {
  events_.Publish(FrameUnusable{frame, reason, own_master});
}

}  // namespace ecaudit::track
