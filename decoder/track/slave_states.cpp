#include "decoder/track/slave_states.h"

#include <algorithm>

#include "decoder/esc/register_addresses.h"

namespace ecaudit::track {
namespace {

/// It asks for INIT, or gives a slave its station address.
bool BeginsSetUp(const SlaveAccess& access) {
  const ByteSpan control = access.Covered(access.written, esc::kAlControl, 1);
  if (!control.empty()) return esc::AlWord{control[0]}.state() == static_cast<std::uint8_t>(esc::AlState::INIT);
  return !access.broadcast && !access.Covered(access.written, esc::kStationAddress, 2).empty();
}

}  // namespace

void SlaveStates::Add() {
  const auto id = static_cast<SlaveId>(states_.size());
  ++al_version_;
  by_id_.push_back(&states_.emplace_back());
  states_.back().registers.Limit(register_pages_);
  states_.back() = everyone_;
  states_.back().sii = SiiAssembler(id, &eeprom_pages_);
}

void SlaveStates::Learn(const SlaveAccess& access) {
  SlaveState& state = *by_id_[access.slave];
  const FrameNo sent = (access.sent.seen() ? access.sent : access.returned).number;
  NoteExtent(state, access);
  // A command that does both reads first: what came back is what was there before.
  if (!access.read.empty()) Store(state, access, access.read, Certainty::kObserved);
  if (!access.written.empty() && access.acceptance != Acceptance::kRefused) {
    // Losses show late: a repetition of the same write may have arrived since.
    const bool late = access.acceptance == Acceptance::kUnknown && !access.returned.seen() &&
                      recent_.Since(sent, access.slave, access.address, access.length());
    if (!late) Store(state, access, access.written, CertaintyOfWrite(access));
  }
  // What concerned all slaves at once is kept once: there may be thousands of them.
  if (access.broadcast && access.slave > 0) {
    state.registers.ShareWith(by_id_[access.slave - 1U]->registers, access.address, access.length());
  }
  if (access.acceptance == Acceptance::kAccepted && access.length() > 0) {
    recent_.Add(sent, access.slave, access.address, access.length());
  }
}

/// How much of the mapping of the slave the capture shows, beside the FMMUs themselves.
void SlaveStates::NoteExtent(SlaveState& state, const SlaveAccess& access) {
  if (access.address > esc::kAlControl) return;
  const bool begins = access.done() && BeginsSetUp(access);
  if (begins) state.set_up_since = access.frame().number;
  const bool counts = !access.Covered(access.read, kFmmuCount, 1).empty() &&
                      state.registers.CertaintyOf(kFmmuCount, 1) == Certainty::kUnknown;
  if (begins || counts) mappings_.Changed(access.slave);
}

void SlaveStates::LearnForLater(const SlaveAccess& access) {
  if (access.done() && BeginsSetUp(access)) everyone_.set_up_since = access.frame().number;
  Store(everyone_, access, access.written, CertaintyOfWrite(access));
}

bool SlaveStates::LaterMapNothing() const {
  for (std::size_t n = 0; n < esc::kMaxFmmus; ++n) {
    const auto fmmu = everyone_.fmmu(n, Certainty::kInferred);
    if (everyone_.MayMapUnseen(n) || (fmmu && fmmu->active())) return false;
  }
  return true;
}

void SlaveStates::Doubt(const SlaveAccess& access) {
  Store(*by_id_[access.slave], access, access.written, Certainty::kUnknown);
}

Certainty SlaveStates::CertaintyOfWrite(const SlaveAccess& access) {
  if (access.acceptance == Acceptance::kAccepted) return Certainty::kObserved;
  if (access.acceptance == Acceptance::kAssumed) return Certainty::kInferred;
  // Masters blank all FMMUs and sync managers by broadcast, also those that a slave does not have. Who did not take the
  // zeros has no such unit: it maps nothing either way.
  const bool blanks = access.broadcast && access.returned.seen() && access.address >= kMappingFirst &&
                      access.address + access.written.size() <= kMappingEnd &&
                      std::ranges::all_of(access.written, [](std::uint8_t b) { return b == 0; });
  return blanks ? Certainty::kInferred : Certainty::kUnknown;
}

void SlaveStates::Store(SlaveState& state, const SlaveAccess& access, ByteSpan bytes, Certainty certainty) {
  const bool is_read = bytes.data() == access.read.data();
  const bool touches_mapping = access.address < kMappingEnd && access.address + bytes.size() > kMappingFirst;
  // Reading the mapping area again changes nothing that could be derived from it.
  if (touches_mapping &&
      !(is_read && state.registers.CertaintyOf(access.address, bytes.size()) == Certainty::kObserved)) {
    MappingTouched(state, access, bytes.size());
  }
  state.registers.Write(access.address, bytes, certainty);
}

void SlaveStates::MappingTouched(SlaveState& state, const SlaveAccess& access, std::size_t length) {
  const auto touches = [&](EscAddress at, std::size_t bytes) {
    return access.address < at + bytes && access.address + length > at;
  };
  for (std::size_t n = 0; n < esc::kMaxFmmus; ++n) {
    if (touches(esc::FmmuAddress(n), esc::kFmmuBytes)) state.fmmu_since[n] = access.frame().number;
  }
  for (std::size_t n = 0; n < esc::kMaxSyncManagers; ++n) {
    if (touches(esc::SyncManagerAddress(n), esc::kSyncManagerBytes)) {
      state.sync_manager_since[n] = access.frame().number;
    }
  }
  ++state.mapping_version;
  mappings_.Changed(access.slave);
}

void SlaveStates::ForgetRegisters(SlaveId id, bool device_stays) {
  (*this)[id].registers.ClearFrom(device_stays ? esc::kStationAddress : 0U);
  (*this)[id].set_up_since = 0;
  (*this)[id].sii.Forget();
}

void SlaveStates::ForgetMapping(SlaveId id) {
  ++(*this)[id].mapping_version;
  mappings_.Changed(id);
}

bool SlaveStates::ForgetAl(SlaveId id, FrameNo frame) {
  SlaveState& state = *by_id_[id];
  ++al_version_;
  state.al_status_code.Forget(frame);
  if (state.al_status.if_known() == nullptr) return false;
  state.al_status.Forget(frame);
  return true;
}

void SlaveStates::SetAlStatus(SlaveId id, esc::AlWord status, FrameNo frame) {
  (*this)[id].al_status = Known<esc::AlWord>::Observed(status, frame);
  ++al_version_;
}

}  // namespace ecaudit::track
