/// in: accesses to one slave.  out: what the master did while it set the slave up that the registers do not show.
///
/// An ESC takes start, length and control of a sync manager only while it is switched off: a write to an enabled one
/// counts in the working counter and changes nothing. Source: esc-reference 6.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "decoder/esc/sync_manager.h"
#include "decoder/track/access.h"
#include "decoder/track/slave_state.h"

namespace ecaudit::model {

class SetUpFacts {
 public:
  /// Sync managers 0 to 3: mailboxes and process data.
  static constexpr std::size_t kManagers = 4;

  /// A write to an enabled sync manager, which an ESC ignores. Slave controllers that are programmed may not: only
  /// settings that are read afterwards show which ones apply.
  struct IgnoredWrite {
    std::size_t manager = 0;
    FrameNo frame = 0;
    esc::SyncManager kept;     ///< start, length and control of before
    esc::SyncManager written;  ///< those that the ESC ignored
    FrameNo shown = 0;         ///< the frame that showed those of before again; 0: none did
  };

  /// The slave is met: what broadcasts wrote before.
  void Begin(const track::SlaveState& state);
  void On(const track::SlaveAccess& access);
  /// Another device, or the capture may miss accesses.
  void Forget();

  /// The last write to sync manager `n` that an ESC ignores, unless it took another one since.
  /// Null: there is none.
  [[nodiscard]] const IgnoredWrite* ignored(std::size_t n) const;
  /// The frame that last set who may use the EEPROM (0x0500 bit 0); 0: none did.
  [[nodiscard]] FrameNo eeprom_owner_since() const { return eeprom_owner_since_; }
  /// The last frame that wrote another start, length, control or enable bit to sync manager `n`, or one while these
  /// were unknown; 0: none did.
  [[nodiscard]] FrameNo manager_changed(std::size_t n) const { return managers_[n].changed; }
  /// The same for the process data watchdog time (0x0420).
  [[nodiscard]] FrameNo watchdog_changed() const { return watchdog_changed_; }

 private:
  struct Manager {
    esc::SyncManager settings;    ///< as the ESC uses them
    bool settings_known = false;  ///< start, length, control
    bool enable_known = false;
    FrameNo changed = 0;
  };
  void OnManager(std::size_t n, const track::SlaveAccess& access);
  void OnSettingsRead(std::size_t n, const track::SlaveAccess& access);
  void OnSettingsWritten(std::size_t n, const track::SlaveAccess& access);
  void OnWatchdog(const track::SlaveAccess& access);
  void ForgetIgnored(std::size_t n);

  std::array<Manager, kManagers> managers_;
  std::vector<IgnoredWrite> ignored_;  // one of a manager at most; few slaves have any
  FrameNo eeprom_owner_since_ = 0;
  FrameNo watchdog_changed_ = 0;
  std::optional<std::uint16_t> watchdog_;
};

}  // namespace ecaudit::model
