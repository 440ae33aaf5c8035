#include <algorithm>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_events.h"
#include "analyzers/sync/sync_model.h"
#include "decoder/base/text.h"
#include "decoder/esc/dc_registers.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/access.h"
#include "decoder/track/network.h"

namespace ecaudit::sync_watchdog_margin {
namespace {

constexpr std::uint16_t kDefaultSteps = 1000;
constexpr std::uint16_t kWatchdogCode = 0x001B;
/// A cycle of half the watchdog is measured a little shorter now and then: by no more than this part.
constexpr TimeNs kAboutHalf = 64;
/// Gaps that are as long as usual, where nothing else tells what that is.
constexpr std::size_t kFewGaps = 3;

constexpr RuleInfo kInfo{
    .id = "sync-watchdog-margin",
    .group = "Synchronisation",
    .severity = Severity::kError,
    .subject = Subject::kTiming,
    .title = "Process data pause for half the sync manager watchdog or longer",
    .needs = "FMMUs and AL state of the slave; a clock: DC time in the frames, or good time stamps",
    .source = "ESC-1, watchdogs; ETG1000.6, AL Status Code register 0x0134",
    .doc = R"(
## What it checks
The longest time without outputs for a slave in OP, against its process data watchdog: (0x0400 + 2) * 40 ns * 0x0420.
A pause as long as the watchdog is an error, half of it a warning. So is OP that is refused with 0x001B, or waited for
in vain, because no outputs were sent. Where the cycle itself is that long, nothing pauses, and the watchdog is what is
wrong: that is told once, as an error where it is shorter than the cycle.

## Why it matters
When the watchdog ends the slave leaves OP (AL status code 0x001B) and the drive stops. A master that sometimes comes
near it will one day be too late.

## How it is decided
Outputs are the LRW and LWR whose address an active write FMMU of the slave maps, and whose working counter is not 0, or
writes to the memory of its output sync manager: those for other slaves do not count. A slave in OP that got none yet
waits since it is in OP, and one that gets none any more until it leaves OP or the capture ends. Up to one and a half
times the usual distance (the median of the last frames) is no pause, unless it exceeds the watchdog. The time between
two of them is measured by the DC time they carry, else by stamps; a limit inside the uncertainty of the clock is not
judged, and neither is a pause in which frames were sent that did not return, nor one that may be a hole in the capture:
nobody sent anything, the slave is still in OP, and the indices do not tell. Sync managers without watchdog trigger
(control bit 6) do not feed a watchdog: then only a slave that really leaves OP is reported. Where the registers were
never written in the capture, their values after power-on (100 ms) are assumed and the finding is inferred. Outputs that
no FMMU maps are told by fmmu-inactive. A slave that leaves OP by itself in the pause (al-unexpected-change) names this
finding as its cause.

## Example
samples/captures/falls-out-of-op.pcapng: 130 ms without process data, watchdog 100 ms.

## What to do
Find out why the master paused (scheduling, a blocking call, a debugger). Where the cycle is long by design, set a
longer watchdog in PREOP.
)"};

class SyncWatchdogMargin final : public Rule {
 public:
  SyncWatchdogMargin() : Rule(kInfo) {
    Subscribe<sync::OutputGap>(&SyncWatchdogMargin::On);
    Subscribe<sync::SlaveRunEnded>(&SyncWatchdogMargin::On);
    Subscribe<track::SlaveAccess>(
        &SyncWatchdogMargin::On,
        MemoryRange::Of(esc::kWatchdogDivider, esc::kProcessWatchdog + 2 - esc::kWatchdogDivider));
    Subscribe<model::AlAnswered>(&SyncWatchdogMargin::On);
    Subscribe<model::AlOverdue>(&SyncWatchdogMargin::On);
    Subscribe<model::AlChangedByItself>(&SyncWatchdogMargin::On);
  }

  /// AL Status may be read later than outputs come again.
  void On(const model::AlChangedByItself& e) {
    if (e.slave >= doubtful_.size() || !doubtful_[e.slave]) return;
    sync::OutputGap gap = *std::exchange(doubtful_[e.slave], std::nullopt);
    // Seen in OP behind the gap, or for another reason: that was no watchdog.
    if (e.code != kWatchdogCode || e.before_since > gap.after.number) {
      SayMayBeHole(gap);
      return;
    }
    gap.fell = e.frame;
    gap.fell_to = e.status;
    gap.fell_code = e.code;
    Judge(gap);
  }

  /// The registers of the watchdog are set: what was said of it is another matter.
  void On(const track::SlaveAccess& access) {
    const bool sets = !access.Covered(access.written, esc::kWatchdogDivider, 2).empty() ||
                      !access.Covered(access.written, esc::kProcessWatchdog, 2).empty();
    if (!sets || access.acceptance == track::Acceptance::kRefused) return;
    Of(access.slave).written = access.frame();
    Of(access.slave).told_short = {kNoFinding, kNoFinding};
  }

  void On(const sync::SlaveRunEnded& e) {
    if (e.slave < slaves_.size()) JudgeEarly(e.slave);
  }

  void On(const sync::OutputGap& e) {
    Slave& slave = Of(e.slave);
    sync::OutputGap gap = e;
    if (gap.nominal_ns == 0) gap.nominal_ns = slave.usual_ns;
    const bool may_wait =
        e.end == sync::OutputGap::End::kOutputs && !e.fell.seen() && !context().sync().outputs(e.slave).may_be_hole;
    if (gap.nominal_ns == 0 && may_wait && slave.early.size() < kMostEarly) {
      slave.early.push_back(e);
      if (slave.early.size() == kMostEarly) JudgeEarly(e.slave);
      return;
    }
    JudgeEarly(e.slave);
    Judge(gap);
  }

  void On(const model::AlAnswered& e) {
    if (e.outcome != model::AlAnswered::Outcome::kRefused || !e.code || *e.code != kWatchdogCode ||
        e.request.control.state() != static_cast<std::uint8_t>(esc::AlState::OP)) {
      return;
    }
    const sync::OutputWatch& outputs = context().sync().outputs(e.slave);
    // Whatever flows, nothing brings it to this slave: fmmu-inactive tells it.
    if (!outputs.direct && !IsMapped(e.slave) && context().network().fmmus(e.slave).any) return;
    // The watchdog counts from the last outputs, wherever they came from.
    const bool none = !outputs.seen;
    TimeNs since = 0;
    if (!none) {
      const auto uncertainty = context().sync().Uncertainty(sync::TimeBase::kCapture);
      if (!uncertainty || !outputs.last.stamp || !e.frame.has_time) return;
      since = Elapsed(*outputs.last.stamp, e.frame.time);
      if (since - *uncertainty < outputs.watchdog_ns || outputs.watchdog_ns == 0) return;
    }
    FindingIndex index = Repeat(e.slave, 4, e.frame);
    if (index == kNoFinding) {
      Finding finding;
      finding.slave = e.slave;
      finding.first = e.frame;
      AddRelated(finding, e.request.frame.number);
      finding.title = "OP requested while no process data flow";
      finding.message = "The master requested OP in frame " + std::to_string(e.request.frame.number) +
                        (none ? std::string(", but no outputs for this slave were sent before")
                              : ", but the last outputs for this slave came " + Duration(since) +
                                    " before the answer, in frame " + std::to_string(outputs.last.frame.number)) +
                        "; the slave answers " + esc::StatusText(e.status.raw) +
                        " with AL status code 0x001b (watchdog). Start the cyclic exchange in SAFEOP, then request OP.";
      finding.evidence = {HexNumber("al_status_code", *e.code)};
      index = Report(4, std::move(finding));
    }
    consequences_.push_back({"al-refused", e.slave, e.frame.number, index});
  }

  /// The slave waits in SAFEOP for outputs that nobody sends.
  void On(const model::AlOverdue& e) {
    const bool to_op = e.request.control.state() == static_cast<std::uint8_t>(esc::AlState::OP);
    if (!to_op || e.status.state() != static_cast<std::uint8_t>(esc::AlState::SAFEOP)) return;
    if (context().sync().outputs(e.slave).seen || !IsMapped(e.slave)) return;
    FindingIndex index = Repeat(e.slave, 4, e.frame);
    if (index == kNoFinding) {
      Finding finding;
      finding.slave = e.slave;
      finding.first = e.frame;
      AddRelated(finding, e.request.frame.number);
      finding.title = "OP requested while no process data flow";
      finding.message = "The master requested OP in frame " + std::to_string(e.request.frame.number) +
                        ", but sends no outputs for this slave, which has an FMMU for them: it still shows " +
                        esc::StatusText(e.status.raw) + " after " + Duration(e.waited_ns) +
                        ". Start the cyclic exchange in SAFEOP, then request OP.";
      finding.evidence = {HexNumber("al_status", e.status.raw)};
      index = Report(4, std::move(finding));
    }
    consequences_.push_back({"al-timeout", e.slave, e.frame.number, index});
  }

  void Finish() override {
    for (std::size_t s = 0; s < slaves_.size(); ++s) JudgeEarly(static_cast<SlaveId>(s));
    for (const std::optional<sync::OutputGap>& gap : doubtful_) {
      if (gap) SayMayBeHole(*gap);
    }
    for (const Consequence& c : consequences_) NameCause(context(), c.rule, c.slave, c.frame, c.cause);
    if (NotEvaluableWithoutReturns()) return;
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      const model::SlaveModel& slave = context().slave(id);
      if (slave.al.possible().single() != static_cast<std::uint8_t>(esc::AlState::OP)) continue;
      if (!context().sync().outputs(id).seen && !context().network().fmmus(id).any) {
        NotEvaluable(id, "which process data are outputs of the slave is not known");
      }
    }
  }

 private:
  /// Of the process data of one slave.
  struct Watchdog {
    std::optional<std::uint16_t> divider, steps;
    TimeNs ns = 0;
    bool monitors = false;  ///< the sync manager of the outputs triggers it

    [[nodiscard]] bool known() const { return divider && steps; }
  };

  struct Slave {
    FrameRef written;  ///< the registers of its watchdog
    /// That this is too short for the cycle: a warning, an error.
    std::array<FindingIndex, 2> told_short{kNoFinding, kNoFinding};
    std::vector<sync::OutputGap> early;  ///< before it was known how far its outputs usually are apart
    TimeNs usual_ns = 0;                 ///< by these
  };
  /// So many make a rhythm of their own.
  static constexpr std::size_t kMostEarly = 32;

  Slave& Of(SlaveId id) {
    if (id >= slaves_.size()) slaves_.resize(std::size_t{id} + 1);
    return slaves_[id];
  }

  /// Gaps that waited until it is known what is usual.
  void JudgeEarly(SlaveId id) {
    std::vector<sync::OutputGap> early;
    early.swap(Of(id).early);
    if (early.empty()) return;
    const sync::CyclicImage* image = context().sync().outputs(id).image;
    TimeNs usual = image != nullptr && image->has_nominal() ? image->nominal_ns : 0;
    if (usual == 0 && early.size() >= kFewGaps) {
      std::vector<TimeNs> sorted;
      for (const sync::OutputGap& gap : early) sorted.push_back(gap.gap.ns);
      std::sort(sorted.begin(), sorted.end());
      usual = Of(id).usual_ns = sorted[sorted.size() / 2];
    }
    for (sync::OutputGap& gap : early) {
      gap.nominal_ns = usual;
      Judge(gap);
    }
  }

  void Judge(const sync::OutputGap& e) {
    const Watchdog watchdog = WatchdogOf(e.slave);
    if (watchdog.ns == 0) return;
    // Nothing maps its outputs: that is the fault, and fmmu-inactive tells it.
    if (e.end != sync::OutputGap::End::kOutputs && !context().sync().outputs(e.slave).direct && !IsMapped(e.slave)) {
      return;
    }
    const bool fell = e.fell.seen() && (!e.fell_code || *e.fell_code == kWatchdogCode);
    if (!watchdog.monitors && !fell) return;
    FindingIndex index = kNoFinding;
    if (IsUsual(e, watchdog)) {
      // Nothing paused, and half the watchdog is for what does.
      if (e.nominal_ns + e.nominal_ns / kAboutHalf >= watchdog.ns / 2) index = TellShort(e, watchdog, fell);
    } else if (CanBeJudged(e, watchdog, fell)) {
      index = TellPause(e, watchdog, fell);
    }
    if (fell && index != kNoFinding) consequences_.push_back({"al-unexpected-change", e.slave, e.fell.number, index});
    if (consequences_.size() > kMaxConsequences) consequences_.erase(consequences_.begin());
  }

  /// The gap is one of those that the outputs always have.
  [[nodiscard]] static bool IsUsual(const sync::OutputGap& e, const Watchdog& watchdog) {
    if (e.end != sync::OutputGap::End::kOutputs || e.nominal_ns == 0 || !e.uncertainty_ns) return false;
    const TimeNs least = e.gap.ns - *e.uncertainty_ns;
    if (least > e.nominal_ns + e.nominal_ns / 2) return false;
    // Late by less than half a cycle, but late enough.
    return e.nominal_ns >= watchdog.ns || least < watchdog.ns || least <= e.nominal_ns + e.nominal_ns / 8;
  }

  FindingIndex TellPause(const sync::OutputGap& e, const Watchdog& watchdog, bool fell) {
    const FrameRef& frame = e.after.seen() ? e.after : e.fell;
    const bool exceeds = e.gap.ns - *e.uncertainty_ns >= watchdog.ns;
    const std::uint64_t key = (exceeds ? 1U : 0U) | (fell ? 2U : 0U);
    const FindingIndex index = Repeat(e.slave, key, frame);
    if (index != kNoFinding) {
      AddRelated(context().store[index], frame.number);
      return index;
    }
    return Report(key, exceeds ? Severity::kError : Severity::kWarning, FindingOf(e, watchdog, exceeds, fell));
  }

  /// Once for each watchdog that is set: it is so in every cycle.
  FindingIndex TellShort(const sync::OutputGap& e, const Watchdog& watchdog, bool fell) {
    Slave& slave = Of(e.slave);
    const bool shorter = std::max(e.nominal_ns, e.gap.ns) - *e.uncertainty_ns >= watchdog.ns;
    FindingIndex& told = slave.told_short[shorter ? 1 : 0];
    if (told != kNoFinding) {
      context().store[told].last = e.after;  // it goes on
      return told;
    }
    const std::uint64_t key = shorter ? 8 : 9;
    told = Repeat(e.slave, key, e.after);
    if (told != kNoFinding) return told;
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.after;
    AddRelated(finding, e.before.number);
    if (slave.written.seen()) AddRelated(finding, slave.written.number);
    finding.confidence = watchdog.known() || fell ? Confidence::kObserved : Confidence::kInferred;
    const std::string cycle = Duration(shorter ? std::max(e.nominal_ns, e.gap.ns) : e.nominal_ns);
    finding.title = "The watchdog of " + Duration(watchdog.ns) + " is " + (shorter ? "shorter" : "hardly longer") +
                    " than the cycle of " + cycle;
    finding.message =
        "The outputs of this slave come every " + Duration(e.nominal_ns) +
        PrecisionText({0, e.gap.base}, *e.uncertainty_ns) + ". " + WatchdogText(watchdog) +
        (slave.written.seen() ? " It was set in frame " + std::to_string(slave.written.number) + "." : "") +
        (e.nominal_ns >= watchdog.ns ? " It runs out in every cycle."
         : shorter                   ? " Here it ran out in a cycle of " + cycle + "."
                                     : " A single frame that is lost or late lets it run out.") +
        " Set a watchdog of several cycles in PREOP.";
    finding.evidence = {Real("cycle_ms", static_cast<double>(e.nominal_ns) / 1e6),
                        Real("watchdog_ms", static_cast<double>(watchdog.ns) / 1e6),
                        Text("time_base", std::string(sync::Name(e.gap.base))),
                        Real("uncertainty_us", static_cast<double>(*e.uncertainty_ns) / 1e3)};
    told = Report(key, shorter ? Severity::kError : Severity::kWarning, std::move(finding));
    return told;
  }

  [[nodiscard]] static std::string WatchdogText(const Watchdog& watchdog) {
    return "Its process data watchdog is " + Duration(watchdog.ns) +
           " (0x0400 = " + std::to_string(watchdog.divider.value_or(esc::kDefaultWatchdogDivider)) +
           ", 0x0420 = " + std::to_string(watchdog.steps.value_or(kDefaultSteps)) +
           (watchdog.known() ? "" : "; the value after power-on is assumed") + ").";
  }

  [[nodiscard]] Watchdog WatchdogOf(SlaveId slave) const {
    const track::SlaveState& state = context().network().state(slave);
    Watchdog watchdog;
    watchdog.divider = state.registers.Value<std::uint16_t>(esc::kWatchdogDivider);
    watchdog.steps = state.registers.Value<std::uint16_t>(esc::kProcessWatchdog);
    watchdog.ns = esc::WatchdogNs(watchdog.divider.value_or(esc::kDefaultWatchdogDivider),
                                  watchdog.steps.value_or(kDefaultSteps));
    const auto manager = state.process_manager(esc::SmDirection::ECAT_WRITES);
    watchdog.monitors = manager && manager->watchdog_trigger();
    return watchdog;
  }

  [[nodiscard]] bool IsMapped(SlaveId slave) const {
    const track::KnownFmmus& fmmus = context().network().fmmus(slave);
    return std::any_of(fmmus.active.begin(), fmmus.active.end(), [](const auto& f) { return f.fmmu.writes(); });
  }

  void SayMayBeHole(const sync::OutputGap& e) {
    NotEvaluable(
        e.slave,
        e.end == sync::OutputGap::End::kOutputs
            ? "nobody sent anything for long, and nothing shows that the slave left OP for it: the capture may "
              "have a hole there"
            : "nobody sent anything for long before the slave was to leave OP: the capture may have a hole there",
        e.after.number);
  }

  /// Whether the gap is certainly too long. Where that is open, it is said.
  bool CanBeJudged(const sync::OutputGap& e, const Watchdog& watchdog, bool fell) {
    const TimeNs half = watchdog.ns / 2;
    if (!e.uncertainty_ns) {
      if (e.gap.ns >= half)
        NotEvaluable(e.slave, ReasonCode::kStampsTooCoarse, what::kProcessDataTiming, e.after.number);
      return false;
    }
    if (!fell && context().sync().outputs(e.slave).may_be_hole && e.gap.ns >= half) {
      if (e.slave >= doubtful_.size()) doubtful_.resize(static_cast<std::size_t>(e.slave) + 1);
      if (doubtful_[e.slave]) SayMayBeHole(*doubtful_[e.slave]);
      doubtful_[e.slave] = e;
      return false;
    }
    const TimeNs least = e.gap.ns - *e.uncertainty_ns;
    if (least < watchdog.ns && !(least >= half && watchdog.monitors)) {
      if (watchdog.monitors && e.gap.ns + *e.uncertainty_ns >= half) {
        NotEvaluable(e.slave,
                     "a pause of the process data is as long as half the watchdog within the clock's uncertainty",
                     e.after.number);
      }
      return false;
    }
    if (e.unreturned > 0) {
      NotEvaluable(e.slave, "frames of a pause were sent and did not return: whether the slave got them is not known",
                   e.after.number);
      return false;
    }
    return true;
  }

  [[nodiscard]] static Finding FindingOf(const sync::OutputGap& e, const Watchdog& watchdog, bool exceeds, bool fell) {
    const FrameRef& frame = e.after.seen() ? e.after : e.fell;
    Finding finding;
    finding.slave = e.slave;
    finding.first = frame;
    AddRelated(finding, e.before.number);
    // What rests on the values after power-on is an assumption, unless the slave confirmed it.
    finding.confidence = watchdog.known() || fell ? Confidence::kObserved : Confidence::kInferred;
    const std::string pause = Duration(e.gap.ns);
    const bool goes_on = e.end == sync::OutputGap::End::kRequest || e.end == sync::OutputGap::End::kCapture;
    finding.title = (goes_on ? "Process data stopped, for " : "Process data paused for ") + pause +
                    (exceeds ? ", longer than the watchdog of " : ", more than half the watchdog of ") +
                    Duration(watchdog.ns);
    finding.message = "Between frame " + std::to_string(e.before.number) + " and frame " +
                      std::to_string(frame.number) + EndText(e.end) + " the slave in OP got no outputs for " + pause +
                      PrecisionText(e.gap, *e.uncertainty_ns) + ". " + WatchdogText(watchdog) + " ";
    if (fell) {
      finding.message += "In frame " + std::to_string(e.fell.number) + " it shows " + esc::StatusText(e.fell_to.raw) +
                         (e.fell_code ? ", AL status code " + Hex(*e.fell_code) : std::string()) + ". ";
      if (e.fell.number != frame.number) AddRelated(finding, e.fell.number);
    }
    if (e.nominal_ns > 0) finding.message += "The process data usually come every " + Duration(e.nominal_ns) + ". ";
    finding.message += "Find out why the master paused, or set a longer watchdog in PREOP.";
    finding.evidence = {Real("gap_ms", static_cast<double>(e.gap.ns) / 1e6),
                        Real("watchdog_ms", static_cast<double>(watchdog.ns) / 1e6),
                        Text("time_base", std::string(sync::Name(e.gap.base))),
                        Real("uncertainty_us", static_cast<double>(*e.uncertainty_ns) / 1e3)};
    return finding;
  }

  [[nodiscard]] static std::string EndText(sync::OutputGap::End end) {
    switch (end) {
      case sync::OutputGap::End::kFell:
        return ", where the slave is seen to have left OP,";
      case sync::OutputGap::End::kRequest:
        return ", where the master requests another state,";
      case sync::OutputGap::End::kCapture:
        return ", where the capture ends,";
      case sync::OutputGap::End::kOutputs:
        break;
    }
    return "";
  }

  struct Consequence {
    std::string_view rule;
    SlaveId slave = kNoSlave;
    FrameNo frame = 0;
    FindingIndex cause = kNoFinding;
  };
  static constexpr std::size_t kMaxConsequences = 256;

  std::vector<Slave> slaves_;
  std::vector<Consequence> consequences_;
  std::vector<std::optional<sync::OutputGap>> doubtful_;  // of each slave: the capture may have a hole there
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncWatchdogMargin>};

}  // namespace
}  // namespace ecaudit::sync_watchdog_margin
