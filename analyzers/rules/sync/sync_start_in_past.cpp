#include <algorithm>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/sync/sync_events.h"
#include "decoder/base/text.h"
#include "decoder/base/wrapping.h"

namespace ecaudit::sync_start_in_past {
namespace {

constexpr RuleInfo kInfo{.id = "sync-start-in-past",
                         .group = "Synchronisation",
                         .severity = Severity::kError,
                         .subject = Subject::kClock,
                         .title = "SYNC0 is switched on with a start time that lies in the past",
                         .needs = "start time 0x0990, activation 0x0981, and a read of the system time 0x0910 before",
                         .source = "ESC-1, distributed clocks, SYNC signal generation",
                         .doc = R"(
## What it checks
The start time (0x0990) against the system time when cyclic operation is switched on (0x0981 bit 0).

## Why it matters
The first pulse comes when the system time equals the start time. A start time that has passed already is reached
again only after the clock wraps: after 4.3 s where it has 32 bit, after 584 years where it has 64. The drive waits
without a sync signal and refuses SAFEOP or OP, or loses synchronisation at once.

## How it is decided
The system time is taken from the last read of 0x0910 at this slave, else at the reference clock when offset and
delay of this slave were set. It can only have grown since: a start time before it is in the past without doubt.
Otherwise the time since that read is added by the capture's stamps, unless their uncertainty leaves it open. Nothing
is judged when SYNC was not seen switched off before, or starts by itself (0x0981 bit 3).

## Example
tests/rules/sync-start-in-past/violates.trace

## What to do
Read the system time right before, and add enough for the rest of the configuration: masters usually take 100 ms.
)"};

class SyncStartInPast final : public Rule {
 public:
  SyncStartInPast() : Rule(kInfo) { Hear<sync::SyncSwitchedOn>(&SyncStartInPast::On); }

  void On(const sync::SyncSwitchedOn& e) {
    if ((!e.activation.sync0() && !e.activation.sync1()) || e.activation.auto_activation()) return;
    if (!e.was_off) {
      NotEvaluable(e.slave, "whether SYNC was off before it was switched on is not known", e.frame.number);
      return;
    }
    if (!e.start_ns) {
      NotEvaluable(e.slave, "start time of SYNC (0x0990) not known", e.frame.number);
      return;
    }
    if (!e.read_time_ns) {
      NotEvaluable(e.slave, "system time (0x0910) not read before SYNC was switched on", e.frame.number);
      return;
    }
    // How far ahead the start lies, by the time that was read. Beyond 146 years it is kept there, so that what is added
    // to it later fits.
    constexpr TimeNs kFarNs = TimeNs{1} << 62;
    const TimeNs ahead = std::clamp(
        e.low_half_only
            ? static_cast<std::int32_t>(WrappingDifference(static_cast<std::uint32_t>(*e.start_ns & 0xFFFFFFFFU),
                                                           static_cast<std::uint32_t>(*e.read_time_ns & 0xFFFFFFFFU)))
            : static_cast<TimeNs>(WrappingDifference<std::uint64_t>(*e.start_ns, *e.read_time_ns)),
        -kFarNs, kFarNs);
    TimeNs late = -ahead;
    if (ahead >= 0) {
      if (!e.since_read_ns) {
        NotEvaluable(e.slave, "time stamps too poor to know the system time when SYNC was switched on", e.frame.number);
        return;
      }
      late = *e.since_read_ns - ahead;
      if (late + e.uncertainty_ns <= 0) return;
      if (late - e.uncertainty_ns <= 0) {
        NotEvaluable(e.slave, "the start time equals the system time within the uncertainty of the stamps",
                     e.frame.number);
        return;
      }
    } else if (e.since_read_ns && *e.since_read_ns > 0) {
      late += *e.since_read_ns;
    }
    if (Repeat(e.slave, 0, e.frame) != kNoFinding) return;
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    AddRelated(finding, e.read_frame.number);
    finding.title = "SYNC0 starts " + Duration(late) + " in the past";
    finding.message = "Frame " + std::to_string(e.frame.number) +
                      " switches SYNC on (0x0981 = " + Hex(e.activation.raw, 2) + ") with the start time " +
                      std::to_string(*e.start_ns) + " ns (0x0990), but frame " + std::to_string(e.read_frame.number) +
                      " read the system time " + std::to_string(*e.read_time_ns) + " ns before" +
                      (ahead >= 0 ? ", and " + Duration(*e.since_read_ns) + " passed since" : std::string()) +
                      ". The first pulse would come when the clock has wrapped. Read the system time right before, and "
                      "let the start lie far enough ahead (100 ms is usual).";
    finding.evidence = {Number("start_time_ns", static_cast<std::int64_t>(*e.start_ns)),
                        Number("system_time_ns", static_cast<std::int64_t>(*e.read_time_ns)), Number("late_ns", late)};
    Report(0, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncStartInPast>};

}  // namespace
}  // namespace ecaudit::sync_start_in_past
