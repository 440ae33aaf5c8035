#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_manager_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/what.h"
#include "decoder/track/access.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::sm_changed_while_active {
namespace {

constexpr FindingKind kChanged{
    .name = "changed",
    .title = "SM{sync_manager} is changed in {state}, which uses it",
    .message =
        R"(The master writes sync manager {sync_manager} in {frame}: start {start}, length {length}, control {control}. The
slave is in {state} and uses it for {use} with start {start_before}, length {length_before}, control {control_before}[
({before_frame})]. An ESC ignores such a write while the sync manager is enabled. If the master switched it off first, the
slave checks the values again and may leave its state.)",
    .next = "Configure the sync manager in {configure_in}.",
    .identity = "sync_manager state"};

constexpr FindingKind kSwitchedOff{
    .name = "switched-off",
    .title = "SM{sync_manager} is switched off in {state}, which uses it",
    .message =
        R"(The master switches sync manager {sync_manager} off in {frame}. The slave is in {state} and uses it for {use}
with start {start_before}, length {length_before}, control {control_before}[ ({before_frame})]. [{?left_in_op}The slave stays
in OP without these process data.][{!left_in_op}Then the slave changes its state by itself.])",
    .next = "Configure the sync manager in {configure_in}.",
    .identity = "sync_manager state"};

constexpr const FindingKind* kKinds[] = {&kChanged, &kSwitchedOff};

constexpr Word kMailbox{"mailbox", "the mailbox"};
constexpr Word kProcessData{"process-data", "process data"};

// Several rules may explain one finding: the first that does so wins.
constexpr std::string_view kAfter[] = {"pdo-length-mismatch"};

constexpr RuleInfo kInfo{.id = "sm-changed-while-active",
                         .group = "Sync managers and FMMUs",
                         .severity = Severity::kError,
                         .history = History::kWhole,
                         .subject = Subject::kSlave,
                         .title = "A sync manager is changed in a state that uses it",
                         .needs = "the settings before and after, and the AL state of the slave",
                         .source = "ESC-1, sync manager; ETG1000.6, sync managers",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Whether an enabled sync manager gets another start, length or control byte, or is switched off, while the slave is in a
state that uses it:

- mailboxes: PREOP, SAFEOP and OP
- process data: SAFEOP and OP

## Why it matters
While a sync manager is enabled, the ESC ignores its start, length and control byte, so the master works with settings
that are not in force. If the master switches it off and on again, they are in force, and the slave checks them again:
it drops to SAFEOP, PREOP or INIT with 0x0016, 0x001D or 0x001E.

## How it is decided
The finding needs a slave that is known to be in that state, with no request in flight, and both settings.

- These do not count: writing the same values again, the repeat bit of a mailbox, and broadcasts (masters clear
  everything when they scan).
- Switching off alone counts only in two cases, because masters switch sync managers off before they request a lower
  state: if the slave then changes its state by itself, or if it stays in OP for longer than 100 ms without its process
  data.

## Example
samples/captures/sm-changed-in-op.pcapng

## What to do
Go to INIT before the mailboxes are configured, and to PREOP before the process data are configured.
)"};

class SmChangedWhileActive final : public Rule {
 public:
  SmChangedWhileActive() : Rule(kInfo) {
    Subscribe<track::SlaveAccess>(
        &SmChangedWhileActive::On,
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
      if (now && !e.written.empty() && !e.broadcast && e.done()) Evaluate(e, n, sync, *now);
      // The settings in force stay the reference while it is switched off for a change.
      if (!sync.off) sync.in_force = now;
    }
  }

  /// At any request sync managers may be switched off; lower states may be configured again.
  void On(const track::AlRequest& e) {
    const auto found = slaves_.find(e.slave);
    if (found != slaves_.end()) ReportStandstill(e.slave, found->second, e.frame());
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
        cause = ReportChange(e.slave, n, *sync.in_force, now, *sync.off);
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
    for (auto& [id, slave] : slaves_) ReportStandstill(id, slave, context().statistics().last);
  }

 private:
  struct SwitchedOff {
    FrameRef frame;
    esc::AlState state = esc::AlState::OP;
  };
  struct Sync {
    std::optional<KnownSyncManager> in_force;
    std::unique_ptr<SwitchedOff> off;  ///< since then, in a state that uses it; rare
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

  void Evaluate(const track::SlaveAccess& e, std::size_t n, Sync& sync, const KnownSyncManager& now) {
    if (!sync.in_force) return;
    const esc::SyncManager& before = sync.in_force->settings;
    if (!before.enabled() || before.length == 0) return;
    const auto state = StateThatUses(e.slave, n, before);
    if (!state) {
      sync.off.reset();
      if (context().slave(e.slave).al.possible().empty() && !Same(before, now.settings)) {
        NotEvaluable(e.slave, ReasonCode::kNotInCapture, what::kAlState, e.frame().number);
      }
      return;
    }
    if (!now.settings.enabled()) {
      if (!sync.off) sync.off = std::make_unique<SwitchedOff>(SwitchedOff{e.frame(), *state});
      return;
    }
    sync.off.reset();
    if (Same(before, now.settings)) return;
    sync.reported = ReportChange(e.slave, n, *sync.in_force, now, {e.frame(), *state});
  }

  static KnownSyncManager Off(const Sync& sync) {
    KnownSyncManager now = *sync.in_force;
    now.settings.activate = static_cast<std::uint8_t>(now.settings.activate & ~1U);
    now.since = sync.off->frame.number;
    return now;
  }

  /// A slave that stays in OP although its process data were switched off.
  void ReportStandstill(SlaveId id, Slave& slave, const FrameRef& now) {
    constexpr TimeNs kLongEnough = 100'000'000;
    for (std::size_t n = 0; n < slave.size(); ++n) {
      Sync& sync = slave[n];
      if (!sync.off || !sync.in_force || IsMailbox(n, sync.in_force->settings)) continue;
      const FrameRef& off = sync.off->frame;
      if (sync.off->state != esc::AlState::OP || !off.has_time || !now.has_time) continue;
      if (Elapsed(off.time, now.time) < kLongEnough) continue;
      sync.reported = ReportChange(id, n, *sync.in_force, Off(sync), *sync.off, true);
      sync.off.reset();
    }
  }

  /// @param left_in_op  it was switched off, and the slave stays in OP
  FindingIndex ReportChange(SlaveId slave, std::size_t n, const KnownSyncManager& before, const KnownSyncManager& now,
                            const SwitchedOff& change, bool left_in_op = false) {
    const FrameRef& frame = change.frame;
    const std::uint64_t key = KeyOfBoth(SettingsKey(n, before.settings), SettingsKey(n, now.settings));
    if (const FindingIndex index = Repeat(slave, key, frame); index != kNoFinding) return index;
    const bool mailbox = IsMailbox(n, before.settings);
    Finding finding = Found(now.settings.enabled() ? kChanged : kSwitchedOff, slave, frame);
    finding.Set("sync_manager", arg::Number(static_cast<std::int64_t>(n)))
        .Set("start_before", arg::Hex(before.settings.start))
        .Set("length_before", arg::Number(before.settings.length))
        .Set("control_before", arg::Hex(before.settings.control, 2))
        .Set("start", arg::Hex(now.settings.start))
        .Set("length", arg::Number(now.settings.length))
        .Set("control", arg::Hex(now.settings.control, 2))
        .Set("state", arg::State(static_cast<std::uint8_t>(change.state)))
        .Set("use", arg::Of(mailbox ? kMailbox : kProcessData))
        .Set("configure_in", arg::State(static_cast<std::uint8_t>(mailbox ? esc::AlState::INIT : esc::AlState::PREOP)))
        .Set("left_in_op", arg::Flag(left_in_op));
    if (before.since != 0) finding.Set("before_frame", arg::Frame(before.since));
    AddRelated(finding, before.since);
    if (!before.observed || !now.observed) finding.confidence = Confidence::kInferred;
    return Report(key, std::move(finding));
  }

  std::map<SlaveId, Slave> slaves_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SmChangedWhileActive>};

}  // namespace
}  // namespace ecaudit::sm_changed_while_active
