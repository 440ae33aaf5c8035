#include "samples/builder/simulated_slave.h"

#include <algorithm>
#include <utility>

namespace ecaudit::samples {
namespace {

constexpr std::uint8_t kInit = 1;
constexpr std::uint8_t kPreop = 2;
constexpr std::uint8_t kBoot = 3;
constexpr std::uint8_t kSafeop = 4;
constexpr std::uint8_t kOp = 8;
constexpr std::uint16_t kErrorBit = 0x0010;
constexpr std::uint16_t kCodeInvalidChange = 0x0011;
constexpr std::uint16_t kCodeWatchdog = 0x001B;

}  // namespace

SimulatedSlave::SimulatedSlave(SlaveDescription description, TimeNs power_on)
    : description_(std::move(description)),
      esc_(
          [this] {
            EscDescription esc = description_.esc;
            if (esc.eeprom.empty()) esc.eeprom = BuildSii(description_.sii);
            return esc;
          }(),
          power_on),
      objects_(description_.objects),
      coe_(description_.coe, [this](std::uint16_t index, std::uint8_t subindex, ByteView value) {
        return CheckDownload(index, subindex, value);
      }) {}

void SimulatedSlave::Advance(TimeNs now) {
  if (const std::optional<TimeNs> written = esc_.al_control_written();
      written && !description_.esc.device_emulation && now >= *written + description_.al.read_time) {
    HandleAlControl(*written + description_.al.read_time, esc_.TakeAlControl());
  }
  if (planned_ && now >= planned_->at) {
    const Planned planned = *planned_;
    planned_.reset();
    Enter(planned.at, planned.status, planned.code);
  }
  CheckWatchdog(now);
  coe_.Run(now, esc_, objects_);
  ExchangeProcessData(now);
}

// ---------------------------------------------------------------------------------------------- AL

void SimulatedSlave::HandleAlControl(TimeNs at, std::uint16_t control) {
  const std::uint16_t status = esc_.Word(reg::kAlStatus);
  const auto from = static_cast<std::uint8_t>(status & 0x0FU);
  const auto to = static_cast<std::uint8_t>(control & 0x0FU);
  const bool error = (status & kErrorBit) != 0;
  const bool acknowledge = (control & kErrorBit) != 0;

  for (AlOverride& one : overrides_) {
    if ((one.from != 0 && one.from != from) || (one.to != 0 && one.to != to) || one.times == 0) continue;
    if (one.times > 0) --one.times;
    if (one.action == AlOverride::Action::kIgnore) return;
    if (one.action == AlOverride::Action::kRefuse) {
      planned_ = Planned{at, static_cast<std::uint16_t>(from | kErrorBit), one.code};
    } else {
      planned_ = Planned{at + description_.al.safeop_time, to, 0};
    }
    return;
  }

  // An error must be acknowledged, except by going to INIT (esc-reference 5.3).
  if (error && !acknowledge && to != kInit) return;
  if (to == from) {
    if (error) planned_ = Planned{at, from, 0};
    return;
  }
  if (const std::uint16_t code = CheckTransition(from, to)) {
    planned_ = Planned{at, static_cast<std::uint16_t>(from | kErrorBit), code};
    return;
  }
  const AlBehaviour& al = description_.al;
  const bool up = to > from && from != kBoot;
  const TimeNs time = !up ? al.down_time : to == kOp ? al.op_time : to == kSafeop ? al.safeop_time : al.preop_time;
  planned_ = Planned{at + time, to, 0};
}

std::uint16_t SimulatedSlave::CheckTransition(std::uint8_t from, std::uint8_t to) const {
  if (to != kInit && to != kPreop && to != kBoot && to != kSafeop && to != kOp)
    return description_.al.unknown_state_code;
  if (to == kInit) return 0;
  const bool allowed = (from == kInit && (to == kPreop || to == kBoot)) || (from == kPreop && to == kSafeop) ||
                       (from == kSafeop && (to == kPreop || to == kOp)) ||
                       (from == kOp && (to == kPreop || to == kSafeop));
  if (!allowed) return kCodeInvalidChange;
  if (from == kInit && to == kPreop && !MailboxSyncManagersGood()) return description_.al.mailbox_code;
  if (from == kPreop && to == kSafeop && !ProcessSyncManagersGood()) return description_.al.process_data_code;
  return 0;
}

bool SimulatedSlave::MailboxSyncManagersGood() const {
  const SiiContent& sii = description_.sii;
  if (sii.mailbox_out_start == 0) return true;
  const SyncManagerSettings out = esc_.sync_manager(0);
  const SyncManagerSettings in = esc_.sync_manager(1);
  return out.enabled && in.enabled && out.mailbox() && in.mailbox() && out.master_writes() && !in.master_writes() &&
         out.start == sii.mailbox_out_start && out.length == sii.mailbox_out_length &&
         in.start == sii.mailbox_in_start && in.length == sii.mailbox_in_length;
}

bool SimulatedSlave::ProcessSyncManagersGood() const {
  if (description_.outputs_start == 0) return true;
  const SyncManagerSettings out = esc_.sync_manager(2);
  const SyncManagerSettings in = esc_.sync_manager(3);
  const bool one_buffer = (description_.sii.sync_managers.at(3).control & 0x03U) == 2;
  return out.enabled && in.enabled && !out.mailbox() && in.mailbox() == one_buffer && out.master_writes() &&
         !in.master_writes() && out.start == description_.outputs_start &&
         out.length == ProcessDataBytes(kRxAssignment) && in.start == description_.inputs_start &&
         in.length == ProcessDataBytes(kTxAssignment);
}

void SimulatedSlave::Enter(TimeNs at, std::uint16_t status, std::uint16_t code) {
  const std::uint8_t before = state();
  const auto after = static_cast<std::uint8_t>(status & 0x0FU);
  esc_.SetAlStatus(status, code);
  if (before == after) return;
  if (before == kInit && after != kInit) coe_.Start(esc_);
  if (after == kInit) coe_.Stop();
  if (after == kOp) op_since_ = at;
}

// The watchdog counts from the last complete write of an output sync manager with bit 6 (esc-reference 6.4).
void SimulatedSlave::CheckWatchdog(TimeNs now) {
  if (state() != kOp || description_.outputs_start == 0 || !esc_.sync_manager(2).watchdog_trigger()) return;
  const TimeNs tick = (TimeNs{esc_.Word(reg::kWatchdogDivider)} + 2) * 40;
  const TimeNs limit = tick * esc_.Word(reg::kWatchdogProcessData);
  if (limit == 0) return;
  const TimeNs last = std::max(op_since_, esc_.outputs_written(2).value_or(0));
  if (now > last + limit) {
    esc_.SetWord(reg::kWatchdogStatus, 0);
    esc_.CountErrors(0x0442, 1);
    Enter(last + limit, kSafeop | kErrorBit, kCodeWatchdog);
  }
}

// ---------------------------------------------------------------------------------------------- process data

std::uint16_t SimulatedSlave::ProcessDataBytes(std::uint16_t assignment) const {
  std::uint32_t bits = 0;
  const auto pdos = objects_.Number<std::uint8_t>(assignment, 0);
  for (std::uint8_t i = 1; i <= pdos; ++i) {
    const auto pdo = objects_.Number<std::uint16_t>(assignment, i);
    const auto entries = objects_.Number<std::uint8_t>(pdo, 0);
    for (std::uint8_t k = 1; k <= entries; ++k) bits += objects_.Number<std::uint32_t>(pdo, k) & 0xFFU;
  }
  return static_cast<std::uint16_t>((bits + 7) / 8);
}

void SimulatedSlave::ExchangeProcessData(TimeNs now) {
  if (description_.outputs_start == 0) {
    // A terminal without mailbox: its inputs simply change with time.
    if (!esc_.sync_manager(0).master_writes()) {
      const auto value = static_cast<std::uint8_t>(now / 10'000'000 & 0x0F);
      esc_.SetByte(description_.sii.sync_managers.at(0).start, value);
    }
    return;
  }
  const auto walk = [&](std::uint16_t assignment, auto&& each) {
    std::size_t offset = 0;
    const auto pdos = objects_.Number<std::uint8_t>(assignment, 0);
    for (std::uint8_t i = 1; i <= pdos; ++i) {
      const auto pdo = objects_.Number<std::uint16_t>(assignment, i);
      const auto entries = objects_.Number<std::uint8_t>(pdo, 0);
      for (std::uint8_t k = 1; k <= entries; ++k) {
        const auto entry = objects_.Number<std::uint32_t>(pdo, k);
        const std::size_t bytes = (entry & 0xFFU) / 8;
        each(objects_.Find(static_cast<std::uint16_t>(entry >> 16U), static_cast<std::uint8_t>(entry >> 8U & 0xFFU)),
             offset, bytes);
        offset += bytes;
      }
    }
  };
  const bool op = state() == kOp;
  if (op && esc_.outputs_written(2) && esc_.outputs_written(2) != outputs_seen_) {
    outputs_seen_ = esc_.outputs_written(2);
    const Bytes& outputs = esc_.outputs(2);
    walk(kRxAssignment, [&](ObjectEntry* object, std::size_t offset, std::size_t bytes) {
      for (std::size_t i = 0; object != nullptr && i < bytes && i < object->value.size(); ++i) {
        object->value[i] = LoadLe<std::uint8_t>(outputs, offset + i);
      }
    });
  }
  if (description_.is_drive) drive_.Run(now, op, objects_);
  if (state() != kSafeop && !op) return;
  Bytes inputs(ProcessDataBytes(kTxAssignment), 0);
  walk(kTxAssignment, [&](const ObjectEntry* object, std::size_t offset, std::size_t bytes) {
    for (std::size_t i = 0; object != nullptr && i < bytes && i < object->value.size(); ++i) {
      inputs[offset + i] = object->value[i];
    }
  });
  if (!esc_.sync_manager(3).mailbox()) {
    esc_.PutInputs(3, inputs);
  } else if (description_.fills_inputs_every != 0 && now >= inputs_filled_ + description_.fills_inputs_every) {
    if (esc_.PutMailbox(3, inputs)) inputs_filled_ = now;
  }
}

// Assignments change in PREOP only, and their entries only while the number of entries is 0.
std::uint32_t SimulatedSlave::CheckDownload(std::uint16_t index, std::uint8_t subindex, ByteView value) const {
  const bool assignment = index == kRxAssignment || index == kTxAssignment;
  const bool mapping = (index >= 0x1600 && index < 0x1800) || (index >= 0x1A00 && index < 0x1C00);
  if (!assignment && !mapping) return 0;
  if (state() != kPreop) return kAbortState;
  if (subindex != 0 && objects_.Number<std::uint8_t>(index, 0) != 0) return kAbortSubindexZeroFirst;
  const auto mapped = mapping && subindex != 0 ? static_cast<std::uint16_t>(LoadLe<std::uint32_t>(value, 0) >> 16U) : 0;
  if (mapped >= 0x1000 && mapped < 0x2000) return kAbortNotMappable;  // communication objects
  if (assignment && subindex != 0 && !objects_.Has(LoadLe<std::uint16_t>(value, 0))) return kAbortRange;
  return 0;
}

}  // namespace ecaudit::samples
