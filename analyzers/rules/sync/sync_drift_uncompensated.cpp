#include <utility>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_model.h"
#include "decoder/base/text.h"
#include "decoder/base/time.h"
#include "decoder/track/events.h"

namespace ecaudit::sync_drift_uncompensated {
namespace {

constexpr std::int64_t kDefaultLimit = 1'000'000'000;
/// The slaves in OP are looked through once in so many frames.
constexpr std::uint32_t kLookEvery = 32;
/// Process data further apart are two runs with a pause between them.
constexpr TimeNs kPause = 100'000'000;

constexpr RuleInfo kInfo{.id = "sync-drift-uncompensated",
                         .group = "Synchronisation",
                         .severity = Severity::kWarning,
                         .subject = Subject::kClock,
                         .title = "Distributed clocks are in use in OP, but the system time is not distributed",
                         .needs = "SYNC0 switched on and AL state OP of a slave, two slaves with clocks, time stamps",
                         .source = "ESC-1, distributed clocks, clock synchronisation and drift compensation",
                         .doc = R"(
## What it checks
While a slave with SYNC0 is in OP: more than a second without ARMW or FRMW of the system time (0x0910),
or BWR of a time that goes on from write to write.

## Why it matters
Each slave has a quartz of its own. Without distribution the clocks drift apart by up to 0.1 ms a second, and with
them the SYNC0 pulses: the axes lose their common time slowly and unnoticed.

## How it is decided
At least two slaves showed a clock unit; with a single clock there is nothing to drift against. The time is that of
the capture's stamps, counted from the last distribution or from when the slave was seen in OP with SYNC0 on, as far as
process data were exchanged: pauses of 100 ms and more are left out, for the capture may have a hole there. The
limit in ns is configurable: sync-drift-uncompensated.

## Example
tests/rules/sync-drift-uncompensated/violates.trace

## What to do
Send FRMW (or ARMW) of 0x0910 to the reference clock in each cycle, with the process data.
)"};

class SyncDriftUncompensated final : public Rule {
 public:
  SyncDriftUncompensated() : Rule(kInfo) {
    Subscribe<track::LogicalAccess>(&SyncDriftUncompensated::On);
    Subscribe<track::LogicalRepeated>(&SyncDriftUncompensated::On);
  }

  void On(const track::LogicalAccess& e) {
    // The last of several cycles is told once more, in full.
    if (!e.returned.seen() || e.returned.number > repeated_until_) Measure(e);
  }
  void On(const track::LogicalRepeated& e) {
    repeated_until_ = e.access.returned.number;
    Measure(e.access);
  }

  void Finish() override { (void)NotEvaluableWithoutReturns(); }

 private:
  void Measure(const track::LogicalAccess& e) {
    if (frames_++ % kLookEvery == 0) Look(e.frame());
    if (!in_use_since_.has_time || !e.frame().has_time) return;
    const FrameRef& last = context().sync().clock().last_distribution();
    const FrameRef& from = last.has_time && last.number > in_use_since_.number ? last : in_use_since_;
    const FrameRef before = std::exchange(last_frame_, e.frame());
    if (from.number != measured_from_) {
      measured_from_ = from.number;
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
      if (!said_poor_)
        NotEvaluable(kNoSlave, "time stamps too poor to measure the distribution of the system time by",
                     e.frame().number);
      said_poor_ = true;
      return;
    }
    if (gap - *uncertainty <= limit) return;
    if (from.number == told_from_) {  // the same gap goes on
      if (told_ != kNoFinding) context().store[told_].last = e.frame();
      return;
    }
    told_from_ = from.number;
    told_ = Repeat(kNoSlave, 0, e.frame());
    if (told_ != kNoFinding) return;
    Finding finding;
    finding.first = e.frame();
    AddRelated(finding, from.number);
    finding.title = "The system time is not distributed although SYNC0 is in use";
    finding.message = "Since frame " + std::to_string(from.number) +
                      (from.number == in_use_since_.number ? " " + context().Label(slave_) + " is in OP with SYNC0"
                                                           : ", the last distribution,") +
                      " no ARMW, FRMW or BWR of 0x0910 was answered for " + Duration(gap) +
                      ". The clocks of the slaves drift apart. Send FRMW 0x0910 to the reference clock in each cycle.";
    finding.evidence = {Real("gap_ms", static_cast<double>(gap) / 1e6),
                        Real("limit_ms", static_cast<double>(limit) / 1e6)};
    told_ = Report(0, std::move(finding));
  }

  void Look(const FrameRef& frame) {
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

  FrameNo repeated_until_ = 0;
  std::uint32_t frames_ = 0;
  FrameRef in_use_since_;
  SlaveId slave_ = kNoSlave;
  FrameNo told_from_ = 0;
  FindingIndex told_ = kNoFinding;
  FrameRef last_frame_;        ///< last process data
  FrameNo measured_from_ = 0;  ///< last distribution, or since when clocks are in use ...
  TimeNs gap_ = 0;             ///< ... and how long process data have been exchanged since
  bool said_poor_ = false;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncDriftUncompensated>};

}  // namespace
}  // namespace ecaudit::sync_drift_uncompensated
