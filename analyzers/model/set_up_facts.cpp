#include "analyzers/model/set_up_facts.h"

#include <algorithm>

#include "decoder/base/bytes.h"
#include "decoder/esc/register_addresses.h"

namespace ecaudit::model {
namespace {

constexpr std::size_t kSettings = 5;  // start, length, control
constexpr std::size_t kActivate = 6;

esc::SyncManager SettingsFrom(ByteSpan bytes) {
  esc::SyncManager settings;
  settings.start = LittleEndian<std::uint16_t>(bytes, 0);
  settings.length = LittleEndian<std::uint16_t>(bytes, 2);
  settings.control = bytes[4];
  return settings;
}

bool SameSettings(const esc::SyncManager& a, const esc::SyncManager& b) {
  return a.start == b.start && a.length == b.length && a.control == b.control;
}

void Take(esc::SyncManager& to, const esc::SyncManager& from) {
  to.start = from.start;
  to.length = from.length;
  to.control = from.control;
}

}  // namespace

void SetUpFacts::On(const track::SlaveAccess& access) {
  if (access.address <= esc::kEepromConfiguration && access.done()) {
    if (!access.Covered(access.written, esc::kEepromConfiguration, 1).empty()) {
      eeprom_owner_since_ = access.frame().number;
    }
  }
  constexpr auto kEnd = esc::SyncManagerAddress(kManagers);
  if (access.address >= kEnd || access.address + access.length() <= esc::kSyncManagerBase) return;
  for (std::size_t n = 0; n < kManagers; ++n) OnManager(n, access);
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
  if (access.address >= at + esc::kSyncManagerBytes || access.address + access.length() <= at) return;
  if (!access.done()) {
    // Nothing is certain after a write that the slave took or not.
    if (access.acceptance == track::Acceptance::kUnknown && !access.written.empty()) {
      manager = {};
      ForgetIgnored(n);
    }
    return;
  }
  if (!access.broadcast) {
    if (const ByteSpan read = access.Covered(access.read, at, kSettings); !read.empty()) {
      const esc::SyncManager shown = SettingsFrom(read);
      if (const IgnoredWrite* own = ignored(n); own != nullptr && SameSettings(shown, own->written)) ForgetIgnored(n);
      Take(manager.settings, shown);
      manager.settings_known = true;
    }
    if (const ByteSpan read = access.Covered(access.read, activate_at, 1); !read.empty()) {
      manager.settings.activate = read[0];
      manager.enable_known = true;
    }
  }
  if (access.written.empty()) return;
  // The old enable bit counts: all registers of a datagram are written at once, when the frame has passed.
  if (const ByteSpan written = access.Covered(access.written, at, kSettings); !written.empty()) {
    const esc::SyncManager wanted = SettingsFrom(written);
    const bool ignores = manager.settings_known && manager.enable_known && manager.settings.enabled();
    ForgetIgnored(n);
    if (ignores && !SameSettings(wanted, manager.settings)) {
      ignored_.push_back({n, access.frame().number, manager.settings, wanted});
    } else {
      Take(manager.settings, wanted);
      manager.settings_known = true;
    }
  }
  if (const ByteSpan written = access.Covered(access.written, activate_at, 1); !written.empty()) {
    manager.settings.activate = written[0];
    manager.enable_known = true;
  }
}

void SetUpFacts::Forget() {
  managers_ = {};
  ignored_.clear();
  eeprom_owner_since_ = 0;
}

}  // namespace ecaudit::model
