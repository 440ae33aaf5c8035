/// in: SlaveAccess.  out: one SlaveState a slave.
///
/// keeps: what each ESC is known to hold, what broadcasts left in slaves that are met later, and what the slaves may
/// keep together.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "decoder/base/allowance.h"
#include "decoder/track/access.h"
#include "decoder/track/events.h"
#include "decoder/track/mapping_cache.h"
#include "decoder/track/recent_accesses.h"
#include "decoder/track/slave_state.h"
#include "decoder/track/slave_work.h"

namespace ecaudit::track {

class SlaveStates {
 public:
  /// @param mappings receives each change of a sync manager or FMMU
  explicit SlaveStates(MappingCache& mappings) : mappings_(mappings) {}

  [[nodiscard]] std::size_t size() const { return by_id_.size(); }
  [[nodiscard]] const SlaveState& operator[](SlaveId id) const { return *by_id_[id]; }
  [[nodiscard]] SlaveState& operator[](SlaveId id) { return *by_id_[id]; }
  /// Cost so far of handing something to every slave.
  [[nodiscard]] SlaveWork& work() { return work_; }
  [[nodiscard]] const SlaveWork& work() const { return work_; }
  /// Changes with any AL state, and with each new slave.
  [[nodiscard]] std::uint64_t al_version() const { return al_version_; }

  /// One more slave, after the others: it took the broadcasts so far.
  void Add();
  /// What one slave read or took of an access to its registers.
  void Learn(const SlaveAccess& access);
  /// What a broadcast wrote, for slaves that are met later.
  void LearnForLater(const SlaveAccess& access);
  /// It is unknown whether the slave takes, or has taken, what the access writes to its registers.
  void Doubt(const SlaveAccess& access);
  /// Slaves that are met later map nothing so far: all of them took what clears their FMMUs, or were asked for INIT and
  /// nothing that all took has set one since.
  [[nodiscard]] bool LaterMapNothing() const;
  /// Slaves that are met later may not have been there.
  void ForgetForLater() {
    everyone_ = SlaveState();
    requested_.reset();
  }
  /// The AL state that a broadcast asked all slaves for last, also those that are not met yet.
  void RequestedForLater(const AlRequest& request) { requested_ = request; }
  [[nodiscard]] const std::optional<AlRequest>& requested_for_later() const { return requested_; }
  // A slave may have been switched off, or set up again. In three steps, because events published between them see the
  // others.
  /// @param device_stays  what its controller is and can do (0x0000 to 0x000F) is as it was
  void ForgetRegisters(SlaveId id, bool device_stays);
  void ForgetMapping(SlaveId id);
  /// @return false: the AL state was not known anyway
  bool ForgetAl(SlaveId id, FrameNo frame);

  void SetAlStatus(SlaveId id, esc::AlWord status, FrameNo frame);

 private:
  [[nodiscard]] static Certainty CertaintyOfWrite(const SlaveAccess& access);
  void Store(SlaveState& state, const SlaveAccess& access, ByteSpan bytes, Certainty certainty);
  void NoteExtent(SlaveState& state, const SlaveAccess& access);
  void MappingTouched(SlaveState& state, const SlaveAccess& access, std::size_t length);

  // What a capture could make thousands of slaves keep.
  static constexpr std::size_t kEepromPages = 8192;
  static constexpr std::size_t kRegisterPages = 16'384;

  MappingCache& mappings_;
  Allowance eeprom_pages_{kEepromPages};
  Allowance register_pages_{kRegisterPages};
  std::deque<SlaveState> states_;   // grows without moving what rules refer to
  std::vector<SlaveState*> by_id_;  // the same: found without the deque's arithmetic, for every access
  SlaveState everyone_;             // what broadcasts wrote: a slave met later has taken it, too
  std::optional<AlRequest> requested_;
  RecentAccesses recent_;
  SlaveWork work_;
  std::uint64_t al_version_ = 1;
};

}  // namespace ecaudit::track
