#include "analyzers/model/set_up_facts.h"

#include <algorithm>
#include <array>
#include <optional>

#include "decoder/base/bytes.h"
#include "decoder/esc/register_addresses.h"

namespace ecaudit::model {
namespace {

constexpr std::size_t kSettings = 5;  // start, length, control
constexpr std::size_t kActivate = 6;

using Settings = std::array<std::uint8_t, kSettings>;

void Take(esc::SyncManager& to, const Settings& bytes) {
  to.start = LittleEndian<std::uint16_t>(bytes, 0);
  to.length = LittleEndian<std::uint16_t>(bytes, 2);
  to.control = bytes[4];
}

Settings BytesOf(const esc::SyncManager& manager) {
  return {static_cast<std::uint8_t>(manager.start & 0xFFU), static_cast<std::uint8_t>(manager.start >> 8U),
          static_cast<std::uint8_t>(manager.length & 0xFFU), static_cast<std::uint8_t>(manager.length >> 8U),
          manager.control};
}

/// Puts those bytes of `span` (from `address` on) that lie in the settings at `at` into `bytes`.
/// @return how many
std::size_t Merge(Settings& bytes, ByteSpan span, EscAddress address, EscAddress at) {
  std::size_t merged = 0;
  for (std::size_t i = 0; i < kSettings; ++i) {
    if (!track::CoversByte(address, span.size(), static_cast<EscAddress>(at + i))) continue;
    bytes[i] = span[at + i - address];
    ++merged;
  }
  return merged;
}

bool Overlaps(const track::SlaveAccess& access, EscAddress at, std::size_t bytes) {
  return access.address < at + bytes && access.address + access.length() > at;
}

}  // namespace

void SetUpFacts::Begin(const track::SlaveState& state) {
  for (std::size_t n = 0; n < kManagers; ++n) {
    const auto settings = state.sync_manager(n, Certainty::kInferred);
    if (!settings) continue;
    managers_[n] = {*settings, true, true, state.sync_manager_since[n]};
  }
}

void SetUpFacts::On(const track::SlaveAccess& access) {
  if (access.address <= esc::kEepromConfiguration && access.done()) {
    if (!access.Covered(access.written, esc::kEepromConfiguration, 1).empty()) {
      eeprom_owner_since_ = access.frame().number;
    }
  }
  if (Overlaps(access, esc::kProcessWatchdog, 2)) OnWatchdog(access);
  if (!Overlaps(access, esc::kSyncManagerBase, kManagers * esc::kSyncManagerBytes)) return;
  for (std::size_t n = 0; n < kManagers; ++n) OnManager(n, access);
}

void SetUpFacts::OnWatchdog(const track::SlaveAccess& access) {
  if (!access.done()) {
    if (access.acceptance != track::Acceptance::kUnknown || access.written.empty()) return;
    watchdog_.reset();
    watchdog_changed_ = access.frame().number;
    return;
  }
  if (const ByteSpan read = access.Covered(access.read, esc::kProcessWatchdog, 2); !read.empty() && !access.broadcast) {
    watchdog_ = LittleEndian<std::uint16_t>(read, 0);
  }
  if (access.written.empty()) return;
  const ByteSpan written = access.Covered(access.written, esc::kProcessWatchdog, 2);
  const auto time = written.empty() ? std::nullopt : std::optional(LittleEndian<std::uint16_t>(written, 0));
  if (!time || time != watchdog_) watchdog_changed_ = access.frame().number;
  watchdog_ = time;
}

const SetUpFacts::IgnoredWrite* SetUpFacts::ignored(std::size_t n) const {
  const auto found = std::find_if(ignored_.begin(), ignored_.end(), [n](const auto& one) { return one.manager == n; });
  return found == ignored_.end() ? nullptr : &*found;
}

void SetUpFacts::ForgetIgnored(std::size_t n) {
  std::erase_if(ignored_, [n](const IgnoredWrite& one) { return one.manager == n; });
}

void SetUpFacts::OnManager(std::size_t n, const track::SlaveAccess& access) {
  Manager& manager = managers_[n];
  const EscAddress at = esc::SyncManagerAddress(n);
  const auto activate_at = static_cast<EscAddress>(at + kActivate);
  if (!Overlaps(access, at, esc::kSyncManagerBytes)) return;
  if (!access.done()) {
    // Nothing is certain after a write that the slave took or not.
    if (access.acceptance == track::Acceptance::kUnknown && !access.written.empty()) {
      manager = {};
      manager.changed = access.frame().number;
      ForgetIgnored(n);
    }
    return;
  }
  if (!access.broadcast && !access.read.empty()) OnSettingsRead(n, access);
  if (access.written.empty()) return;
  // The old enable bit counts: all registers of a datagram are written at once, when the frame has passed.
  OnSettingsWritten(n, access);
  if (const ByteSpan written = access.Covered(access.written, activate_at, 1); !written.empty()) {
    const bool enabled = manager.enable_known && manager.settings.enabled();
    manager.settings.activate = written[0];
    if (!manager.enable_known || enabled != manager.settings.enabled()) manager.changed = access.frame().number;
    manager.enable_known = true;
  }
}

void SetUpFacts::OnSettingsRead(std::size_t n, const track::SlaveAccess& access) {
  Manager& manager = managers_[n];
  const EscAddress at = esc::SyncManagerAddress(n);
  Settings bytes = BytesOf(manager.settings);
  const std::size_t merged = Merge(bytes, access.read, access.address, at);
  if (merged == kSettings || (merged > 0 && manager.settings_known)) {
    const auto own = std::find_if(ignored_.begin(), ignored_.end(), [n](const auto& one) { return one.manager == n; });
    if (own != ignored_.end()) {
      if (bytes == BytesOf(own->kept) && merged == kSettings) {
        own->shown = access.frame().number;
      } else if (bytes != BytesOf(own->kept)) {
        ignored_.erase(own);  // the slave took what was written, or some of it
      }
    }
    Take(manager.settings, bytes);
    manager.settings_known = true;
  }
  const ByteSpan read = access.Covered(access.read, static_cast<EscAddress>(at + kActivate), 1);
  if (read.empty()) return;
  manager.settings.activate = read[0];
  manager.enable_known = true;
}

void SetUpFacts::OnSettingsWritten(std::size_t n, const track::SlaveAccess& access) {
  Manager& manager = managers_[n];
  const Settings before = BytesOf(manager.settings);
  Settings wanted = before;
  const std::size_t merged = Merge(wanted, access.written, access.address, esc::SyncManagerAddress(n));
  if (merged == 0) return;
  const bool same = manager.settings_known && wanted == before;
  if (!same) manager.changed = access.frame().number;
  if (!manager.enable_known) {
    manager.settings_known = same;  // it may be enabled, and ignore it
    return;
  }
  if (!manager.settings.enabled()) {
    ForgetIgnored(n);
    if (!manager.settings_known && merged < kSettings) return;
    Take(manager.settings, wanted);
    manager.settings_known = true;
    return;
  }
  if (!manager.settings_known) return;
  // What is left of an earlier write that it ignored is the master's wish, too.
  if (const IgnoredWrite* own = ignored(n); own != nullptr && merged < kSettings) {
    wanted = BytesOf(own->written);
    (void)Merge(wanted, access.written, access.address, esc::SyncManagerAddress(n));
  }
  ForgetIgnored(n);
  if (wanted == before) return;
  IgnoredWrite ignored{n, access.frame().number, manager.settings, manager.settings, 0};
  Take(ignored.written, wanted);
  ignored_.push_back(ignored);
}

void SetUpFacts::Forget() {
  managers_ = {};
  ignored_.clear();
  eeprom_owner_since_ = 0;
  watchdog_changed_ = 0;
  watchdog_.reset();
}

}  // namespace ecaudit::model
