#include "analyzers/model/bus_model.h"

#include <algorithm>
#include <utility>

#include "decoder/esc/register_addresses.h"
#include "decoder/esc/register_map.h"

namespace ecaudit::model {
namespace {

/// Whether a slave exchanges process data in a state.
bool HasProcessData(std::uint8_t state) {
  return state >= static_cast<std::uint8_t>(esc::AlState::SAFEOP);
}

}  // namespace

BusModel::BusModel(const track::Network& network, const AnalysisOptions& options, EventBus& bus)
    : network_(network),
      events_(bus),
      al_limits_(options),
      choice_(options),
      image_(network, slaves_, choice_,
             options.files != nullptr && options.files->eni ? &options.files->eni->content : nullptr),
      signalled_(network, bus),
      al_(network, bus),
      al_wait_(bus) {
  const auto limit = [&](std::string_view name, std::int64_t& value) {
    const auto found = options.limits.find(name);
    if (found != options.limits.end()) value = found->second;
  };
  al_wait_.SetTimeouts(al_limits_.usual());
  limit("latch-ack-mismatch", latch_acknowledge_ns_);
  limit("drive-no-reaction", drive_limits_.reaction_ns);
  limit("drive-no-reaction.stop", drive_limits_.leaving_operation_ns);

  bus.ListenTo<track::SlaveFound, track::AddressAssigned, track::IdentityLearned, track::EventFieldChanged,
               track::AlRequestSent, track::AlRequest, track::AlRequestOfAll, track::AlStatusRead, track::AlPoll,
               track::AlStatusOfAll, track::AlStatusCodeRead, track::RunBegan, track::AlStateForgotten,
               track::CaptureGap, track::LogicalAccess, track::FrameLost, track::SlaveAccess, track::EepromRead,
               track::EepromWrite, mailbox::SdoTransfer, mailbox::SdoUnexpected, mailbox::SdoInfo, mailbox::Emergency>(
      Stage::kModel, *this);
}

void BusModel::On(const track::SlaveFound& event) {
  slaves_.emplace_back(event.slave, network_.state(event.slave), limits_, events_);
  by_id_.push_back(&slaves_.back());
  slaves_.back().al.SetTimeouts(al_limits_.usual());
  slaves_.back().set_up.Begin(network_.state(event.slave));
  slaves_.back().latch.SetAcknowledgeLimit(latch_acknowledge_ns_);
  slaves_.back().drives.SetLimits(drive_limits_);
  identities_.emplace_back(event.slave);
  signalled_.OnSlave(event.slave);
  ChooseProfile(event.slave);
  // In a capture that begins in the run broadcasts may have shown it before it is met. Where a broadcast asked for a
  // state, AlRequest of the slave follows, and what was shown after that.
  if (const auto common = al_.common(); common && !asked_of_all_) {
    const esc::AlWord status{common->state};
    slaves_.back().al.OnStatus(
        {event.slave, common->frame, status, std::nullopt, std::nullopt, !common->error_of_some});
    if (common->frame.number < network_.last_gap()) slaves_.back().al.OnPause();
  }
}

void BusModel::On(const track::AddressAssigned& event) {
  ChooseProfile(event.slave);
}

void BusModel::On(const track::IdentityLearned& event) {
  if (identities_[event.slave].Learn(event)) {
    SlaveModel& slave = slaves_[event.slave];
    slave.al.OnOtherDevice();
    slave.objects.Clear();
    slave.process.OnOtherDevice();
    image_.OnLayoutChanged(event.slave);
  }
  ChooseProfile(event.slave);
}

void BusModel::ChooseProfile(SlaveId id) {
  SlaveModel& slave = slaves_[id];
  choice_.Choose(network_.slaves()[id], identities_[id].known(), slave);
  slave.al.SetFamily(*slave.profile);
  slave.al.SetTimeouts(al_limits_.For(slave.profile->esi ? slave.profile->esi->timeouts : device::StateTimeouts{},
                                      slave.eni != nullptr ? slave.eni->Waits() : device::StateTimeouts{}));
  const std::uint64_t layouts = slave.process.version();
  slave.process.SetFamily(*slave.profile);
  slave.latch.SetFamily(*slave.profile);
  slave.touch_probe.SetFamily(*slave.profile);
  slave.drives.SetFamily(*slave.profile);
  slave.process.SetEni(slave.eni, choice_.eni());
  if (slave.process.version() != layouts) image_.OnLayoutChanged(id);
}

void BusModel::On(const track::AlRequest& event) {
  ++states_version_;
  slaves_[event.slave].mailbox.Forget();
  if (!HasProcessData(event.control.state())) slaves_[event.slave].ForgetLatches();
  if (event.control.state() == static_cast<std::uint8_t>(esc::AlState::INIT)) DoubtSettings(event.slave);
  if (event.control.state() != static_cast<std::uint8_t>(esc::AlState::OP)) {
    slaves_[event.slave].outputs.since = slaves_[event.slave].inputs.since = {.request = event.frame().number};
  }
  AlMachine& al = slaves_[event.slave].al;
  al.OnRequest(event);
  if (event.frame().number < network_.last_gap()) al.OnPause();  // it is met after a silence since then
  // Who is met after a broadcast request was in the state that a broadcast read showed of all since then.
  const auto& shown = al_.shown();
  const std::uint16_t* count = network_.slave_count().if_known();
  if (event.broadcast && al.status_reads() == 0 && shown && shown->last.number >= event.frame().number &&
      count != nullptr && *count == shown->slaves && esc::IsAlState(static_cast<std::uint8_t>(shown->status.raw))) {
    al.OnStatus({event.slave, shown->last, shown->status, std::nullopt, std::nullopt, true});
    if (shown->last.number < network_.last_gap()) al.OnPause();
  }
  if (!event.broadcast) al_.OnRequest(event.control, event.acceptance, event.frame(), false);
  al_.OnAsked(event.slave, event.control, event.acceptance);
  if (event.broadcast) return;
  al_wait_.OnRequest(event.control, event.acceptance, event.frame(), event.slave);
}
void BusModel::On(const track::AlRequestOfAll& event) {
  asked_of_all_ = asked_of_all_ || event.acceptance != track::Acceptance::kRefused;
  al_.OnRequest(event.control, event.acceptance, event.frame, true);
  al_wait_.OnRequest(event.control, event.acceptance, event.frame, kNoSlave);
}
void BusModel::On(const track::AlStatusRead& event) {
  al_.On(event);
  al_wait_.On(event);
  if (event.changed()) {
    slaves_[event.slave].mailbox.Forget();
    if (!HasProcessData(event.status.state())) slaves_[event.slave].ForgetLatches();
  }
  AlMachine& al = slaves_[event.slave].al;
  const bool settled = al.SettledIn(esc::AlState::OP);
  al.OnStatus(event);
  if (al.SettledIn(esc::AlState::OP) != settled) ++states_version_;
}
void BusModel::On(const track::AlPoll& poll) {
  if (poll.each_wanted) return;
  for (const SlaveId id : poll.slaves) {
    if (!by_id_[id]->al.RepeatsState(poll.status.state())) return;
  }
  for (const SlaveId id : poll.slaves) by_id_[id]->al.Repeat(poll.frame.number);
  poll.taken = true;
}
void BusModel::On(const track::AlStatusCodeRead& event) {
  slaves_[event.slave].al.OnStatusCode(event);
}
void BusModel::On(const track::AlStateForgotten& event) {
  ++states_version_;
  slaves_[event.slave].al.Forget(event.frame);
  if (!event.may_be_set_up_anew) return;
  slaves_[event.slave].set_up.Forget();
  DoubtLayouts(event.slave);
}

/// Whatever was reported in the frames that are missing.
void BusModel::On(const track::CaptureGap& event) {
  if (event.certain) {
    al_.Forget();
  } else {
    al_.OnPause();
  }
  if (event.is_short()) {
    al_wait_.OnShortGap();
  } else {
    al_wait_.Forget();
  }
  for (std::size_t id = 0; id < slaves_.size(); ++id) {
    SlaveModel& slave = slaves_[id];
    if (event.certain) {
      slave.al.OnGap(event);
    } else {
      slave.al.OnPause();
    }
    slave.NoteLatchGap(event.frame, event.certain || event.skip);
    if (!event.certain) continue;
    slave.mailbox.Forget();
    slave.entry_port.Forget();
    slave.set_up.Forget();
    slave.drives.Forget();
    if (!slave.al.SettledIn(esc::AlState::OP)) DoubtLayouts(static_cast<SlaveId>(id));
  }
}

void BusModel::On(const track::LogicalAccess& access) {
  if (!image_.Read(access, Expect(access), *this)) events_.Publish(ProcessDataUnplaced{access});
  access.told += image_.TakeWork() + expectations_.TakeWork();
}

void BusModel::On(const track::FrameLost& event) {
  for (std::size_t i = 0; i < event.sent.size(); ++i) {
    const wire::DatagramView datagram = event.sent[i];
    if (!wire::IsDefined(datagram.command_byte()) || !wire::IsLogical(datagram.command())) continue;
    track::LogicalAccess access;
    access.command = datagram.command();
    access.address = datagram.logical_address();
    access.sent = event.sent.ref();
    access.sent_data = datagram.data();
    access.length = datagram.length();
    (void)image_.Read(access, Expect(access), *this);
  }
  event.told += image_.TakeWork() + expectations_.TakeWork();
}

/// Published first: who looks at the values sees them before the units of the slave conclude something from them.
void BusModel::On(const ProcessCycle& cycle) {
  events_.Publish(cycle);
  if (cycle.part.slave == kNoSlave) return Presume(cycle);
  SlaveModel& slave = *by_id_[cycle.part.slave];
  const bool inputs = cycle.part.direction == device::PdoDirection::kTx;
  if (cycle.exchange == Exchange::kNo) {
    events_.Publish(ProcessDataMissed{cycle});
  } else if (cycle.exchange == Exchange::kYes && cycle.has_data()) {
    if (inputs) {
      events_.Publish(InputsGiven{cycle});
    } else {
      events_.Publish(OutputsTaken{cycle});
    }
  }
  ProcessTraffic& traffic = inputs ? slave.inputs : slave.outputs;
  if (cycle.exchange == Exchange::kYes || cycle.exchange == Exchange::kInferred) {
    if (traffic.exchanged++ == 0) traffic.first = cycle.frame();
    traffic.last = cycle.frame();
    ++traffic.since.exchanged;
  } else if (cycle.exchange == Exchange::kNo) {
    ++traffic.missed;
    ++traffic.since.missed;
    if (cycle.command == wire::Command::LRW) ++traffic.since.missed_by_lrw;
    traffic.since.last_missed = cycle.frame().number;
  }
  if (slave.latch.Wants(cycle.part.serial, inputs)) slave.latch.OnCycle(cycle);
  if (slave.touch_probe.Wants(cycle.part.serial, inputs)) slave.touch_probe.OnCycle(cycle);
  slave.drives.OnCycle(cycle);
}

/// Mid-run captures of nothing but process data: the ENI states whose they are, and the working counter that they are.
void BusModel::Presume(const ProcessCycle& cycle) {
  const device::EniSlave* eni = cycle.part.model->eni;
  if (cycle.exchange != Exchange::kInferred || eni == nullptr) return;
  if (std::find(presumed_.begin(), presumed_.end(), eni) != presumed_.end()) return;
  presumed_.push_back(eni);
  events_.Publish(SlavePresumed{eni->position(), eni->station_address});
}

void BusModel::On(const track::SlaveAccess& access) {
  if (access.address >= esc::kProcessRam) (void)image_.Read(access, *this);
  slaves_[access.slave].mailbox.OnAccess(access);
  slaves_[access.slave].entry_port.On(access);
  slaves_[access.slave].set_up.On(access);
  signalled_.OnAccess(access);
  const ByteSpan configuration = access.Covered(access.read, esc::kEscConfiguration, 1);
  if (!configuration.empty() && !access.broadcast) {
    slaves_[access.slave].al.SetDeviceEmulation((configuration[0] & 1U) != 0);
  }
}

void BusModel::On(const track::EepromRead& event) {
  identities_[event.slave].OnEepromRead(event.frame);
  DescriptionChanged(event.slave);
}
void BusModel::On(const track::EepromWrite& event) {
  DescriptionChanged(event.slave);
}
void BusModel::DescriptionChanged(SlaveId slave) {
  slaves_[slave].process.OnDescriptionChanged();
  image_.OnLayoutChanged(slave);
}

/// The capture does not show whether the slave wrote the value: the object holds the old value or the new one.
void BusModel::ForgetObject(SlaveId id, std::uint16_t index, std::uint8_t subindex, bool whole) {
  SlaveModel& slave = slaves_[id];
  slave.objects.Forget(index, subindex);
  if (slave.process.Forget(index, subindex, whole)) image_.OnLayoutChanged(id);
  slave.drives.ForgetObject(index);
}

/// An answer to a download that the capture lacks.
void BusModel::On(const mailbox::SdoUnexpected& answer) {
  constexpr std::uint8_t kDownloaded = 0x60;
  if (!answer.has_object || answer.abort || answer.command != kDownloaded) return;
  ForgetObject(answer.slave, answer.index, answer.subindex, false);
}

void BusModel::On(const track::RunBegan& event) {
  al_.Forget();
  // A master that initialises the bus again waits for nothing any more.
  if (event.reason == track::RunBegan::Reason::kInitialised) al_wait_.GiveUp(event.frame);
  al_wait_.Forget();
  for (std::size_t id = 0; id < slaves_.size(); ++id) DoubtSettings(static_cast<SlaveId>(id));
}

/// What was written by SDO a device may forget in INIT, and does without power.
void BusModel::DoubtSettings(SlaveId id) {
  DoubtLayouts(id);
  slaves_[id].drives.OnRunBegan();
}

/// What was assigned and mapped may be another by now.
void BusModel::DoubtLayouts(SlaveId id) {
  SlaveModel& slave = slaves_[id];
  slave.process.OnRunBegan();
  image_.OnLayoutChanged(id);
}

void BusModel::On(const mailbox::SdoTransfer& transfer) {
  if (identities_[transfer.slave].Learn(transfer)) ChooseProfile(transfer.slave);
  SlaveModel& slave = slaves_[transfer.slave];
  slave.objects.Apply(transfer);
  slave.modules.Apply(transfer);
  slave.diagnosis.Apply(transfer);
  // When the list is complete: a description for each of its entries would be kept for nothing.
  if (transfer.has_object && !SlotModules::IsList(transfer.index)) TakeModules(transfer.slave);
  if (slave.process.Apply(transfer)) {
    image_.OnLayoutChanged(transfer.slave);
    // Of several editions the one that has what the drive takes.
    if (process::IsAssignment(transfer.index)) ChooseProfile(transfer.slave);
  }
  if (transfer.has_object && transfer.service == mailbox::SdoService::kDownload && transfer.incomplete()) {
    ForgetObject(transfer.slave, transfer.index, transfer.subindex, transfer.complete_access);
  }
  slave.latch.OnSdo(transfer);
  slave.touch_probe.OnSdo(transfer);
  slave.drives.OnSdo(transfer);
}

void BusModel::TakeModel(SlaveId id) {
  if (identities_[id].LookInto(network_.state(id).sii.image())) ChooseProfile(id);
}

void BusModel::TakeModules(SlaveId id) {
  if (slaves_[id].modules.TakeChanged()) ChooseProfile(id);
}

void BusModel::On(const mailbox::SdoInfo& info) {
  slaves_[info.slave].names.Learn(info);
  DescriptionChanged(info.slave);
}

void BusModel::On(const mailbox::Emergency& emergency) {
  slaves_[emergency.slave].drives.OnEmergency(emergency);
}

void BusModel::On(const track::AlRequestSent& request) {
  ++states_version_;
  if (request.slave >= slaves_.size()) return;
  TakeModel(request.slave);
  TakeModules(request.slave);
  slaves_[request.slave].al.OnRequestSent(request.frame, request.control);
}

void BusModel::Finish() {
  signalled_.Finish();
  al_.Finish();
  al_wait_.Finish();
  for (std::size_t id = 0; id < slaves_.size(); ++id) {
    TakeModel(static_cast<SlaveId>(id));
    TakeModules(static_cast<SlaveId>(id));
  }
  for (SlaveModel& slave : slaves_) {
    slave.latch.Finish();
    slave.touch_probe.Finish();
  }
}

}  // namespace ecaudit::model
