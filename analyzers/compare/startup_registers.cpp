#include "analyzers/compare/startup_registers.h"

#include <algorithm>

#include "decoder/esc/al.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/esc/register_map.h"
#include "decoder/esc/sync_manager.h"

namespace ecaudit::startup {
namespace {

constexpr std::size_t kSmControl = 4;
constexpr std::size_t kSmActivate = 6;
constexpr std::uint8_t kRepeatRequest = 0x02;

/// First and last address of a range of registers.
struct Range {
  EscAddress first, last;
  [[nodiscard]] constexpr bool holds(EscAddress address) const { return address >= first && address <= last; }
};
constexpr Range kEscInformation{0x0000, 0x000F};
constexpr Range kStation{0x0010, 0x0013};
constexpr Range kDlControl{0x0100, 0x0113};
constexpr Range kErrorCounters{0x0300, 0x0313};
constexpr Range kWatchdogs{0x0400, 0x044F};
constexpr Range kEeprom{0x0500, 0x050F};
constexpr Range kFmmus{0x0600, 0x06FF};
constexpr Range kSyncManagers{0x0800, 0x087F};
constexpr Range kClocks{0x0900, 0x09FF};
constexpr Range kReceiveTimes{0x0900, 0x090F};
constexpr Range kSystemTime{0x0910, 0x0917};

bool IsZero(ByteSpan data) {
  return std::ranges::all_of(data, [](std::uint8_t byte) { return byte == 0; });
}

StartupPhase PhaseOfSyncManager(EscAddress address, ByteSpan data) {
  const std::size_t offset = (address - esc::kSyncManagerBase) % esc::kSyncManagerBytes;
  const std::size_t number = (address - esc::kSyncManagerBase) / esc::kSyncManagerBytes;
  bool mailbox = number < 2;
  if (offset <= kSmControl && data.size() > kSmControl - offset) {
    mailbox = (data[kSmControl - offset] & 0x03U) == static_cast<unsigned>(esc::SmMode::MAILBOX);
    // A cleared sync manager is identified by its number only.
    if (IsZero(data)) mailbox = number < 2;
  }
  return mailbox ? StartupPhase::kMailboxSetup : StartupPhase::kPreopToSafeop;
}

}  // namespace

bool Configures(EscAddress address, ByteSpan data, std::uint8_t state) {
  if (data.empty() || address >= esc::kProcessRam || kErrorCounters.holds(address)) return false;
  if (address == esc::kAlControl) return false;
  if (kEeprom.holds(address)) return address == kEeprom.first && (data[0] & 0x01U) != 0;
  if (kSyncManagers.holds(address) && state >= kPreop) {
    const std::size_t offset = (address - esc::kSyncManagerBase) % esc::kSyncManagerBytes;
    if (offset == kSmActivate && data.size() <= 2 && (address - esc::kSyncManagerBase) / esc::kSyncManagerBytes < 2) {
      return false;
    }
  }
  return true;
}

StartupPhase PhaseOfWrite(EscAddress address, ByteSpan data, std::uint8_t state) {
  const bool below_preop = state <= kInit;
  if (kStation.holds(address)) return StartupPhase::kAddressing;
  if (kEeprom.holds(address)) return StartupPhase::kEeprom;
  if (kClocks.holds(address)) return StartupPhase::kDc;
  if (kWatchdogs.holds(address)) return StartupPhase::kPreopToSafeop;
  if (below_preop && (kFmmus.holds(address) || kSyncManagers.holds(address)) && IsZero(data))
    return StartupPhase::kScan;
  if (kSyncManagers.holds(address)) return PhaseOfSyncManager(address, data);
  if (kFmmus.holds(address)) return below_preop ? StartupPhase::kMailboxSetup : StartupPhase::kPreopToSafeop;
  if (below_preop) return StartupPhase::kScan;
  return state >= kSafeop ? StartupPhase::kSafeopToOp : StartupPhase::kPreopToSafeop;
}

std::optional<StartupPhase> PhaseOfRead(EscAddress address, std::uint8_t state) {
  if (kEeprom.holds(address)) return StartupPhase::kEeprom;
  if (kClocks.holds(address) && state < kSafeop) return StartupPhase::kDc;
  if (state > kInit) return std::nullopt;
  if (kEscInformation.holds(address) || kDlControl.holds(address)) return StartupPhase::kScan;
  if (kStation.holds(address)) return StartupPhase::kAddressing;
  return std::nullopt;
}

bool IsVolatile(EscAddress address, std::size_t length) {
  // 0x0900 latches whatever is written; 0x0910 time, 0x0918 receive time, 0x0920 offset, 0x0928 delay, 0x092C
  // difference; 0x0990 start time.
  const auto within = [&](EscAddress first, EscAddress last) {
    return address >= first && address + length <= static_cast<std::size_t>(last) + 1;
  };
  return within(0x0010, 0x0011) || within(0x0900, 0x092F) || within(0x0990, 0x0997);
}

bool IsWithoutOrder(const StartupKey& key) {
  if (key.kind != StartupKey::Kind::kWrite) return false;
  const auto address = static_cast<EscAddress>(key.address);
  return kReceiveTimes.holds(address) || kSystemTime.holds(address);
}

bool IsMapping(const StartupKey& key) {
  if (key.kind == StartupKey::Kind::kWrite) return key.address >= 0x0600 && key.address < 0x0900;
  if (key.kind != StartupKey::Kind::kDownload) return false;
  const bool assignment = key.address >= 0x1C00 && key.address < 0x1C40;
  return assignment || (key.address >= 0x1600 && key.address < 0x1800) ||
         (key.address >= 0x1A00 && key.address < 0x1C00);
}

bool LogicalStartOnly(const StartupKey& key, ByteSpan a, ByteSpan b) {
  if (key.kind != StartupKey::Kind::kWrite || key.address < 0x0600 || key.address >= 0x0700) return false;
  constexpr std::size_t kLogicalStart = 4;
  return a.size() == b.size() && a.size() > kLogicalStart &&
         std::equal(a.begin() + kLogicalStart, a.end(), b.begin() + kLogicalStart);
}

WantedBytes BytesOf(const ExpectedStep& expected) {
  WantedBytes wanted;
  wanted.address = static_cast<EscAddress>(expected.key.address);
  wanted.any_value = expected.any_value();
  if (expected.data) {
    wanted.data = *expected.data;
    return wanted;
  }
  const esc::Register* reg = esc::FindRegister(wanted.address);
  const std::size_t width = expected.number && reg != nullptr ? std::min<std::size_t>(reg->length, 8) : 1;
  for (std::size_t i = 0; i < width; ++i) {
    wanted.data.push_back(
        static_cast<std::uint8_t>(static_cast<std::uint64_t>(expected.number.value_or(0)) >> 8U * i & 0xFFU));
  }
  return wanted;
}

std::vector<bool> WrittenBy(const StartupStep& actual, const WantedBytes& wanted) {
  std::vector<bool> written(wanted.data.size());
  if (actual.key.kind != StartupKey::Kind::kWrite || actual.data.size() != actual.size) return written;
  for (std::size_t i = 0; i < written.size(); ++i) {
    const std::size_t byte = std::size_t{wanted.address} + i;
    if (byte < actual.key.address || byte - actual.key.address >= actual.data.size()) continue;
    if (!wanted.any_value && actual.data[byte - actual.key.address] != wanted.data[i])
      return std::vector<bool>(written.size());
    written[i] = true;
  }
  return written;
}

bool SameValue(const StartupKey& key, ByteSpan a, ByteSpan b) {
  if (a.size() != b.size()) return false;
  const auto address = static_cast<EscAddress>(key.address);
  if (key.kind != StartupKey::Kind::kWrite || !kSyncManagers.holds(address) || a.size() != esc::kSyncManagerBytes) {
    return std::equal(a.begin(), a.end(), b.begin());
  }
  return std::equal(a.begin(), a.begin() + kSmControl + 1, b.begin()) &&
         ((a[kSmActivate] ^ b[kSmActivate]) & ~static_cast<unsigned>(kRepeatRequest) & 0xFFU) == 0;
}

}  // namespace ecaudit::startup
