#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_manager_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/track/access.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::sm_changed_while_active {
namespace {

constexpr RuleInfo kInfo{.id = "sm-changed-while-active",
                         .group = "Sync managers and FMMUs",
                         .severity = Severity::kError,
                         .subject = Subject::kSlave,
                         .title = "A sync manager is given other settings in a state that uses it",
                         .needs = "the settings before and after, and the AL state of the slave",
                         .source = "ESC-1, sync manager; ETG1000.6, sync managers",
                         .doc = R"(
## What it checks
Whether an enabled sync manager is given another start, length, control byte, or is switched off, while the slave is in
a state that uses it: mailboxes in PREOP, SAFEOP and OP, process data in SAFEOP and OP.

## Why it matters
While a sync manager is enabled the ESC ignores its start, length and control byte, so the master works with settings
that are not in force. Switched off and on again they are, and the slave checks them anew: it falls to SAFEOP, PREOP or
INIT with 0x0016, 0x001D or 0x001E.

## How it is decided
Only where the slave is known to be in that state with no request under way, and both settings are known. Writing the
same values again, the repeat bit of a mailbox and broadcasts (masters blank everything when they scan) do not count.
Switching off alone counts only when the slave then changes its state by itself, or when it is left in OP so for longer
than 100 ms, its process data standing still: masters switch sync managers off before they request a lower state.

## Example
samples/captures/sm-changed-in-op.pcapng

## What to do
Go to INIT before the mailboxes, and to PREOP before the process data are configured anew.
)"};

class SmChangedWhileActive final : public Rule {
 public:
  SmChangedWhileActive() : Rule(kInfo) {
    Subscribe<track::SlaveAccess>(&SmChangedWhileActive::On,
                             MemoryRange::Of(esc::kSyncManagerBase, esc::kMaxSyncManagers * esc::kSyncManagerBytes));
    Subscribe<track::AlRequest>(&SmChangedWhileActive::On);
    Subscribe<model::AlChangedByItself>(&SmChangedWhileActive::On);
  }

  void On(const track::SlaveAccess& e) {
    const std::size_t length = std::max(e.written.size(), e.read.size());
    if (length == 0) return;
    Slave& slave = slaves_[e.slave];
    const track::SlaveState& state = context().network().state(e.slave);
    for (std::size_t n = 0; n < esc::kMaxSyncManagers; ++n) {
      const EscAddress at = esc::SyncManagerAddress(n);
      if (e.address >= at + esc::kSyncManagerBytes || e.address + length <= at) continue;
      const auto now = SyncManagerOf(state, n);
      if (n >= slave.size()) {
        if (!now) continue;
        slave.resize(n + 1);
      }
      Sync& sync = slave[n];
      if (now && !e.written.empty() && !e.broadcast && e.done()) Judge(e, n, sync, *now);
      // What was in force stays the yardstick while it is switched off for a change.
      if (!sync.off) sync.in_force = now;
    }
  }

  /// Whatever is requested, sync managers may be switched off for it; lower states may be configured anew.
  void On(const track::AlRequest& e) {
    const auto found = slaves_.find(e.slave);
    if (found != slaves_.end()) TellStandstill(e.slave, found->second, e.frame());
    slaves_[e.slave] = Current(e.slave);
  }

  void On(const model::AlChangedByItself& e) {
    const auto found = slaves_.find(e.slave);
    if (found == slaves_.end()) return;
    for (std::size_t n = 0; n < found->second.size(); ++n) {
      Sync& sync = found->second[n];
      FindingIndex cause = sync.reported;
      if (sync.off && sync.in_force) {
        const KnownSyncManager now = Off(sync);
        cause = Tell(e.slave, n, *sync.in_force, now, *sync.off, "The slave then changes its state by itself. ");
      }
      if (cause == kNoFinding) continue;
      for (Finding& finding : context().store.findings()) {
        const bool this_change = finding.rule == "al-unexpected-change" && finding.slave == e.slave &&
                                 finding.last.number == e.frame.number && finding.caused_by == kNoFinding;
        if (this_change) finding.caused_by = cause;
      }
      break;
    }
    found->second = Current(e.slave);
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    for (auto& [id, slave] : slaves_) TellStandstill(id, slave, context().statistics().last);
  }

 private:
  struct SwitchedOff {
    FrameRef frame;
    esc::AlState state = esc::AlState::OP;
  };
  struct Sync {
    std::optional<KnownSyncManager> in_force;
    std::unique_ptr<SwitchedOff> off;  ///< since then, in a state that uses it; there hardly ever is one
    FindingIndex reported = kNoFinding;
  };
  using Slave = std::vector<Sync>;  ///< up to the last one that is known

  [[nodiscard]] Slave Current(SlaveId id) const {
    Slave slave;
    const track::SlaveState& state = context().network().state(id);
    for (std::size_t n = 0; n < esc::kMaxSyncManagers; ++n) {
      const auto now = SyncManagerOf(state, n);
      if (!now) continue;
      slave.resize(n + 1);
      slave[n].in_force = now;
    }
    return slave;
  }

  /// The state of the slave if it uses a sync manager with these settings.
  [[nodiscard]] std::optional<esc::AlState> StateThatUses(SlaveId slave, std::size_t n,
                                                          const esc::SyncManager& settings) const {
    const model::AlMachine& al = context().slave(slave).al;
    for (const esc::AlState state : {esc::AlState::SAFEOP, esc::AlState::OP, esc::AlState::PREOP}) {
      if (state == esc::AlState::PREOP && !IsMailbox(n, settings)) continue;
      if (al.SettledIn(state)) return state;
    }
    return std::nullopt;
  }

  /// Process data may go through a single buffer as well; mailboxes are the first two.
  static bool IsMailbox(std::size_t n, const esc::SyncManager& settings) { return n < 2 && settings.mailbox(); }

  static bool Same(const esc::SyncManager& a, const esc::SyncManager& b) {
    constexpr std::uint8_t kDefinedBits = 0x7F;  // of the control byte
    return a.start == b.start && a.length == b.length && ((a.control ^ b.control) & kDefinedBits) == 0;
  }

  void Judge(const track::SlaveAccess& e, std::size_t n, Sync& sync, const KnownSyncManager& now) {
    if (!sync.in_force) return;
    const esc::SyncManager& before = sync.in_force->settings;
    if (!before.enabled() || before.length == 0) return;
    const auto state = StateThatUses(e.slave, n, before);
    if (!state) {
      sync.off.reset();
      if (context().slave(e.slave).al.possible().empty() && !Same(before, now.settings)) {
        NotEvaluable(e.slave, "the state of the slave is not known where a sync manager is changed", e.frame().number);
      }
      return;
    }
    if (!now.settings.enabled()) {
      if (!sync.off) sync.off = std::make_unique<SwitchedOff>(SwitchedOff{e.frame(), *state});
      return;
    }
    sync.off.reset();
    if (Same(before, now.settings)) return;
    sync.reported = Tell(e.slave, n, *sync.in_force, now, {e.frame(), *state},
                         "An ESC ignores the values while the sync manager is enabled; where it was switched off "
                         "first, the slave checks them anew and may leave its state. ");
  }

  static KnownSyncManager Off(const Sync& sync) {
    KnownSyncManager now = *sync.in_force;
    now.settings.activate = static_cast<std::uint8_t>(now.settings.activate & ~1U);
    now.since = sync.off->frame.number;
    return now;
  }

  /// A slave that nobody takes out of OP although its process data were switched off.
  void TellStandstill(SlaveId id, Slave& slave, const FrameRef& now) {
    constexpr TimeNs kLeftSo = 100'000'000;
    for (std::size_t n = 0; n < slave.size(); ++n) {
      Sync& sync = slave[n];
      if (!sync.off || !sync.in_force || IsMailbox(n, sync.in_force->settings)) continue;
      const FrameRef& off = sync.off->frame;
      if (sync.off->state != esc::AlState::OP || !off.has_time || !now.has_time) continue;
      if (Elapsed(off.time, now.time) < kLeftSo) continue;
      sync.reported = Tell(id, n, *sync.in_force, Off(sync), *sync.off,
                           "The slave is left in OP, and these process data stand still from then on. ");
      sync.off.reset();
    }
  }

  FindingIndex Tell(SlaveId slave, std::size_t n, const KnownSyncManager& before, const KnownSyncManager& now,
                    const SwitchedOff& change, std::string_view what_follows) {
    const FrameRef& frame = change.frame;
    const std::uint64_t key = KeyOfBoth(SettingsKey(n, before.settings), SettingsKey(n, now.settings));
    if (const FindingIndex index = Repeat(slave, key, frame); index != kNoFinding) return index;
    const std::string name = "SM" + std::to_string(n);
    const std::string in = esc::StateName(static_cast<std::uint8_t>(change.state));
    const bool off = !now.settings.enabled();
    Finding finding;
    finding.slave = slave;
    finding.first = frame;
    finding.title = name + (off ? " is switched off in " : " is changed in ") + in;
    finding.message = "In frame " + std::to_string(frame.number) + " the master writes sync manager " +
                      std::to_string(n) + " (" + SettingsText(now.settings) + ") while the slave is in " + in +
                      " and uses it for " + (IsMailbox(n, before.settings) ? "the mailbox" : "process data") +
                      " with " + SettingsText(before.settings) + " (frame " + std::to_string(before.since) + "). ";
    finding.message += std::string(what_follows) + std::string("Configure it in ") +
                       (IsMailbox(n, before.settings) ? "INIT" : "PREOP") + ".";
    finding.evidence.push_back(Number("sync_manager", static_cast<std::int64_t>(n)));
    finding.evidence.push_back(HexNumber("start_before", before.settings.start));
    finding.evidence.push_back(Number("length_before", before.settings.length));
    finding.evidence.push_back(HexNumber("start", now.settings.start));
    finding.evidence.push_back(Number("length", now.settings.length));
    finding.evidence.push_back(Text("state", in));
    AddRelated(finding, before.since);
    if (!before.observed || !now.observed) finding.confidence = Confidence::kInferred;
    return Report(key, std::move(finding));
  }

  std::map<SlaveId, Slave> slaves_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SmChangedWhileActive>};

}  // namespace
}  // namespace ecaudit::sm_changed_while_active
