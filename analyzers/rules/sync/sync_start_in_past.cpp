#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/sync/sync_events.h"
#include "analyzers/sync/sync_model.h"
#include "decoder/base/text.h"
#include "decoder/base/time.h"
#include "decoder/base/wrapping.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/access.h"
#include "decoder/track/events.h"

namespace ecaudit::sync_start_in_past {
namespace {

constexpr RuleInfo kInfo{.id = "sync-start-in-past",
                         .group = "Synchronisation",
                         .severity = Severity::kError,
                         .subject = Subject::kClock,
                         .title = "SYNC0 is switched on with a start time in the past, or one that nobody waits for",
                         .needs = "start time 0x0990, activation 0x0981, and a read of the system time 0x0910 before",
                         .source = "ESC-1, distributed clocks, SYNC signal generation",
                         .doc = R"(
## What it checks
The start time (0x0990) against the system time when cyclic operation is switched on (0x0981 bit 0): it must not lie in
the past, nor so far ahead that nobody waits for it, and it must be written before.

## Why it matters
The first pulse comes when the system time equals the start time. A start time that has passed already is reached
again only after the clock wraps: after 4.3 s where it has 32 bit, after 584 years where it has 64. The drive waits
without a sync signal and refuses SAFEOP or OP, or loses synchronisation at once.

## How it is decided
The system time is taken from the last read of 0x0910 at this slave, else at the reference clock when offset and delay
of this slave were set. It can only have grown since: a start time before it is in the past without doubt. Otherwise the
time since that read is added by the capture's stamps, unless their uncertainty leaves it open. Far ahead is more than
an hour, or more than 10 s that are left when OP is requested: a start time that counts from 1970 instead of 2000 is 30
years ahead. A clock of 32 bit compares the low halves alone, whatever is written: where nothing shows one of 64 (bit 3
of 0x0008, a time that was read and needs more), so is done here. Where the start time is not known, it is a fault that
it is written behind 0x0981. Nothing is judged when SYNC was not seen switched off before, or starts by itself (0x0981
bit 3).

## Example
tests/rules/sync-start-in-past/violates.trace

## What to do
Read the system time right before, and add enough for the rest of the configuration: masters usually take 100 ms.
)"};

/// Nobody lets a drive wait for longer.
constexpr TimeNs kLongWait = 10'000'000'000;
/// And where it is longer than this, whoever waits need not be seen.
constexpr TimeNs kNeverNs = 3'600'000'000'000;
/// System times begin with 2000; those of hosts with 1970.
constexpr TimeNs kEpochs = 946'684'800'000'000'000;

class SyncStartInPast final : public Rule {
 public:
  SyncStartInPast() : Rule(kInfo) {
    Subscribe<sync::SyncSwitchedOn>(&SyncStartInPast::On);
    Subscribe<track::SlaveAccess>(&SyncStartInPast::On, MemoryRange::Of(esc::kDcStartTime, 8));
    Subscribe<track::AlRequestSent>(&SyncStartInPast::On);
  }

  void On(const sync::SyncSwitchedOn& e) {
    SayUnset(e.slave);
    Of(e.slave) = {};
    if ((!e.activation.sync0() && !e.activation.sync1()) || e.activation.auto_activation()) return;
    if (!e.was_off) {
      NotEvaluable(e.slave, "whether SYNC was off before it was switched on is not known", e.frame.number);
      return;
    }
    if (!e.start_ns) {
      Of(e.slave).unset = e;
      return;
    }
    if (!e.read_time_ns) {
      NotEvaluable(e.slave, "system time (0x0910) not read before SYNC was switched on", e.frame.number);
      return;
    }
    const TimeNs ahead = AheadOf(e);
    TimeNs late = -ahead;
    if (ahead >= 0) {
      if (!e.since_read_ns) {
        NotEvaluable(e.slave, "time stamps too poor to know the system time when SYNC was switched on", e.frame.number);
        return;
      }
      late = *e.since_read_ns - ahead;
      if (late + e.uncertainty_ns <= 0) return LookAhead(e, -late);
      if (late - e.uncertainty_ns <= 0) {
        NotEvaluable(e.slave, "the start time equals the system time within the uncertainty of the stamps",
                     e.frame.number);
        return;
      }
    } else if (e.since_read_ns && *e.since_read_ns > 0) {
      late += *e.since_read_ns;
    }
    TellPast(e, ahead, late);
  }

  /// The start time is written when SYNC is on already.
  void On(const track::SlaveAccess& access) {
    if (access.slave >= slaves_.size() || access.written.empty() || !access.done()) return;
    const std::optional<sync::SyncSwitchedOn> on = std::exchange(slaves_[access.slave].unset, std::nullopt);
    if (!on || !context().sync().dc(access.slave).active()) return;
    if (Repeat(access.slave, 1, on->frame) != kNoFinding) return;
    Finding finding = About(*on);
    AddRelated(finding, access.frame().number);
    finding.title = "SYNC0 switched on before its start time was set";
    finding.message =
        "Frame " + std::to_string(on->frame.number) + " switches SYNC on (0x0981 = " + Hex(on->activation.raw, 2) +
        "), but its start time (0x0990) is not written before frame " + std::to_string(access.frame().number) +
        ". The unit waits for the time that the register held when it was switched on, mostly 0: that has "
        "passed, and no pulse comes until the clock has wrapped. Write start time and cycle (0x0990, "
        "0x09A0) first, and 0x0981 last.";
    finding.evidence = {HexNumber("activation", on->activation.raw)};
    Report(1, std::move(finding));
  }

  /// Whoever wants OP wants SYNC0 by then.
  void On(const track::AlRequestSent& e) {
    if (e.slave >= slaves_.size() || e.control.state() != static_cast<std::uint8_t>(esc::AlState::OP)) return;
    const std::optional<Far> far = std::exchange(slaves_[e.slave].far, std::nullopt);
    if (!far || !e.frame.has_time || !far->on.frame.has_time) return;
    const TimeNs left = far->ahead - Elapsed(far->on.frame.time, e.frame.time);
    if (left - far->on.uncertainty_ns > kLongWait) TellFar(far->on, far->ahead, e.frame);
  }

  void Finish() override {
    for (std::size_t s = 0; s < slaves_.size(); ++s) SayUnset(static_cast<SlaveId>(s));
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

  void SayUnset(SlaveId id) {
    if (!Of(id).unset) return;
    NotEvaluable(id, "start time of SYNC (0x0990) not written in the capture: what it was is not known",
                 Of(id).unset->frame.number);
  }

  /// How far ahead the start lies, by the time that was read. Beyond 146 years it is kept there, so that what is added
  /// to it later fits.
  static TimeNs AheadOf(const sync::SyncSwitchedOn& e) {
    constexpr TimeNs kFarNs = TimeNs{1} << 62;
    return std::clamp(
        e.low_half_only
            ? static_cast<std::int32_t>(WrappingDifference(static_cast<std::uint32_t>(*e.start_ns & 0xFFFFFFFFU),
                                                           static_cast<std::uint32_t>(*e.read_time_ns & 0xFFFFFFFFU)))
            : static_cast<TimeNs>(WrappingDifference<std::uint64_t>(*e.start_ns, *e.read_time_ns)),
        -kFarNs, kFarNs);
  }

  void LookAhead(const sync::SyncSwitchedOn& e, TimeNs ahead) {
    if (ahead - e.uncertainty_ns > kNeverNs) return TellFar(e, ahead, {});
    if (ahead - e.uncertainty_ns > kLongWait) Of(e.slave).far = Far{e, ahead};
  }

  static Finding About(const sync::SyncSwitchedOn& e) {
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    if (e.read_time_ns) AddRelated(finding, e.read_frame.number);
    return finding;
  }

  static std::string SettingText(const sync::SyncSwitchedOn& e) {
    return "Frame " + std::to_string(e.frame.number) + " switches SYNC on (0x0981 = " + Hex(e.activation.raw, 2) +
           ") with the start time " + std::to_string(*e.start_ns) + " ns (0x0990), but frame " +
           std::to_string(e.read_frame.number) + " read the system time " + std::to_string(*e.read_time_ns) +
           " ns before";
  }

  void TellPast(const sync::SyncSwitchedOn& e, TimeNs ahead, TimeNs late) {
    if (Repeat(e.slave, 0, e.frame) != kNoFinding) return;
    Finding finding = About(e);
    finding.title = "SYNC0 starts " + Duration(late) + " in the past";
    finding.message = SettingText(e) + (ahead >= 0 ? ", and " + Duration(*e.since_read_ns) + " passed since" : "") +
                      ". The first pulse would come when the clock has wrapped. Read the system time right before, and "
                      "let the start lie far enough ahead (100 ms is usual).";
    finding.evidence = {Number("start_time_ns", static_cast<std::int64_t>(*e.start_ns)),
                        Number("system_time_ns", static_cast<std::int64_t>(*e.read_time_ns)), Number("late_ns", late)};
    Report(0, std::move(finding));
  }

  /// @param wanted  the request of OP, where one is needed to tell
  void TellFar(const sync::SyncSwitchedOn& e, TimeNs ahead, const FrameRef& wanted) {
    if (Repeat(e.slave, 2, e.frame) != kNoFinding) return;
    constexpr TimeNs kDay = 86'400'000'000'000;
    const bool epochs = ahead > kEpochs - kDay && ahead < kEpochs + kDay;
    Finding finding = About(e);
    if (wanted.seen()) AddRelated(finding, wanted.number);
    const std::string years = Fixed(static_cast<double>(ahead) / static_cast<double>(365 * kDay + kDay / 4), 1);
    const std::string wait = ahead > 365 * kDay ? years + " years" : Duration(ahead);
    finding.title = "SYNC0 starts only " + wait + " after it is switched on";
    finding.message =
        SettingText(e) + ": the first pulse comes " + wait + " later" +
        (wanted.seen() ? ", while frame " + std::to_string(wanted.number) + " requests OP" : "") +
        ", and the drive waits for it. " +
        (epochs ? "The start time counts from 1970, the system time of EtherCAT from 2000. " : "") +
        "Take the start time from the system time that was read, and let it lie little ahead (100 ms is usual).";
    finding.evidence = {Number("start_time_ns", static_cast<std::int64_t>(*e.start_ns)),
                        Number("system_time_ns", static_cast<std::int64_t>(*e.read_time_ns)),
                        Number("ahead_ns", ahead)};
    Report(2, std::move(finding));
  }

  std::vector<Slave> slaves_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncStartInPast>};

}  // namespace
}  // namespace ecaudit::sync_start_in_past
