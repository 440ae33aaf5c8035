#include <algorithm>
#include <array>
#include <bitset>
#include <limits>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_manager_text.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_model.h"
#include "decoder/base/time.h"
#include "decoder/esc/fmmu.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/pipeline.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::fmmu_inactive {
namespace {

constexpr std::uint8_t kOp = static_cast<std::uint8_t>(esc::AlState::OP);
/// After this time in OP the slave must have exchanged something.
constexpr std::int64_t kLongEnoughNs = 20'000'000;

constexpr std::string_view kNext =
    R"([{!last_fmmu}Before SAFEOP is requested, write an FMMU of type {fmmu_type} for {physical_start}, {length}, with
activate 1.][{?last_fmmu}Use no FMMU after FMMU {last_fmmu}. One can map several sync managers that lie side by
side.])";

constexpr FindingKind kSwitchedOff{
    .name = "switched-off",
    .title = "The FMMU of the {direction} is switched off in OP",
    .message =
        R"(The master writes register {written_register} in {frame}, while the slave is in OP. Then no active FMMU maps
its {direction} (sync manager with start {physical_start}, length {length:number}, control {control}). The master does
not access them directly either. [{?outputs}The slave gets no outputs[{!stays}[{?watchdog}, and its watchdog will end OP
(AL status code 0x001b)]].][{!outputs}The master gets no inputs of this slave.])",
    .next = R"(Do not write FMMUs in OP: find what switches this one off.)",
    .identity = "direction"};

constexpr FindingKind kNotMapped{
    .name = "not-mapped",
    .title = "In OP, but no active FMMU maps the {direction}",
    .message =
        R"(The slave is in OP since {frame}. No active FMMU maps its {direction} (sync manager with start
{physical_start}, length {length:number}, control {control}). The master does not access them directly either.
[{?outputs}The slave gets no outputs[{!stays}[{?watchdog}, and its watchdog will end OP (AL status code
0x001b)]].][{!outputs}The master gets no inputs of this slave. A slave does not need that to stay in OP.])",
    .next = kNext,
    .identity = "direction"};

constexpr FindingKind kOpRefused{
    .name = "op-refused",
    .title = "OP requested, but no active FMMU maps the {direction}",
    .message =
        R"(The slave refuses OP in {frame}. No active FMMU maps its {direction} (sync manager with start
{physical_start}, length {length:number}, control {control}). The master does not access them directly either. The slave gets
no outputs, and its watchdog reports it (AL status code 0x001b).)",
    .next = kNext,
    .identity = "direction"};

constexpr FindingKind kPartNotMapped{
    .name = "part-not-mapped",
    .title = "In OP, but no active FMMU maps the outputs of SM{sync_manager}",
    .message =
        R"(The slave is in OP since {frame}. SM{sync_manager} is enabled for outputs (start {physical_start}, length
{length:number}). No active FMMU maps it, and the master does not write it directly either. Other outputs of the slave
are mapped, so its watchdog does not report the missing ones.)",
    .next =
        R"(Before SAFEOP is requested, write an FMMU of type 2 for {physical_start}, {length}: check how many FMMUs the
master can set up. If this part of the slave is not used, switch SM{sync_manager} off.)",
    .identity = "sync_manager"};

constexpr FindingKind kNothingAssigned{
    .name = "nothing-assigned",
    .title = "In OP without process data: 1C12h and 1C13h assign no PDO",
    .message =
        R"(The slave is in OP since {frame}, and exchanges nothing: 1C12h:0 and 1C13h:0 are 0 ({count_frame}), and no FMMU is
active. {other} is the same device, and has {other_bytes} of process data in OP. So the lists of this slave may have been
left empty by an earlier run.)",
    .next = R"(Write the PDOs to 1C12h and 1C13h in PREOP, in each start-up. Or load the defaults of the slave: power
cycle, 1011h.)"};

constexpr NoteKind kStaysInOp{
    .name = "stays-in-op",
    .text =
        R"(The slave stays in OP for {stayed_ms}, until {until_frame}, without outputs: its watchdog does not
act[ ({reason})]. Its outputs keep their values, also if the master fails.)"};

constexpr NoteKind kNoSuchFmmu{
    .name = "no-such-fmmu",
    .text =
        R"(For these the master wrote FMMU {fmmu} in {fmmu_frame}, which the slave did not accept: its controller has only
{fmmus} (0x0004).)"};

constexpr const FindingKind* kKinds[] = {&kSwitchedOff, &kNotMapped, &kOpRefused, &kPartNotMapped, &kNothingAssigned};
constexpr const NoteKind* kNotes[] = {&kStaysInOp, &kNoSuchFmmu};

constexpr Word kWatchdogTimeZero{"watchdog-time-zero", "0x0420 is 0"};
constexpr Word kNoTrigger{"no-watchdog-trigger", "bit 6 of the control byte of the sync manager is 0"};

constexpr Word kOutputs{"outputs", "outputs", true};
constexpr Word kInputs{"inputs", "inputs", true};
constexpr Word kWriteResult{"result-of-fmmu-write", "the result of a write to an FMMU"};
constexpr Word kEnabledManager{"enabled-sync-manager", "an enabled sync manager of process data"};

// Several rules may explain one finding: the first that does so wins.
constexpr std::string_view kAfter[] = {"al-refused", "al-timeout", "al-unexpected-change"};

constexpr RuleInfo kInfo{.id = "fmmu-inactive",
                         .group = "Sync managers and FMMUs",
                         .severity = Severity::kError,
                         .title = "Process data of a slave in OP are mapped by no active FMMU",
                         .needs = "the settings of FMMUs and sync managers, and that the slave is in OP",
                         .source = "ESC-1, FMMU; ETG1000.4, FMMUs",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .after = kAfter,
                         .doc = R"(
## What it checks
A slave in OP with an enabled sync manager for outputs (or inputs), if both hold:

- No active FMMU of that direction maps a byte of the sync manager.
- The master does not write (or read) its memory directly either.

Also a slave that refuses OP for this reason (0x001B), and a slave with several sync managers for outputs of which one
is not mapped.

## Why it matters
The slave takes no part in the exchange. Its outputs do not change and its watchdog ends OP (0x001B), or the master
works with inputs that never change. The frames of the other slaves look healthy.

## How it is decided
Sync managers and FMMUs have the settings that were written or read in the capture. If it shows neither, the rule is not
evaluated.

- A write that switches the last FMMU of a direction off in OP is reported at once.
- Everything else is reported when the slave leaves OP or the capture ends, after at least 20 ms in OP.
- AL Status that shows OP after twice the watchdog time without outputs shows that the watchdog does not act: a
  warning.
- Outputs of one sync manager beside mapped ones of another are a warning: the slave stays in OP without them.
- Inputs that no FMMU maps are an info: the master does not use them, and the slave does not need that. They are a
  warning if the master wrote an FMMU for them that the slave controller does not have (0x0004).
- A slave in OP whose 1C12h and 1C13h are empty is an info if another slave with the same vendor, product code and
  revision exchanges process data: it may be meant so.
- One access to the memory of the sync manager by position or station address proves an exchange without FMMU.

## Example
tests/rules/fmmu-inactive/violates.trace

## What to do
Write the FMMUs between PREOP and SAFEOP: logical start, length of the sync manager, its address, type 2 for outputs, 1
for inputs, activate 1. Find what switches them off: a scan, a second master, a reconfiguration of another slave.
)"};

class FmmuInactive final : public Rule {
 public:
  FmmuInactive() : Rule(kInfo) {
    Subscribe<track::AlStatusRead>(&FmmuInactive::On);
    Subscribe<track::AlRequest>(&FmmuInactive::On);
    Subscribe<track::SlaveAccess>(&FmmuInactive::On, MemoryRange::Of(esc::kFmmuBase, esc::kMaxFmmus * esc::kFmmuBytes),
                                  Stage::kAfterModel);
    Subscribe<track::SlaveAccess>(&FmmuInactive::On, MemoryRange{esc::RegisterImage::kSize, 0xFFFF},
                                  Stage::kAfterModel);
    Subscribe<model::AlChangedByItself>(&FmmuInactive::On);
    Subscribe<model::AlErrorCode>(&FmmuInactive::On);
    Subscribe<model::AlAnswered>(&FmmuInactive::On);
  }

  /// OP is refused because outputs are missing.
  void On(const model::AlAnswered& e) {
    const bool refused = e.outcome == model::AlAnswered::Outcome::kRefused && e.code == esc::al_code::kWatchdog;
    if (!refused || e.request.control.state() != kOp) return;
    if (e.slave >= slaves_.size()) slaves_.resize(static_cast<std::size_t>(e.slave) + 1);
    Watched& slave = slaves_[e.slave];
    if (slave.in_op) return;
    slave.reported.fill(false);
    slave.outputs = kNoFinding;
    (void)Evaluate(e.slave, true, e.frame, nullptr, true);
    if (slave.outputs != kNoFinding) refusals_.push_back({e.slave, e.frame.number, slave.outputs});
    if (refusals_.size() > kMost) refusals_.erase(refusals_.begin());
  }

  void On(const track::AlStatusRead& e) {
    const bool op = e.status.state() == kOp;
    if (op && e.slave < slaves_.size()) slaves_[e.slave].shown = e.frame;
    if (e.slave >= slaves_.size() && op) slaves_.resize(static_cast<std::size_t>(e.slave) + 1);
    if (e.slave >= slaves_.size() || !op || slaves_[e.slave].in_op) return;
    Watched& slave = slaves_[e.slave];
    slave.in_op = true;
    slave.op_since = slave.shown = e.frame;
    slave.off = {};
    slave.direct.fill(false);
    slave.written.reset();
    slave.reported.fill(false);
  }
  void On(const track::AlRequest& e) {
    if (e.control.state() != kOp && e.acceptance != track::Acceptance::kRefused) Leave(e.slave, e.frame());
  }
  void On(const model::AlChangedByItself& e) {
    if (e.status.state() == kOp) return;
    Leave(e.slave, e.frame, true);
    if (e.slave >= slaves_.size()) return;
    slaves_[e.slave].dropped = e.frame.number;
    if (e.code) Blame(e.slave, *e.code);
  }
  void On(const model::AlErrorCode& e) { Blame(e.slave, e.code); }
  void On(const track::SlaveAccess& e) {
    if (e.acceptance == track::Acceptance::kRefused) NoteRefused(e);
    if (e.slave >= slaves_.size() || !slaves_[e.slave].in_op || !e.done() || e.broadcast) return;
    if (e.address >= esc::kFmmuBase && e.address < esc::FmmuAddress(esc::kMaxFmmus) && !e.written.empty()) {
      for (const bool outputs : {true, false}) (void)Evaluate(e.slave, outputs, e.frame(), &e);
    } else if (e.address >= esc::RegisterImage::kSize) {
      const track::SlaveState& state = context().network().state(e.slave);
      for (const bool outputs : {true, false}) {
        const auto manager = state.process_manager(DirectionOf(outputs));
        const std::size_t length = outputs ? e.written.size() : e.read.size();
        if (length == 0 || !manager || e.address >= manager->end() || e.address + length <= manager->start) continue;
        slaves_[e.slave].direct[outputs ? 1 : 0] = true;
      }
      for (std::size_t n = 0; n < esc::kMaxSyncManagers && !e.written.empty(); ++n) {
        const auto manager = OutputsOf(state, n);
        if (manager && e.address < manager->end() && e.address + e.written.size() > manager->start) {
          slaves_[e.slave].written.set(n);
        }
      }
    }
  }

  void Finish() override {
    for (std::size_t s = 0; s < slaves_.size(); ++s) Leave(static_cast<SlaveId>(s), context().statistics().last);
    for (std::size_t s = 0; s < slaves_.size(); ++s) EvaluateNothing(static_cast<SlaveId>(s));
    for (const Consequence& drop : drops_)
      NameCause(context(), "al-unexpected-change", drop.slave, drop.frame, drop.cause);
    for (const Consequence& r : refusals_) NameCause(context(), "al-refused", r.slave, r.frame, r.cause);
    if (NotEvaluableWithoutReturns()) return;
    for (std::size_t s = 0; s < slaves_.size(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      if (!slaves_[s].was_in_op || IsKnown(id)) continue;
      NotEvaluable(id, ReasonCode::kNotInCapture, IsSwitchedOff(id) ? kEnabledManager : what::kSyncManagersAndFmmus);
    }
  }

 private:
  struct Watched {
    FrameRef op_since;  ///< the last time
    FrameRef shown;     ///< the last read that shows it in OP
    FrameRef off;       ///< its outputs are switched off since then; not seen: they are not
    bool in_op = false;
    bool was_in_op = false;                      ///< and left it
    std::array<bool, 2> direct{};                ///< inputs are read, outputs are written without FMMU
    std::bitset<esc::kMaxSyncManagers> written;  ///< outputs of these are written without FMMU
    std::array<bool, 2> reported{};              ///< since it is in OP
    FindingIndex outputs = kNoFinding;
    FrameNo dropped = 0;
  };
  static constexpr std::size_t kMost = 256;
  static constexpr std::uint64_t kNothing = 3;
  static constexpr std::uint64_t kParts = 16;  ///< key of sync manager 0; below: directions
  struct Consequence {
    SlaveId slave = kNoSlave;
    FrameNo frame = 0;
    FindingIndex cause = kNoFinding;
  };

  static constexpr esc::SmDirection DirectionOf(bool outputs) {
    return outputs ? esc::SmDirection::ECAT_WRITES : esc::SmDirection::ECAT_READS;
  }
  [[nodiscard]] bool IsKnown(SlaveId id) const {
    const track::SlaveState& state = context().network().state(id);
    return context().network().fmmus(id).any && (state.process_manager(esc::SmDirection::ECAT_WRITES) ||
                                                 state.process_manager(esc::SmDirection::ECAT_READS));
  }

  /// The capture shows its sync managers, and that none is switched on.
  [[nodiscard]] bool IsSwitchedOff(SlaveId id) const {
    const track::SlaveState& state = context().network().state(id);
    if (!context().network().fmmus(id).any) return false;
    bool any = false;
    for (std::size_t n = 0; n < esc::kMaxSyncManagers; ++n) any = any || state.sync_manager(n, Certainty::kInferred);
    return any;
  }

  /// @param by_itself  the slave dropped
  void Leave(SlaveId id, const FrameRef& frame, bool by_itself = false) {
    if (id >= slaves_.size() || !slaves_[id].in_op) return;
    Watched& slave = slaves_[id];
    const FrameRef since = slave.op_since;
    slave.was_in_op = true;
    const bool long_enough = since.has_time && frame.has_time && Elapsed(since.time, frame.time) >= kLongEnoughNs;
    for (const bool outputs : {true, false}) {
      if (!long_enough) continue;
      const bool new_one = !slave.reported[outputs ? 1 : 0];
      const FindingIndex index = Evaluate(id, outputs, since, nullptr);
      if (index != kNoFinding && new_one && !by_itself) GoesOn(id, outputs, index, since);
    }
    if (long_enough && !slave.reported[1]) EvaluateParts(id, since);
    if (slave.off.seen() && slave.outputs != kNoFinding && !by_itself) GoesOn(id, true, slave.outputs, slave.off);
    slave.in_op = false;
  }

  /// It did not leave OP by itself, as far as the capture shows.
  /// @param since  the frame from which on nothing maps them
  void GoesOn(SlaveId id, bool outputs, FindingIndex index, const FrameRef& since) {
    // An FMMU that was written shows that the master wants these inputs.
    const bool wanted = context().store[index].Has(kNoSuchFmmu);
    if (!outputs) return context().store.Regrade(index, wanted ? Severity::kWarning : Severity::kInfo);
    const FrameRef& until = slaves_[id].shown;
    if (until.number <= since.number || !since.has_time || !until.has_time) return;
    const TimeNs watchdog = context().sync().outputs(id).watchdog_ns;
    const TimeNs stayed = Elapsed(since.time, until.time);
    if (stayed < 2 * watchdog) return;
    Finding& finding = context().store[index];
    if (finding.Has(kStaysInOp)) return;
    context().store.Regrade(index, Severity::kWarning);
    Arguments arguments{{"stayed_ms", arg::Ms(stayed)}, {"until_frame", arg::Frame(until.number)}};
    if (const Word* reason = WatchdogOffBy(id)) arguments.Set("reason", arg::Of(*reason));
    finding.Set("stays", arg::Flag()).Add(kStaysInOp, std::move(arguments));
  }

  /// Why its watchdog cannot expire; null if it can.
  [[nodiscard]] const Word* WatchdogOffBy(SlaveId id) const {
    const track::SlaveState& state = context().network().state(id);
    const auto time = state.registers.Value<std::uint16_t>(esc::kProcessWatchdog);
    if (time && *time == 0) return &kWatchdogTimeZero;
    const auto manager = state.process_manager(esc::SmDirection::ECAT_WRITES);
    return manager && !manager->watchdog_trigger() ? &kNoTrigger : nullptr;
  }

  /// A write to an FMMU that the slave controller does not have.
  void NoteRefused(const track::SlaveAccess& e) {
    if (e.address < esc::kFmmuBase || e.address >= esc::FmmuAddress(esc::kMaxFmmus) || e.broadcast) return;
    const auto fmmu = esc::Fmmu::Decode(e.written);
    const auto number = static_cast<std::uint8_t>((e.address - esc::kFmmuBase) / esc::kFmmuBytes);
    if (!fmmu || !fmmu->active() || e.address != esc::FmmuAddress(number)) return;
    const auto count =
        context().network().state(e.slave).registers.Value<std::uint8_t>(esc::kFmmuCount, Certainty::kObserved);
    if (!count || *count == 0 || number < *count) return;
    no_such_[e.slave] = {e.frame().number, number, *count, *fmmu};
  }
  /// ... for this sync manager.
  struct NoSuchFmmu {
    FrameNo frame = 0;
    std::uint8_t number = 0;
    std::uint8_t count = 0;  ///< of those that it has
    esc::Fmmu fmmu;
  };
  [[nodiscard]] const NoSuchFmmu* NoSuchFor(SlaveId id, const esc::SyncManager& manager, bool outputs) const {
    const auto found = no_such_.find(id);
    if (found == no_such_.end()) return nullptr;
    const esc::Fmmu& fmmu = found->second.fmmu;
    const bool of_it = fmmu.physical_start < manager.end() && fmmu.physical_end() > manager.start;
    return of_it && (outputs ? fmmu.writes() : fmmu.reads()) ? &found->second : nullptr;
  }

  /// @return the finding; kNoFinding: nothing to report
  /// @param off  the write that switched it off in OP; null: it was never active
  /// @param refused  the slave is not in OP, but refused it
  FindingIndex Evaluate(SlaveId id, bool outputs, const FrameRef& frame, const track::SlaveAccess* off,
                        bool refused = false) {
    Watched& slave = slaves_[id];
    const track::SlaveState& state = context().network().state(id);
    const track::KnownFmmus& fmmus = context().network().fmmus(id);
    const auto manager = state.process_manager(DirectionOf(outputs));
    if (!manager || !fmmus.any || slave.direct[outputs ? 1 : 0] || slave.reported[outputs ? 1 : 0]) return kNoFinding;
    if (IsMapped(fmmus, *manager, outputs) || IsUndecided(id, frame, off)) return kNoFinding;
    slave.reported[outputs ? 1 : 0] = true;
    const std::uint64_t key = refused ? 2 : outputs ? 1 : 0;
    FindingIndex index = Repeat(id, key, frame);
    if (index == kNoFinding) {
      Finding finding = Describe(id, outputs, *manager, frame, off, refused);
      // The master may have set it in a silence, or where its numbers skip.
      const bool skips = off == nullptr && context().network().MayMissBetween(FirstLearned(state), frame.number);
      if (skips) finding.confidence = Confidence::kInferred;
      index = Report(key, std::move(finding));
    }
    if (outputs) slave.outputs = index;
    if (outputs && off != nullptr) slave.off = frame;
    return index;
  }

  [[nodiscard]] static bool IsMapped(const track::KnownFmmus& fmmus, const esc::SyncManager& manager, bool outputs) {
    return std::ranges::any_of(fmmus.active, [&](const auto& unit) {
      return (outputs ? unit.fmmu.writes() : unit.fmmu.reads()) && unit.fmmu.physical_start < manager.end() &&
             unit.fmmu.physical_end() > manager.start;
    });
  }

  /// Something may map the process data that the capture does not show; the reason is noted.
  bool IsUndecided(SlaveId id, const FrameRef& frame, const track::SlaveAccess* off) {
    const track::SlaveState& state = context().network().state(id);
    if (MayMapUnseen(state)) {
      NotEvaluable(id, ReasonCode::kNotInCapture, kWriteResult, frame.number);
    } else if (MissesPackets(context().pairing())) {
      NotEvaluable(id, ReasonCode::kMissesPackets, frame.number);
    } else if (off == nullptr && context().network().MissesBetween(FirstLearned(state), frame.number)) {
      NotEvaluable(id, ReasonCode::kCaptureGap, what::kSyncManagersAndFmmus, frame.number);
    } else if (off == nullptr && !context().network().fmmus(id).all) {
      NotEvaluable(id, ReasonCode::kNotInCapture, what::kFmmus, frame.number);
    } else {
      return false;
    }
    return true;
  }

  /// The slave gave 0 for both, or took it.
  [[nodiscard]] const process::PdoObject* EmptyList(SlaveId id, std::uint16_t assignment) const {
    const process::PdoObject* const list = context().slave(id).process.seen().Find(assignment);
    const std::uint8_t* const count = list != nullptr ? list->count.if_observed() : nullptr;
    return count != nullptr && *count == 0 ? list : nullptr;
  }

  /// Another slave of the same kind that has process data; kNoSlave: none.
  [[nodiscard]] SlaveId SiblingOf(SlaveId id) const {
    const track::IdentityLearned& own = context().slave(id).identity;
    if (!own.vendor_id || !own.product_code || !own.revision) return kNoSlave;
    for (std::size_t s = 0; s < slaves_.size(); ++s) {
      const auto other = static_cast<SlaveId>(s);
      const model::SlaveModel& slave = context().slave(other);
      const bool same = slave.identity.vendor_id == own.vendor_id && slave.identity.product_code == own.product_code &&
                        slave.identity.revision == own.revision;
      if (other != id && same && slaves_[s].was_in_op && slave.outputs.exchanged + slave.inputs.exchanged > 0) {
        return other;
      }
    }
    return kNoSlave;
  }

  /// A device whose lists an earlier run left empty reaches OP all the same.
  void EvaluateNothing(SlaveId id) {
    const Watched& slave = slaves_[id];
    const track::KnownFmmus& fmmus = context().network().fmmus(id);
    const process::PdoObject* const rx = EmptyList(id, process::kRxAssignment);
    const process::PdoObject* const tx = EmptyList(id, process::kTxAssignment);
    if (!slave.was_in_op || rx == nullptr || tx == nullptr || !fmmus.active.empty()) return;
    const FrameNo since = slave.op_since.number;
    if (rx->since > since || tx->since > since || MissesPackets(context().pairing())) return;
    const SlaveId other = SiblingOf(id);
    if (other == kNoSlave || Repeat(id, kNothing, slave.op_since) != kNoFinding) return;
    const model::ProcessData& process = context().slave(other).process;
    Finding finding = Found(kNothingAssigned, id, slave.op_since);
    finding.confidence = Confidence::kInferred;
    finding.Set("count_frame", arg::Frame(std::max(rx->since, tx->since)))
        .Set("other", arg::Slave(other, context().Label(other)))
        .Set("other_bytes", arg::Count(process.rx().bytes() + process.tx().bytes(), "byte"));
    Report(kNothing, Severity::kInfo, std::move(finding));
  }

  /// Sync manager n, if it is enabled for outputs.
  [[nodiscard]] static std::optional<esc::SyncManager> OutputsOf(const track::SlaveState& state, std::size_t n) {
    const auto manager = state.sync_manager(n, Certainty::kInferred);
    const bool outputs = manager && manager->enabled() && manager->length > 0 && esc::IsProcessData(n, *manager) &&
                         manager->direction() == esc::SmDirection::ECAT_WRITES;
    return outputs ? manager : std::nullopt;
  }

  /// Of several sync managers for outputs one is not mapped.
  void EvaluateParts(SlaveId id, const FrameRef& frame) {
    const track::SlaveState& state = context().network().state(id);
    const track::KnownFmmus& fmmus = context().network().fmmus(id);
    if (!fmmus.any) return;
    for (std::size_t n = 0; n < esc::kMaxSyncManagers; ++n) {
      const auto manager = OutputsOf(state, n);
      if (!manager || slaves_[id].written[n] || IsMapped(fmmus, *manager, true)) continue;
      if (IsUndecided(id, frame, nullptr)) return;
      const std::uint64_t key = kParts + n;
      if (Repeat(id, key, frame) != kNoFinding) continue;
      Finding finding = Found(kPartNotMapped, id, frame);
      if (context().network().MayMissBetween(FirstLearned(state), frame.number)) {
        finding.confidence = Confidence::kInferred;
      }
      finding.Set("sync_manager", arg::Number(static_cast<std::int64_t>(n)))
          .Set("physical_start", arg::Hex(manager->start))
          .Set("length", arg::Count(manager->length, "byte"));
      Report(key, Severity::kWarning, std::move(finding));
    }
  }

  [[nodiscard]] Finding Describe(SlaveId id, bool outputs, const esc::SyncManager& manager, const FrameRef& frame,
                                 const track::SlaveAccess* off, bool refused) const {
    Finding finding = Found(off != nullptr ? kSwitchedOff : refused ? kOpRefused : kNotMapped, id, frame);
    finding.Set("direction", arg::Of(outputs ? kOutputs : kInputs))
        .Set("outputs", arg::Flag(outputs))
        .Set("watchdog", arg::Flag(WatchdogOffBy(id) == nullptr))
        .Set("physical_start", arg::Hex(manager.start))
        .Set("length", arg::Count(manager.length, "byte"))
        .Set("control", arg::Hex(manager.control, 2))
        .Set("fmmu_type", arg::Number(outputs ? 2 : 1));
    if (off != nullptr) finding.Set("written_register", arg::Register(off->address));
    if (const NoSuchFmmu* none = NoSuchFor(id, manager, outputs)) {
      AddRelated(finding, none->frame);
      finding.Set("last_fmmu", arg::Number(none->count - 1));
      finding.Add(kNoSuchFmmu, {{"fmmu", arg::Number(none->number)},
                                {"fmmu_frame", arg::Frame(none->frame)},
                                {"fmmus", arg::Count(none->count, "FMMU")}});
    }
    return finding;
  }

  /// The frame that showed the oldest known setting of its sync managers and FMMUs.
  [[nodiscard]] static FrameNo FirstLearned(const track::SlaveState& state) {
    FrameNo first = std::numeric_limits<FrameNo>::max();
    const auto add = [&](FrameNo since) {
      if (since != 0) first = std::min(first, since);
    };
    for (const FrameNo since : state.fmmu_since) add(since);
    for (const FrameNo since : state.sync_manager_since) add(since);
    return first;
  }

  /// The result of a write to an FMMU is not known.
  [[nodiscard]] static bool MayMapUnseen(const track::SlaveState& state) {
    for (std::size_t n = 0; n < esc::kMaxFmmus; ++n) {
      if (state.fmmu_since[n] != 0 && !state.fmmu(n, Certainty::kInferred)) return true;
    }
    return false;
  }

  void Blame(SlaveId id, std::uint16_t code) {
    if (code != esc::al_code::kWatchdog || id >= slaves_.size() || drops_.size() >= kMost) return;
    const Watched& slave = slaves_[id];
    if (slave.outputs != kNoFinding && slave.dropped != 0) drops_.push_back({id, slave.dropped, slave.outputs});
  }

  std::vector<Watched> slaves_;
  std::map<SlaveId, NoSuchFmmu> no_such_;  ///< the last one of each slave
  std::vector<Consequence> drops_;
  std::vector<Consequence> refusals_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<FmmuInactive>};

}  // namespace
}  // namespace ecaudit::fmmu_inactive
