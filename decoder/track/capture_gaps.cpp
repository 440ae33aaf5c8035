#include "decoder/track/capture_gaps.h"

#include <algorithm>
#include <utility>

namespace ecaudit::track {

void CaptureGaps::OnGap(const FrameRef& frame, const FrameRef& before, bus::GapBefore gap) {
  const bool certain = gap == bus::GapBefore::kCertain;
  const bool likely = gap == bus::GapBefore::kLikelySkip;
  const bool skip = likely || gap == bus::GapBefore::kSkip;
  // The models of all slaves receive it, too.
  states_.work().Take(states_.size());
  Note(frame, gap);
  const CaptureGap event{frame, certain, skip, likely, before};
  events_.Publish(event);
  // A command to the EEPROM lasts for a few frames: its answer may belong to another one.
  for (std::size_t s = 0; skip && s < states_.size(); ++s) states_[static_cast<SlaveId>(s)].sii.Forget();
  if (!certain) return;
  states_.ForgetForLater();
  addressing_.ForgetCount(frame.number);
  for (std::size_t s = 0; s < states_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    const Presumed presumed = PresumedOver(id, event);
    if (presumed == Presumed::kNothing) {
      if (!addressing_.slaves()[id].replaced) Forget(id, frame, true);
      continue;
    }
    states_[id].presumed = presumed;
    ++presumed_;
    mailboxes_.Forget(id, frame);
    if (presumed == Presumed::kMapping && states_.ForgetAl(id, frame.number)) {
      events_.Publish(AlStateForgotten{id, frame, false});
    }
  }
}

CaptureGaps::Presumed CaptureGaps::PresumedOver(SlaveId id, const CaptureGap& gap) const {
  const SlaveState& state = states_[id];
  const esc::AlWord* status = state.al_status.if_known();
  if (status == nullptr || state.presumed != Presumed::kNothing) return Presumed::kNothing;
  if (status->raw == static_cast<std::uint16_t>(esc::AlState::OP)) return Presumed::kAll;
  const bool mapped = status->raw == static_cast<std::uint16_t>(esc::AlState::SAFEOP);
  return mapped && gap.is_short() ? Presumed::kMapping : Presumed::kNothing;
}

void CaptureGaps::OnOtherRecording(const FrameRef& frame) {
  Note(frame, bus::GapBefore::kCertain);
  events_.Publish(CaptureGap{frame, true, false, false, {}});
  states_.ForgetForLater();
  addressing_.ForgetCount(frame.number);
  for (std::size_t s = 0; s < states_.size(); ++s) Forget(static_cast<SlaveId>(s), frame);
}

void CaptureGaps::Settle(SlaveId id, Still still, const FrameRef& frame) {
  const bool holds = still == Still::kInOp || (still == Still::kMapped && states_[id].presumed == Presumed::kMapping);
  if (!holds) {
    Forget(id, frame, true);
    return;
  }
  states_[id].presumed = Presumed::kNothing;
  --presumed_;
}

void CaptureGaps::SettleAll(Still still, const FrameRef& frame) {
  for (std::size_t s = 0; s < states_.size() && presumed_ > 0; ++s) Presume(static_cast<SlaveId>(s), still, frame);
}

void CaptureGaps::OnLogical(const DatagramPair& d) {
  const std::uint32_t address = d.any.logical_address();
  Habit& habit = habits_[(address >> 8U ^ address ^ static_cast<std::uint32_t>(d.command())) % habits_.size()];
  const bool same = habit.command == d.command() && habit.address == address && habit.length == d.any.length();
  const bool goes_on = same && d.wkc() > 0 && d.wkc() == habit.wkc;
  PresumeAll(goes_on ? Still::kInOp : Still::kNo, d.transaction.first_ref());
  habit = {d.command(), address, d.any.length(), d.wkc()};
}

void CaptureGaps::OnReturnFrom(std::uint16_t first_position, const FrameRef& frame) {
  states_.ForgetForLater();
  bool branch = false;
  for (std::size_t s = 0; s < states_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    const SlavePos* position = addressing_.slaves()[id].position.if_known();
    branch = branch || (position != nullptr && *position >= first_position && addressing_.Stayed(id));
  }
  for (std::size_t s = 0; s < states_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    if (!WasAway(id, first_position, branch)) continue;
    const bus::SlaveAddress& address = addressing_.slaves()[id];
    const StationAddress* station = address.station.if_known();
    const bool can_show = station != nullptr && *station != 0 && address.station_valid;
    if (!can_show || states_[id].presumed != Presumed::kNothing || states_[id].returned) {
      Forget(id, frame);
      continue;
    }
    states_.work().Take(1);
    states_[id].returned = true;
    mailboxes_.Forget(id, frame);
    if (states_.ForgetAl(id, frame.number)) events_.Publish(AlStateForgotten{id, frame, false});
  }
}

/// Those after the last one that was left; of a branch in the middle it is unknown which they are.
bool CaptureGaps::WasAway(SlaveId id, std::uint16_t first_position, bool branch) const {
  const SlavePos* position = addressing_.slaves()[id].position.if_known();
  if (position == nullptr) return false;
  if (first_position == 0) return true;
  return (branch || *position >= first_position) && !addressing_.Stayed(id);
}

void CaptureGaps::OnStationsCleared(const FrameRef& frame) {
  for (std::size_t s = 0; s < states_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    if (addressing_.InDoubt(id)) Forget(id, frame);
  }
}

void CaptureGaps::OnState(SlaveId id, esc::AlWord status, const FrameRef& frame) {
  if (!states_[id].returned) return;
  if (status.state() == static_cast<std::uint8_t>(esc::AlState::INIT)) {
    Forget(id, frame);
  } else {
    states_[id].returned = false;
  }
}

void CaptureGaps::AssessReturn(const SlaveAccess& access) {
  if (access.broadcast || access.acceptance != Acceptance::kAccepted) return;
  if (wire::IsNodeAddressed(access.command)) {
    states_[access.slave].returned = false;
    return;
  }
  // Any slave may answer by position: its address shows which, and a slave that is given one is being set up.
  const ByteSpan station = access.written.empty() ? access.Covered(access.read, esc::kStationAddress, 2) : ByteSpan{};
  const StationAddress* known = addressing_.slaves()[access.slave].station.if_known();
  const bool kept = !station.empty() && known != nullptr && LittleEndian<std::uint16_t>(station, 0) == *known;
  constexpr EscAddress kDescription = 0x0010;  // what lies before is alike in all slaves of the kind
  const auto end = static_cast<EscAddress>(access.address + access.length());
  const bool of_state = access.written.empty() && access.address >= esc::kAlStatus && end <= esc::kAlStatusCode + 2;
  if (kept) {
    states_[access.slave].returned = false;
  } else if (end > kDescription && !of_state) {
    Forget(access.slave, access.frame());
  }
}

/// The slave may have been switched off, or set up again.
void CaptureGaps::Forget(SlaveId id, const FrameRef& frame, bool device_stays) {
  states_.work().Take(1);
  const bool returned = std::exchange(states_[id].returned, false);
  if (std::exchange(states_[id].presumed, Presumed::kNothing) != Presumed::kNothing) --presumed_;
  states_.ForgetRegisters(id, device_stays);
  mailboxes_.Forget(id, frame);
  states_.ForgetMapping(id);
  if (states_.ForgetAl(id, frame.number) || returned) events_.Publish(AlStateForgotten{id, frame});
}

}  // namespace ecaudit::track
