#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_model.h"
#include "decoder/base/wrapping.h"
#include "decoder/esc/dc_registers.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/esc/sync_manager.h"
#include "decoder/pipeline.h"
#include "decoder/track/events.h"

namespace ecaudit::sync_switched_off {
namespace {

constexpr Word kShutDown{"sync0-shutdown", "the shutdown of SYNC0"};
constexpr Word kOwnState{"own-al-status", "AL Status (0x0130) of the slave itself"};
constexpr Word kActivationBefore{"activation-before", "the activation of SYNC0 (0x0981) before it was switched off"};
constexpr Word kActivationAtOffset{"activation-at-offset",
                                   "the activation of SYNC0 (0x0981) when the offset (0x0920) was written"};
constexpr Word kClockWidth{"clock-width", "the width of the clock (0x0008)"};
constexpr Word kDelayBefore{"delay-before", "the propagation delay (0x0928) before the write in OP"};

constexpr FindingKind kOff{
    .name = "switched-off",
    .title = "SYNC0 switched off in OP (0x0981 = {activation})",
    .message = R"({frame} writes 0x0981 = {activation} while the slave is in OP. SYNC0 was on: 0x0981 was
{activation_before} since {since_frame}. No further pulse comes, and the drive loses its synchronisation.)",
    .next = "Leave OP before SYNC0 is switched off."};

constexpr FindingKind kShifted{
    .name = "system-time-shifted",
    .title = "System time shifted by {shift_ns} in OP",
    .message = R"({frame} writes the system time offset (0x0920 = {offset}) while the slave is in OP with SYNC0 on. That
moves the system time of the slave by {shift_ns}. SYNC0 follows the system time: its next pulse comes at another time,
or never.)",
    .next = "Set the offset before SYNC0 is switched on."};

constexpr FindingKind kOffsetWritten{
    .name = "offset-written",
    .title = "System time offset (0x0920) written in OP while SYNC0 is on",
    .message = R"({frame} writes the system time offset (0x0920 = {offset}) while the slave is in OP with SYNC0 on. The
offset before is not in the capture, so a new value is assumed. SYNC0 follows the system time: its next pulse comes at
another time, or never.)",
    .next = "Set the offset before SYNC0 is switched on."};

constexpr FindingKind kDelayChanged{
    .name = "delay-changed",
    .title = "Propagation delay changed from {delay_before_ns} to {delay_ns} in OP",
    .message =
        R"({frame} changes the propagation delay (0x0928) from {delay_before_ns} to {delay_ns} while the slave is in
OP with SYNC0 on. The clock of the slave is regulated to the reference time plus this delay. So its SYNC0 moves by the
difference against the frames and the other slaves.)",
    .next = "Measure and write delays before SAFEOP."};

constexpr const FindingKind* kKinds[] = {&kOff, &kShifted, &kOffsetWritten, &kDelayChanged};

constexpr RuleInfo kInfo{.id = "sync-switched-off",
                         .group = "Synchronisation",
                         .severity = Severity::kError,
                         .subject = Subject::kClock,
                         .title = "SYNC0 is switched off, or the system time is shifted, in OP",
                         .needs = "AL Status OP, writes of 0x0981, 0x0920 and 0x0928 of the slave",
                         .source = "ESC-1, distributed clocks, SYNC signal generation",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Writes that take the clock from a drive while it runs by it, in OP:

- the cyclic generation of SYNC0 is switched off (0x0981 bit 0 or 1),
- the system time offset (0x0920) is changed,
- the propagation delay (0x0928) is changed.

## Why it matters
Without SYNC0 the drive loses its time base within a few cycles and faults. Another offset makes its system time jump:
the next SYNC0 pulse comes too early, too late, or only after the clock wraps. To another delay the clock of the slave
is regulated with each distribution of the time: its SYNC0 moves against that of the others, and against the frames.

## How it is decided
- AL Status showed OP, and no request to leave it is in flight. If the master starts up again, it clears the station
  addresses or sync managers of all slaves by broadcast. After that OP counts only when it is read again.
- SYNC0 was on before, as a write or a read of 0x0981 showed, and the slave accepted the write. If it is not known
  whether SYNC0 is on, nothing is reported.
- Masters that shut down switch SYNC0 off slave by slave and then request another state. If that request follows within
  10 ms, nothing is reported.
- An offset counts if SYNC0 is on and the value differs from the last one that was written or read. Another upper half
  does not count if the clock has 32 bit (0x0008). If no value was seen before, the value counts as new (inferred).
- A delay counts if SYNC0 is on and it differs from the last one by more than 1 us. Masters that measure again stay
  below that.
- Corrections by 0x0910, the regular distribution of the system time, do not concern this rule.

## Example
samples/captures/sync-switched-off.pcapng

## What to do
Leave OP (request SAFEOP or PREOP) before SYNC0, the offset or the delay is changed. Set clocks up before SAFEOP.
)"};

/// A delay that was measured again differs by less: slaves are synchronised within it.
constexpr std::int64_t kMeasuredAgainNs = 1000;

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
    Subscribe<track::Answered>(&SyncSwitchedOff::OnClear,
                               MemoryRange::Of(esc::kSyncManagerBase, esc::kSyncManagerBytes));
    Subscribe<track::AlStatusRead>(&SyncSwitchedOff::On);
  }

  /// If the state of a slave itself is not known, that of all slaves may be.
  void OnStates(const track::Answered& e) {
    if (e.command != wire::Command::BRD || e.wkc == 0 || e.circulating || e.address > esc::kAlStatus) return;
    const auto at = static_cast<std::size_t>(esc::kAlStatus - e.address);
    if (!Fits(e.returned_data, at, 1)) return;
    some_in_op_ = (e.returned_data[at] & static_cast<std::uint8_t>(esc::AlState::OP)) != 0;
  }

  /// A master that found slaves begins with all of them: what ran before has ended, or is not its own.
  void OnClear(const track::Answered& e) {
    if (e.command != wire::Command::BWR || e.wkc == 0 || e.circulating) return;
    const ByteSpan data = e.returned_data;
    if (data.empty() || std::ranges::any_of(data, [](std::uint8_t byte) { return byte != 0; })) return;
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
      if (!Near(e.frame)) ReportOff(e.slave, *off);
      off.reset();
    }
  }

  void Finish() override {
    for (std::size_t i = 0; i < slaves_.size(); ++i) {
      const std::optional<Off>& off = slaves_[i].off;
      if (!off) continue;
      if (Near(context().statistics().last)) {
        NotEvaluable(static_cast<SlaveId>(i), ReasonCode::kCaptureEnds, kShutDown, off->frame.number);
      } else {
        ReportOff(static_cast<SlaveId>(i), *off);
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
    bool state_read = false;  ///< since the master started up all slaves again
  };

  Slave& Of(SlaveId id) {
    if (id >= slaves_.size()) slaves_.resize(std::size_t{id} + 1);
    return slaves_[id];
  }

  [[nodiscard]] bool InOp(SlaveId id) const {
    if (begun_ && (id >= slaves_.size() || !slaves_[id].state_read)) return false;
    return context().slave(id).al.SettledIn(esc::AlState::OP);
  }

  /// By broadcasts alone.
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
        ReportOff(access.slave, *slave.off);
        slave.off.reset();
      }
      if (Generates(now)) return;
      if (!InOp(access.slave)) {
        if (MayBeInOp(access.slave) && (!before || Generates(*before))) {
          NotEvaluable(access.slave, ReasonCode::kNotRead, kOwnState, access.frame().number);
        }
        return;
      }
      if (!before) {
        NotEvaluable(access.slave, ReasonCode::kNotInCapture, kActivationBefore, access.frame().number);
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
      NotEvaluable(access.slave, ReasonCode::kNotInCapture, kActivationAtOffset, access.frame().number);
      return;
    }
    if (!Generates(*slave.activation)) return;
    const std::uint64_t shift = before ? WrappingDifference(now, *before) : now;
    const esc::RegisterImage& registers = context().network().state(access.slave).registers;
    const auto moved = both_wide && context().sync().dc(access.slave).IsWide(registers)
                           ? static_cast<std::int64_t>(shift)
                           : std::int64_t{static_cast<std::int32_t>(static_cast<std::uint32_t>(shift))};
    if (!before || moved != 0) {
      ReportOffset(access, before.has_value(), moved, now);
    } else if (both_wide && shift != 0 && !registers.Value<std::uint8_t>(esc::kEscFeatures)) {
      NotEvaluable(access.slave, ReasonCode::kNotInCapture, kClockWidth, access.frame().number);
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
    if (!before) return NotEvaluable(access.slave, ReasonCode::kNotInCapture, kDelayBefore, access.frame().number);
    const std::int64_t moved = std::int64_t{now} - std::int64_t{*before};
    if (moved > kMeasuredAgainNs || moved < -kMeasuredAgainNs) ReportDelay(access, *before, now);
  }

  /// Shortly after SYNC0 of a slave was switched off.
  [[nodiscard]] bool Near(const FrameRef& frame) const {
    if (frame.has_time && last_off_.has_time) {
      // A clock that moves in steps shows a whole step even after next to no time.
      return frame.time - last_off_.time <= kShutDownNs + context().statistics().time_step_ns;
    }
    return frame.number - last_off_.number <= kShutDownFrames;
  }

  void ReportOff(SlaveId slave, const Off& off) {
    if (Repeat(slave, 0, off.frame) != kNoFinding) return;
    Finding finding = FindingOf(kOff, slave, off.frame, off.assumed);
    finding.Set("activation_before", arg::Hex(off.before.raw, 2))
        .Set("activation", arg::Hex(off.now.raw, 2))
        .Set("since_frame", arg::Frame(off.since.number));
    AddRelated(finding, off.since.number);
    Report(0, std::move(finding));
  }

  void ReportOffset(const track::SlaveAccess& access, bool known, std::int64_t moved, std::uint64_t now) {
    if (Repeat(access.slave, 1, access.frame()) != kNoFinding) return;
    Finding finding = FindingOf(known ? kShifted : kOffsetWritten, access.slave, access.frame(), IsAssumed(access));
    finding.Set("offset", arg::Hex(now));
    if (known) {
      finding.Set("shift_ns", arg::Ns(moved));
    } else {
      finding.confidence = Confidence::kInferred;
    }
    Report(1, std::move(finding));
  }

  void ReportDelay(const track::SlaveAccess& access, std::uint32_t before, std::uint32_t now) {
    if (Repeat(access.slave, 2, access.frame()) != kNoFinding) return;
    Finding finding = FindingOf(kDelayChanged, access.slave, access.frame(), IsAssumed(access));
    finding.Set("delay_before_ns", arg::Ns(before)).Set("delay_ns", arg::Ns(now));
    Report(2, std::move(finding));
  }

  static bool IsAssumed(const track::SlaveAccess& access) { return access.acceptance == track::Acceptance::kAssumed; }

  static Finding FindingOf(const FindingKind& kind, SlaveId slave, const FrameRef& frame, bool assumed) {
    Finding finding = Found(kind, slave, frame);
    if (assumed) finding.confidence = Confidence::kInferred;
    return finding;
  }

  std::vector<Slave> slaves_;
  FrameRef last_off_;  // of any slave
  bool some_in_op_ = false;
  bool begun_ = false;  // the master started up all slaves again
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncSwitchedOff>};

}  // namespace
}  // namespace ecaudit::sync_switched_off
