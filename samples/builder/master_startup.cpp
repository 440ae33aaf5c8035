// Scan, EEPROM, configuration, AL state changes and clocks of ScriptedMaster (esc-reference 13).
#include <algorithm>
#include <type_traits>
#include <utility>

#include "samples/builder/scripted_master.h"

namespace ecaudit::samples {
namespace {

Bytes SyncManagerBytes(std::uint16_t start, std::uint16_t length, std::uint8_t control, std::uint8_t enable = 1) {
  Bytes out = LeBytes(start);
  AppendLe(out, length);
  out.insert(out.end(), {control, 0, enable, 0});
  return out;
}

Bytes FmmuBytes(std::uint32_t logical, std::uint16_t length, std::uint16_t physical, std::uint8_t type) {
  Bytes out = LeBytes(logical);
  AppendLe(out, length);
  out.insert(out.end(), {0, 7});
  AppendLe(out, physical);
  out.insert(out.end(), {0, type, 1, 0, 0, 0});
  return out;
}

}  // namespace

void ScriptedMaster::Scan() {
  const auto word = [](unsigned value) { return LeBytes(static_cast<std::uint16_t>(value)); };
  scanning_ = true;
  aliases_.clear();
  Bwr(reg::kDlControl + 3, {0});
  Bwr(reg::kAlControl, word(0x11));
  Bwr(reg::kAlControl, word(0x11));
  const std::uint16_t count = Brd(reg::kInformation, 2).wkc;
  Bwr(reg::kDlControl + 1, {0});
  Bwr(reg::kEventMask, word(4));
  Bwr(reg::kRxErrors, Bytes(8, 0));
  Bwr(reg::kFmmu, Bytes(48, 0));
  Bwr(reg::kSyncManager, Bytes(32, 0));
  Bwr(reg::kSyncActivation, {0});
  Bwr(reg::kSystemTime, Bytes(4, 0));
  Bwr(reg::kSpeedCounterStart, word(0x1000));
  Bwr(reg::kFilterDepth, word(0x0C00));
  Bwr(reg::kDlControl + 3, {0});
  Bwr(reg::kAlControl, word(0x11));
  Bwr(reg::kEepromConfig, {2});
  Bwr(reg::kEepromConfig, {0});
  image_.assign(bus_.size(), {});
  if (way_.clears_stations) Bwr(reg::kStationAddress, word(0));
  for (std::size_t i = 0; i < count; ++i) {
    Aprd(i, reg::kPdiControl, 2);
    if (way_.addressing != Addressing::kPosition) Apwr(i, reg::kStationAddress, word(station(i)));
    Apwr(i, reg::kDlControl, word(i == 0 ? 1 : 0));
    Aprd(i, reg::kStationAddress, 2);
    const Answer alias = Read(i, reg::kAlias, 2);
    if (alias.wkc != 0 && LoadLe<std::uint16_t>(alias.data, 0) != 0) aliases_[i] = LoadLe<std::uint16_t>(alias.data, 0);
    Read(i, reg::kEepromControl, 2);
  }
  if (way_.addressing == Addressing::kAlias) Bwr(reg::kDlControl + 3, {1});
  for (std::size_t i = 0; i < count; ++i) {
    for (const int address : {0x08, 0x0A, 0x0C, 0x0E, 0x18, 0x1A, 0x1C}) {
      ReadEeprom(i, static_cast<std::uint16_t>(address));
    }
    Read(i, reg::kInformation, 10);
    Read(i, reg::kDlStatus, 2);
  }
  for (std::size_t i = 0; i < count; ++i) Poll(i, 1);
  scanning_ = false;
  if (way_.numbering.restarts) index_.reset();
}

std::uint32_t ScriptedMaster::ReadEeprom(std::size_t position, std::uint16_t word) {
  Bytes command = LeBytes(std::uint16_t{0x0100});
  AppendLe(command, std::uint32_t{word});
  Write(position, reg::kEepromControl, command);
  for (int i = 0; i < 100; ++i) {
    const Answer status = Read(position, reg::kEepromControl, 2);
    if ((LoadLe<std::uint16_t>(status.data, 0) & 0x8000U) == 0) break;
    Wait(200'000);
  }
  return LoadLe<std::uint32_t>(Read(position, reg::kEepromData, 4).data, 0);
}

void ScriptedMaster::SetUpMailbox(std::size_t position) {
  const SiiContent& sii = bus_.slave(position).description().sii;
  if (sii.mailbox_out_start == 0) return;
  Bytes both = SyncManagerBytes(sii.mailbox_out_start, sii.mailbox_out_length, 0x26);
  AppendBytes(both, SyncManagerBytes(sii.mailbox_in_start, sii.mailbox_in_length, 0x22));
  Write(position, reg::kSyncManager, both);
  mailbox_counter_[position] = 0;
}

void ScriptedMaster::SetUpProcessData(std::size_t position, std::optional<std::uint16_t> output_bytes,
                                      std::optional<std::uint16_t> input_bytes) {
  const SlaveDescription& slave = bus_.slave(position).description();
  Image& image = image_.at(position);
  if (slave.outputs_start == 0) {
    const SiiSyncManager& inputs = slave.sii.sync_managers.at(0);
    image.input_bytes = inputs.length;
    Write(position, reg::kSyncManager, SyncManagerBytes(inputs.start, inputs.length, inputs.control, inputs.enable));
    return;
  }
  image.output_bytes = output_bytes.value_or(bus_.slave(position).ProcessDataBytes(0x1C12));
  image.input_bytes = input_bytes.value_or(bus_.slave(position).ProcessDataBytes(0x1C13));
  Write(position, reg::kSyncManager + 16, SyncManagerBytes(slave.outputs_start, image.output_bytes, 0x64));
  Write(position, reg::kSyncManager + 24,
        SyncManagerBytes(slave.inputs_start, image.input_bytes, slave.sii.sync_managers.at(3).control));
}

void ScriptedMaster::DisableSyncManager(std::size_t position, int number) {
  Write(position, static_cast<std::uint16_t>(reg::kSyncManager + 8 * number), Bytes(8, 0));
}

void ScriptedMaster::MapProcessImage() {
  // All outputs and then all inputs, or those of one slave beside each other.
  const bool by_slave = way_.grouping.apart_by_slave && !way_.grouping.apart_by_direction;
  std::uint32_t next = 0;
  for (Image& image : image_) {
    image.output_offset = next;
    next += image.output_bytes;
    if (!by_slave) continue;
    image.input_offset = next;
    next += image.input_bytes;
  }
  for (Image& image : image_) {
    if (by_slave) break;
    image.input_offset = next;
    next += image.input_bytes;
  }
  for (std::size_t i = 0; i < image_.size(); ++i) MapAgain(i);
}

void ScriptedMaster::MapAgain(std::size_t position) {
  const SlaveDescription& slave = bus_.slave(position).description();
  const Image& image = image_[position];
  std::uint16_t fmmu = reg::kFmmu;
  if (image.output_bytes != 0) {
    Write(position, fmmu,
          FmmuBytes(way_.logical_base + image.output_offset, image.output_bytes, slave.outputs_start, 2));
    fmmu = static_cast<std::uint16_t>(fmmu + 16);
  }
  if (image.input_bytes != 0) {
    const std::uint16_t start = slave.outputs_start != 0 ? slave.inputs_start : slave.sii.sync_managers.at(0).start;
    Write(position, fmmu, FmmuBytes(way_.logical_base + image.input_offset, image.input_bytes, start, 1));
  }
}

void ScriptedMaster::MapBehind(std::size_t position) {
  std::uint32_t end = 0;
  for (std::size_t i = 0; i < image_.size(); ++i) {
    if (i == position) continue;
    end = std::max(
        {end, image_[i].output_offset + image_[i].output_bytes, image_[i].input_offset + image_[i].input_bytes});
  }
  Image& image = image_.at(position);
  image.output_offset = end;
  image.input_offset = end + image.output_bytes;
  MapAgain(position);
}

void ScriptedMaster::Joined(std::size_t position, std::uint16_t station) {
  for (std::size_t i = stations_.size(); i < image_.size(); ++i) stations_.push_back(this->station(i));
  stations_.insert(stations_.begin() + static_cast<std::ptrdiff_t>(position), station);
  image_.insert(image_.begin() + static_cast<std::ptrdiff_t>(position), Image{});
  const auto shift = [&](auto& by_position) {
    std::remove_reference_t<decltype(by_position)> moved;
    for (auto& [at, value] : by_position) moved[at < position ? at : at + 1] = std::move(value);
    by_position = std::move(moved);
  };
  shift(outputs_);
  shift(aliases_);
  shift(mailbox_counter_);
}

void ScriptedMaster::BringToPreop() {
  for (std::size_t i = 0; i < bus_.size(); ++i) SetUpMailbox(i);
  if (way_.requests_by_broadcast) {
    Bwr(reg::kEepromConfig, {1});
    ChangeAll(Al::kPreop);
    return;
  }
  for (std::size_t i = 0; i < bus_.size(); ++i) {
    Write(i, reg::kEepromConfig, {1});
    ChangeState(i, Al::kPreop);
  }
}

void ScriptedMaster::BringToSafeop() {
  for (std::size_t i = 0; i < bus_.size(); ++i) SetUpProcessData(i);
  MapProcessImage();
  ChangeAll(Al::kSafeop);
}

void ScriptedMaster::BringToOp(CyclicTask task) {
  StartCyclic(std::move(task));
  Cycles(5);
  ChangeAll(Al::kOp);
}

void ScriptedMaster::ChangeAll(Al state) {
  if (way_.requests_by_broadcast) {
    RequestAll(ControlFor(state));
    for (std::size_t i = 0; i < bus_.size(); ++i) Poll(i, static_cast<std::uint8_t>(state));
    return;
  }
  for (std::size_t i = 0; i < bus_.size(); ++i) ChangeState(i, state);
}

void ScriptedMaster::ShutDown() {
  for (const Al state : {Al::kSafeop, Al::kPreop, Al::kInit}) {
    for (std::size_t i = 0; i < bus_.size(); ++i) {
      if (bus_.slave(i).state() > static_cast<std::uint8_t>(state)) ChangeState(i, state);
    }
    if (state == Al::kSafeop) StopCyclic();
  }
}

// ---------------------------------------------------------------------------------------------- AL

std::uint16_t ScriptedMaster::ControlFor(Al state) const {
  return static_cast<std::uint16_t>(static_cast<unsigned>(state) | (way_.always_acknowledges ? 0x10U : 0U));
}

FrameIds ScriptedMaster::Request(std::size_t position, std::uint16_t control) {
  return Write(position, reg::kAlControl, LeBytes(control)).frame;
}

FrameIds ScriptedMaster::RequestAll(std::uint16_t control) {
  return Bwr(reg::kAlControl, LeBytes(control)).frame;
}

AlAnswer ScriptedMaster::Poll(std::size_t position, std::uint8_t state, TimeNs timeout) {
  const TimeNs end = now_ + timeout;
  AlAnswer answer;
  while (true) {
    const Answer status = Read(position, reg::kAlStatus, way_.reads_status_code ? 6 : 2);
    answer.status_read = status.frame;
    if (status.wkc != 0) {
      answer.status = LoadLe<std::uint16_t>(status.data, 0);
      answer.code = LoadLe<std::uint16_t>(status.data, 4);
      // A terminal without processor echoes the acknowledge bit; that is no error.
      answer.error = (answer.status & 0x10U) != 0 && !bus_.slave(position).description().esc.device_emulation;
      answer.reached = (answer.status & 0x0FU) == state && !answer.error;
    }
    if (answer.reached || answer.error || now_ + way_.poll_interval > end) return answer;
    Wait(way_.poll_interval);
  }
}

AlAnswer ScriptedMaster::ChangeState(std::size_t position, Al state, TimeNs timeout) {
  const FrameIds request = Request(position, ControlFor(state));
  Wait(way_.poll_interval);
  AlAnswer answer = Poll(position, static_cast<std::uint8_t>(state), timeout);
  answer.request = request;
  return answer;
}

AlAnswer ScriptedMaster::Acknowledge(std::size_t position, Al present) {
  const FrameIds request = Request(position, static_cast<std::uint16_t>(static_cast<unsigned>(present) | 0x10U));
  Wait(way_.poll_interval);
  AlAnswer answer = Poll(position, static_cast<std::uint8_t>(present));
  answer.request = request;
  return answer;
}

// ---------------------------------------------------------------------------------------------- clocks

void ScriptedMaster::SetUpClocks(int bursts) {
  constexpr TimeNs kEpoch2000 = 946'684'800'000'000'000;
  const TimeNs latched_at = now_;
  Bwr(reg::kReceiveTime, Bytes(4, 0));
  std::uint32_t delay = 0;
  std::uint32_t loop_before = 0;
  for (std::size_t i = 0; i < bus_.size(); ++i) {
    const Bytes ports = Read(i, reg::kReceiveTime, 16).data;
    const Answer local = Read(i, reg::kReceiveTimeEpu, 8);
    const bool last = i + 1 == bus_.size();
    const std::uint32_t loop = last ? 0 : LoadLe<std::uint32_t>(ports, 4) - LoadLe<std::uint32_t>(ports, 0);
    // Half of what the parent's loop is longer than the own one (esc-reference 10.1).
    if (i > 0) delay += (loop_before - loop) / 2;
    loop_before = loop;
    const auto wanted = static_cast<std::uint64_t>(latched_at - kEpoch2000) + delay;
    Write(i, reg::kTimeOffset, LeBytes(wanted - LoadLe<std::uint64_t>(local.data, 0)));
    Write(i, reg::kTimeDelay, LeBytes(delay));
  }
  Bwr(reg::kSpeedCounterStart, LeBytes(std::uint16_t{0x1000}));
  for (int i = 0; i < bursts; ++i) {
    Exchange({TimeDatagram()});
  }
}

void ScriptedMaster::StartSync0(std::size_t position, std::uint32_t cycle_ns) {
  Write(position, reg::kSyncActivation, {0});
  Write(position, reg::kCyclicUnit, {0});
  const auto time = LoadLe<std::uint64_t>(Read(position, reg::kSystemTime, 8).data, 0);
  const std::uint64_t start = (time + 100'000'000) / cycle_ns * cycle_ns + cycle_ns;
  Write(position, reg::kSyncStart, LeBytes(start));
  Write(position, reg::kSync0Cycle, LeBytes(cycle_ns));
  Write(position, reg::kSyncActivation, {3});
}

}  // namespace ecaudit::samples
