#include "decoder/track/al_tracker.h"

#include <algorithm>

#include "decoder/bus/direction.h"

namespace ecaudit::track {
namespace {

/// 0x0134 in what was read from AL Status on.
std::optional<std::uint16_t> CodeIn(ByteSpan status) {
  return status.size() >= 6 ? std::optional(LittleEndian<std::uint16_t>(status, 4)) : std::nullopt;
}

/// Of slaves that are not named by the data of the datagram.
bool WritesControl(const wire::DatagramView& d) {
  const wire::Command c = d.command();
  return !wire::IsLogical(c) && wire::Writes(c) && c != wire::Command::ARMW && c != wire::Command::FRMW &&
         CoversByte(d.ado(), d.length(), esc::kAlControl);
}

constexpr auto kInit = static_cast<std::uint8_t>(esc::AlState::INIT);
constexpr auto kSafeop = static_cast<std::uint8_t>(esc::AlState::SAFEOP);
constexpr auto kOp = static_cast<std::uint8_t>(esc::AlState::OP);

/// @param states of one slave, or the OR of several
CaptureGaps::Still StillOf(std::uint8_t states, bool error) {
  if (states == kOp && !error) return CaptureGaps::Still::kInOp;
  const bool exchange = states != 0 && (states & ~(kSafeop | kOp)) == 0;
  return exchange ? CaptureGaps::Still::kMapped : CaptureGaps::Still::kNo;
}

}  // namespace

bool AlTracker::AsksForState(const wire::FrameView& frame) {
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (WritesControl(frame[i])) return true;
  }
  return false;
}

void AlTracker::OnSent(const wire::FrameView& frame) {
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const wire::DatagramView d = frame[i];
    if (!WritesControl(d)) continue;
    const wire::Command c = d.command();
    const std::size_t at = static_cast<std::size_t>(esc::kAlControl - d.ado());
    const esc::AlWord control{WordOrByte(Slice(d.data(), at, 2))};
    if (wire::IsBroadcast(c)) {
      states_.work().Take(states_.size());
      for (std::size_t s = 0; s < states_.size(); ++s) {
        const auto id = static_cast<SlaveId>(s);
        if (addressing_.OnBus(id)) events_.Publish(AlRequestSent{id, frame.ref(), control});
      }
    } else if (const SlaveId slave = addressing_.AddressedBy(d); slave != kNoSlave) {
      events_.Publish(AlRequestSent{slave, frame.ref(), control});
    }
  }
}

void AlTracker::OnAccess(const SlaveAccess& access) {
  if (CoversByte(access.address, access.written.size(), esc::kAlControl)) OnWritten(access);
  if (!access.broadcast) OnRead(access);
}

void AlTracker::OnWritten(const SlaveAccess& access) {
  const ByteSpan bytes = Slice(access.written, static_cast<std::size_t>(esc::kAlControl - access.address), 2);
  const esc::AlWord control{WordOrByte(bytes)};
  if (access.acceptance != Acceptance::kRefused) runs_.OnState(control);
  events_.Publish(AlRequest{access.slave, access.sent, access.returned, control, access.acceptance, access.broadcast});
  if (access.done() && control.state() == kInit) mailboxes_.Reset(access.slave, access.frame());
  if (access.broadcast || access.acceptance == Acceptance::kRefused || addressing_.IsWhole(access.slave)) return;
  for (std::size_t s = 0; s < states_.size(); ++s) {
    const auto other = static_cast<SlaveId>(s);
    if (other == access.slave || !addressing_.MayBeOne(access.slave, other)) continue;
    states_.work().Take(1);
    events_.Publish(AlRequest{other, access.sent, access.returned, control, Acceptance::kUnknown, false});
  }
}

void AlTracker::OnBroadcastRequest(const DatagramPair& d, Acceptance acceptance) {
  if (acceptance == Acceptance::kRefused || !d.CoversByte(esc::kAlControl)) return;
  const SlaveAccess access = d.Access(kNoSlave, acceptance);
  const ByteSpan bytes = Slice(access.written, static_cast<std::size_t>(esc::kAlControl - access.address), 2);
  const AlRequest request{kNoSlave, access.sent, access.returned, esc::AlWord{WordOrByte(bytes)}, acceptance, true};
  states_.RequestedForLater(request);
  events_.Publish(AlRequestOfAll{request.frame(), request.control, acceptance});
}

void AlTracker::OnMet(SlaveId slave) {
  const std::optional<AlRequest>& before = states_.requested_for_later();
  if (!before) return;
  AlRequest request = *before;
  request.slave = slave;
  events_.Publish(request);
}

void AlTracker::OnRead(const SlaveAccess& access) {
  if (poll_.length > 1) poll_.version = 0;  // a single slave: its code may be reported again
  if (CoversByte(access.address, access.read.size(), esc::kAlStatus)) {
    const ByteSpan status = Slice(access.read, static_cast<std::size_t>(esc::kAlStatus - access.address));
    Apply({access.slave, access.frame(), esc::AlWord{WordOrByte(status)}, std::nullopt, CodeIn(status), true,
           access.sent});
  } else if (const ByteSpan code = access.Covered(access.read, esc::kAlStatusCode, 2); !code.empty()) {
    const auto value = LittleEndian<std::uint16_t>(code, 0);
    states_[access.slave].al_status_code = Known<std::uint16_t>::Observed(value, access.frame().number);
    events_.Publish(AlStatusCodeRead{access.slave, access.frame(), value});
  }
}

/// Slaves of which nothing shows that they are on the sender's segment are reported by others only.
bool AlTracker::ConcernsAny(const DatagramPair& d) const {
  for (std::size_t s = 0; s < states_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    if (addressing_.OnBus(id) && addressing_.Concerns(id, d)) return true;
  }
  return false;
}

void AlTracker::OnBroadcastRead(const DatagramPair& d) {
  const std::uint16_t* count = addressing_.slave_count().if_known();
  if (count == nullptr || d.wkc() != *count) return;
  if (!addressing_.ConcernsAll(d) && !ConcernsAny(d)) return;
  if (d.has_sent) {
    // Bits that the master sent set would be taken for answers.
    const ByteSpan sent = d.sent().data();
    if (std::ranges::any_of(sent, [](std::uint8_t b) { return b != 0; })) return;
  }
  const ByteSpan data = Slice(d.any.data(), static_cast<std::size_t>(esc::kAlStatus - d.address()));
  const Answer answer{d.transaction.returned_ref(), d.transaction.sent_ref(), data, d.transaction.any().sender(),
                      data[0]};
  events_.Publish(AlStatusOfAll{answer.frame, esc::AlWord{static_cast<std::uint16_t>(answer.status & 0x1FU)}, *count});
  SlaveId only = *count == 1 ? OnlySlave() : kNoSlave;
  if (only != kNoSlave && !addressing_.Concerns(only, d)) only = kNoSlave;
  const ByteSpan shown = only == kNoSlave ? answer.data.first(1) : answer.data;
  if (!TakesAgain(answer, shown, only)) CompareAll(d, answer, shown, only);
}

/// Of each slave that it concerns, what it shows against what is known.
void AlTracker::CompareAll(const DatagramPair& d, const Answer& answer, ByteSpan shown, SlaveId only) {
  const bool of_all = addressing_.ConcernsAll(d);
  const CaptureGaps::Still still = StillOf(answer.states(), answer.error());
  if (of_all) gaps_.PresumeAll(still, answer.frame);
  poll_.version = 0;
  poll_.slaves.clear();
  bool all_same = true;
  for (std::size_t s = 0; s < states_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    if (!addressing_.OnBus(id) || (!of_all && !addressing_.Concerns(id, d))) continue;
    if (!of_all) gaps_.Presume(id, still, answer.frame);
    const bool same = id == only ? CompareOnly(id, answer) : Compare(id, answer);
    all_same = all_same && same;
  }
  if (!all_same || shown.size() > kShown) return;
  poll_.version = Version();
  poll_.sender = answer.sender;
  poll_.length = shown.size();
  std::ranges::copy(shown, poll_.shown.begin());
}

/// The same as at the last poll, and no subscriber needs each slave.
bool AlTracker::TakesAgain(const Answer& answer, ByteSpan shown, SlaveId only) {
  if (poll_.version != Version() || poll_.sender != answer.sender || shown.size() != poll_.length) return false;
  if (!std::equal(shown.begin(), shown.end(), poll_.shown.begin())) return false;
  if (gaps_.presumes() && (answer.error() || !answer.one_state())) return false;
  const AlPoll poll{answer.frame, esc::AlWord{answer.states()}, poll_.slaves};
  events_.Publish(poll);
  if (!poll.taken) return false;
  if (const auto code = CodeIn(shown)) {
    states_[only].al_status_code = Known<std::uint16_t>::Observed(*code, answer.frame.number);
  }
  return true;
}

/// The one slave on the bus, where its place or its being alone shows which that is.
SlaveId AlTracker::OnlySlave() const {
  const SlaveId first = addressing_.slaves().AtPosition(0);
  return first == kNoSlave && addressing_.slaves().size() == 1 ? SlaveId{0} : first;
}

bool AlTracker::Compare(SlaveId id, const Answer& answer) {
  const esc::AlWord* before = states_[id].al_status.if_known();
  if (answer.one_state() && !answer.error()) {
    // Bits above the error bit are an OR of all: they show nothing of this slave.
    const bool same = before != nullptr && before->state() == answer.states() && !before->bit4();
    if (!same) {
      Apply({id, answer.frame, esc::AlWord{answer.states()}, std::nullopt, std::nullopt, true, answer.sent});
      return false;
    }
    poll_.slaves.push_back(id);
    states_.work().Take(1);
    events_.Publish(AlStatusRead{id, answer.frame, *before, *before, std::nullopt, true, answer.sent});
    return true;
  }
  if (answer.one_state()) {
    // The state is certain, whose error bit it is, is not.
    if (before != nullptr && before->state() == answer.states()) return true;
    Apply({id, answer.frame, esc::AlWord{answer.states()}, std::nullopt, std::nullopt, false, answer.sent});
    return false;
  }
  if (before == nullptr || (before->state() & ~answer.status & 0x0FU) == 0) return true;
  states_.ForgetAl(id, answer.frame.number);
  events_.Publish(AlStateForgotten{id, answer.frame});
  return false;
}

/// A single slave shows more than its state.
bool AlTracker::CompareOnly(SlaveId id, const Answer& answer) {
  const std::uint16_t status = WordOrByte(answer.data);
  const std::optional<std::uint16_t> code = CodeIn(answer.data);
  const esc::AlWord* before = states_[id].al_status.if_known();
  const std::uint16_t* code_before = states_[id].al_status_code.if_known();
  const bool same = before != nullptr && before->raw == status && answer.one_state() && !answer.error() &&
                    (!code || (code_before != nullptr && *code_before == *code));
  Apply({id, answer.frame, esc::AlWord{status}, std::nullopt, code, true, answer.sent});
  if (same) poll_.slaves.push_back(id);
  return same;
}

void AlTracker::Apply(const AlStatusRead& read) {
  states_.work().Take(1);
  gaps_.Presume(read.slave, StillOf(read.status.state(), read.status.bit4()), read.frame);
  gaps_.OnState(read.slave, read.status, read.frame);
  AlStatusRead event = read;
  SlaveState& state = states_[read.slave];
  if (const esc::AlWord* before = state.al_status.if_known()) event.before = *before;
  if (event.changed()) {
    runs_.OnState(event.status);
    const bool other_state = event.before && event.before->state() != event.status.state();
    if (other_state && event.status.state() == kInit) mailboxes_.Reset(read.slave, read.frame);
    states_.SetAlStatus(read.slave, event.status, read.frame.number);
  }
  if (read.status_code) state.al_status_code = Known<std::uint16_t>::Observed(*read.status_code, read.frame.number);
  events_.Publish(event);
}

}  // namespace ecaudit::track
