#include <algorithm>
#include <bit>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_events.h"
#include "analyzers/sync/sync_model.h"
#include "decoder/base/time.h"
#include "decoder/esc/dc_registers.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/access.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::sync_difference_large {
namespace {

constexpr EscAddress kControlEnd = 0x0936;
constexpr std::int64_t kDefaultLimit = 1000;
constexpr TimeNs kSettleTime = 5'000'000'000;
constexpr TimeNs kLongWait = 1'000'000'000;
/// 0x092C is the mean over this many distributions (0x0934 after power-on), and begins with 0.
constexpr std::uint64_t kFilter = 16;
/// Longer than any line of slaves delays a frame, wherever on it the capture was taken.
constexpr TimeNs kLongestLine = 1'000'000;

constexpr Word kDifference{"time-difference", "the time difference (0x092C) in SAFEOP or OP"};
constexpr Word kLaterDifference{"time-difference-while-distributed",
                                "the time difference (0x092C) while the system time was distributed"};

constexpr FindingKind kClockOff{
    .name = "clock-off",
    .title = "Clock is {difference_ns} away from the system time (limit {limit_ns})",
    .message =
        R"(The time difference (0x092C) reads {difference_ns} in {frame}, in SAFEOP or OP and after settling. Up to
{limit_ns} is usual.)",
    .next =
        R"(Check that ARMW, FRMW or BWR of 0x0910 distributes the system time in each cycle. Check the offset (0x0920)
and the propagation delay (0x0928).)"};

constexpr FindingKind kClockOfOneOff{
    .name = "clock-of-one-off",
    .title = "Clock of one slave is {at_least_ns} or more away from the system time",
    .message = R"(A broadcast read of the time difference (0x092C) gives {difference_or_ns} ns in {frame}, the OR over
{slaves}. So at least one of them is {at_least_ns} or more away, in SAFEOP or OP and after settling. Up to {limit_ns}
is usual.)",
    .next = "Read 0x092C of each slave to find it."};

constexpr FindingKind kDelayTooLong{
    .name = "delay-too-long",
    .title = "Propagation delay is {delay_ns}, but a round trip takes {round_trip_ns}",
    .message = R"(In {frame} the propagation delay (0x0928) is {delay_ns}. Frames with process data return after
{round_trip_ns}, so their way to this slave cannot take longer. The system time and the SYNC0 of this slave are off by
the difference. 0x092C does not show that.)",
    .next = "Compute the delay from receive times (0x0900) that were latched and read together."};

constexpr FindingKind kNeverSettles{
    .name = "never-settles",
    .title = "Clock is still {difference_ns} off after {waited_ms} of waiting",
    .message =
        R"(The master reads the time difference (0x092C) {reads}, from {since_frame} to {frame}, for {waited_ms}. It
is {first_ns} at first and {difference_ns} in the last read. Then the slave goes on to {state}. Up to {limit_ns} is usual.)",
    .next =
        R"(Send ARMW or FRMW of 0x0910 in each cycle while the slave is in PREOP, too. Check the offset (0x0920) and whether
the time of the master is what it writes to the reference clock.)"};

constexpr const FindingKind* kKinds[] = {&kClockOff, &kClockOfOneOff, &kDelayTooLong, &kNeverSettles};

/// Its findings are the cause of delays that cannot be true.
constexpr std::string_view kPortOrder = "bus-port-order";
constexpr std::string_view kAfter[] = {kPortOrder};

constexpr RuleInfo kInfo{.id = "sync-difference-large",
                         .group = "Synchronisation",
                         .severity = Severity::kWarning,
                         .subject = Subject::kClock,
                         .title = "The clock of a slave stays away from the system time",
                         .needs = "reads of the time difference 0x092C in SAFEOP or OP while the time is distributed",
                         .source = "ESC-1, distributed clocks, system time difference 0x092C",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
- The magnitude of 0x092C while the slave is in SAFEOP or OP: more than 1 us after it settled. 0x092C is the mean
  difference between the slave's copy of the system time and the time that it receives.
- The propagation delay (0x0928) of a slave with SYNC0. The delay is part of its clock, and 0x092C does not show that it
  is wrong.

## Why it matters
SYNC0 of this slave is off by that much against the other axes. Possible causes are a wrong propagation delay, a
drifting clock without compensation, and a control loop that does not settle.

## How it is decided
- A slave has settled when a read was within the limit, or 5 s after the first read. This starts again when offset,
  delay or the control loop (0x0920 to 0x0935) are written.
- A read counts once the time was distributed 16 times since (ARMW, FRMW or BWR of 0x0910). Before, 0x092C is 0 or old.
- Some masters (IgH EtherLab) read 0x092C in PREOP only, and go on when they have waited long enough. That is a finding
  (`never-settles`) if the slave reaches SAFEOP and these reads last 1 s or more, all are beyond the limit, and the last
  one is more than half of the first. A later read within the limit clears it.
- Only bits 0 to 30 count: the manuals differ on bit 31.
- A broadcast read is the OR over all slaves. At least half of its value must be true of one slave.
- The limit in ns is configurable: sync-difference-large.
- A propagation delay is certainly wrong if it is longer than 1 ms and than the whole round trip of the frames with
  process data, by good stamps. Its cause is bus-port-order, if that rule found a slave with swapped cables.

## Example
tests/rules/sync-difference-large/violates.trace

## What to do
Check that ARMW, FRMW or BWR of 0x0910 runs in each cycle. Check that offset and delay were computed after the last
change of the topology. Let the start-up wait until 0x092C is small.
)"};

class SyncDifferenceLarge final : public Rule {
 public:
  SyncDifferenceLarge() : Rule(kInfo) {
    Subscribe<track::SlaveAccess>(&SyncDifferenceLarge::On,
                                  MemoryRange::Of(esc::kSystemTimeOffset, kControlEnd - esc::kSystemTimeOffset));
    Subscribe<track::Answered>(&SyncDifferenceLarge::On, MemoryRange::Of(esc::kSystemTimeDifference, 4));
    Subscribe<sync::SlaveRunEnded>(&SyncDifferenceLarge::On);
  }

  /// The next run may have another delay, or no SYNC0.
  void On(const sync::SlaveRunEnded& e) {
    if (e.slave < slaves_.size() && context().sync().dc(e.slave).last_active()) CheckDelay(e.slave, slaves_[e.slave]);
  }

  void On(const track::SlaveAccess& access) {
    if (access.slave >= slaves_.size()) slaves_.resize(static_cast<std::size_t>(access.slave) + 1);
    Slave& slave = slaves_[access.slave];
    if (!access.written.empty() && access.acceptance != track::Acceptance::kRefused) {
      slave.settled = any_.settled = false;
      slave.first = any_.first = {};
      waits_.erase(access.slave);
      slave.distributed = any_.distributed = context().sync().clock().distributions();
    }
    const ByteSpan written = access.Covered(access.written, esc::kSystemTimeDelay, 4);
    const ByteSpan delay = written.empty() ? access.Covered(access.read, esc::kSystemTimeDelay, 4) : written;
    if (!delay.empty() && !access.broadcast && access.done()) {
      slave.delay_ns = LittleEndian<std::uint32_t>(delay, 0);
      slave.delay_frame = access.frame();
    }
    if (access.broadcast) return;
    const ByteSpan raw = access.Covered(access.read, esc::kSystemTimeDifference, 4);
    if (raw.empty()) return;
    const std::uint32_t magnitude = esc::TimeDifference{LittleEndian<std::uint32_t>(raw, 0)}.magnitude_ns();
    if (!Synchronous(access.slave)) return Wait(access.slave, access.frame(), magnitude);
    if (magnitude <= LimitNs()) waits_.erase(access.slave);
    slave.read = true;
    if (!IsDistributed(slave)) return;
    if (!Settled(slave, access.frame(), magnitude)) return;
    if (Repeat(access.slave, 0, access.frame()) != kNoFinding) return;
    Finding finding = Found(kClockOff, access.slave, access.frame());
    finding.Set("difference_ns", arg::Ns(magnitude)).Set("limit_ns", arg::Ns(LimitNs()));
    Report(0, std::move(finding));
  }

  void On(const track::Answered& e) {
    if (e.command != wire::Command::BRD || e.wkc == 0 || e.circulating || e.address > esc::kSystemTimeDifference)
      return;
    const auto at = static_cast<std::size_t>(esc::kSystemTimeDifference - e.address);
    if (!Fits(e.returned_data, at, 4)) return;
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      if (!Synchronous(static_cast<SlaveId>(s))) return;  // another slave may still be starting up
    }
    const std::uint32_t all = esc::TimeDifference{LittleEndian<std::uint32_t>(e.returned_data, at)}.magnitude_ns();
    const std::uint32_t of_some = all == 0 ? 0 : std::bit_floor(all);
    any_.read = true;
    if (!IsDistributed(any_)) return;
    if (!Settled(any_, e.returned, of_some) || Repeat(kNoSlave, 1, e.returned) != kNoFinding) return;
    Finding finding = Found(kClockOfOneOff, kNoSlave, e.returned);
    finding.Set("difference_or_ns", arg::Number(all))
        .Set("limit_ns", arg::Ns(LimitNs()))
        .Set("at_least_ns", arg::Ns(of_some))
        .Set("slaves", arg::Count(e.wkc, "slave"));
    Report(1, std::move(finding));
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      // The clock of any run counts: the last one may have ended in INIT.
      if (!context().sync().dc(id).activated()) continue;
      if (s < slaves_.size()) CheckDelay(id, slaves_[s]);
      if (s < slaves_.size() && CheckWait(id)) continue;
      const bool read = any_.read || (s < slaves_.size() && slaves_[s].read);
      const bool counted = any_.counted || (s < slaves_.size() && slaves_[s].counted);
      if (!read) NotEvaluable(id, ReasonCode::kNotRead, kDifference);
      if (read && !counted) NotEvaluable(id, ReasonCode::kNotRead, kLaterDifference);
    }
    for (const FindingIndex delay : delays_) NameWiring(context().store[delay]);
  }

 private:
  /// Reads of a master that waits in PREOP until the clock has settled.
  struct Waiting {
    FrameRef first, last;
    std::uint32_t first_ns = 0, last_ns = 0;
    std::uint64_t reads = 0;
  };
  struct Slave {
    bool read = false;     ///< 0x092C was
    bool counted = false;  ///< and it meant something
    bool settled = false;
    FrameRef first;
    std::uint64_t distributed = 0;  ///< how often the time was when the clock was set up
    std::uint32_t delay_ns = 0;     ///< 0x0928
    FrameRef delay_frame;
    FrameNo reported_delay = 0;  ///< the frame of the last one that was checked and too long
  };

  [[nodiscard]] std::int64_t LimitNs() const { return context().Limit("sync-difference-large", kDefaultLimit); }
  [[nodiscard]] bool Synchronous(SlaveId id) const {
    const model::AlMachine& al = context().slave(id).al;
    return al.SettledIn(esc::AlState::OP) || al.SettledIn(esc::AlState::SAFEOP);
  }
  [[nodiscard]] bool IsDistributed(Slave& slave) {
    const bool is = context().sync().clock().distributions() >= slave.distributed + kFilter;
    slave.counted = slave.counted || is;
    return is;
  }

  void Wait(SlaveId id, const FrameRef& frame, std::uint32_t magnitude) {
    if (magnitude <= LimitNs()) {
      waits_.erase(id);
    } else if (IsDistributed(slaves_[id])) {
      Waiting& wait = waits_[id];
      if (wait.reads++ == 0) {
        wait.first = frame;
        wait.first_ns = magnitude;
      }
      wait.last = frame;
      wait.last_ns = magnitude;
    }
  }

  /// True when the clock of the slave is reported.
  bool CheckWait(SlaveId id) {
    const auto found = waits_.find(id);
    if (found == waits_.end()) return false;
    const Waiting& wait = found->second;
    const model::AlMachine& al = context().slave(id).al;
    if (wait.reads < kFilter || !wait.first.has_time || !wait.last.has_time || !Synchronous(id)) return false;
    const TimeNs waited = Elapsed(wait.first.time, wait.last.time);
    if (waited < kLongWait || wait.last_ns <= wait.first_ns / 2) return false;
    if (context().network().MayMissBetween(wait.first.number, wait.last.number)) return false;
    Finding finding = Found(kNeverSettles, id, wait.last);
    AddRelated(finding, wait.first.number);
    finding.Set("difference_ns", arg::Ns(wait.last_ns))
        .Set("first_ns", arg::Ns(wait.first_ns))
        .Set("waited_ms", arg::Ms(waited))
        .Set("reads", arg::Count(wait.reads, "time"))
        .Set("since_frame", arg::Frame(wait.first.number))
        .Set("state", arg::State(static_cast<std::uint8_t>(al.SettledIn(esc::AlState::OP) ? esc::AlState::OP
                                                                                          : esc::AlState::SAFEOP)))
        .Set("limit_ns", arg::Ns(LimitNs()));
    (void)Report(3, std::move(finding));
    return true;
  }

  void CheckDelay(SlaveId id, Slave& slave) {
    const std::optional<TimeNs> trip = context().sync().UsualRoundTrip();
    const TimeNs delay = slave.delay_ns;
    if (!trip || delay <= std::max(*trip, kLongestLine) || slave.reported_delay == slave.delay_frame.number) return;
    slave.reported_delay = slave.delay_frame.number;
    if (Repeat(id, 2, slave.delay_frame) != kNoFinding) return;
    Finding finding = Found(kDelayTooLong, id, slave.delay_frame);
    finding.Set("delay_ns", arg::Ns(delay)).Set("round_trip_ns", arg::Ns(*trip));
    delays_.push_back(Report(2, std::move(finding)));
  }

  /// The master computes the delays of all slaves from the receive times of each: one that is wired the wrong way round
  /// is enough. That of the slave itself first.
  void NameWiring(Finding& delay) const {
    const std::vector<Finding>& findings = context().store.findings();
    for (FindingIndex i = 0; i < findings.size(); ++i) {
      if (findings[i].rule != kPortOrder) continue;
      if (delay.caused_by == kNoFinding || findings[i].slave == delay.slave) delay.caused_by = i;
    }
  }

  /// True when `magnitude` is to be reported.
  bool Settled(Slave& slave, const FrameRef& frame, std::uint32_t magnitude) const {
    if (!slave.first.seen()) slave.first = frame;
    if (magnitude <= LimitNs()) {
      slave.settled = true;
      return false;
    }
    if (!slave.settled && slave.first.has_time && frame.has_time &&
        Elapsed(slave.first.time, frame.time) >= kSettleTime) {
      slave.settled = true;
    }
    return slave.settled;
  }

  std::vector<Slave> slaves_;
  std::map<SlaveId, Waiting> waits_;  ///< of few slaves
  Slave any_;
  std::vector<FindingIndex> delays_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncDifferenceLarge>};

}  // namespace
}  // namespace ecaudit::sync_difference_large
