#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_manager_text.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/base/time.h"
#include "decoder/pipeline.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::fmmu_inactive {
namespace {

constexpr std::uint8_t kOp = static_cast<std::uint8_t>(esc::AlState::OP);
constexpr std::uint16_t kWatchdogCode = 0x001B;
/// In OP for so long the slave must have exchanged something.
constexpr std::int64_t kLongEnoughNs = 20'000'000;

constexpr RuleInfo kInfo{.id = "fmmu-inactive",
                         .group = "Sync managers and FMMUs",
                         .severity = Severity::kError,
                         .title = "Process data of a slave in OP are mapped by no active FMMU",
                         .needs = "the settings of FMMUs and sync managers, and that the slave is in OP",
                         .source = "ESC-1, FMMU; ETG1000.4, FMMUs",
                         .doc = R"(
## What it checks
A slave in OP with an enabled sync manager for outputs (or inputs) of which no byte is mapped by an active FMMU of that
direction, and whose memory nobody writes (or reads) directly either. And one that refuses OP for this (0x001B).

## Why it matters
The slave takes part in no exchange: its outputs stay as they were and its watchdog ends OP (0x001B), or the master
works on inputs that never change. The frames of the other slaves look healthy.

## How it is decided
Sync managers and FMMUs as they were written or read in the capture; where it shows neither, nothing is said. A write
that switches the last FMMU of a direction off in OP is told at once, all else when the slave leaves OP or the capture
ends, after at least 20 ms in OP. One access to the memory of the sync manager by position or station address is proof
of an exchange without FMMU.

## Example
tests/rules/fmmu-inactive/violates.trace

## What to do
Write the FMMUs between PREOP and SAFEOP: logical start, length of the sync manager, its address, type 2 for outputs, 1
for inputs, activate 1. Look for what switches them off: a scan, a second master, a reconfiguration of another slave.
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

  /// OP is refused because no outputs come.
  void On(const model::AlAnswered& e) {
    const bool refused = e.outcome == model::AlAnswered::Outcome::kRefused && e.code == kWatchdogCode;
    if (!refused || e.request.control.state() != kOp) return;
    if (e.slave >= slaves_.size()) slaves_.resize(static_cast<std::size_t>(e.slave) + 1);
    Watched& slave = slaves_[e.slave];
    if (slave.op_since.seen()) return;
    slave.told.fill(false);
    slave.outputs = kNoFinding;
    Judge(e.slave, true, e.frame, nullptr, true);
    if (slave.outputs != kNoFinding) refusals_.push_back({e.slave, e.frame.number, slave.outputs});
    if (refusals_.size() > kMost) refusals_.erase(refusals_.begin());
  }

  void On(const track::AlStatusRead& e) {
    const bool op = e.status.state() == kOp;
    if (e.slave >= slaves_.size() && op) slaves_.resize(static_cast<std::size_t>(e.slave) + 1);
    if (e.slave >= slaves_.size() || !op || slaves_[e.slave].op_since.seen()) return;
    Watched& slave = slaves_[e.slave];
    slave.op_since = e.frame;
    slave.direct.fill(false);
    slave.told.fill(false);
  }
  void On(const track::AlRequest& e) {
    if (e.control.state() != kOp && e.acceptance != track::Acceptance::kRefused) Leave(e.slave, e.frame());
  }
  void On(const model::AlChangedByItself& e) {
    if (e.status.state() == kOp) return;
    Leave(e.slave, e.frame);
    if (e.slave >= slaves_.size()) return;
    slaves_[e.slave].fell = e.frame.number;
    if (e.code) Blame(e.slave, *e.code);
  }
  void On(const model::AlErrorCode& e) { Blame(e.slave, e.code); }
  void On(const track::SlaveAccess& e) {
    if (e.slave >= slaves_.size() || !slaves_[e.slave].op_since.seen() || !e.done() || e.broadcast) return;
    if (e.address >= esc::kFmmuBase && e.address < esc::FmmuAddress(esc::kMaxFmmus) && !e.written.empty()) {
      for (const bool outputs : {true, false}) Judge(e.slave, outputs, e.frame(), &e);
    } else if (e.address >= esc::RegisterImage::kSize) {
      const track::SlaveState& state = context().network().state(e.slave);
      for (const bool outputs : {true, false}) {
        const auto manager = state.process_manager(DirectionOf(outputs));
        const std::size_t length = outputs ? e.written.size() : e.read.size();
        if (length == 0 || !manager || e.address >= manager->end() || e.address + length <= manager->start) continue;
        slaves_[e.slave].direct[outputs ? 1 : 0] = true;
      }
    }
  }

  void Finish() override {
    for (std::size_t s = 0; s < slaves_.size(); ++s) Leave(static_cast<SlaveId>(s), context().statistics().last);
    for (const Fall& fall : falls_) NameCause(context(), "al-unexpected-change", fall.slave, fall.frame, fall.cause);
    for (const Fall& fall : refusals_) NameCause(context(), "al-refused", fall.slave, fall.frame, fall.cause);
    if (NotEvaluableWithoutReturns()) return;
    for (std::size_t s = 0; s < slaves_.size(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      if (!slaves_[s].was_in_op || IsKnown(id)) continue;
      NotEvaluable(id, IsSwitchedOff(id) ? "no sync manager of process data of the slave in OP is on"
                                         : "which sync managers and FMMUs the slave in OP has is not in the capture");
    }
  }

 private:
  struct Watched {
    FrameRef op_since;  ///< not seen: not in OP
    bool was_in_op = false;
    std::array<bool, 2> direct{};  ///< somebody reads inputs, writes outputs without FMMU
    std::array<bool, 2> told{};    ///< since it is in OP
    FindingIndex outputs = kNoFinding;
    FrameNo fell = 0;
  };
  static constexpr std::size_t kMost = 256;
  struct Fall {
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

  /// The capture shows what it has: nothing that is switched on.
  [[nodiscard]] bool IsSwitchedOff(SlaveId id) const {
    const track::SlaveState& state = context().network().state(id);
    if (!context().network().fmmus(id).any) return false;
    bool any = false;
    for (std::size_t n = 0; n < esc::kMaxSyncManagers; ++n) any = any || state.sync_manager(n, Certainty::kInferred);
    return any;
  }

  void Leave(SlaveId id, const FrameRef& frame) {
    if (id >= slaves_.size() || !slaves_[id].op_since.seen()) return;
    Watched& slave = slaves_[id];
    const FrameRef since = slave.op_since;
    slave.was_in_op = true;
    const bool long_enough = since.has_time && frame.has_time && Elapsed(since.time, frame.time) >= kLongEnoughNs;
    for (const bool outputs : {true, false}) {
      if (long_enough) Judge(id, outputs, since, nullptr);
    }
    slave.op_since = {};
  }

  /// @param off  the write that switched it off in OP; null: it was never on
  /// @param refused  the slave is not in OP, but refused it
  void Judge(SlaveId id, bool outputs, const FrameRef& frame, const track::SlaveAccess* off, bool refused = false) {
    Watched& slave = slaves_[id];
    const track::SlaveState& state = context().network().state(id);
    const track::KnownFmmus& fmmus = context().network().fmmus(id);
    const auto manager = state.process_manager(DirectionOf(outputs));
    if (!manager || !fmmus.any || slave.direct[outputs ? 1 : 0] || slave.told[outputs ? 1 : 0]) return;
    const bool mapped = std::any_of(fmmus.active.begin(), fmmus.active.end(), [&](const auto& unit) {
      return (outputs ? unit.fmmu.writes() : unit.fmmu.reads()) && unit.fmmu.physical_start < manager->end() &&
             unit.fmmu.physical_end() > manager->start;
    });
    if (mapped) return;
    if (MayMapUnseen(state)) {
      NotEvaluable(id, "whether a write to an FMMU was taken is not in the capture", frame.number);
      return;
    }
    if (MissesPackets(context().pairing())) {
      NotEvaluable(id, ReasonCode::kMissesPackets, frame.number);
      return;
    }
    if (off == nullptr && context().network().MayMissBetween(FirstLearned(state), frame.number)) {
      NotEvaluable(id, ReasonCode::kCaptureGap, what::kHistory, frame.number);
      return;
    }
    if (off == nullptr && !fmmus.all) {
      NotEvaluable(id, "an FMMU may map them that was set before the capture begins", frame.number);
      return;
    }
    slave.told[outputs ? 1 : 0] = true;
    const std::uint64_t key = refused ? 2 : outputs ? 1 : 0;
    FindingIndex index = Repeat(id, key, frame);
    if (index == kNoFinding) {
      Finding finding = Describe(id, outputs, *manager, frame, off, refused);
      if (refused) finding.title = "OP requested, but no active FMMU maps the outputs";
      index = Report(key, std::move(finding));
    }
    if (outputs) slave.outputs = index;
  }

  [[nodiscard]] static Finding Describe(SlaveId id, bool outputs, const esc::SyncManager& manager,
                                        const FrameRef& frame, const track::SlaveAccess* off, bool refused) {
    Finding finding;
    finding.slave = id;
    finding.first = frame;
    const std::string what = outputs ? "outputs" : "inputs";
    finding.title = off != nullptr ? "The FMMU of the " + what + " is switched off in OP"
                                   : "In OP, but no active FMMU maps the " + what;
    finding.message =
        (off != nullptr
             ? "In frame " + std::to_string(frame.number) + " the master writes " + Hex(off->address) +
                   " while the slave is in OP; then no active FMMU maps its " + what
             : (refused ? "The slave refuses OP in frame " : "The slave is in OP since frame ") +
                   std::to_string(frame.number) + (refused ? ": no" : ", but no") + " active FMMU maps its " + what) +
        " (sync manager with " + SettingsText(manager) + "), and nobody " + (outputs ? "writes" : "reads") +
        " them directly. " +
        (refused   ? "It gets no outputs, whatever flows for others, and says so by its watchdog (0x001b). "
         : outputs ? "The slave gets no outputs, and its watchdog will end OP (0x001b). "
                   : "The master gets no inputs of this slave. ") +
        "Write an FMMU of type " + (outputs ? "2" : "1") + " for " + Hex(manager.start) + ", " +
        std::to_string(manager.length) + " bytes, with activate 1, before SAFEOP is requested.";
    finding.evidence = {HexNumber("physical_start", manager.start), Number("length", manager.length)};
    return finding;
  }

  /// The frame that taught the oldest of what is known of its sync managers and FMMUs.
  [[nodiscard]] static FrameNo FirstLearned(const track::SlaveState& state) {
    FrameNo first = std::numeric_limits<FrameNo>::max();
    const auto add = [&](FrameNo since) {
      if (since != 0) first = std::min(first, since);
    };
    for (const FrameNo since : state.fmmu_since) add(since);
    for (const FrameNo since : state.sync_manager_since) add(since);
    return first;
  }

  /// The fate of a write to some FMMU is not known.
  [[nodiscard]] static bool MayMapUnseen(const track::SlaveState& state) {
    for (std::size_t n = 0; n < esc::kMaxFmmus; ++n) {
      if (state.fmmu_since[n] != 0 && !state.fmmu(n, Certainty::kInferred)) return true;
    }
    return false;
  }

  void Blame(SlaveId id, std::uint16_t code) {
    if (code != kWatchdogCode || id >= slaves_.size() || falls_.size() >= kMost) return;
    const Watched& slave = slaves_[id];
    if (slave.outputs != kNoFinding && slave.fell != 0) falls_.push_back({id, slave.fell, slave.outputs});
  }

  std::vector<Watched> slaves_;
  std::vector<Fall> falls_;
  std::vector<Fall> refusals_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<FmmuInactive>};

}  // namespace
}  // namespace ecaudit::fmmu_inactive
