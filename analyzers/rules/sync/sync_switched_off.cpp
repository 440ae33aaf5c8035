#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_model.h"
#include "decoder/base/text.h"
#include "decoder/base/wrapping.h"
#include "decoder/esc/dc_registers.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/esc/sync_manager.h"
#include "decoder/pipeline.h"
#include "decoder/track/events.h"

namespace ecaudit::sync_switched_off {
namespace {

constexpr RuleInfo kInfo{.id = "sync-switched-off",
                         .group = "Synchronisation",
                         .severity = Severity::kError,
                         .subject = Subject::kClock,
                         .title = "SYNC0 is switched off, or the system time is shifted, while the slave is in OP",
                         .needs = "AL Status OP, writes of 0x0981, 0x0920 and 0x0928 of the slave",
                         .source = "ESC-1, distributed clocks, SYNC signal generation",
                         .doc = R"(
## What it checks
Writes that take the clock from a drive while it runs by it: cyclic generation of SYNC0 switched off (0x0981 bit 0 or
1), another system time offset (0x0920), or another propagation delay (0x0928), while the slave is in OP.

## Why it matters
Without SYNC0 the drive loses its time base within a few cycles and goes into a fault. Another offset lets its system
time jump: the next SYNC0 pulse comes too early, too late, or only when the clock has wrapped. To another delay the
slave's clock is regulated with each distribution of the time: its SYNC0 moves against that of the others, and against
the frames.

## How it is decided
AL Status showed OP, and no request to leave it is under way. A master that begins anew clears station addresses or sync
managers of all slaves by broadcast, whatever ran before: from there on OP counts where it is read again. SYNC0 was on
before, as a write or a read of 0x0981 showed, and the slave took the write. Masters that shut down switch SYNC0 off
slave by slave and then request another state: where that follows within 10 ms, nothing is said. An offset counts where
SYNC0 is on and the value differs from the last one that was written or read; the same value again shifts nothing, nor
does another upper half where the clock has 32 bit (0x0008), and where no value was seen before, the write is taken for
a new one (inferred). A delay counts where SYNC0 is on and it differs from the last one that was written or read by more
than 1 us, which masters that measure anew do not come to. Where it is not known whether SYNC0 is on, nothing is said.
Corrections by 0x0910, the regular distribution of the system time, are no matter of this rule.

## Example
samples/captures/sync-switched-off.pcapng

## What to do
Leave OP (request SAFEOP or PREOP) before SYNC0, the offset or the delay is changed; set clocks up before SAFEOP.
)"};

/// A delay that was measured anew is another by less: slaves are synchronised within it.
constexpr std::int64_t kMeasuredAnewNs = 1000;

/// From the last slave whose SYNC0 is switched off to the request of another state.
constexpr TimeNs kShutDownNs = 10'000'000;
constexpr FrameNo kShutDownFrames = 64;

class SyncSwitchedOff final : public Rule {
 public:
  SyncSwitchedOff() : Rule(kInfo) {
    Subscribe<track::SlaveAccess>(&SyncSwitchedOff::On,
                             MemoryRange::Of(esc::kSystemTimeOffset, esc::kDcEnd - esc::kSystemTimeOffset));
    Subscribe<track::AlRequestSent>(&SyncSwitchedOff::On);
    Subscribe<track::Answered>(&SyncSwitchedOff::OnStates, MemoryRange::Of(esc::kAlStatus, 1));
    Subscribe<track::Answered>(&SyncSwitchedOff::OnClear, MemoryRange::Of(esc::kStationAddress, 2));
    Subscribe<track::Answered>(&SyncSwitchedOff::OnClear, MemoryRange::Of(esc::kSyncManagerBase, esc::kSyncManagerBytes));
    Subscribe<track::AlStatusRead>(&SyncSwitchedOff::On);
  }

  /// Where each slave's own state is not known, those of all may be.
  void OnStates(const track::Answered& e) {
    if (e.command != wire::Command::BRD || e.wkc == 0 || e.circulating || e.address > esc::kAlStatus) return;
    const auto at = static_cast<std::size_t>(esc::kAlStatus - e.address);
    if (!Fits(e.returned_data, at, 1)) return;
    some_in_op_ = (e.returned_data[at] & static_cast<std::uint8_t>(esc::AlState::OP)) != 0;
  }

  /// A master that found slaves begins with all of them: what ran before it runs no more, or is not its own.
  void OnClear(const track::Answered& e) {
    if (e.command != wire::Command::BWR || e.wkc == 0 || e.circulating) return;
    const ByteSpan data = e.returned_data;
    if (data.empty() || std::any_of(data.begin(), data.end(), [](std::uint8_t byte) { return byte != 0; })) return;
    for (Slave& slave : slaves_) slave.state_read = false;
    begun_ = true;
  }

  void On(const track::AlStatusRead& e) { Of(e.slave).state_read = true; }

  void On(const track::SlaveAccess& access) {
    Slave& slave = Of(access.slave);
    OnOffset(access, slave);
    OnDelay(access, slave);
    OnActivation(access, slave);
  }

  void On(const track::AlRequestSent& e) {
    if (e.slave >= slaves_.size() || e.control.state() == static_cast<std::uint8_t>(esc::AlState::OP)) return;
    if (std::optional<Off>& off = slaves_[e.slave].off) {
      if (!Near(e.frame)) TellOff(e.slave, *off);
      off.reset();
    }
  }

  void Finish() override {
    for (std::size_t i = 0; i < slaves_.size(); ++i) {
      const std::optional<Off>& off = slaves_[i].off;
      if (!off) continue;
      if (Near(context().statistics().last)) {
        NotEvaluable(static_cast<SlaveId>(i), "the capture ends right behind the frame that switches SYNC0 off",
                     off->frame.number);
      } else {
        TellOff(static_cast<SlaveId>(i), *off);
      }
    }
    (void)NotEvaluableWithoutReturns();
  }

 private:
  /// SYNC0 was switched off in OP, and whether the slave leaves OP now is to be seen.
  struct Off {
    FrameRef frame, since;
    esc::SyncActivation before, now;
    bool assumed = false;
  };
  struct Slave {
    std::optional<esc::SyncActivation> activation;
    FrameRef activation_since;
    std::optional<std::uint64_t> offset;
    bool offset_is_wide = false;  ///< all 64 bits of it were seen
    std::optional<std::uint32_t> delay;
    std::optional<Off> off;
    bool state_read = false;  ///< since the master began with all slaves
  };

  Slave& Of(SlaveId id) {
    if (id >= slaves_.size()) slaves_.resize(std::size_t{id} + 1);
    return slaves_[id];
  }

  [[nodiscard]] bool InOp(SlaveId id) const {
    if (begun_ && (id >= slaves_.size() || !slaves_[id].state_read)) return false;
    return context().slave(id).al.SettledIn(esc::AlState::OP);
  }

  /// By what broadcasts show, and nothing else.
  [[nodiscard]] bool MayBeInOp(SlaveId id) const { return some_in_op_ && context().slave(id).al.possible().empty(); }

  void OnActivation(const track::SlaveAccess& access, Slave& slave) {
    if (const ByteSpan written = access.Covered(access.written, esc::kDcActivation, 1); !written.empty()) {
      if (!access.done()) {
        if (access.acceptance == track::Acceptance::kUnknown) slave.activation.reset();
        return;
      }
      const esc::SyncActivation now{written[0]};
      const std::optional<esc::SyncActivation> before = std::exchange(slave.activation, now);
      const FrameRef since = std::exchange(slave.activation_since, access.frame());
      if (Generates(now) && slave.off) {
        TellOff(access.slave, *slave.off);
        slave.off.reset();
      }
      if (Generates(now)) return;
      if (!InOp(access.slave)) {
        if (MayBeInOp(access.slave) && (!before || Generates(*before))) {
          NotEvaluable(access.slave,
                       "whether the slave was in OP when SYNC0 was switched off (0x0981) is not known: its own AL "
                       "Status was not read",
                       access.frame().number);
        }
        return;
      }
      if (!before) {
        NotEvaluable(access.slave, "whether SYNC0 was on (0x0981) before it was switched off in OP is not known",
                     access.frame().number);
        return;
      }
      if (!Generates(*before)) return;
      slave.off = Off{access.frame(), since, *before, now, access.acceptance == track::Acceptance::kAssumed};
      last_off_ = access.frame();
      return;
    }
    if (access.broadcast) return;
    if (const ByteSpan read = access.Covered(access.read, esc::kDcActivation, 1); !read.empty()) {
      if (!slave.activation || slave.activation->raw != read[0]) slave.activation_since = access.frame();
      slave.activation = esc::SyncActivation{read[0]};
    }
  }

  static bool Generates(esc::SyncActivation activation) { return activation.active() && activation.sync0(); }

  void OnOffset(const track::SlaveAccess& access, Slave& slave) {
    const bool writes = !access.written.empty();
    if (!writes && access.broadcast) return;
    const ByteSpan bytes = writes ? access.written : access.read;
    const ByteSpan wide = access.Covered(bytes, esc::kSystemTimeOffset, 8);
    const ByteSpan low = access.Covered(bytes, esc::kSystemTimeOffset, 4);
    if (low.empty()) return;
    if (writes && !access.done()) {
      if (access.acceptance == track::Acceptance::kUnknown) slave.offset.reset();
      return;
    }
    const bool is_wide = !wide.empty();
    const std::uint64_t now =
        is_wide ? LittleEndian<std::uint64_t>(wide, 0) : std::uint64_t{LittleEndian<std::uint32_t>(low, 0)};
    const std::optional<std::uint64_t> before = std::exchange(slave.offset, now);
    const bool both_wide = std::exchange(slave.offset_is_wide, is_wide) && is_wide;
    if (!writes || !InOp(access.slave)) return;
    if (!slave.activation) {
      NotEvaluable(access.slave, "whether SYNC0 was on (0x0981) when 0x0920 was written in OP is not known",
                   access.frame().number);
      return;
    }
    if (!Generates(*slave.activation)) return;
    const std::uint64_t shift = before ? WrappingDifference(now, *before) : now;
    const esc::RegisterImage& registers = context().network().state(access.slave).registers;
    const auto moved = both_wide && context().sync().dc(access.slave).IsWide(registers)
                           ? static_cast<std::int64_t>(shift)
                           : std::int64_t{static_cast<std::int32_t>(static_cast<std::uint32_t>(shift))};
    if (!before || moved != 0) {
      TellShift(access, before.has_value(), moved, now);
    } else if (both_wide && shift != 0 && !registers.Value<std::uint8_t>(esc::kEscFeatures)) {
      NotEvaluable(access.slave,
                   "the upper half of 0x0920 was changed in OP: whether the clock has 64 bit (0x0008) is not known",
                   access.frame().number);
    }
  }

  void OnDelay(const track::SlaveAccess& access, Slave& slave) {
    const bool writes = !access.written.empty();
    if (!writes && access.broadcast) return;
    const ByteSpan bytes = access.Covered(writes ? access.written : access.read, esc::kSystemTimeDelay, 4);
    if (bytes.empty()) return;
    if (writes && !access.done()) {
      if (access.acceptance == track::Acceptance::kUnknown) slave.delay.reset();
      return;
    }
    const auto now = LittleEndian<std::uint32_t>(bytes, 0);
    const std::optional<std::uint32_t> before = std::exchange(slave.delay, now);
    if (!writes || !InOp(access.slave) || !slave.activation || !Generates(*slave.activation)) return;
    if (!before) {
      NotEvaluable(access.slave, "what the delay (0x0928) was before it was written in OP is not known",
                   access.frame().number);
      return;
    }
    const std::int64_t moved = std::int64_t{now} - std::int64_t{*before};
    if (moved > kMeasuredAnewNs || moved < -kMeasuredAnewNs) TellDelay(access, *before, now);
  }

  /// Right behind the last time that SYNC0 of some slave was switched off.
  [[nodiscard]] bool Near(const FrameRef& frame) const {
    if (frame.has_time && last_off_.has_time) {
      // A clock that moves in steps shows a whole one where next to nothing passed.
      return frame.time - last_off_.time <= kShutDownNs + context().statistics().time_step_ns;
    }
    return frame.number - last_off_.number <= kShutDownFrames;
  }

  void TellOff(SlaveId slave, const Off& off) {
    if (Repeat(slave, 0, off.frame) != kNoFinding) return;
    Finding finding = Begin(slave, off.frame, off.assumed);
    finding.title = "SYNC0 switched off in OP";
    finding.message = "Frame " + std::to_string(off.frame.number) + " writes 0x0981 = " + Hex(off.now.raw, 2) +
                      " while the slave is in OP and SYNC0 is on (" + Hex(off.before.raw, 2) + " since frame " +
                      std::to_string(off.since.number) +
                      "): no further pulse comes, and the drive loses its synchronisation. Leave OP first.";
    finding.evidence = {HexNumber("activation_before", off.before.raw), HexNumber("activation", off.now.raw)};
    AddRelated(finding, off.since.number);
    Report(0, std::move(finding));
  }

  void TellShift(const track::SlaveAccess& access, bool known, std::int64_t moved, std::uint64_t now) {
    if (Repeat(access.slave, 1, access.frame()) != kNoFinding) return;
    Finding finding = Begin(access.slave, access.frame(), access.acceptance == track::Acceptance::kAssumed);
    finding.title = known ? "System time shifted by " + Duration(moved) + " in OP" : "System time offset written in OP";
    finding.message =
        "Frame " + std::to_string(access.frame().number) +
        " writes the system time offset (0x0920) while the slave is "
        "in OP and SYNC0 is on" +
        (known ? ", which moves the slave's system time by " + Duration(moved)
               : "; what it was before is not in the capture") +
        ". SYNC0 follows the system time: its next pulse comes at another time, or not at all. Set the offset before "
        "SYNC0 is switched on.";
    finding.evidence.push_back(HexNumber("offset", now));
    if (known) {
      finding.evidence.push_back(Number("shift_ns", moved));
    } else {
      finding.confidence = Confidence::kInferred;
    }
    Report(1, std::move(finding));
  }

  void TellDelay(const track::SlaveAccess& access, std::uint32_t before, std::uint32_t now) {
    if (Repeat(access.slave, 2, access.frame()) != kNoFinding) return;
    Finding finding = Begin(access.slave, access.frame(), access.acceptance == track::Acceptance::kAssumed);
    finding.title = "Propagation delay changed from " + Duration(before) + " to " + Duration(now) + " in OP";
    finding.message =
        "Frame " + std::to_string(access.frame().number) + " writes 0x0928 = " + Duration(now) +
        " while the slave is in OP and SYNC0 is on; before that it was " + Duration(before) +
        ". The slave's clock is regulated to the reference's time plus this delay: its SYNC0 moves by the "
        "difference against the frames and the other slaves. Measure and write delays before SAFEOP.";
    finding.evidence = {Number("delay_before_ns", before), Number("delay_ns", now)};
    Report(2, std::move(finding));
  }

  static Finding Begin(SlaveId slave, const FrameRef& frame, bool assumed) {
    Finding finding;
    finding.slave = slave;
    finding.first = frame;
    if (assumed) finding.confidence = Confidence::kInferred;
    return finding;
  }

  std::vector<Slave> slaves_;
  FrameRef last_off_;  // of any slave
  bool some_in_op_ = false;
  bool begun_ = false;  // the master began with all slaves anew
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncSwitchedOff>};

}  // namespace
}  // namespace ecaudit::sync_switched_off
