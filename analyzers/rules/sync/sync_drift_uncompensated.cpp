#include <utility>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_model.h"
#include "decoder/base/bytes.h"
#include "decoder/base/time.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/events.h"

namespace ecaudit::sync_drift_uncompensated {
namespace {

constexpr std::int64_t kDefaultLimit = 1'000'000'000;
/// The slaves in OP are checked once in this many frames.
constexpr std::uint32_t kCheckEvery = 32;
/// Process data further apart are two runs with a pause between them.
constexpr TimeNs kPause = 100'000'000;

constexpr Word kDistribution{"time-distribution", "the distribution of the system time"};

constexpr FindingKind kNotDistributed{
    .name = "not-distributed",
    .title = "System time not distributed for {gap_ms} although SYNC0 is in use",
    .message = R"([{slave_in_op} is in OP with SYNC0 since {since_frame}.][{!slave_in_op}The last distribution of the
system time is in {since_frame}.] After it no slave answered ARMW, FRMW or BWR of 0x0910 for {gap_ms}; the limit is
{limit_ms}. The clocks of the slaves drift apart.)",
    .next = "Send FRMW of 0x0910 to the reference clock in each cycle."};

constexpr FindingKind kReferenceAway{
    .name = "reference-away",
    .title = "{command} gives {slaves} the time {time} of the master: no reference clock",
    .message = R"(From {frame} to {last_frame}, {count} times, {command} of 0x0910 returned with the data that the
master sent ({time}). So the reference clock[ ({reference})] did not answer, but {slaves} took these data. They regulate
their clocks to them, as to the time of the reference clock. {slave_in_op} is in OP with SYNC0.)",
    .next = "Find out why the reference clock does not answer. End the distribution while it is away."};

constexpr const FindingKind* kKinds[] = {&kNotDistributed, &kReferenceAway};

constexpr RuleInfo kInfo{.id = "sync-drift-uncompensated",
                         .group = "Synchronisation",
                         .severity = Severity::kWarning,
                         .subject = Subject::kClock,
                         .title = "SYNC0 is in use in OP, but the system time is not distributed",
                         .needs = "SYNC0 switched on and AL state OP of a slave, two slaves with clocks, time stamps",
                         .source = "ESC-1, distributed clocks, clock synchronisation and drift compensation",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
While a slave with SYNC0 is in OP, the system time must be distributed: by ARMW or FRMW of 0x0910, or by BWR of a time
that increases from write to write. The rule reports more than a second without it.

Also whether the slave that ARMW or FRMW addresses answers. If it is away, the other slaves take what the master sent
(usually 0) for the time of the reference clock. Ten such frames one after the other are reported.

## Why it matters
Each slave has its own quartz. Without distribution the clocks drift apart by up to 0.1 ms per second, and the SYNC0
pulses with them. The axes slowly lose their common time.

## How it is decided
- At least two slaves showed a clock unit. A single clock cannot drift against another.
- The time is that of the stamps of the capture. It counts from the last distribution, or from when the slave was seen
  in OP with SYNC0 on.
- Only time with process data counts. Pauses of 100 ms and more are left out: they may be capture gaps.
- A frame that is cut by the snap length may have carried the distribution: the time starts again at it.
- The limit in ns is configurable: sync-drift-uncompensated.

## Example
tests/rules/sync-drift-uncompensated/violates.trace

## What to do
Send FRMW (or ARMW) of 0x0910 to the reference clock in each cycle, with the process data.
)"};

class SyncDriftUncompensated final : public Rule {
 public:
  SyncDriftUncompensated() : Rule(kInfo) {
    Subscribe<track::LogicalAccess>(&SyncDriftUncompensated::On);
    Subscribe<track::Answered>(&SyncDriftUncompensated::On, MemoryRange::Of(esc::kSystemTime, 4));
  }

  /// A reference clock changes the data. Outbound copies with a counter were captured downstream of slaves.
  void On(const track::Answered& e) {
    const bool distributes = e.command == wire::Command::ARMW || e.command == wire::Command::FRMW;
    if (!in_use_since_.seen() || !distributes || !e.returned.seen() || e.address != esc::kSystemTime) return;
    if (e.wkc == 0 || e.sent_wkc != 0 || e.circulating || !SameBytes(e.sent_data, e.returned_data)) {
      if (away_.count != 0) away_ = {};
      return;
    }
    if (e.returned_data.size() < 4) return;
    if (away_.count == 0) away_.first = e.returned;
    ++away_.count;
    if (away_.finding != kNoFinding) {
      context().store[away_.finding].last = e.returned;
      ++context().store[away_.finding].count;
    } else if (away_.count == kSeveral && context().sync().clock().distributions() > 0) {
      ReportAway(e);
    }
  }

  void On(const track::LogicalAccess& e) {
    if (frames_++ % kCheckEvery == 0) CheckUse(e.frame());
    if (!in_use_since_.has_time || !e.frame().has_time) return;
    const FrameRef& last = context().sync().clock().last_distribution();
    const FrameRef& from = last.has_time && last.number > in_use_since_.number ? last : in_use_since_;
    const FrameRef before = std::exchange(last_frame_, e.frame());
    const FrameNo cut = context().statistics().last_cut.number;
    if (from.number != measured_from_ || cut != last_cut_) {  // what is cut off may have been the distribution
      measured_from_ = from.number;
      last_cut_ = cut;
      gap_ = 0;
    }
    // A pause in which nothing was sent, or over which the clock was set, shows nothing of the distribution.
    if (before.has_time && before.number >= from.number) {
      const TimeNs step = Elapsed(before.time, e.frame().time);
      if (step > 0 && step < kPause) gap_ += step;
    }
    if (gap_ == 0) return;  // nearly always: each frame brings the time
    const TimeNs gap = gap_;
    const TimeNs limit = context().Limit("sync-drift-uncompensated", kDefaultLimit);
    if (gap <= limit || e.frame().number <= from.number) return;
    const auto uncertainty = context().sync().Uncertainty(sync::TimeBase::kCapture);
    if (!uncertainty) {
      if (!reported_coarse_) {
        NotEvaluable(kNoSlave, ReasonCode::kStampsTooCoarse, kDistribution, e.frame().number);
      }
      reported_coarse_ = true;
      return;
    }
    if (gap - *uncertainty <= limit) return;
    if (from.number == reported_from_) {  // the same gap goes on
      if (reported_ != kNoFinding) context().store[reported_].last = e.frame();
      return;
    }
    reported_from_ = from.number;
    reported_ = Repeat(kNoSlave, 0, e.frame());
    if (reported_ != kNoFinding) return;
    Finding finding = Found(kNotDistributed, kNoSlave, e.frame());
    AddRelated(finding, from.number);
    finding.Set("gap_ms", arg::Ms(gap)).Set("limit_ms", arg::Ms(limit)).Set("since_frame", arg::Frame(from.number));
    if (from.number == in_use_since_.number) {
      finding.Set("slave_in_op", arg::Slave(slave_, context().Label(slave_)));
    }
    if (away_.count != 0) finding.caused_by = away_.finding;
    reported_ = Report(0, std::move(finding));
  }

  void Finish() override { (void)NotEvaluableWithoutReturns(); }

 private:
  static constexpr std::uint64_t kSeveral = 10;

  void ReportAway(const track::Answered& e) {
    if ((away_.finding = Repeat(kNoSlave, 1, e.returned)) != kNoFinding) return;
    Finding finding = Found(kReferenceAway, kNoSlave, away_.first);
    finding.last = e.returned;
    finding.count = away_.count;
    AddRelated(finding, context().sync().clock().last_distribution().number);
    finding.Set("command", arg::Text(wire::Name(e.command)))
        .Set("slaves", arg::Count(e.wkc, "slave"))
        .Set("time", arg::Number(LittleEndian<std::uint32_t>(e.returned_data, 0)))
        .Set("slave_in_op", arg::Slave(slave_, context().Label(slave_)));
    if (e.slave != kNoSlave) finding.Set("reference", arg::Slave(e.slave, context().Label(e.slave)));
    away_.finding = Report(1, std::move(finding));
  }

  void CheckUse(const FrameRef& frame) {
    std::size_t clocks = 0;
    SlaveId in_use = kNoSlave;
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      const sync::DcUnit& unit = context().sync().dc(id);
      if (unit.present()) ++clocks;
      if (unit.active() && unit.active()->activation.sync0() && context().slave(id).al.SettledIn(esc::AlState::OP)) {
        in_use = id;
      }
    }
    if (clocks < 2 || in_use == kNoSlave) {
      in_use_since_ = {};
    } else if (!in_use_since_.seen()) {
      in_use_since_ = frame;
      slave_ = in_use;
    }
  }

  /// Frames one after the other in which the reference clock did not answer.
  struct Away {
    FrameRef first;
    std::uint64_t count = 0;
    FindingIndex finding = kNoFinding;
  };
  Away away_;
  std::uint32_t frames_ = 0;
  FrameRef in_use_since_;
  SlaveId slave_ = kNoSlave;
  FrameNo reported_from_ = 0;
  FindingIndex reported_ = kNoFinding;
  FrameRef last_frame_;        ///< last process data
  FrameNo measured_from_ = 0;  ///< last distribution, or since when clocks are in use ...
  TimeNs gap_ = 0;             ///< ... and how long process data have been exchanged since
  FrameNo last_cut_ = 0;       ///< by the snap length, up to the last process data
  bool reported_coarse_ = false;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncDriftUncompensated>};

}  // namespace
}  // namespace ecaudit::sync_drift_uncompensated
