#include <algorithm>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/no_pause.h"
#include "analyzers/judge/pause_reason.h"
#include "analyzers/judge/refusal_reasons.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_events.h"
#include "analyzers/sync/sync_model.h"
#include "analyzers/words/al_code_advice.h"
#include "analyzers/words/al_text.h"
#include "analyzers/words/what.h"
#include "decoder/pipeline.h"

namespace ecaudit::al_unexpected_change {
namespace {

// Of one slave.
constexpr std::string_view kMessage =
    R"([{!before_requested}AL Status is {al_status_before} in {before_frame}, and {al_status} ({al_status:number}) in
{frame}. [{!may_be_asked}No request of the master explains that.][{?may_be_asked}The capture holds no request of the
master that explains that: it may have been sent before the capture began.]][{?before_requested}The master requested {al_status_before} in
{before_frame} and did not read AL Status until {frame}. Then it is {al_status} ({al_status:number}).][ The AL status code (0x0134) is {al_status_code}.][ The cause by
[{?manual}the manual ({manual})][{!manual}the EtherCAT standard] is: {known_cause}.])";
constexpr std::string_view kNext =
    R"([{?reason}[{?reason_inferred}Check][{!reason_inferred}Correct]
this.][{!reason}[{code_advice}.][{!code_advice}Check what happened between {before_frame} and {frame}: {advice}.]])";

// Of all slaves together.
constexpr std::string_view kMessageOfBus =
    R"(Broadcast reads of AL Status, with a working counter of {slaves:number}, show {al_status_of_all_before} in
{before_frame}. From {frame} to {last_read_frame} they show {al_status_of_all}. No request of the master explains
that.)";
constexpr std::string_view kNextOfBus =
    R"(Read AL Status (0x0130) and its code (0x0134) from [{?one}the
slave][{!one}each slave]. Check what happened between {before_frame} and {frame}.)";

constexpr FindingKind kDropped{
    .name = "dropped",
    .title =
        "Drops from {al_status_before} to {al_status}[{?reason} ({al_status_code:number}): "
        "[{?reason_inferred}maybe ]{reason}[ ({reason_value})]][{!reason}[{?outputs_arrive} ({al_status_code:number}) "
        "although outputs arrive][{!outputs_arrive} by itself[, AL status code {al_status_code}]]]",
    .message = kMessage,
    .next = kNext,
    .identity = "al_status_before al_status al_status_code"};

constexpr FindingKind kErrorBitSet{
    .name = "error-bit-set",
    .title =
        "Error bit set in {al_status_before}[{!may_be_asked} without a request][, AL status code {al_status_code}]",
    .message = kMessage,
    .next = kNext,
    .identity = "al_status_before al_status al_status_code"};

constexpr FindingKind kAllDropped{
    .name = "all-dropped",
    .title = "All {slaves} drop from {al_status_before} to {dropped_to} by themselves (error bit set)",
    .message =
        R"(All {slaves} are in {al_status_before} in {before_frame}. From {frame} on a broadcast read of AL Status
shows all of them in {dropped_to}, and the error bit of at least one. No request of the master explains the change.)",
    .next =
        R"(Read AL Status (0x0130) and its code (0x0134) from each slave. Check what happened between {before_frame} and
{frame}.)",
    .identity = "al_status_before dropped_to"};

constexpr FindingKind kDroppedOnBus{
    .name = "dropped-on-bus",
    .title =
        "[{?one}The slave drops][{!one}One or more of {slaves} drop] to {dropped_to}[{?with_error} with an error] by "
        "[{?one}itself][{!one}themselves]",
    .message = kMessageOfBus,
    .next = kNextOfBus,
    .identity = "dropped_to with_error"};

constexpr FindingKind kErrorBitOnBus{
    .name = "error-bit-on-bus",
    .title = "[{?one}The slave sets][{!one}One or more of {slaves} set] the error bit without a request",
    .message = kMessageOfBus,
    .next = kNextOfBus};

constexpr NoteKind kCodeNotRead{.name = "code-not-read",
                                .text = "The master did not read the AL status code (0x0134)."};
constexpr NoteKind kErrorOfSome{
    .name = "error-of-some-slave",
    .text =
        R"(The broadcast read that shows the drop also shows the error bit of at least one slave. No read of this slave
shows whether the error is its own.)"};
constexpr NoteKind kUndefinedState{
    .name = "undefined-state",
    .text =
        R"(State {state} is none of the states 1, 2, 3, 4 and 8. The processor of the slave did not write AL Status,
or not as the standard requires.)"};
constexpr NoteKind kMayBeRestart{
    .name = "may-be-restart",
    .text = "Without the error bit this is typical of [{?to_init}a restart of the slave, or of ]another master."};
constexpr NoteKind kOnlySlaveLeft{
    .name = "only-slave-left",
    .text = "It is {slave}: the master read all other slaves, and none of them shows the change."};
constexpr NoteKind kSlaveNotKnown{
    .name = "slave-not-known",
    .text =
        R"(A broadcast read does not show which slave it is.[ It is {excluded?not|none of} {excluded}[, and {more}]:
the master read {excluded?it|them}, and {excluded?it does|they do} not show the change.])"};

constexpr const FindingKind* kKinds[] = {&kDropped, &kErrorBitSet, &kAllDropped, &kDroppedOnBus, &kErrorBitOnBus};
constexpr const NoteKind* kOwnNotes[] = {&kAllPaused,      &kNoPause,      &kCodeNotRead,   &kErrorOfSome,
                                         &kUndefinedState, &kMayBeRestart, &kOnlySlaveLeft, &kSlaveNotKnown};
constexpr auto kNotes = refusal::With(kOwnNotes);

// What takes a slave to a state.
constexpr Word kProcessData{"process-data", "pauses of the process data, lost frames, link errors"};
constexpr Word kSettings{"settings", "accesses to SM2 and SM3 and to their PDOs, faults of the slave itself"};
constexpr Word kPower{"power", "its power supply, restarts of the slave, accesses to SM0 and SM1"};
constexpr Word kOtherMaster{"other-master", "other masters, and requests that the capture does not hold"};

constexpr Word kRequest{"request", "a request of the master"};
constexpr Word kAlStatusTwice{"al-status-twice", "AL Status (0x0130) twice"};

constexpr RuleInfo kInfo{.id = "al-unexpected-change",
                         .group = "AL state machine",
                         .severity = Severity::kError,
                         .title = "The state drops, or the error bit appears, without a request",
                         .needs = "AL Status before and after",
                         .source = "ETG1000.6, EtherCAT state machine",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .doc = R"(
## What it checks
Whether AL Status (0x0130) shows a lower state than before, or the error bit, although the master requested neither.

## Why it matters
The drive left operation by itself: watchdog, loss of synchronisation, power cycle, local control. This is usually the
moment at which the machine stopped.

## How it is decided
- The state before was read.
- No request since then leads to the new state, not even over intermediate states.
- No request is in flight or lost.
- If the error bit appears in the same state soon after the capture began, and the capture holds no request, the slave
  may have refused one that was sent before: the finding is inferred.
- For 0x001B without a pause of the outputs in OP, the finding states so. It shows how many frames with outputs counted
  the slave, its watchdog, and whether SM2 restarts it (bit 6 of its control byte).
- For 0x001B of a slave whose FMMUs are not in the capture, a pause of all process data on the bus is named as possible
  cause: the finding is inferred.

The event happened between the last good read and this one. If the master requested OP and did not read AL Status
before it requested a lower state, a watchdog code (0x001B) shows that the slave was in OP: the finding is inferred. A
value that is no state counts as a drop if two reads in a row show it.

A broadcast read counts if its result shows the state of every slave. Otherwise the finding belongs to the bus:

- The result is a mixture (0x001C: some slaves in SAFEOP, some in OP, and an error bit). Some slave dropped or set its
  error bit. The finding names the slaves that it cannot be. If a slave shows the change by itself before the next
  request, the finding belongs to that slave.
- The result shows all slaves in one lower state and the error bit (0x14: all in SAFEOP), and no slave is read before
  the next request.

The rule is not evaluated if a request may be missing in the capture:

- The capture misses many packets (returned frames without an outbound copy, indices that skip). A drop from OP to
  SAFEOP with a code of watchdog or synchronisation is evaluated: a slave that refuses a request stays in its state.
- The state dropped without the error bit soon after the capture began, and the capture holds no request.
- The state dropped without the error bit, and a frame before it is cut by the snap length.
- The state dropped without the error bit in a long pause, and the indices do not show whether frames are missing there.
- The state dropped without the error bit, and the slave rose to a higher state before without a request. No slave rises
  by itself, so the capture does not hold all requests (a filter chose its packets).

## Example
samples/captures/falls-out-of-op.pcapng: 0x001B after the process data paused.

## What to do
Use the AL status code: 0x001B process data stopped (watchdog), 0x001A, 0x002C, 0x0032, 0x0034 synchronisation. Check
what happened between the two frames:

- Drop to SAFEOP with an error: pauses of the process data, lost frames, link errors.
- Drop to PREOP with an error: accesses to SM2 and SM3 and to their PDOs, faults of the slave itself.
- Drop to INIT: its power supply, restarts of the slave, accesses to SM0 and SM1.
- Drop to SAFEOP or PREOP without an error: other masters, and requests that the capture does not hold.
)"};

class AlUnexpectedChange final : public Rule {
 public:
  AlUnexpectedChange() : Rule(kInfo) {
    Subscribe<model::AlChangedByItself>(&AlUnexpectedChange::On);
    Subscribe<model::AlErrorRepeated>(&AlUnexpectedChange::On);
    Subscribe<model::AlErrorCode>(&AlUnexpectedChange::On);
    Subscribe<model::AlErrorCleared>(&AlUnexpectedChange::On);
    Subscribe<model::AlAnswered>(&AlUnexpectedChange::On);
    Subscribe<model::BusAlChanged>(&AlUnexpectedChange::On);
    Subscribe<sync::OutputGap>(&AlUnexpectedChange::On);
  }

  void On(const model::AlChangedByItself& e) {
    const bool of_all = e.error_of_some && !e.after_pause && context().slave_count() > 1;
    if (!of_all || (!pending_.empty() && pending_.front().frame.number != e.frame.number)) Settle();
    if (of_all) {
      pending_.push_back(e);
    } else {
      ReportChange(e);
    }
  }
  void On(const sync::OutputGap& e) {
    const TimeNs watchdog = context().sync().outputs(e.slave).watchdog_ns;
    if (e.gap.ns < watchdog / 2) return;
    late_outputs_[e.slave] = e.after.seen() ? e.after.number : e.fell.number;
  }
  void On(const model::AlErrorRepeated& e) {
    Flush();
    const FindingIndex index = OpenOf(e.slave);
    if (index == kNoFinding) return;
    ++context().store[index].count;
    context().store[index].last = e.frame;
    // A broadcast read showed the state only; now this slave shows its error bit.
    Reported& reported = reported_[index];
    if (reported.change.status.state() == e.status.state() && !reported.change.status.bit4()) {
      reported.change.status = e.status;
      Describe(context().store[index], reported);
    }
  }
  void On(const model::AlErrorCode& e) {
    Flush();
    if (const auto found = undecided_.find(e.slave); found != undecided_.end()) {
      model::AlChangedByItself change = found->second;
      change.code = e.code;
      if (IsProven(change)) {
        undecided_.erase(found);
        return ReportChange(change);
      }
    }
    if (const FindingIndex index = OpenOf(e.slave); index != kNoFinding) AddCode(index, e.frame, e.code);
  }
  void On(const model::BusAlChanged& e) {
    if (MissesPackets(context().pairing())) return NotEvaluable(kNoSlave, ReasonCode::kMissesPackets, e.frame.number);
    if (!e.unexplained.bit4()) {
      if (const std::optional<Reason> reason = ReasonToDoubt(e)) return NotEvaluable(kNoSlave, *reason, e.frame.number);
    }
    const std::uint64_t key = static_cast<std::uint64_t>(e.before.raw) << 16U | e.status.raw;
    const SlaveId only = OnlyOneLeft(e);
    if (const FindingIndex repeated = Repeat(only, key, e.last); repeated != kNoFinding) {
      AddRelated(context().store[repeated], e.frame.number);
      return;
    }
    const std::uint8_t state = e.unexplained.state();
    Finding finding = Found(state != 0 ? kDroppedOnBus : kErrorBitOnBus, only, e.frame);
    finding.last = e.last;
    AddRelated(finding, e.before_since);
    finding.Set("al_status_of_all_before", arg::StatusOfAll(e.before.raw))
        .Set("al_status_of_all", arg::StatusOfAll(e.status.raw))
        .Set("before_frame", arg::Frame(e.before_since))
        .Set("last_read_frame", arg::Frame(e.last.number))
        .Set("slaves", arg::Count(e.slaves, "slave"))
        .Set("one", arg::Flag(e.slaves == 1 || only != kNoSlave));
    if (state != 0) {
      finding.Set("dropped_to", arg::StatusOfAll(state)).Set("with_error", arg::Flag(e.unexplained.bit4()));
    }
    AddWhoItIs(finding, only, e.excluded);
    (void)Report(key, std::move(finding));
  }
  void On(const model::AlErrorCleared& e) {
    Settle();
    GiveUp(e.slave);
    Close(e.slave, e.frame.number);
  }
  void On(const model::AlAnswered& e) {
    Settle();
    GiveUp(e.slave);
    Close(e.slave, e.frame.number);
  }

  void Finish() override {
    Settle();
    while (!undecided_.empty()) GiveUp(undecided_.begin()->first);
    if (NotEvaluableWithoutReturns()) return;
    NotEvaluableWhere([](const model::SlaveModel& s) { return s.al.status_reads() < 2; },
                      Reason::Of(ReasonCode::kNotRead, kAlStatusTwice));
  }

 private:
  /// What a finding rests on: its first occasion, and the code read then or later.
  struct Reported {
    model::AlChangedByItself change;
    std::optional<std::uint16_t> code;
    RefusalReasons reasons;
    std::optional<NoPause> no_pause;
  };

  /// Why a request between two reads may be missing: the indices of the frames do not show that each of them is in the
  /// capture, or one of them is cut.
  [[nodiscard]] std::optional<Reason> MayLackRequest(FrameNo before, FrameNo now) const {
    const auto between = [&](FrameNo frame) { return before < frame && frame <= now; };
    if (between(context().statistics().last_cut.number)) return Reason::Of(ReasonCode::kSnapLength);
    if (between(context().pairing().last_loose)) return Reason::Of(ReasonCode::kMissesPackets, kRequest);
    return std::nullopt;
  }

  /// Why a request of the lower state may be missing in the capture.
  [[nodiscard]] std::optional<Reason> ReasonToDoubt(const model::BusAlChanged& e) const {
    if (e.after_pause) return Reason::Of(ReasonCode::kCaptureGap, what::kAlState);
    if (auto reason = MayLackRequest(e.before_since, e.frame.number)) return reason;
    if (e.rose_unasked != 0) return Reason::Of(ReasonCode::kNotInCapture, kRequest);
    return std::nullopt;
  }

  /// The only slave that was not read, if all others were and do not show the change.
  [[nodiscard]] SlaveId OnlyOneLeft(const model::BusAlChanged& e) const {
    const std::size_t slaves = context().network().slaves().size();
    if (slaves != e.slaves || e.excluded.empty() || e.excluded.size() + 1 != slaves) return kNoSlave;
    for (std::size_t s = 0; s < slaves; ++s) {
      const auto slave = static_cast<SlaveId>(s);
      if (std::ranges::find(e.excluded, slave) == e.excluded.end()) return slave;
    }
    return kNoSlave;
  }

  void AddWhoItIs(Finding& finding, SlaveId only, std::span<const SlaveId> excluded) const {
    constexpr std::size_t kNamed = 8;
    if (only != kNoSlave) {
      finding.Add(kOnlySlaveLeft, {{"slave", arg::Slave(only, context().Label(only))}});
      return;
    }
    std::vector<Value> named;
    for (const SlaveId slave : excluded.first(std::min(excluded.size(), kNamed))) {
      named.push_back(arg::Slave(slave, context().Label(slave)));
    }
    Arguments arguments;
    if (!named.empty()) arguments.Set("excluded", arg::List(std::move(named)));
    if (excluded.size() > kNamed) arguments.Set("more", arg::Count(excluded.size() - kNamed, "other"));
    finding.Add(kSlaveNotKnown, std::move(arguments));
  }
  [[nodiscard]] FindingIndex OpenOf(SlaveId slave) const { return slave < open_.size() ? open_[slave] : kNoFinding; }
  /// The slave does not stay where it dropped to.
  void Close(SlaveId slave, FrameNo until) {
    if (const FindingIndex index = OpenOf(slave); index != kNoFinding) {
      context().store[index].until = until;
      open_[slave] = kNoFinding;
    }
    if (all_ != kNoFinding) context().store[std::exchange(all_, kNoFinding)].until = until;
  }

  void ReportChange(const model::AlChangedByItself& e) {
    GiveUp(e.slave);
    if (e.slave >= open_.size()) open_.resize(static_cast<std::size_t>(e.slave) + 1, kNoFinding);
    Close(e.slave, e.frame.number);
    if (MissesPackets(context().pairing()) && !IsProven(e)) {
      undecided_[e.slave] = e;
      return;
    }
    if (e.after_pause && !e.status.bit4()) {
      NotEvaluable(e.slave, ReasonCode::kCaptureGap, what::kAlState, e.frame.number);
      return;
    }
    // Slaves that only mirror AL Control return the acknowledge bit as error bit.
    const bool no_error = !e.error_of_some && (!e.status.bit4() || e.code == std::uint16_t{0});
    if (const auto reason = MayLackRequest(e.before_since, e.frame.number); reason && no_error) {
      NotEvaluable(e.slave, *reason, e.frame.number);
      return;
    }
    if (e.may_be_asked && !e.status.bit4() && !e.error_of_some) {
      NotEvaluable(e.slave, ReasonCode::kNotInCapture, kRequest, e.frame.number);
      return;
    }
    // A slave never rises by itself: the capture does not hold every request.
    if (e.rose_unasked != 0 && !e.status.bit4() && !e.error_of_some) {
      NotEvaluable(e.slave, ReasonCode::kNotInCapture, kRequest, e.frame.number);
      return;
    }
    const std::uint64_t key = static_cast<std::uint64_t>(e.before.raw) << 16U | e.status.raw;
    FindingIndex index = Repeat(e.slave, key, e.frame);
    if (index == kNoFinding) {
      const bool same_state = e.before.state() == e.status.state();
      Finding finding = Found(same_state ? kErrorBitSet : kDropped, e.slave, e.frame);
      AddRelated(finding, e.before_since);
      index = Report(key, std::move(finding));
      if (index == kNoFinding) return;
      if (reported_.emplace(index, Reported{e, {}, {}, {}}).second) Describe(context().store[index], reported_[index]);
    } else {
      AddRelated(context().store[index], e.frame.number);
    }
    open_[e.slave] = index;
    context().store[index].until = Finding::kCaptureEnds;
    if (e.code && e.status.bit4()) AddCode(index, e.frame, *e.code);
  }

  /// A slave that refuses a request stays in its state. So no missing request explains a drop with such a code.
  [[nodiscard]] static bool IsProven(const model::AlChangedByItself& e) {
    const std::uint16_t code = e.code.value_or(0);
    const bool runs_out = code == esc::al_code::kWatchdog || esc::SpeaksOfSynchronisation(code);
    return runs_out && e.status.bit4() && !e.error_of_some && !e.before_requested && e.before.state() == kOp &&
           e.status.state() == kSafeop;
  }

  /// The code that would prove that no request is missing was not read.
  void GiveUp(SlaveId slave) {
    const auto found = undecided_.find(slave);
    if (found == undecided_.end()) return;
    NotEvaluable(slave, ReasonCode::kMissesPackets, found->second.frame.number);
    undecided_.erase(found);
  }

  /// Slaves are read by themselves: each has a finding of its own.
  void Flush() {
    for (const model::AlChangedByItself& e : pending_) ReportChange(e);
    pending_.clear();
  }

  /// No slave was read by itself: what one broadcast read shows of all of them is one finding, of the bus.
  void Settle() {
    if (pending_.empty()) return;
    const auto alike = [&](const model::AlChangedByItself& e) { return e.before.raw == pending_.front().before.raw; };
    if (pending_.size() < context().slave_count() || MissesPackets(context().pairing()) ||
        !std::ranges::all_of(pending_, alike)) {
      return Flush();
    }
    const model::AlChangedByItself e = pending_.front();
    pending_.clear();
    const std::uint64_t key = kOfAll | static_cast<std::uint64_t>(e.before.raw) << 16U | e.status.raw;
    all_ = Repeat(kNoSlave, key, e.frame);
    if (all_ != kNoFinding) {
      context().store[all_].until = Finding::kCaptureEnds;
      return;
    }
    Finding finding = Found(kAllDropped, kNoSlave, e.frame);
    finding.until = Finding::kCaptureEnds;
    AddRelated(finding, e.before_since);
    finding.Set("al_status_before", arg::Status(e.before.raw))
        .Set("al_status_of_all", arg::StatusOfAll(e.status.raw | kErrorBit))
        .Set("dropped_to", arg::Status(e.status.raw))
        .Set("before_frame", arg::Frame(e.before_since))
        .Set("slaves", arg::Count(context().slave_count(), "slave"));
    all_ = Report(key, std::move(finding));
  }

  void AddCode(FindingIndex index, const FrameRef& frame, std::uint16_t code) {
    Reported& reported = reported_[index];
    if (reported.code) return;
    reported.code = code;
    const FrameRef& shown = reported.change.frame;
    reported.reasons =
        FindRefusalReasons(context(), {.slave = reported.change.slave,
                                       .code = code,
                                       .shown = shown.number,
                                       .held_since = reported.change.before_first,
                                       .time = shown.has_time ? std::optional<TimeNs>(shown.time) : std::nullopt});
    if (code == esc::al_code::kWatchdog && reported.reasons.reason == nullptr) AddPause(reported);
    if (code == esc::al_code::kWatchdog && reported.reasons.reason == nullptr) AddNoPause(reported);
    Describe(context().store[index], reported);
    AddRelated(context().store[index], frame.number == context().store[index].first.number ? 0 : frame.number);
  }

  void AddPause(Reported& reported) const {
    const model::AlChangedByItself& e = reported.change;
    if (e.before.state() != kOp) return;
    const auto pause = PauseReason(context(), e.slave, e.before_since, e.frame);
    if (!pause) return;
    reported.reasons.reason = &kWhyPaused;
    reported.reasons.value = arg::Ms(pause->length());
    reported.reasons.inferred = true;
    reported.reasons.notes.push_back(NoteOf(context(), e.slave, *pause));
  }

  void AddNoPause(Reported& reported) const {
    const model::AlChangedByItself& e = reported.change;
    const auto late = late_outputs_.find(e.slave);
    const bool paused = late != late_outputs_.end() && late->second >= e.before_first;
    if (e.before.state() != kOp || e.before_requested || paused) return;
    reported.no_pause = FindNoPause(context(), e.slave, e.before_first, e.frame);
  }

  /// Called again when the error bit or the code is read later.
  void Describe(Finding& finding, const Reported& reported) const {
    const model::AlChangedByItself& e = reported.change;
    const device::DeviceDescription& family = *context().slave(e.slave).profile;
    finding.Set("al_status_before", arg::Status(e.before.raw))
        .Set("al_status", arg::Status(e.status.raw))
        .Set("before_frame", arg::Frame(e.before_since));
    if (e.before_requested) {
      finding.Set("before_requested", arg::Flag());
      finding.confidence = Confidence::kInferred;
    }
    if (e.may_be_asked) {
      finding.Set("may_be_asked", arg::Flag());
      finding.confidence = Confidence::kInferred;
    }
    finding.Set("advice", arg::Of(AdviceFor(e)));
    finding.notes.clear();
    if (reported.code) {
      SetCode(finding, e, *reported.code, family);
      AddTo(finding, reported.reasons);
      if (reported.no_pause) {
        finding.Set("outputs_arrive", arg::Flag()).Set("code_advice", arg::Of(*reported.no_pause->advice));
        finding.notes.push_back(reported.no_pause->note);
      }
    } else if (e.status.bit4()) {
      finding.Add(kCodeNotRead);
    } else if (e.error_of_some) {
      finding.Add(kErrorOfSome);
    } else if (!esc::IsAlState(e.status.state())) {
      finding.Add(kUndefinedState, {{"state", arg::Number(e.status.state())}});
    } else {
      finding.Add(kMayBeRestart, {{"to_init", arg::Flag(e.status.state() == kInit)}});
    }
  }

  /// Only slaves in SAFEOP and OP watch their process data: without these they drop to SAFEOP, no further.
  [[nodiscard]] static const Word& AdviceFor(const model::AlChangedByItself& e) {
    const std::uint8_t state = e.status.state();
    if (state == kInit || !esc::IsAlState(state)) return kPower;
    const bool error = e.status.bit4() || e.error_of_some;
    if (!error) return kOtherMaster;
    return state == kSafeop || state == kOp ? kProcessData : kSettings;
  }

  static void SetCode(Finding& finding, const model::AlChangedByItself& e, std::uint16_t code,
                      const device::DeviceDescription& family) {
    finding.Set("al_status_code", CodeValue(code, family));
    SetCodeAdvice(finding, code);
    SetKnownCause(finding, family, e.before, e.status, code);
  }

  static constexpr std::uint64_t kOfAll = std::uint64_t{1} << 40U;
  static constexpr std::uint16_t kErrorBit = 0x10;
  static constexpr auto kInit = static_cast<std::uint8_t>(esc::AlState::INIT);
  static constexpr auto kSafeop = static_cast<std::uint8_t>(esc::AlState::SAFEOP);
  static constexpr auto kOp = static_cast<std::uint8_t>(esc::AlState::OP);

  std::vector<model::AlChangedByItself> pending_;  // shown by one broadcast read: one finding of all, or one of each
  std::vector<FindingIndex> open_;                 // of each slave: whose repetitions and code are awaited
  FindingIndex all_ = kNoFinding;                  // all slaves dropped, and none has left that state
  std::map<FindingIndex, Reported> reported_;
  std::map<SlaveId, model::AlChangedByItself> undecided_;  ///< the capture misses packets, and no code is read yet
  std::map<SlaveId, FrameNo> late_outputs_;                ///< in OP: where their last pause of half a watchdog ends
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlUnexpectedChange>};

}  // namespace
}  // namespace ecaudit::al_unexpected_change
