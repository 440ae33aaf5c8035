#include <optional>
#include <utility>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/sync/sync_events.h"
#include "analyzers/sync/sync_model.h"
#include "decoder/base/time.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/access.h"
#include "decoder/track/events.h"

namespace ecaudit::sync_start_in_past {
namespace {

constexpr Word kActivationBefore{"activation-before", "the activation of SYNC0 (0x0981) before it was switched on"};
constexpr Word kSystemTime{"system-time", "the system time (0x0910) before SYNC0 was switched on"};
constexpr Word kTimeOfActivation{"time-of-activation", "the system time when SYNC0 was switched on"};
constexpr Word kStartTime{"start-time", "the start time of SYNC0 (0x0990)"};

constexpr FindingKind kInPast{
    .name = "start-in-past",
    .title = "SYNC0 start time lies [{late_years}][{!late_years}{late_ns}] in the past",
    .message = R"({frame} switches SYNC on (0x0981 = {activation}) with the start time {start_time_ns} ns (0x0990). But
{read_frame} read the system time {system_time_ns} ns[, {since_read_ns} before].[{?low_half} Only the low 32 bits of
both count for this clock.] So the first pulse comes only after the clock wraps.)",
    .next = R"(Read the system time directly before, and let the start lie far enough ahead (100 ms is usual).)"};

constexpr FindingKind kFarAhead{
    .name = "start-far-ahead",
    .title = "SYNC0 starts only [{ahead_years}][{!ahead_years}{ahead_ns}] after it is switched on",
    .message = R"({frame} switches SYNC on (0x0981 = {activation}) with the start time {start_time_ns} ns (0x0990). But
{read_frame} read the system time {system_time_ns} ns.[{?low_half} Only the low 32 bits of both count for this clock.]
So the first pulse comes [{ahead_years}][{!ahead_years}{ahead_ns}] later, and the drive waits for it.[ The master
requests OP already in {request_frame}.][{?since_1970} The start time counts from 1970, the system time of EtherCAT
from 2000.])",
    .next =
        R"(Take the start time from the system time that was read, and let it lie a little ahead (100 ms is usual).)"};

constexpr FindingKind kNotSet{
    .name = "start-not-set",
    .title = "SYNC0 switched on before its start time (0x0990) is written",
    .message = R"({frame} switches SYNC on (0x0981 = {activation}), but the start time (0x0990) is written only in
{start_frame}. The slave waits for the time that 0x0990 held before, mostly 0. That time has passed, so no pulse comes
until the clock wraps.)",
    .next = "Write start time and cycle (0x0990, 0x09A0) first, and 0x0981 last."};

constexpr const FindingKind* kKinds[] = {&kInPast, &kFarAhead, &kNotSet};

constexpr RuleInfo kInfo{.id = "sync-start-in-past",
                         .group = "Synchronisation",
                         .severity = Severity::kError,
                         .subject = Subject::kClock,
                         .title = "SYNC0 starts in the past, or too far in the future",
                         .needs = "start time 0x0990, activation 0x0981, and a read of the system time 0x0910 before",
                         .source = "ESC-1, distributed clocks, SYNC signal generation",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
The start time (0x0990) against the system time when cyclic operation is switched on (0x0981 bit 0). It must not lie in
the past or too far ahead, and it must be written before.

## Why it matters
The first pulse comes when the system time equals the start time. A start time that has passed is reached again only
after the clock wraps: after 4.3 s with 32 bit, after 584 years with 64 bit. The drive waits without a sync signal and
refuses SAFEOP or OP, or loses synchronisation at once.

## How it is decided
- The system time is that of the last read of 0x0910 at this slave. If there is none, it is that of the reference clock,
  provided that offset and delay of this slave were set.
- The system time only grows after that read, so a start time before it is certainly in the past. Otherwise the time
  since the read is added by the stamps of the capture, unless their uncertainty leaves the result open.
- Far ahead is more than 1 h, or more than 10 s that remain when OP is requested. A start time that counts from 1970
  instead of 2000 is 30 years ahead.
- A 32 bit clock compares only the low halves. The clock counts as such unless bit 3 of 0x0008, or a larger time that
  was read, shows 64 bit.
- If the start time is unknown when SYNC is switched on, writing it after 0x0981 is the fault.
- Nothing is evaluated if SYNC was not seen switched off before, or starts by itself (0x0981 bit 3).

## Example
tests/rules/sync-start-in-past/violates.trace

## What to do
Read the system time directly before, and add enough for the rest of the configuration: masters usually take 100 ms.
)"};

/// A drive that has to wait for longer is not meant to.
constexpr TimeNs kLongWait = 10'000'000'000;
/// A wait of more than this is reported without a request of OP.
constexpr TimeNs kNeverNs = 3'600'000'000'000;
constexpr TimeNs kDay = 86'400'000'000'000;
/// System times begin with 2000; those of hosts with 1970.
constexpr TimeNs kEpochs = 946'684'800'000'000'000;

class SyncStartInPast final : public Rule {
 public:
  SyncStartInPast() : Rule(kInfo) {
    Subscribe<sync::SyncSwitchedOn>(&SyncStartInPast::On);
    Subscribe<track::SlaveAccess>(&SyncStartInPast::On, MemoryRange::Of(esc::kDcStartTime, 8));
    Subscribe<track::AlRequestSent>(&SyncStartInPast::On);
    Subscribe<track::CaptureGap>(&SyncStartInPast::On);
  }

  void On(const sync::SyncSwitchedOn& e) {
    AddUnset(e.slave);
    Of(e.slave) = {};
    if ((!e.activation.sync0() && !e.activation.sync1()) || e.activation.auto_activation()) return;
    if (!e.was_off) return NotEvaluable(e.slave, ReasonCode::kNotInCapture, kActivationBefore, e.frame.number);
    if (!e.start_ns) {
      Of(e.slave).unset = e;
      return;
    }
    if (!e.read_time_ns) return NotEvaluable(e.slave, ReasonCode::kNotRead, kSystemTime, e.frame.number);
    const TimeNs ahead = e.Ahead();
    TimeNs late = -ahead;
    if (ahead >= 0) {
      if (!e.since_read_ns) {
        NotEvaluable(e.slave, ReasonCode::kStampsTooCoarse, kTimeOfActivation, e.frame.number);
        return;
      }
      late = *e.since_read_ns - ahead;
      if (late + e.uncertainty_ns <= 0) return CheckAhead(e, -late);
      if (late - e.uncertainty_ns <= 0) {
        NotEvaluable(e.slave, ReasonCode::kWithinUncertainty, kStartTime, e.frame.number);
        return;
      }
    } else if (e.since_read_ns && *e.since_read_ns > 0) {
      late += *e.since_read_ns;
    }
    // The start time may have been written again in frames that the capture misses.
    if (last_skip_ > e.read_frame.number) {
      NotEvaluable(e.slave, ReasonCode::kCaptureGap, kStartTime, e.frame.number);
      return;
    }
    ReportPast(e, ahead, late);
  }

  /// After a silence the registers hold what they held before.
  void On(const track::CaptureGap& e) {
    if (e.skip) last_skip_ = e.frame.number;
  }

  /// The start time is written when SYNC is on already.
  void On(const track::SlaveAccess& access) {
    if (access.slave >= slaves_.size() || access.written.empty() || !access.done()) return;
    const std::optional<sync::SyncSwitchedOn> on = std::exchange(slaves_[access.slave].unset, std::nullopt);
    if (!on || !context().sync().dc(access.slave).active()) return;
    if (Repeat(access.slave, 1, on->frame) != kNoFinding) return;
    Finding finding = FindingOf(kNotSet, *on);
    AddRelated(finding, access.frame().number);
    finding.Set("start_frame", arg::Frame(access.frame().number));
    Report(1, std::move(finding));
  }

  /// A drive needs SYNC0 when OP is requested.
  void On(const track::AlRequestSent& e) {
    if (e.slave >= slaves_.size() || e.control.state() != static_cast<std::uint8_t>(esc::AlState::OP)) return;
    const std::optional<Far> far = std::exchange(slaves_[e.slave].far, std::nullopt);
    if (!far || !e.frame.has_time || !far->on.frame.has_time) return;
    const TimeNs left = far->ahead - Elapsed(far->on.frame.time, e.frame.time);
    if (left - far->on.uncertainty_ns > kLongWait) ReportFar(far->on, far->ahead, e.frame);
  }

  void Finish() override {
    for (std::size_t s = 0; s < slaves_.size(); ++s) AddUnset(static_cast<SlaveId>(s));
  }

 private:
  struct Far {
    sync::SyncSwitchedOn on;
    TimeNs ahead = 0;
  };
  /// Since SYNC was switched on last.
  struct Slave {
    std::optional<sync::SyncSwitchedOn> unset;  ///< without start time
    std::optional<Far> far;
  };

  Slave& Of(SlaveId id) {
    if (id >= slaves_.size()) slaves_.resize(std::size_t{id} + 1);
    return slaves_[id];
  }

  void AddUnset(SlaveId id) {
    if (!Of(id).unset) return;
    NotEvaluable(id, ReasonCode::kNotInCapture, kStartTime, Of(id).unset->frame.number);
  }

  void CheckAhead(const sync::SyncSwitchedOn& e, TimeNs ahead) {
    if (ahead - e.uncertainty_ns > kNeverNs) return ReportFar(e, ahead, {});
    if (ahead - e.uncertainty_ns > kLongWait) Of(e.slave).far = Far{e, ahead};
  }

  static Finding FindingOf(const FindingKind& kind, const sync::SyncSwitchedOn& e) {
    Finding finding = Found(kind, e.slave, e.frame);
    if (e.read_time_ns) AddRelated(finding, e.read_frame.number);
    finding.Set("activation", arg::Hex(e.activation.raw, 2));
    return finding;
  }

  /// Decimal, as far as that fits.
  static Value TimeValue(std::uint64_t ns) {
    return ns >> 63U == 0 ? arg::Number(static_cast<std::int64_t>(ns)) : arg::Hex(ns, 16);
  }

  static void SetTimes(Finding& finding, const sync::SyncSwitchedOn& e) {
    finding.Set("start_time_ns", TimeValue(*e.start_ns))
        .Set("system_time_ns", TimeValue(*e.read_time_ns))
        .Set("read_frame", arg::Frame(e.read_frame.number))
        .Set("low_half", arg::Flag(e.low_half_only));
  }

  /// Long times in years. Ahead() ends at 146 of them: a number would be none of the capture.
  static void SetYears(Finding& finding, std::string_view name, TimeNs time) {
    constexpr TimeNs kYear = 365 * kDay + kDay / 4;
    if (time >= sync::SyncSwitchedOn::kFarNs) {
      static constexpr Word kMoreThanACentury{"more-than-a-century", "more than 100 years"};
      finding.Set(name, arg::Of(kMoreThanACentury));
    } else if (time > 365 * kDay) {
      finding.Set(name, arg::Real(static_cast<double>(time) / static_cast<double>(kYear), "years"));
    }
  }

  void ReportPast(const sync::SyncSwitchedOn& e, TimeNs ahead, TimeNs late) {
    if (Repeat(e.slave, 0, e.frame) != kNoFinding) return;
    Finding finding = FindingOf(kInPast, e);
    SetTimes(finding, e);
    finding.Set("late_ns", arg::Ns(late));
    SetYears(finding, "late_years", late);
    if (ahead >= 0) finding.Set("since_read_ns", arg::Ns(*e.since_read_ns));
    Report(0, std::move(finding));
  }

  /// @param wanted  the request of OP that makes the wait too long, if there is one
  void ReportFar(const sync::SyncSwitchedOn& e, TimeNs ahead, const FrameRef& wanted) {
    if (Repeat(e.slave, 2, e.frame) != kNoFinding) return;
    Finding finding = FindingOf(kFarAhead, e);
    if (wanted.seen()) AddRelated(finding, wanted.number);
    SetTimes(finding, e);
    finding.Set("ahead_ns", arg::Ns(ahead));
    SetYears(finding, "ahead_years", ahead);
    if (wanted.seen()) finding.Set("request_frame", arg::Frame(wanted.number));
    finding.Set("since_1970", arg::Flag(ahead > kEpochs - kDay && ahead < kEpochs + kDay));
    Report(2, std::move(finding));
  }

  std::vector<Slave> slaves_;
  FrameNo last_skip_ = 0;  ///< first frame after the last place where the capture may miss frames, by the indices
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncStartInPast>};

}  // namespace
}  // namespace ecaudit::sync_start_in_past
