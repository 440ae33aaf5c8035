#include <algorithm>
#include <array>
#include <deque>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_events.h"
#include "analyzers/sync/sync_model.h"
#include "analyzers/words/al_text.h"
#include "decoder/base/time.h"
#include "decoder/esc/dc_registers.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/mailbox/events.h"
#include "decoder/track/access.h"
#include "decoder/track/network.h"

namespace ecaudit::sync_watchdog_margin {
namespace {

constexpr std::uint16_t kDefaultSteps = 1000;
/// A cycle of half the watchdog is measured a little shorter now and then: by no more than this part.
constexpr TimeNs kAboutHalf = 64;
/// Gaps that are as long as usual, if nothing else shows what that is.
constexpr std::size_t kFewGaps = 3;

constexpr Word kOutputsWord{"outputs", "the outputs of the slave", true};
constexpr Word kHalfWatchdog{"half-watchdog", "the difference between a pause and half the watchdog"};

constexpr std::string_view kPauseMessage =
    R"(From {before_frame} to {frame} the slave in OP got no outputs for {gap_ms} (+-{uncertainty_us} by
{time_base}).[{!left_op_frame} In {frame} {pause_end}.] Its process data watchdog is {watchdog_ms} (0x0400 =
{divider}, 0x0420 = {intervals}[{?assumed}; assumed: the values after power-on]).[ In {left_op_frame} it reports
{left_op_status}[ with AL status code {left_op_code}].][ Its outputs usually come every {usual_ms}.])";
constexpr std::string_view kPauseNext = "Find out why the master paused, or set a longer watchdog in PREOP.";
constexpr std::string_view kWatchdogNext = "Set a watchdog of several cycles in PREOP.";
constexpr std::string_view kNoOutputsNext = "Start the cyclic exchange in SAFEOP, then request OP.";

constexpr FindingKind kExceeded{
    .name = "watchdog-exceeded",
    .title = "Outputs [{?stopped}stopped][{!stopped}paused] for {gap_ms}, longer than the watchdog of {watchdog_ms}",
    .message = kPauseMessage,
    .next = kPauseNext,
    .identity = "stopped"};

constexpr FindingKind kHalfExceeded{
    .name = "half-watchdog-exceeded",
    .title = "Outputs [{?stopped}stopped][{!stopped}paused] for {gap_ms}, over half the watchdog of {watchdog_ms}",
    .message = kPauseMessage,
    .next = kPauseNext,
    .identity = "stopped"};

constexpr FindingKind kShorter{
    .name = "watchdog-shorter-than-cycle",
    .title = "Watchdog of {watchdog_ms} is shorter than the cycle of {longest_cycle_ms}",
    .message = R"(The outputs of this slave come every {cycle_ms} (+-{uncertainty_us} by {time_base}). Its process data
watchdog is {watchdog_ms} (0x0400 = {divider}, 0x0420 = {intervals}[{?assumed}; assumed: the values after
power-on]).[ It was set in {set_frame}.] It expires in [{?every_cycle}every cycle][{!every_cycle}a cycle of
{longest_cycle_ms}].)",
    .next = kWatchdogNext};

constexpr FindingKind kTight{
    .name = "watchdog-short",
    .title = "Watchdog of {watchdog_ms} covers no more than 2 cycles of {cycle_ms}",
    .message = R"(The outputs of this slave come every {cycle_ms} (+-{uncertainty_us} by {time_base}). Its process data
watchdog is {watchdog_ms} (0x0400 = {divider}, 0x0420 = {intervals}[{?assumed}; assumed: the values after power-on]).[
It was set in {set_frame}.][{?every_cycle} It expires in every cycle.][{!every_cycle} A single lost or late frame lets
it expire.])",
    .next = kWatchdogNext};

constexpr FindingKind kRefused{
    .name = "no-outputs-refused",
    .title = "OP refused with {al_status_code:number}: no outputs before the request",
    .message =
        R"(The master requested OP in {request_frame}. It sent no outputs for this slave before. In {frame} the slave
answers {al_status} with AL status code {al_status_code}.)",
    .next = kNoOutputsNext};

constexpr FindingKind kRefusedLater{
    .name = "outputs-ended-refused",
    .title = "OP refused with {al_status_code:number}: no outputs for {since_ms}",
    .message =
        R"(The master requested OP in {request_frame}. The last outputs for this slave are in {last_outputs_frame},
{since_ms} before the answer. In {frame} the slave answers {al_status} with AL status code {al_status_code}.)",
    .next = kNoOutputsNext};

constexpr FindingKind kWaiting{
    .name = "no-outputs-waiting",
    .title = "OP not reached after {waited_ms}: the master sends no outputs",
    .message = R"(The master requested OP in {request_frame}. It sends no outputs for this slave, which has an FMMU for
them. After {waited_ms}, in {frame}, the slave still reports {al_status}.)",
    .next = kNoOutputsNext};

constexpr FindingKind kDropped{
    .name = "no-outputs-dropped",
    .title = "OP lost with {al_status_code:number}: the master sent no outputs",
    .message = R"(The slave is in OP in {op_frame}[ (requested in {request_frame})]. The capture has no outputs for this
slave up to {frame}, where it reports {al_status} with AL status code {al_status_code}.)",
    .next = kNoOutputsNext};

constexpr NoteKind kStillInOp{
    .name = "still-in-op",
    .text = "The slave is still in OP in {op_frame}: its watchdog did not expire, or does not act."};

constexpr const FindingKind* kKinds[] = {&kExceeded, &kHalfExceeded, &kShorter, &kTight,
                                         &kRefused,  &kRefusedLater, &kWaiting, &kDropped};

constexpr NoteKind kWaitsForSdo{
    .name = "waits-for-sdo",
    .text =
        R"(In the pause the master waited for an SDO response: [{object}, ]request in {sdo_request_frame}, response in
{sdo_response_frame}, {sdo_ms}. It sent no process data of any slave in between: its program may transfer the SDO in the
thread that sends them.)"};

constexpr const NoteKind* kNotes[] = {&kStillInOp, &kWaitsForSdo};

// Several rules may explain one finding: the first that does so wins.
constexpr std::string_view kAfter[] = {"sync-op-before-sync"};

constexpr RuleInfo kInfo{
    .id = "sync-watchdog-margin",
    .group = "Synchronisation",
    .severity = Severity::kError,
    .history = History::kWhole,
    .subject = Subject::kTiming,
    .title = "Process data pause for half the sync manager watchdog or longer",
    .needs = "FMMUs and AL state of the slave; a clock: DC time in the frames, or good time stamps",
    .source = "ESC-1, watchdogs; ETG1000.6, AL Status Code register 0x0134",
    .kinds = kKinds,
    .notes = kNotes,
    .after = kAfter,
    .doc = R"(
## What it checks
The longest time without outputs for a slave in OP, against its process data watchdog: (0x0400 + 2) * 40 ns * 0x0420.

- A pause as long as the watchdog is an error, half of it a warning.
- OP that is refused or lost with 0x001B, or not reached, because no outputs are sent, is an error.
- A watchdog of no more than 2 cycles is reported once: as an error if it is shorter than the cycle, else as a warning.

## Why it matters
When the watchdog expires, the slave leaves OP (AL status code 0x001B) and the drive stops. A master that sometimes
comes close to it will be too late one day.

## How it is decided
- Outputs are LRW and LWR whose address an active write FMMU of the slave maps, with a working counter that is not 0.
  Writes to the memory of its output sync manager count, too. Those for other slaves do not count.
- The time between two of them is measured by the DC time that they carry, else by stamps.
- A slave in OP without outputs so far waits since it is in OP. One that gets no more outputs waits until it leaves OP
  or the capture ends.
- Up to 1.5 times the usual distance (the median of the last frames) is no pause, unless it exceeds the watchdog.
- Not evaluated: a pause whose limit lies within the uncertainty of the clock, and a cycle that is no longer than it.
- Not evaluated: a pause with frames that never returned, and outputs that end before frames cut by the snap length.
- Not evaluated: a pause that may be a capture gap. It may be one if no frame at all was captured in it, the slave is
  still in OP, and the indices of the frames do not show that none are missing.
- Sync managers without watchdog trigger (control bit 6) do not feed a watchdog. Then only a slave that really leaves OP
  is reported.
- If the capture does not show the registers, their values after power-on (100 ms) are assumed, and the finding is
  inferred.
- If the master waited for an SDO response in at least half of the pause, and sent no process data of any slave in
  between, the finding names the transfer.
- fmmu-inactive reports outputs that no FMMU maps.
- If the slave is in OP until the end of the capture, and AL Status shows that after the pause, its watchdog did not
  expire: a warning.
- If the slave leaves OP by itself in the pause (al-unexpected-change), that finding has this one as its cause.

## Example
samples/captures/falls-out-of-op.pcapng: 130 ms without process data, watchdog 100 ms.

## What to do
Find out why the master paused (scheduling, a blocking call, a debugger). If the cycle is long by design, set a longer
watchdog in PREOP.
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
    Subscribe<model::AlErrorCode>(&SyncWatchdogMargin::On);
    Subscribe<mailbox::SdoTransfer>(&SyncWatchdogMargin::On);
    Subscribe<track::LogicalAccess>(&SyncWatchdogMargin::On);
  }

  void On(const track::LogicalAccess& e) { last_process_data_ = e.sent.seen() ? e.sent.number : e.returned.number; }

  void On(const mailbox::SdoTransfer& t) {
    constexpr TimeNs kLongEnough = 1'000'000;  // no watchdog expires in a shorter one
    if (!t.request.seen() || !t.request.has_time || !t.last.has_time) return;
    if (Elapsed(t.request.time, t.last.time) < kLongEnough || SentProcessDataSince(t.request.number)) return;
    SdoWait wait{t.request, t.last, {}};
    if (t.has_object) wait.object = arg::Object(t.index, t.subindex);
    sdo_waits_[next_sdo_wait_++ % sdo_waits_.size()] = std::move(wait);
  }

  /// The master may read AL Status after outputs come again.
  void On(const model::AlChangedByItself& e) {
    std::erase_if(unconfirmed_, [&](const Unconfirmed& u) { return u.slave == e.slave; });
    Of(e.slave).drop = e;
    if (e.code) DroppedWithoutOutputs(e.slave, *e.code);
    if (e.slave >= doubtful_.size() || !doubtful_[e.slave]) return;
    sync::OutputGap gap = *std::exchange(doubtful_[e.slave], std::nullopt);
    // Seen in OP after the gap, or for another reason: that was no watchdog.
    if (!MayBeWatchdog(e) || e.before_since > gap.after.number) {
      AddMayBeGap(gap);
      return;
    }
    gap.fell = e.frame;
    gap.fell_to = e.status;
    gap.fell_code = e.code;
    Evaluate(gap);
  }

  void On(const model::AlErrorCode& e) { DroppedWithoutOutputs(e.slave, e.code); }

  /// The registers of the watchdog are written: what was reported was about the values before.
  void On(const track::SlaveAccess& access) {
    const bool sets = !access.Covered(access.written, esc::kWatchdogDivider, 2).empty() ||
                      !access.Covered(access.written, esc::kProcessWatchdog, 2).empty();
    if (!sets || access.acceptance == track::Acceptance::kRefused) return;
    Of(access.slave).written = access.frame();
    Of(access.slave).reported_short = {kNoFinding, kNoFinding};
  }

  void On(const sync::SlaveRunEnded& e) {
    if (e.slave < slaves_.size()) EvaluateEarly(e.slave);
  }

  void On(const sync::OutputGap& e) {
    Slave& slave = Of(e.slave);
    sync::OutputGap gap = e;
    if (gap.nominal_ns == 0) gap.nominal_ns = slave.usual_ns;
    const bool may_wait =
        e.end == sync::OutputGap::End::kOutputs && !e.fell.seen() && !context().sync().outputs(e.slave).may_be_hole;
    if (gap.nominal_ns == 0 && may_wait && slave.early.size() < kMostEarly) {
      slave.early.push_back(e);
      if (slave.early.size() == kMostEarly) EvaluateEarly(e.slave);
      return;
    }
    EvaluateEarly(e.slave);
    Evaluate(gap);
  }

  void On(const model::AlAnswered& e) {
    if (e.outcome != model::AlAnswered::Outcome::kRefused || !e.code || *e.code != esc::al_code::kWatchdog ||
        e.request.control.state() != static_cast<std::uint8_t>(esc::AlState::OP)) {
      return;
    }
    const sync::OutputWatch& outputs = context().sync().outputs(e.slave);
    // No process data reach this slave at all: fmmu-inactive reports that.
    if (!outputs.direct && !IsMapped(e.slave) && context().network().fmmus(e.slave).any) return;
    // The watchdog counts from the last outputs from any source.
    const bool none = !outputs.seen;
    const FrameNo last_outputs = none ? 0 : outputs.last.frame.number;
    if (AcceptsNone(e.slave, last_outputs) || AnyCutSince(last_outputs)) return;
    TimeNs since = 0;
    if (!none) {
      const auto uncertainty = context().sync().Uncertainty(sync::TimeBase::kCapture);
      if (!uncertainty || !outputs.last.stamp || !e.frame.has_time) return;
      since = Elapsed(*outputs.last.stamp, e.frame.time);
      if (since - *uncertainty < outputs.watchdog_ns || outputs.watchdog_ns == 0) return;
    }
    FindingIndex index = Repeat(e.slave, 4, e.frame);
    if (index == kNoFinding) {
      Finding finding = Found(none ? kRefused : kRefusedLater, e.slave, e.frame);
      AddRelated(finding, e.request.frame.number);
      finding.Set("al_status_code", CodeValue(*e.code, *context().slave(e.slave).profile))
          .Set("al_status", arg::Status(e.status.raw))
          .Set("request_frame", arg::Frame(e.request.frame.number));
      if (!none) {
        finding.Set("since_ms", arg::Ms(since)).Set("last_outputs_frame", arg::Frame(outputs.last.frame.number));
      }
      index = Report(4, std::move(finding));
    }
    consequences_.push_back({"al-refused", e.slave, e.frame.number, index});
  }

  /// The slave waits in SAFEOP for outputs that the master does not send.
  void On(const model::AlOverdue& e) {
    const bool to_op = e.request.control.state() == static_cast<std::uint8_t>(esc::AlState::OP);
    if (!to_op || e.status.state() != static_cast<std::uint8_t>(esc::AlState::SAFEOP)) return;
    if (context().sync().outputs(e.slave).seen || !IsMapped(e.slave) || AcceptsNone(e.slave, 0)) return;
    if (AnyCutSince(e.request.frame.number)) return;
    FindingIndex index = Repeat(e.slave, 4, e.frame);
    if (index == kNoFinding) {
      Finding finding = Found(kWaiting, e.slave, e.frame);
      AddRelated(finding, e.request.frame.number);
      finding.Set("al_status", arg::Status(e.status.raw))
          .Set("waited_ms", arg::Ms(e.waited_ns))
          .Set("request_frame", arg::Frame(e.request.frame.number));
      index = Report(4, std::move(finding));
    }
    consequences_.push_back({"al-timeout", e.slave, e.frame.number, index});
  }

  void Finish() override {
    for (std::size_t s = 0; s < slaves_.size(); ++s) EvaluateEarly(static_cast<SlaveId>(s));
    for (const std::optional<sync::OutputGap>& gap : doubtful_) {
      if (gap) AddMayBeGap(*gap);
    }
    ConfirmByState();
    for (const Consequence& c : consequences_) NameCause(context(), c.rule, c.slave, c.frame, c.cause);
    if (NotEvaluableWithoutReturns()) return;
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      const model::SlaveModel& slave = context().slave(id);
      if (slave.al.possible().single() != static_cast<std::uint8_t>(esc::AlState::OP)) continue;
      if (!context().sync().outputs(id).seen && !context().network().fmmus(id).any) {
        NotEvaluable(id, ReasonCode::kNotInCapture, what::kFmmus);
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
    std::array<FindingIndex, 2> reported_short{kNoFinding, kNoFinding};
    std::vector<sync::OutputGap> early;            ///< before it was known how far its outputs usually are apart
    std::deque<sync::OutputGap> recent;            ///< newest first
    TimeNs usual_ns = 0;                           ///< by these
    std::optional<model::AlChangedByItself> drop;  ///< out of OP; its code may be read later
  };
  /// A master that reads AL Status seldom sends some outputs before it sees the drop.
  static constexpr std::size_t kRecent = 4;
  /// This many gaps make a rhythm of their own.
  static constexpr std::size_t kMostEarly = 32;

  Slave& Of(SlaveId id) {
    if (id >= slaves_.size()) slaves_.resize(std::size_t{id} + 1);
    return slaves_[id];
  }

  /// Without a code, the slave dropped as it does where the watchdog runs out.
  static bool MayBeWatchdog(const model::AlChangedByItself& e) {
    if (e.code) return *e.code == esc::al_code::kWatchdog;
    return e.before.state() == static_cast<std::uint8_t>(esc::AlState::OP) && e.status.bit4() &&
           e.status.state() == static_cast<std::uint8_t>(esc::AlState::SAFEOP);
  }

  /// The slave left OP because of outputs that the master never sent. Where a pause is the cause, On(OutputGap) has it.
  void DroppedWithoutOutputs(SlaveId id, std::uint16_t code) {
    const std::optional<model::AlChangedByItself> drop = std::exchange(Of(id).drop, std::nullopt);
    if (!drop || code != esc::al_code::kWatchdog || drop->before.state() != static_cast<std::uint8_t>(esc::AlState::OP))
      return;
    if (context().sync().outputs(id).seen || AcceptsNone(id, 0) || AnyCutSince(drop->before_first)) return;
    // No FMMU maps its outputs: fmmu-inactive reports that.
    if (!IsMapped(id)) {
      if (!context().network().fmmus(id).any) NotEvaluable(id, ReasonCode::kNotInCapture, what::kFmmus);
      return;
    }
    if (context().network().MayMissBetween(drop->before_first, drop->frame.number)) {
      NotEvaluable(id, ReasonCode::kCaptureGap, kOutputsWord, drop->frame.number);
      return;
    }
    const FrameNo request = context().slave(id).al.last_request();
    FindingIndex index = Repeat(id, 5, drop->frame);
    if (index == kNoFinding) {
      Finding finding = Found(kDropped, id, drop->frame);
      finding.Set("op_frame", arg::Frame(drop->before_first))
          .Set("al_status", arg::Status(drop->status.raw))
          .Set("al_status_code", CodeValue(code, *context().slave(id).profile));
      if (request != 0) finding.Set("request_frame", arg::Frame(request));
      AddRelated(finding, drop->before_first);
      index = Report(5, std::move(finding));
    }
    consequences_.push_back({"al-unexpected-change", id, drop->frame.number, index});
    if (consequences_.size() > kMaxConsequences) consequences_.erase(consequences_.begin());
  }

  /// Gaps that waited until it is known what is usual.
  void EvaluateEarly(SlaveId id) {
    std::vector<sync::OutputGap> early;
    early.swap(Of(id).early);
    if (early.empty()) return;
    const sync::CyclicImage* image = context().sync().outputs(id).image;
    TimeNs usual = image != nullptr && image->has_nominal() ? image->nominal_ns : 0;
    if (usual == 0 && early.size() >= kFewGaps) {
      std::vector<TimeNs> sorted;
      for (const sync::OutputGap& gap : early) sorted.push_back(gap.gap.ns);
      std::ranges::sort(sorted);
      usual = Of(id).usual_ns = sorted[sorted.size() / 2];
    }
    for (sync::OutputGap& gap : early) {
      gap.nominal_ns = usual;
      Evaluate(gap);
    }
  }

  void Evaluate(const sync::OutputGap& measured) {
    const Watchdog watchdog = WatchdogOf(measured.slave);
    if (watchdog.ns == 0) return;
    const sync::OutputGap e = GapOfDrop(measured, watchdog);
    std::deque<sync::OutputGap>& recent = Of(e.slave).recent;
    recent.push_front(measured);
    if (recent.size() > kRecent) recent.pop_back();
    // No FMMU maps its outputs: that is the fault, and fmmu-inactive reports it.
    if (e.end != sync::OutputGap::End::kOutputs && !context().sync().outputs(e.slave).direct && !IsMapped(e.slave)) {
      return;
    }
    // No outputs paused where none ever came: DroppedWithoutOutputs() has that.
    if (e.end == sync::OutputGap::End::kFell && !e.fed_before && !context().sync().outputs(e.slave).seen) return;
    const bool left_op = e.fell.seen() && (!e.fell_code || *e.fell_code == esc::al_code::kWatchdog);
    if (!watchdog.monitors && !left_op) return;
    if (e.end != sync::OutputGap::End::kOutputs && AnyCutSince(e.before.number)) return;
    FindingIndex index = kNoFinding;
    if (IsUsual(e, watchdog)) {
      // Nothing paused, and half the watchdog is for what does.
      if (e.nominal_ns + e.nominal_ns / kAboutHalf < watchdog.ns / 2) return;
      if (*e.uncertainty_ns >= e.nominal_ns) {
        return NotEvaluable(e.slave, ReasonCode::kStampsTooCoarse, what::kProcessDataTiming, e.after.number);
      }
      index = ReportShort(e, watchdog, left_op);
    } else if (CanBeEvaluated(e, watchdog, left_op)) {
      index = ReportPause(e, watchdog, left_op);
    }
    if (left_op && index != kNoFinding)
      consequences_.push_back({"al-unexpected-change", e.slave, e.fell.number, index});
    if (consequences_.size() > kMaxConsequences) consequences_.erase(consequences_.begin());
  }

  /// The watchdog cannot expire within less than its time after outputs. A slave that is seen to have left OP so soon
  /// left it in the gap before.
  [[nodiscard]] sync::OutputGap GapOfDrop(const sync::OutputGap& e, const Watchdog& watchdog) {
    if (!e.fell.has_time || !e.before.has_time || !e.fed_before || !e.uncertainty_ns) return e;
    if (e.gap.ns < watchdog.ns || Elapsed(e.before.time, e.fell.time) + *e.uncertainty_ns >= watchdog.ns) return e;
    const std::deque<sync::OutputGap>& recent = Of(e.slave).recent;
    const auto found = std::ranges::find_if(recent, [&](const sync::OutputGap& gap) {
      return !gap.fell.seen() && gap.after.seen() && gap.after.number < e.fell.number && gap.gap.ns >= watchdog.ns;
    });
    if (found == recent.end()) return e;
    sync::OutputGap before = *found;
    before.nominal_ns = e.nominal_ns;
    before.fell = e.fell;
    before.fell_to = e.fell_to;
    before.fell_code = e.fell_code;
    return before;
  }

  /// The gap is one of those that the outputs always have.
  [[nodiscard]] static bool IsUsual(const sync::OutputGap& e, const Watchdog& watchdog) {
    if (e.end != sync::OutputGap::End::kOutputs || e.nominal_ns == 0 || !e.uncertainty_ns) return false;
    const TimeNs least = e.gap.ns - *e.uncertainty_ns;
    if (least > e.nominal_ns + e.nominal_ns / 2) return false;
    // Late by less than half a cycle, but late enough.
    return e.nominal_ns >= watchdog.ns || least < watchdog.ns || least <= e.nominal_ns + e.nominal_ns / 8;
  }

  FindingIndex ReportPause(const sync::OutputGap& e, const Watchdog& watchdog, bool left_op) {
    const FrameRef& frame = e.after.seen() ? e.after : e.fell;
    const bool exceeds = e.gap.ns - *e.uncertainty_ns >= watchdog.ns;
    const std::uint64_t key = (exceeds ? 1U : 0U) | (left_op ? 2U : 0U);
    const FindingIndex index = Repeat(e.slave, key, frame);
    if (index != kNoFinding) {
      AddRelated(context().store[index], frame.number);
      return index;
    }
    Finding finding = FindingOf(e, watchdog, exceeds, left_op);
    if (exceeds) finding.caused_by = Of(e.slave).reported_short[1];  // each cycle is such a pause
    AddSdoWait(finding, e);
    const FindingIndex reported = Report(key, exceeds ? Severity::kError : Severity::kWarning, std::move(finding));
    if (exceeds && !left_op && e.end == sync::OutputGap::End::kOutputs) AddUnconfirmed(e, reported);
    return reported;
  }

  /// Once for each watchdog that is set: it is so in every cycle.
  FindingIndex ReportShort(const sync::OutputGap& e, const Watchdog& watchdog, bool left_op) {
    Slave& slave = Of(e.slave);
    const bool shorter = std::max(e.nominal_ns, e.gap.ns) - *e.uncertainty_ns >= watchdog.ns;
    FindingIndex& reported = slave.reported_short[shorter ? 1 : 0];
    if (reported != kNoFinding) {
      context().store[reported].last = e.after;  // it goes on
      return reported;
    }
    const std::uint64_t key = shorter ? 8 : 9;
    reported = Repeat(e.slave, key, e.after);
    if (reported != kNoFinding) return reported;
    Finding finding = Found(shorter ? kShorter : kTight, e.slave, e.after);
    AddRelated(finding, e.before.number);
    if (slave.written.seen()) AddRelated(finding, slave.written.number);
    finding.Set("cycle_ms", arg::Ms(e.nominal_ns));
    SetMeasured(finding, e, watchdog, left_op);
    if (shorter) finding.Set("longest_cycle_ms", arg::Ms(std::max(e.nominal_ns, e.gap.ns)));
    if (slave.written.seen()) finding.Set("set_frame", arg::Frame(slave.written.number));
    finding.Set("every_cycle", arg::Flag(e.nominal_ns >= watchdog.ns));
    reported = Report(key, shorter ? Severity::kError : Severity::kWarning, std::move(finding));
    if (shorter && !left_op) AddUnconfirmed(e, reported);
    return reported;
  }

  /// The master sends outputs since `frame`, but the slave counts for none: wkc-never-right and al-refused report that.
  [[nodiscard]] bool AcceptsNone(SlaveId slave, FrameNo frame) const {
    return context().slave(slave).outputs.since.last_missed > frame;
  }

  /// A frame that is cut by the snap length may have brought outputs.
  [[nodiscard]] bool AnyCutSince(FrameNo frame) const { return context().statistics().last_cut.number > frame; }

  /// To any slave, also those that are written to its memory.
  [[nodiscard]] bool SentProcessDataSince(FrameNo frame) const {
    if (last_process_data_ > frame) return true;
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      const sync::OutputWatch& outputs = context().sync().outputs(static_cast<SlaveId>(s));
      if (outputs.seen && outputs.last.frame.number > frame) return true;
    }
    return false;
  }

  /// Whether the master did nothing but wait for an SDO response in most of the pause.
  void AddSdoWait(Finding& finding, const sync::OutputGap& e) const {
    for (const SdoWait& wait : sdo_waits_) {
      if (!wait.request.seen() || wait.request.number < e.before.number) continue;
      if (e.after.seen() && wait.response.number > e.after.number) continue;
      const TimeNs took = Elapsed(wait.request.time, wait.response.time);
      if (2 * took < e.gap.ns) continue;
      Arguments arguments{{"sdo_request_frame", arg::Frame(wait.request.number)},
                          {"sdo_response_frame", arg::Frame(wait.response.number)},
                          {"sdo_ms", arg::Ms(took)}};
      if (wait.object) arguments.Set("object", *wait.object);
      finding.Add(kWaitsForSdo, std::move(arguments));
      AddRelated(finding, wait.request.number);
      AddRelated(finding, wait.response.number);
      return;
    }
  }

  void AddUnconfirmed(const sync::OutputGap& e, FindingIndex finding) {
    if (finding != kNoFinding && unconfirmed_.size() < kMaxConsequences) {
      unconfirmed_.push_back({e.slave, e.after.number, finding});
    }
  }

  /// The slave decides: where it stays in OP, its watchdog did not expire.
  void ConfirmByState() {
    for (const Unconfirmed& u : unconfirmed_) {
      const model::AlMachine& al = context().slave(u.slave).al;
      const FrameNo shown = al.last_seen();
      if (shown <= std::max(u.after, context().store[u.finding].last.number) || !al.SettledIn(esc::AlState::OP))
        continue;
      context().store.Regrade(u.finding, Severity::kWarning);
      context().store[u.finding].Add(kStillInOp, {{"op_frame", arg::Frame(shown)}});
    }
  }

  /// The watchdog, and how a gap was measured.
  static void SetMeasured(Finding& finding, const sync::OutputGap& e, const Watchdog& watchdog, bool left_op) {
    // What rests on the values after power-on is an assumption, unless the slave confirmed it.
    finding.confidence = watchdog.known() || left_op ? Confidence::kObserved : Confidence::kInferred;
    finding.Set("watchdog_ms", arg::Ms(watchdog.ns))
        .Set("time_base", arg::Of(WordOf(e.gap.base)))
        .Set("uncertainty_us", arg::Us(*e.uncertainty_ns))
        .Set("divider", arg::Number(watchdog.divider.value_or(esc::kDefaultWatchdogDivider)))
        .Set("intervals", arg::Number(watchdog.steps.value_or(kDefaultSteps)))
        .Set("assumed", arg::Flag(!watchdog.known()));
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
    return std::ranges::any_of(fmmus.active, [](const auto& f) { return f.fmmu.writes(); });
  }

  /// The master was silent for long, or the capture has a gap: nothing shows that the slave left OP for it.
  void AddMayBeGap(const sync::OutputGap& e) {
    NotEvaluable(e.slave, ReasonCode::kAmbiguous, what::kPause, e.after.number);
  }

  /// Whether the gap is certainly too long. If that is open, the reason is added.
  bool CanBeEvaluated(const sync::OutputGap& e, const Watchdog& watchdog, bool left_op) {
    const TimeNs half = watchdog.ns / 2;
    if (!e.uncertainty_ns) {
      if (e.gap.ns >= half)
        NotEvaluable(e.slave, ReasonCode::kStampsTooCoarse, what::kProcessDataTiming, e.after.number);
      return false;
    }
    if (!left_op && context().sync().outputs(e.slave).may_be_hole && e.gap.ns >= half) {
      if (e.slave >= doubtful_.size()) doubtful_.resize(static_cast<std::size_t>(e.slave) + 1);
      if (doubtful_[e.slave]) AddMayBeGap(*doubtful_[e.slave]);
      doubtful_[e.slave] = e;
      return false;
    }
    const TimeNs least = e.gap.ns - *e.uncertainty_ns;
    if (least < watchdog.ns && !(least >= half && watchdog.monitors)) {
      if (watchdog.monitors && e.gap.ns + *e.uncertainty_ns >= half) {
        NotEvaluable(e.slave, ReasonCode::kWithinUncertainty, kHalfWatchdog, e.after.number);
      }
      return false;
    }
    if (e.unreturned > 0) {
      NotEvaluable(e.slave, ReasonCode::kNeverReturned, what::kWorkingDuringPause, e.after.number);
      return false;
    }
    return true;
  }

  [[nodiscard]] static Finding FindingOf(const sync::OutputGap& e, const Watchdog& watchdog, bool exceeds,
                                         bool left_op) {
    const FrameRef& frame = e.after.seen() ? e.after : e.fell;
    Finding finding = Found(exceeds ? kExceeded : kHalfExceeded, e.slave, frame);
    AddRelated(finding, e.before.number);
    finding.Set("gap_ms", arg::Ms(e.gap.ns)).Set("before_frame", arg::Frame(e.before.number));
    SetMeasured(finding, e, watchdog, left_op);
    if (const Word* end = WordOf(e.end); end != nullptr) finding.Set("pause_end", arg::Of(*end));
    if (e.end == sync::OutputGap::End::kRequest || e.end == sync::OutputGap::End::kCapture) {
      finding.Set("stopped", arg::Flag());
    }
    if (left_op) {
      finding.Set("left_op_frame", arg::Frame(e.fell.number)).Set("left_op_status", arg::Status(e.fell_to.raw));
      if (e.fell_code) finding.Set("left_op_code", arg::Hex(*e.fell_code));
      if (e.fell.number != frame.number) AddRelated(finding, e.fell.number);
    }
    if (e.nominal_ns > 0) finding.Set("usual_ms", arg::Ms(e.nominal_ns));
    return finding;
  }

  struct Consequence {
    std::string_view rule;
    SlaveId slave = kNoSlave;
    FrameNo frame = 0;
    FindingIndex cause = kNoFinding;
  };
  static constexpr std::size_t kMaxConsequences = 256;

  std::vector<Slave> slaves_;
  /// A watchdog that should have expired, of a slave that was not seen to leave OP.
  struct Unconfirmed {
    SlaveId slave = kNoSlave;
    FrameNo after = 0;
    FindingIndex finding = kNoFinding;
  };
  std::vector<Unconfirmed> unconfirmed_;
  /// An SDO transfer of any slave.
  struct SdoWait {
    FrameRef request, response;
    std::optional<Value> object;
  };
  std::array<SdoWait, 8> sdo_waits_{};  // the newest
  std::size_t next_sdo_wait_ = 0;
  FrameNo last_process_data_ = 0;
  std::vector<Consequence> consequences_;
  std::vector<std::optional<sync::OutputGap>> doubtful_;  // of each slave: it may be a capture gap
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncWatchdogMargin>};

}  // namespace
}  // namespace ecaudit::sync_watchdog_margin
