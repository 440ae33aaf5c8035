#include "samples/builder/esc.h"

#include <algorithm>
#include <utility>

namespace ecaudit::samples {
namespace {

enum class Kind : std::uint8_t { kRead, kReadWrite };

struct Range {
  std::uint16_t first;
  std::uint16_t last;
  Kind kind;
};

// What the wire may access below 0x1000, apart from what depends on the features of the chip (esc-reference 4).
constexpr Range kRegisters[] = {
    {0x0000, 0x0009, Kind::kRead},      {0x0010, 0x0011, Kind::kReadWrite}, {0x0012, 0x0013, Kind::kRead},
    {0x0020, 0x0021, Kind::kReadWrite}, {0x0030, 0x0031, Kind::kReadWrite}, {0x0040, 0x0040, Kind::kReadWrite},
    {0x0100, 0x0103, Kind::kReadWrite}, {0x0108, 0x0109, Kind::kReadWrite}, {0x0110, 0x0111, Kind::kRead},
    {0x0120, 0x0121, Kind::kReadWrite}, {0x0130, 0x0135, Kind::kRead},      {0x0140, 0x0141, Kind::kRead},
    {0x0150, 0x0153, Kind::kRead},      {0x0200, 0x0201, Kind::kReadWrite}, {0x0204, 0x0207, Kind::kRead},
    {0x0210, 0x0211, Kind::kRead},      {0x0220, 0x0223, Kind::kRead},      {0x0300, 0x030D, Kind::kReadWrite},
    {0x0310, 0x0313, Kind::kReadWrite}, {0x0400, 0x0401, Kind::kReadWrite}, {0x0410, 0x0411, Kind::kReadWrite},
    {0x0420, 0x0421, Kind::kReadWrite}, {0x0440, 0x0441, Kind::kRead},      {0x0442, 0x0443, Kind::kReadWrite},
    {0x0500, 0x0500, Kind::kReadWrite}, {0x0501, 0x0501, Kind::kRead},      {0x0502, 0x050F, Kind::kReadWrite},
    {0x0F00, 0x0F03, Kind::kReadWrite}, {0x0F80, 0x0FFF, Kind::kReadWrite},
};

constexpr Range kClockRegisters[] = {
    {0x0910, 0x0917, Kind::kReadWrite}, {0x0918, 0x091F, Kind::kRead},      {0x0920, 0x092B, Kind::kReadWrite},
    {0x092C, 0x092F, Kind::kRead},      {0x0930, 0x0931, Kind::kReadWrite}, {0x0932, 0x0933, Kind::kRead},
    {0x0934, 0x0935, Kind::kReadWrite}, {0x0980, 0x0981, Kind::kReadWrite}, {0x0982, 0x0984, Kind::kRead},
    {0x098E, 0x098F, Kind::kRead},      {0x0990, 0x0997, Kind::kReadWrite}, {0x0998, 0x099F, Kind::kRead},
    {0x09A0, 0x09A9, Kind::kReadWrite}, {0x09AE, 0x09AF, Kind::kRead},      {0x09B0, 0x09CF, Kind::kRead},
};

template <std::size_t N>
const Range* Find(const Range (&ranges)[N], std::uint16_t address) {
  const auto* found = std::find_if(std::begin(ranges), std::end(ranges),
                                   [address](const Range& r) { return address >= r.first && address <= r.last; });
  return found == std::end(ranges) ? nullptr : found;
}

// Upper halves of 64-bit clock registers, which 32-bit clocks do not have.
bool UpperClockHalf(std::uint16_t address) {
  constexpr std::uint16_t kUpper[] = {0x0914, 0x091C, 0x0924, 0x0994, 0x099C};
  return std::any_of(std::begin(kUpper), std::end(kUpper),
                     [address](std::uint16_t upper) { return address >= upper && address < upper + 4; });
}

constexpr std::uint16_t kEventDlStatus = 0x0004;
constexpr std::uint16_t kEventAlStatus = 0x0008;
constexpr std::uint16_t kEepromBusy = 0x8000;
constexpr std::uint16_t kEepromCommandMask = 0x0700;
constexpr std::uint16_t kLinkOfPort1 = 0x0020;  // DL status

void Merge(std::span<std::uint8_t> out, std::size_t at, std::uint8_t value, bool combine) {
  out[at] = static_cast<std::uint8_t>(combine ? out[at] | value : value);
}

}  // namespace

Esc::Esc(EscDescription description, TimeNs power_on)
    : description_(std::move(description)),
      memory_(0x10000, 0),
      clock_(description_.clock_ppb, description_.clock_at_power_on, power_on) {
  std::copy(description_.information.begin(), description_.information.end(), memory_.begin());
  SetWord(reg::kAlias, LoadLe<std::uint16_t>(description_.eeprom, 8));
  SetByte(reg::kDlControl, 0x01);
  SetByte(reg::kDlControl + 2, 0x07);
  SetWord(reg::kDlStatus, 0x5503);  // everything closed until links come up
  SetWord(reg::kAlControl, 1);
  SetWord(reg::kAlStatus, 1);
  SetWord(reg::kPdiControl, LoadLe<std::uint16_t>(description_.eeprom, 0));
  SetWord(reg::kWatchdogDivider, 2498);
  SetWord(reg::kWatchdogPdi, 1000);
  SetWord(reg::kWatchdogProcessData, 1000);
  SetWord(reg::kWatchdogStatus, 1);
  SetWord(reg::kSpeedCounterStart, 0x1000);
  SetByte(reg::kFilterDepth, 4);
  SetByte(reg::kFilterDepth + 1, 12);
}

// ---------------------------------------------------------------------------------------------- what exists

bool Esc::Implemented(std::uint16_t address) const {
  const std::uint16_t features = Word(8);
  if (address >= 0x1000) return address < 0x1000 + memory_[6] * 1024;
  if (address >= reg::kFmmu && address < 0x0700) return address < reg::kFmmu + 16 * memory_[4];
  if (address >= reg::kSyncManager && address < 0x0880) return address < reg::kSyncManager + 8 * memory_[5];
  if (address >= 0x0900 && address < 0x0A00) {
    if ((features & 0x0004U) == 0) return false;
    if (address < 0x0910) return true;
    if (description_.receive_times_only) return false;
    if ((features & 0x0008U) == 0 && UpperClockHalf(address)) return false;
    return Find(kClockRegisters, address) != nullptr;
  }
  return Find(kRegisters, address) != nullptr;
}

bool Esc::Readable(std::uint16_t address) const {
  return Implemented(address);
}

bool Esc::Writable(std::uint16_t address) const {
  if (!Implemented(address)) return false;
  if (address >= 0x1000 || (address >= reg::kFmmu && address < 0x0700)) return true;
  if (address >= reg::kSyncManager && address < 0x0880) return address % 8 != 5 && address % 8 != 7;
  if (address >= 0x0900 && address < 0x0910) return address < 0x0904;
  if (const Range* clock = Find(kClockRegisters, address)) return clock->kind == Kind::kReadWrite;
  if (address == reg::kAlControl || address == reg::kAlControl + 1) return !al_control_written_;
  if (address >= reg::kEepromControl && address < 0x0510) return (memory_[reg::kEepromConfig] & 0x01U) == 0;
  const Range* range = Find(kRegisters, address);
  return range != nullptr && range->kind == Kind::kReadWrite;
}

SyncManagerSettings Esc::sync_manager(int n) const {
  const std::uint16_t at = Sm(n);
  return {Word(at), Word(static_cast<std::uint16_t>(at + 2)), memory_[at + 4U],
          (memory_[at + 6U] & 0x01U) != 0 && (memory_[at + 7U] & 0x01U) == 0};
}

// Length 1 has no buffer: accesses pass through (esc-reference 6.2).
int Esc::SyncManagerAt(std::uint16_t address) const {
  for (int n = 0; n < sync_manager_count(); ++n) {
    const std::uint16_t at = Sm(n);
    const bool active = (memory_[at + 6U] & 0x01U) != 0;
    const std::uint16_t start = Word(at);
    const std::uint16_t length = Word(static_cast<std::uint16_t>(at + 2));
    if (active && length > 1 && address >= start && address < start + length) return n;
  }
  return -1;
}

// ---------------------------------------------------------------------------------------------- reading

void Esc::Refresh(TimeNs now) {
  std::uint16_t control = Word(reg::kEepromControl);
  if ((control & kEepromBusy) != 0 && now >= eeprom_done_) {
    control = static_cast<std::uint16_t>(control & ~(kEepromBusy | kEepromCommandMask | 0x0001U));
    const std::size_t size = description_.eeprom_emulated ? 4 : 8;
    const std::size_t byte = std::size_t{LoadLe<std::uint32_t>(memory_, reg::kEepromAddress)} * 2;
    for (std::size_t i = 0; i < size; ++i) {
      memory_[reg::kEepromData + i] = byte + i < description_.eeprom.size() ? description_.eeprom[byte + i] : 0xFF;
    }
  }
  control |= static_cast<std::uint16_t>(description_.eeprom_emulated ? 0x0020U : 0x0040U);
  SetWord(reg::kEepromControl, control);

  const std::uint32_t delay = LoadLe<std::uint32_t>(memory_, reg::kTimeDelay);
  StoreLe(memory_, reg::kSystemTime, static_cast<std::uint64_t>(SystemTime(now) - delay));
  StoreLe(memory_, reg::kTimeDifference, clock_.DifferenceRegister());

  for (int n = 0; n < sync_manager_count(); ++n) {
    const SyncManagerSettings sm = sync_manager(n);
    const SmState& state = sm_state_.at(Index(n));
    std::uint8_t status = static_cast<std::uint8_t>(state.buffer << 4U);
    if (sm.enabled && sm.mailbox() && state.full) status = static_cast<std::uint8_t>(status | 0x09U);
    SetByte(static_cast<std::uint16_t>(Sm(n) + 5), status);
  }
}

bool Esc::ReadSyncManager(int n, std::size_t first, std::span<std::uint8_t> out, bool combine, TimeNs now) {
  const SyncManagerSettings sm = sync_manager(n);
  SmState& state = sm_state_.at(Index(n));
  if (!sm.enabled || sm.master_writes()) return false;
  if (sm.mailbox()) {
    if (!state.full || (first != 0 && !state.open)) return false;
    state.open = true;
  } else if (!state.inputs_valid) {
    return false;
  }
  for (std::size_t i = 0; i < out.size(); ++i) Merge(out, i, memory_[sm.start + first + i], combine);
  if (sm.mailbox() && first + out.size() == sm.length) {
    state.full = false;
    state.open = false;
    state.emptied = now;
  }
  return true;
}

bool Esc::Read(std::uint16_t address, std::span<std::uint8_t> out, bool combine, const Passage& passage) {
  bool any = false;
  for (std::size_t i = 0; i < out.size() && address + i <= 0xFFFF;) {
    const auto at = static_cast<std::uint16_t>(address + i);
    if (const int n = SyncManagerAt(at); n >= 0) {
      const SyncManagerSettings sm = sync_manager(n);
      const std::size_t first = at - sm.start;
      const std::size_t count = std::min<std::size_t>(out.size() - i, sm.length - first);
      any |= ReadSyncManager(n, first, out.subspan(i, count), combine, passage.arrival);
      i += count;
      continue;
    }
    if (Readable(at)) {
      Merge(out, i, memory_[at], combine);
      any = true;
    }
    ++i;
  }
  const auto last = static_cast<std::size_t>(address) + out.size();
  const auto covers = [&](std::uint16_t at) { return at >= address && at < last; };
  std::uint16_t events = Word(reg::kEventRequest);
  if (covers(reg::kDlStatus)) events = static_cast<std::uint16_t>(events & ~kEventDlStatus);
  if (covers(reg::kAlStatus)) events = static_cast<std::uint16_t>(events & ~kEventAlStatus);
  SetWord(reg::kEventRequest, events);
  return any;
}

// ---------------------------------------------------------------------------------------------- writing

bool Esc::WriteSyncManager(int n, std::size_t first, ByteView data, ByteView mask, TimeNs now) {
  const SyncManagerSettings sm = sync_manager(n);
  SmState& state = sm_state_.at(Index(n));
  if (!sm.enabled || !sm.master_writes()) return false;
  if (sm.mailbox()) {
    if (state.full || (first != 0 && !state.open)) return false;
    state.open = true;
  }
  for (std::size_t i = 0; i < data.size(); ++i) {
    const std::uint8_t keep = memory_[sm.start + first + i];
    memory_[sm.start + first + i] = static_cast<std::uint8_t>((keep & ~mask[i]) | (data[i] & mask[i]));
  }
  if (first + data.size() == sm.length) {
    if (sm.mailbox()) {
      state.full = true;
      state.open = false;
      state.filled = now;
    }
    state.written = now;
    state.buffer = static_cast<std::uint8_t>(state.buffer == 3 ? 0 : (state.buffer + 1) % 3);
    state.committed.assign(memory_.begin() + sm.start, memory_.begin() + sm.start + sm.length);
  }
  return true;
}

// Start, length and control of a sync manager are writable only while it is disabled; WKC counts nevertheless, since
// the access reaches the register.
bool Esc::WriteRegister(std::uint16_t address, std::uint8_t value, std::uint8_t mask) {
  if (!Writable(address)) return false;
  if (address >= reg::kSyncManager && address < 0x0880 && address % 8 < 5 &&
      (sm_activate_before_.at((address - reg::kSyncManager) / 8U) & 0x01U) != 0) {
    return true;
  }
  memory_[address] = static_cast<std::uint8_t>((memory_[address] & ~mask) | (value & mask));
  return true;
}

bool Esc::Write(std::uint16_t address, ByteView data, ByteView mask, const Passage& passage) {
  for (int n = 0; n < 16; ++n) sm_activate_before_.at(Index(n)) = memory_[Sm(n) + 6U];
  bool any = false;
  std::uint16_t first_register = 0xFFFF;
  std::uint16_t last_register = 0;
  for (std::size_t i = 0; i < data.size() && address + i <= 0xFFFF;) {
    const auto at = static_cast<std::uint16_t>(address + i);
    if (const int n = SyncManagerAt(at); n >= 0) {
      const SyncManagerSettings sm = sync_manager(n);
      const std::size_t first = at - sm.start;
      const std::size_t count = std::min<std::size_t>(data.size() - i, sm.length - first);
      any |= WriteSyncManager(n, first, data.subspan(i, count), mask.subspan(i, count), passage.arrival);
      i += count;
      continue;
    }
    if (mask[i] != 0 && WriteRegister(at, data[i], mask[i])) {
      any = true;
      first_register = std::min(first_register, at);
      last_register = std::max(last_register, at);
    }
    ++i;
  }
  if (first_register <= last_register) AfterWrite(first_register, last_register, passage);
  return any;
}

void Esc::AfterWrite(std::uint16_t first, std::uint16_t last, const Passage& passage) {
  const auto touches = [&](std::uint16_t from, std::uint16_t to) { return first <= to && last >= from; };
  if (touches(reg::kAlControl, reg::kAlControl)) {
    if (description_.device_emulation) {
      SetAlStatus(static_cast<std::uint16_t>(Word(reg::kAlControl) & 0x1FU), 0);
    } else {
      al_control_written_ = passage.arrival;
    }
  }
  if (touches(0x0300, 0x030B)) std::fill(memory_.begin() + 0x0300, memory_.begin() + 0x030C, std::uint8_t{0});
  if (touches(0x030C, 0x030C)) memory_[0x030C] = 0;
  if (touches(0x030D, 0x030D)) memory_[0x030D] = 0;
  if (touches(0x0310, 0x0313)) std::fill(memory_.begin() + 0x0310, memory_.begin() + 0x0314, std::uint8_t{0});
  if (touches(0x0442, 0x0443)) memory_[0x0442] = memory_[0x0443] = 0;
  if (touches(reg::kEepromControl, reg::kEepromControl + 1)) EepromCommand(passage.arrival);
  for (int n = 0; n < sync_manager_count(); ++n) {
    const auto activate = static_cast<std::uint16_t>(Sm(n) + 6);
    if (!touches(activate, activate)) continue;
    const bool before = (sm_activate_before_.at(Index(n)) & 0x01U) != 0;
    const bool after = (memory_[activate] & 0x01U) != 0;
    if (before != after) {
      const TimeNs emptied = sm_state_.at(Index(n)).emptied;
      sm_state_.at(Index(n)) = SmState{};
      sm_state_.at(Index(n)).emptied = emptied;
    }
  }
  if (touches(reg::kReceiveTime, reg::kReceiveTime + 3)) {
    const std::int64_t in = clock_.Local(passage.arrival);
    StoreLe(memory_, reg::kReceiveTime, static_cast<std::uint32_t>(in & 0xFFFFFFFF));
    constexpr TimeNs kPassedBefore = 2'600;
    const bool open = (Word(reg::kDlStatus) & kLinkOfPort1) != 0;
    const std::int64_t back = !open                            ? 0x66666F68
                              : ports_swapped_                 ? clock_.Local(passage.arrival - kPassedBefore)
                              : passage.back > passage.arrival ? clock_.Local(passage.back)
                                                               : 0x66666F68;
    StoreLe(memory_, reg::kReceiveTime + 4, static_cast<std::uint32_t>(back & 0xFFFFFFFF));
    StoreLe(memory_, reg::kReceiveTime + 8, std::uint32_t{0x66666F68});
    StoreLe(memory_, reg::kReceiveTime + 12, std::uint32_t{0x66666F68});
    StoreLe(memory_, reg::kReceiveTimeEpu, static_cast<std::uint64_t>(in));
  }
  if (touches(reg::kSystemTime, reg::kSystemTime + 3)) {
    const std::int64_t own = SystemTime(passage.arrival) - LoadLe<std::uint32_t>(memory_, reg::kTimeDelay);
    clock_.Compare(LoadLe<std::uint32_t>(memory_, reg::kSystemTime), own);
  }
  if (touches(reg::kSpeedCounterStart, reg::kSpeedCounterStart + 1)) clock_.Reset();
}

void Esc::EepromCommand(TimeNs now) {
  const std::uint16_t control = Word(reg::kEepromControl);
  const unsigned command = (control & kEepromCommandMask) >> 8U;
  if (command == 0) {
    SetWord(reg::kEepromControl, 0);
    return;
  }
  if (command == 2 && (control & 0x0001U) != 0) {
    const std::size_t byte = std::size_t{LoadLe<std::uint32_t>(memory_, reg::kEepromAddress)} * 2;
    for (std::size_t i = 0; i < 2 && byte + i < description_.eeprom.size(); ++i) {
      description_.eeprom[byte + i] = memory_[reg::kEepromData + i];
    }
  }
  SetWord(reg::kEepromControl, static_cast<std::uint16_t>(control | kEepromBusy));
  eeprom_done_ = now + (command == 1 ? description_.eeprom_read_time : 3'000'000);
}

std::int64_t Esc::Offset() const {
  const auto raw = LoadLe<std::uint64_t>(memory_, reg::kTimeOffset);
  const bool wide = (Word(8) & 0x0008U) != 0;
  return wide ? static_cast<std::int64_t>(raw) : static_cast<std::int32_t>(raw & 0xFFFFFFFFU);
}

// ---------------------------------------------------------------------------------------------- datagrams

Esc::Fmmu Esc::ReadFmmu(int n) const {
  const std::size_t at = reg::kFmmu + 16U * Index(n);
  Fmmu fmmu;
  const auto length = LoadLe<std::uint16_t>(memory_, at + 4);
  fmmu.logical_bit = std::uint64_t{LoadLe<std::uint32_t>(memory_, at)} * 8 + (memory_[at + 6] & 0x07U);
  const std::uint64_t end = std::uint64_t{LoadLe<std::uint32_t>(memory_, at)} * 8 + std::uint64_t{length} * 8 - 8 +
                            (memory_[at + 7] & 0x07U) + 1;
  fmmu.bits = length != 0 && end > fmmu.logical_bit ? end - fmmu.logical_bit : 0;
  fmmu.physical_bit = std::uint64_t{LoadLe<std::uint16_t>(memory_, at + 8)} * 8 + (memory_[at + 10] & 0x07U);
  fmmu.read = (memory_[at + 11] & 0x01U) != 0;
  fmmu.write = (memory_[at + 11] & 0x02U) != 0;
  fmmu.active = (memory_[at + 12] & 0x01U) != 0 && fmmu.bits != 0;
  return fmmu;
}

void Esc::ProcessLogical(Datagram& d, const Passage& passage) {
  const Bytes received = d.data;
  const std::uint64_t begin = std::uint64_t{d.logical()} * 8;
  const std::uint64_t end = begin + received.size() * 8;
  const auto bit = [](ByteView bytes, std::uint64_t n) { return (bytes[n / 8] >> (n % 8) & 1U) != 0; };
  const auto set = [](Bytes& bytes, std::uint64_t n, bool value) {
    const auto one = static_cast<std::uint8_t>(1U << (n % 8));
    bytes[n / 8] = static_cast<std::uint8_t>(value ? bytes[n / 8] | one : bytes[n / 8] & ~one);
  };
  bool did_read = false;
  bool did_write = false;
  for (int pass = 0; pass < 2; ++pass) {  // what is read is the memory before the write
    const bool reading = pass == 0;
    if (reading ? !CmdReads(d.command) : !CmdWrites(d.command)) continue;
    for (int n = 0; n < memory_[4]; ++n) {
      const Fmmu fmmu = ReadFmmu(n);
      if (!fmmu.active || (reading ? !fmmu.read : !fmmu.write)) continue;
      const std::uint64_t from = std::max(begin, fmmu.logical_bit);
      const std::uint64_t to = std::min(end, fmmu.logical_bit + fmmu.bits);
      if (from >= to) continue;
      const std::uint64_t physical = fmmu.physical_bit + (from - fmmu.logical_bit);
      const std::uint64_t first_byte = physical / 8;
      const std::uint64_t last_byte = (physical + (to - from) - 1) / 8;
      if (last_byte > 0xFFFF) continue;
      Bytes data(last_byte - first_byte + 1, 0);
      const auto address = static_cast<std::uint16_t>(first_byte);
      if (reading) {
        if (!Read(address, data, false, passage)) continue;
        for (std::uint64_t i = 0; i < to - from; ++i) {
          set(d.data, from - begin + i, bit(data, physical - first_byte * 8 + i));
        }
        did_read = true;
      } else {
        Bytes mask(data.size(), 0);
        for (std::uint64_t i = 0; i < to - from; ++i) {
          set(data, physical - first_byte * 8 + i, bit(received, from - begin + i));
          set(mask, physical - first_byte * 8 + i, true);
        }
        did_write |= Write(address, data, mask, passage);
      }
    }
  }
  const bool both = d.command == Cmd::LRW;
  d.wkc = static_cast<std::uint16_t>(d.wkc + (did_read ? 1 : 0) + (did_write ? (both ? 2 : 1) : 0));
}

void Esc::Process(Datagram& d, const Passage& passage) {
  Refresh(passage.arrival);
  d.irq = static_cast<std::uint16_t>(d.irq | (Word(reg::kEventRequest) & Word(reg::kEventMask)));
  if (CmdIsLogical(d.command)) {
    ProcessLogical(d, passage);
    return;
  }
  bool match = false;
  switch (d.command) {
    case Cmd::APRD:
    case Cmd::APWR:
    case Cmd::APRW:
    case Cmd::ARMW:
      match = d.adp == 0;
      break;
    case Cmd::BRD:
    case Cmd::BWR:
    case Cmd::BRW:
      match = true;
      break;
    case Cmd::NOP:
      return;
    default:
      match = d.adp == Word(reg::kStationAddress) ||
              ((memory_[reg::kDlControl + 3] & 0x01U) != 0 && d.adp == Word(reg::kAlias));
  }
  const bool multiple = d.command == Cmd::ARMW || d.command == Cmd::FRMW;
  const bool reads = multiple ? match : match && CmdReads(d.command);
  const bool writes = multiple ? !match : match && CmdWrites(d.command);
  const bool broadcast = d.command == Cmd::BRD || d.command == Cmd::BRW;
  const Bytes received = d.data;
  const bool did_read = reads && Read(d.ado, d.data, broadcast, passage);
  const Bytes mask(received.size(), 0xFF);
  const bool did_write = writes && Write(d.ado, received, mask, passage);
  const int write_count = CmdReads(d.command) && CmdWrites(d.command) && !multiple ? 2 : 1;
  d.wkc = static_cast<std::uint16_t>(d.wkc + (did_read ? 1 : 0) + (did_write ? write_count : 0));
  if (CmdCountsSlaves(d.command)) ++d.adp;
}

// ---------------------------------------------------------------------------------------------- the processor

std::uint16_t Esc::TakeAlControl() {
  al_control_written_.reset();
  return Word(reg::kAlControl);
}

void Esc::SetAlStatus(std::uint16_t status, std::uint16_t code) {
  if (Word(reg::kAlStatus) != status) {
    SetWord(reg::kEventRequest, static_cast<std::uint16_t>(Word(reg::kEventRequest) | kEventAlStatus));
  }
  SetWord(reg::kAlStatus, status);
  SetWord(reg::kAlStatusCode, code);
}

Bytes Esc::TakeMailbox(int n) {
  SmState& state = sm_state_.at(Index(n));
  state.full = false;
  state.filled.reset();
  return state.committed;
}

bool Esc::PutMailbox(int n, ByteView content) {
  const SyncManagerSettings sm = sync_manager(n);
  SmState& state = sm_state_.at(Index(n));
  if (!sm.enabled || !sm.mailbox() || state.full) return false;
  for (std::size_t i = 0; i < sm.length; ++i) memory_[sm.start + i] = i < content.size() ? content[i] : 0;
  state.full = true;
  state.buffer = 0;
  return true;
}

void Esc::PutInputs(int n, ByteView data) {
  const SyncManagerSettings sm = sync_manager(n);
  if (!sm.enabled) return;
  for (std::size_t i = 0; i < sm.length; ++i) memory_[sm.start + i] = i < data.size() ? data[i] : 0;
  SmState& state = sm_state_.at(Index(n));
  state.inputs_valid = true;
  state.buffer = static_cast<std::uint8_t>(state.buffer == 3 ? 0 : (state.buffer + 1) % 3);
}

void Esc::LockSyncManager(int n, bool locked) {
  SetByte(static_cast<std::uint16_t>(Sm(n) + 7), locked ? 1 : 0);
}

bool Esc::RepeatRequested(int n) const {
  return ((memory_[Sm(n) + 6U] ^ memory_[Sm(n) + 7U]) & 0x02U) != 0;
}

void Esc::AcknowledgeRepeat(int n) {
  const std::uint8_t bit = memory_[Sm(n) + 6U] & 0x02U;
  SetByte(static_cast<std::uint16_t>(Sm(n) + 7), static_cast<std::uint8_t>((memory_[Sm(n) + 7U] & ~0x02U) | bit));
}

void Esc::SetLink(int port, bool up) {
  std::uint16_t status = Word(reg::kDlStatus);
  const auto link = static_cast<std::uint16_t>(1U << (4 + port));
  const auto closed = static_cast<std::uint16_t>(1U << (8 + 2 * port));
  const auto communication = static_cast<std::uint16_t>(1U << (9 + 2 * port));
  if (((status & link) != 0) == up) return;
  status = static_cast<std::uint16_t>(up ? (status | link | communication) & ~closed
                                         : (status | closed) & ~(link | communication));
  SetWord(reg::kDlStatus, status);
  SetWord(reg::kEventRequest, static_cast<std::uint16_t>(Word(reg::kEventRequest) | kEventDlStatus));
  if (!up) CountErrors(static_cast<std::uint16_t>(reg::kLostLinks + port), 1);
}

void Esc::CountErrors(std::uint16_t address, int count) {
  SetByte(address, static_cast<std::uint8_t>(std::min(255, memory_[address] + count)));
}

}  // namespace ecaudit::samples
