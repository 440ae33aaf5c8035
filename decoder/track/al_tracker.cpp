#include "decoder/track/al_tracker.h"

#include <algorithm>
#include <bit>

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
  if (CoversByte(access.address, access.read.size(), esc::kAlStatus)) {
    const ByteSpan status = Slice(access.read, static_cast<std::size_t>(esc::kAlStatus - access.address));
    Apply(access.slave, access.frame(), WordOrByte(status), CodeIn(status), true);
  } else if (const ByteSpan code = access.Covered(access.read, esc::kAlStatusCode, 2); !code.empty()) {
    const auto value = LittleEndian<std::uint16_t>(code, 0);
    states_[access.slave].al_status_code = Known<std::uint16_t>::Observed(value, access.frame().number);
    events_.Publish(AlStatusCodeRead{access.slave, access.frame(), value});
  }
}

void AlTracker::OnBroadcastRead(const DatagramPair& d) {
  const std::uint16_t* count = addressing_.slave_count().if_known();
  if (count == nullptr || d.wkc() != *count) return;
  if (d.has_sent) {
    // Bits that the master sent set would be taken for answers.
    const ByteSpan sent = d.sent().data();
    if (std::any_of(sent.begin(), sent.end(), [](std::uint8_t b) { return b != 0; })) return;
  }
  Answer answer;
  answer.frame = d.transaction.returned_ref();
  answer.data = Slice(d.any.data(), static_cast<std::size_t>(esc::kAlStatus - d.address()));
  answer.status = answer.data[0];
  answer.one_state = std::has_single_bit(static_cast<unsigned>(answer.states()));
  events_.Publish(AlStatusOfAll{answer.frame, esc::AlWord{static_cast<std::uint16_t>(answer.status & 0x1FU)}, *count});
  if (poll_.version == Version() && poll_.status == answer.status) {
    const AlPoll poll{answer.frame, esc::AlWord{answer.states()}, poll_.slaves};
    events_.Publish(poll);
    if (poll.taken) return;
  }
  holes_.PresumeAll(!answer.error() && answer.states() == static_cast<std::uint8_t>(esc::AlState::OP), answer.frame);
  poll_.version = 0;
  poll_.slaves.clear();
  bool all_same = true;
  const SlaveId only = *count == 1 ? OnlySlave() : kNoSlave;
  for (std::size_t s = 0; s < states_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    if (!addressing_.OnBus(id)) continue;
    if (id == only) {
      Apply(id, answer.frame, WordOrByte(answer.data), CodeIn(answer.data), true);
      all_same = false;  // a single slave tells more than its state
    } else if (!Compare(id, answer)) {
      all_same = false;
    }
  }
  if (all_same && answer.one_state && !answer.error()) {
    poll_.version = Version();
    poll_.status = answer.status;
  }
}

/// The one slave on the bus, where its place or its being alone tells which that is.
SlaveId AlTracker::OnlySlave() const {
  const SlaveId first = addressing_.slaves().AtPosition(0);
  return first == kNoSlave && addressing_.slaves().size() == 1 ? SlaveId{0} : first;
}

bool AlTracker::Compare(SlaveId id, const Answer& answer) {
  const esc::AlWord* before = states_[id].al_status.if_known();
  if (answer.one_state && !answer.error()) {
    // Bits above the error bit are an OR of all: they say nothing of this slave.
    const bool same = before != nullptr && before->state() == answer.states() && !before->bit4();
    if (!same) {
      Apply(id, answer.frame, answer.states(), std::nullopt, true);
      return false;
    }
    poll_.slaves.push_back(id);
    states_.work().Take(1);
    events_.Publish(AlStatusRead{id, answer.frame, *before, *before, std::nullopt, true});
    return true;
  }
  if (answer.one_state) {
    // The state is certain, whose error bit it is, is not.
    if (before == nullptr || before->state() != answer.states()) {
      Apply(id, answer.frame, answer.states(), std::nullopt, false);
    }
  } else if (before != nullptr && (before->state() & ~answer.status & 0x0FU) != 0) {
    states_.ForgetAl(id, answer.frame.number);
    events_.Publish(AlStateForgotten{id, answer.frame});
  }
  return false;
}

void AlTracker::Apply(SlaveId slave, const FrameRef& frame, std::uint16_t status, std::optional<std::uint16_t> code,
                      bool error_bit_known) {
  states_.work().Take(1);
  holes_.Presume(slave, status == static_cast<std::uint16_t>(esc::AlState::OP), frame);
  AlStatusRead event{slave, frame, esc::AlWord{status}, std::nullopt, code, error_bit_known};
  SlaveState& state = states_[slave];
  if (const esc::AlWord* before = state.al_status.if_known()) event.before = *before;
  if (event.changed()) {
    runs_.OnState(event.status);
    const bool other_state = event.before && event.before->state() != event.status.state();
    if (other_state && event.status.state() == kInit) mailboxes_.Reset(slave, frame);
    states_.SetAlStatus(slave, event.status, frame.number);
  }
  if (code) state.al_status_code = Known<std::uint16_t>::Observed(*code, frame.number);
  events_.Publish(event);
}

}  // namespace ecaudit::track
