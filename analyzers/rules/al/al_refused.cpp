#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "analyzers/judge/esi_notes.h"
#include "analyzers/judge/init_command_watch.h"
#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/refusal_reasons.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_code_advice.h"
#include "analyzers/words/al_text.h"
#include "analyzers/words/what.h"

namespace ecaudit::al_refused {
namespace {

constexpr FindingKind kRefused{
    .name = "refused",
    .title =
        R"([{?reason}{requested} refused with {al_status_code:number}: [{?reason_inferred}maybe
]{reason}[ in slot {slot}][ ({reason_value})]][{!reason}{requested} refused[ in {state_before}][ with AL status code
{al_status_code}]])",
    .message = R"(The master requested {requested} (AL Control {al_control}) in {request_frame}[, {times} up to
{last_request_frame}]. From {frame} on AL Status is {al_status:number} ({al_status}).[ The AL status code (0x0134) is
{al_status_code}.][{!al_status_code} The master did not read the AL status code (0x0134), so the reason of the slave
is not in the capture.][ Later AL status codes: {later_codes}.][ This transition requires: {requirement}.])",
    .next =
        R"([{?no_boot}Do not request {requested}: the slave does not have this state. Acknowledge the error (bit 4 of
AL Control).][{!no_boot}[{?reason}[{?reason_inferred}Check][{!reason_inferred}Correct]
this.][{!reason}[{code_advice}.][{!code_advice}[{?checked}Check what else the AL status code names, and the firmware
of the slave.][{!checked}[{?al_status_code}Check the settings that the AL status code names.][{!al_status_code}Read
the AL status code (0x0134).]]]][{!restarts} Then acknowledge the error (bit 4 of AL Control) and [{?first}request {first} first:
from {state_now} the slave does not go to {requested}][{!first}request {requested} again].]])",
    .identity = "requested state_before al_status_code"};

constexpr FindingKind kNotAcknowledged{
    .name = "error-stays",
    .title = "Error in {requested} stays after its acknowledge[: AL status code {al_status_code}]",
    .message =
        R"(The master acknowledged the error in {requested} (AL Control {al_control}) in {request_frame}[, {times} up
to {last_request_frame}]. AL Status in {frame} is still {al_status:number} ({al_status}).[ The AL status code (0x0134)
is {al_status_code}.][{!al_status_code} The master did not read the AL status code (0x0134), so the reason of the
slave is not in the capture.][ Later AL status codes: {later_codes}.])",
    .next =
        R"([{?reason}[{?reason_inferred}Check][{!reason_inferred}Correct] this.][{!reason}[{code_advice}.][{!code_advice}[{?checked}Check what else the AL status code names, and the firmware of the
slave.][{!checked}[{?al_status_code}Check the settings that the AL status code names.][{!al_status_code}Read the AL
status code (0x0134).]]]] Then acknowledge the error again.)",
    .identity = "requested al_status_code"};

constexpr FindingKind kRefusedOnBus{
    .name = "refused-on-bus",
    .title = "{requested} refused by [{?one}the slave][{!one}one or more of {slaves}] (error bit in a broadcast)",
    .message =
        R"(The master requested {requested} in {request_frame}. [{?once}In {frame} a broadcast read of AL Status
shows][{!once}From {frame} to {last_frame} broadcast reads of AL Status show] {al_status_of_all}. No error bit was set before the request. A broadcast read does not show which slave
refused, nor its AL status code.)",
    .next = "Read six bytes from 0x0130 of each slave.",
    .identity = "requested"};

constexpr NoteKind kInitCommandsMissing{
    .name = "init-commands-missing",
    .text =
        "The ESI requires these writes before this transition, but the capture does not show them: {commands}[ and "
        "{more}]."};
constexpr NoteKind kNoEdge{
    .name = "no-acknowledge-edge",
    .text =
        "Bit 4 of AL Control was already 1 before the acknowledge ({al_control_before}, then {al_control}). The slave "
        "acknowledges at the positive edge of bit 4 ({source}): write 0 to it first."};
constexpr NoteKind kOtherResult{
    .name = "other-result",
    .text = R"(The manual ({source}) gives the result "{result}" for {al_status_code}. AL Status shows {state_now}; the
state before was {state_before}.)"};
constexpr NoteKind kMayBeOlder{
    .name = "error-may-be-older",
    .text =
        "The error may be older: the capture does not show AL Status between [the capture gap before {gap_frame}]"
        "[{!gap_frame}the start of the capture] and the request."};

constexpr const FindingKind* kKinds[] = {&kRefused, &kNotAcknowledged, &kRefusedOnBus};
constexpr const NoteKind* kOwnNotes[] = {&kInitCommandsMissing, &kEsiDemandUnmet, &kFurtherEsiDemands, &kNoEdge,
                                         &kOtherResult,         &kMayBeOlder};

constexpr Word kWhyEsi{"esi-demand", "an ESI requirement is not met"};
constexpr auto kNotes = refusal::With(kOwnNotes);

// It asks what explains the request.
constexpr std::string_view kAfter[] = {"al-invalid-request"};

constexpr RuleInfo kInfo{
    .id = "al-refused",
    .group = "AL state machine",
    .severity = Severity::kError,
    .history = History::kNone,
    .subject = Subject::kAlRequest,
    .title = "The slave answers a state request with the error bit",
    .needs = "AL Status after the request; the state before it, to separate the error from an older one",
    .source = "ETG1000.6, AL Status register 0x0130 and AL Status Code register 0x0134",
    .kinds = kKinds,
    .notes = kNotes,
    .after = kAfter,
    .doc = R"(
## What it checks
Whether the slave answers a state request with the error bit (bit 4 of AL Status 0x0130), and with which AL status code
(0x0134). Further reads of the same error count as repetitions.

## Why it matters
This is the moment at which a start-up stops: the drive did not follow its master, and the code is its reason.

## How it is decided
The finding needs an error bit that appears after a request that the slave accepted, and that was not set before.

- After an acknowledge the error must show another code, or stay for 200 ms.
- Slaves without a processor echo the acknowledge bit. That is no error.
- If AL Status was not read before the request, the error may be older: the finding is inferred.
- A request stays open over a capture gap of at most 0.5 s. The finding is inferred then: the slave may answer a request
  in the gap.
- If the first request acknowledges, the error has to stay after the next request, which does not acknowledge.
- If the model knows why the slave had to refuse (an illegal transition, a wrong sync manager), caused_by names that
  finding.
- For many AL status codes the finding lists what the capture shows of the registers, objects and counters that can be
  the reason: what is wrong, and what was checked and is right. The settings at the refusal count.
- A possible reason ("maybe" in the title) makes the finding inferred: another cycle of the process data, SYNC0 left on,
  another synchronisation type, a sync manager that was written while it was enabled.
- With an ESI (--esi), the finding lists what the ESI requires before this request and the capture does not show, or
  shows with another value: init commands, module list, sync managers, watchdogs, AssignActivate. The capture must show
  how the slave reached PREOP.
- The finding belongs to the bus if only broadcast reads show the error bit after a request without the acknowledge bit:
  three times, or once if the master then requests another state or the capture ends. It is not reported if all slaves
  had followed before, or if a slave that was read by itself shows an error.

## Example
samples/captures/init-to-op-refused.pcapng: OP refused with 0x0011.

## What to do
Correct the cause if the finding names one. Otherwise use the AL status code:

- 0x0017, 0x001D, 0x001E: sync manager settings against the assigned PDOs
- 0x001B: missing outputs
- 0x0030 to 0x0037: distributed clocks
- 0x0020 to 0x0023: a cold start, or another state first
- 0x0002 to 0x0014, 0x0051, 0x0052, 0x0080 to 0x0083: the slave itself, its firmware, supply or temperature
)"};

class AlRefused final : public Rule {
 public:
  AlRefused() : Rule(kInfo) {
    Subscribe<model::AlAnswered>(&AlRefused::On);
    Subscribe<model::AlAnswerUnclear>(&AlRefused::On);
    Subscribe<model::AlErrorRepeated>(&AlRefused::On);
    Subscribe<model::AlErrorCode>(&AlRefused::On);
    Subscribe<model::AlErrorCleared>(&AlRefused::On);
    Subscribe<model::AlChangedByItself>(&AlRefused::On);
    Subscribe<mailbox::SdoTransfer>(&AlRefused::On);
    Subscribe<model::BusAlRefused>(&AlRefused::On);
  }

  /// Broadcast reads show neither which slave it was nor its code.
  void On(const model::BusAlRefused& e) {
    if (MissesPackets(context().pairing())) {
      NotEvaluable(kNoSlave, ReasonCode::kMissesPackets, e.frame.number);
      return;
    }
    const std::uint64_t key = kOfAll | e.control.raw;
    if (const FindingIndex repeated = Repeat(kNoSlave, key, e.frame); repeated != kNoFinding) {
      AddRelated(context().store[repeated], e.request.number);
      return;
    }
    Finding finding = Found(kRefusedOnBus, kNoSlave, e.frame);
    finding.last = e.last;
    finding.count = e.reads;
    if (e.reads == 1) finding.Set("once", arg::Flag());
    AddRelated(finding, e.request.number);
    finding.Set("requested", arg::State(e.control.state()))
        .Set("slaves", arg::Count(e.slaves, "slave"))
        .Set("one", arg::Flag(e.slaves == 1))
        .Set("al_status_of_all", arg::StatusOfAll(e.status.raw))
        .Set("request_frame", arg::Frame(e.request.number));
    (void)Report(key, std::move(finding));
  }

  void On(const model::AlAnswered& e) {
    init_commands_.On(e);
    if (e.slave >= open_.size()) open_.resize(static_cast<std::size_t>(e.slave) + 1, kNoFinding);
    open_[e.slave] = kNoFinding;
    if (e.outcome != model::AlAnswered::Outcome::kRefused) return;
    // The same refusal for another reason is another finding.
    const FindingIndex cause = context().ExplanationOf(e.slave, e.request.frame.number);
    const std::uint64_t key = RequestKey(e.request) | static_cast<std::uint64_t>(e.status.raw) << 16U |
                              static_cast<std::uint64_t>(cause) << 32U;
    FindingIndex index = Repeat(e.slave, key, e.frame);
    if (index == kNoFinding) {
      Finding finding = Found(IsAcknowledge(e) ? kNotAcknowledged : kRefused, e.slave, e.frame);
      const bool observed = e.state_before_known && !e.request.over_gap;
      finding.confidence = observed ? Confidence::kObserved : Confidence::kInferred;
      finding.caused_by = cause;
      AddRelated(finding, e.request.frame.number);
      index = Report(key, std::move(finding));
      if (index == kNoFinding) return;
      if (reported_.emplace(index, Reported{e, {}}).second) Describe(context().store[index], reported_[index]);
    } else {
      AddRelated(context().store[index], e.request.frame.number);
    }
    open_[e.slave] = index;
    if (e.code) AddCode(index, e.frame, *e.code);
  }

  void On(const model::AlAnswerUnclear& e) {
    NotEvaluable(e.slave, ReasonCode::kNotRead, what::kAlStateBefore, e.frame.number);
  }
  void On(const model::AlErrorRepeated& e) {
    const FindingIndex index = OpenOf(e.slave);
    if (index == kNoFinding) return;
    ++context().store[index].count;
    context().store[index].last = e.frame;
  }
  void On(const model::AlErrorCode& e) {
    if (const FindingIndex index = OpenOf(e.slave); index != kNoFinding) AddCode(index, e.frame, e.code);
  }
  void On(const mailbox::SdoTransfer& transfer) { init_commands_.On(transfer); }
  void On(const model::AlErrorCleared& e) { Close(e.slave); }
  void On(const model::AlChangedByItself& e) { Close(e.slave); }

  void Finish() override {
    NotEvaluableWhereRequestsAreNotFollowed();
    for (const auto& [index, reported] : reported_) AddWhatTheEsiRequires(context().store[index], reported);
  }

 private:
  /// What a finding rests on: its first occasion, and the codes read since.
  struct Reported {
    model::AlAnswered answer;
    std::vector<std::uint16_t> codes;
  };
  static constexpr std::size_t kMaxCodes = 4;
  static constexpr std::uint64_t kOfAll = std::uint64_t{1} << 63U;

  [[nodiscard]] FindingIndex OpenOf(SlaveId slave) const { return slave < open_.size() ? open_[slave] : kNoFinding; }
  void Close(SlaveId slave) {
    if (slave < open_.size()) open_[slave] = kNoFinding;
  }

  /// It requests only the end of the error.
  [[nodiscard]] static bool IsAcknowledge(const model::AlAnswered& e) {
    const std::uint8_t from = e.request.from != 0 ? e.request.from : e.status.state();
    return from == e.request.control.state() && e.request.control.bit4();
  }

  void AddCode(FindingIndex index, const FrameRef& frame, std::uint16_t code) {
    Reported& reported = reported_[index];
    if (std::find(reported.codes.begin(), reported.codes.end(), code) != reported.codes.end()) return;
    if (reported.codes.size() == kMaxCodes) return;
    reported.codes.push_back(code);
    Finding& finding = context().store[index];
    SetCodes(finding, reported);
    AddRelated(finding, frame.number == finding.first.number ? 0 : frame.number);
    if (reported.codes.size() > 1) return;  // what was checked belongs to the first code
    const model::AlRequestRecord& request = reported.answer.request;
    PreferPredicted(finding, request, code);
    AddTo(finding, FindRefusalReasons(context(), {.slave = finding.slave,
                                                  .code = code,
                                                  .requested = request.control.state(),
                                                  .request = request.last.number,
                                                  .shown = reported.answer.frame.number}));
  }

  /// Of several findings that explain the refusal, the one that predicts this code is its cause.
  void PreferPredicted(Finding& finding, const model::AlRequestRecord& request, std::uint16_t code) {
    const auto predicts = [&](FindingIndex index) {
      const Value* expected = context().store[index].arguments.Find("expected_code");
      return expected != nullptr && expected->number == code;
    };
    if (finding.caused_by == kNoFinding || predicts(finding.caused_by)) return;
    for (const FindingIndex other : context().ExplanationsOf(finding.slave, request.frame.number)) {
      if (!predicts(other)) continue;
      finding.caused_by = other;
      return;
    }
  }

  void Describe(Finding& finding, const Reported& reported) const {
    const model::AlAnswered& e = reported.answer;
    const device::DeviceDescription& family = *context().slave(e.slave).profile;
    finding.Set("requested", arg::State(e.request.control.state()));
    if (e.request.from != 0) finding.Set("state_before", arg::State(e.request.from));
    finding.Set("al_status", arg::Status(e.status.raw));
    SetCodes(finding, reported);
    if (e.request.frame.has_time && e.frame.has_time) {
      finding.Set("answered_after_ms", arg::Ms(e.frame.time - e.request.frame.time));
    }
    finding.Set("al_control", arg::Hex(e.request.control.raw)).Set("request_frame", arg::Frame(e.request.frame.number));
    SetRepetition(finding, e.request);
    const device::AlTransition* row = e.request.transition;
    if (finding.kind == &kRefused && row != nullptr && e.request.verdict == model::AlVerdict::kLegal &&
        !row->requirement.empty()) {
      finding.Set("requirement", arg::Text(row->requirement));
      finding.reference = ReferenceTo(row->source);
    }
    InitCommandWatch::Missing missing = init_commands_.MissingBefore(e.slave, family, e.request);
    if (!missing.commands.empty()) {
      Arguments arguments{{"commands", arg::List(std::move(missing.commands))}};
      if (missing.more > 0) arguments.Set("more", arg::Count(missing.more, "other"));
      finding.Add(kInitCommandsMissing, std::move(arguments));
    }
    if (!e.state_before_known) {
      const FrameNo gap = context().network().last_gap();
      finding.Add(kMayBeOlder,
                  gap != 0 && gap <= e.request.frame.number ? Arguments{{"gap_frame", arg::Frame(gap)}} : Arguments{});
    }
    DescribeWay(finding, e, family);
  }

  void AddWhatTheEsiRequires(Finding& finding, const Reported& reported) const {
    if (finding.kind != &kRefused) return;
    const model::AlRequestRecord& request = reported.answer.request;
    const bool explains = AddEsiDemands(context(),
                                        {.slave = reported.answer.slave,
                                         .first = request.frame.number,
                                         .last = request.last.number,
                                         .requested = request.control.state(),
                                         .commands_named = finding.Has(kInitCommandsMissing)},
                                        finding);
    const bool about_request = !reported.codes.empty() && IsAboutTheRequest(reported.codes.front());
    if (!explains || about_request || finding.caused_by != kNoFinding || finding.arguments.Has("reason")) return;
    finding.Set("reason", arg::Of(kWhyEsi)).Set("reason_inferred", arg::Flag());
    finding.confidence = Confidence::kInferred;
  }
  /// The state itself is what the slave refuses.
  [[nodiscard]] static bool IsAboutTheRequest(std::uint16_t code) {
    return code == esc::al_code::kInvalidChange || code == esc::al_code::kUnknownState ||
           code == esc::al_code::kBootNotSupported;
  }

  /// How the master gets to the requested state from where the slave is now, and acknowledges.
  static void DescribeWay(Finding& finding, const model::AlAnswered& e, const device::DeviceDescription& family) {
    const std::uint8_t now = e.status.state();
    const std::uint8_t requested = e.request.control.state();
    if (finding.kind == &kRefused && esc::IsAlState(now) && esc::IsAlState(requested) &&
        !family.AllowsAl(static_cast<esc::AlState>(now), static_cast<esc::AlState>(requested))) {
      if (const auto first =
              FirstOnTheWay(family, static_cast<esc::AlState>(now), static_cast<esc::AlState>(requested))) {
        finding.Set("first", arg::State(static_cast<std::uint8_t>(*first))).Set("state_now", arg::State(now));
      }
    }
    const device::RegisterBits* edge = AcknowledgeEdge(family);
    // Of another request the error is new: nothing was left to acknowledge.
    const bool stays_set = e.request.before && e.request.before->bit4() && e.request.control.bit4();
    if (finding.kind != &kNotAcknowledged || edge == nullptr || !stays_set) return;
    finding.Add(kNoEdge, {{"al_control_before", arg::Hex(e.request.before->raw)},
                          {"al_control", arg::Hex(e.request.control.raw)},
                          {"source", arg::Text(edge->source)}});
  }

  /// The first state on the shortest way that the family allows; nothing: there is none.
  static std::optional<esc::AlState> FirstOnTheWay(const device::DeviceDescription& family, esc::AlState from,
                                                   esc::AlState to) {
    constexpr std::array kStates{esc::AlState::INIT, esc::AlState::PREOP, esc::AlState::SAFEOP, esc::AlState::OP,
                                 esc::AlState::BOOT};
    std::vector<std::pair<esc::AlState, esc::AlState>> reached{{from, from}};  // a state, and the first on its way
    for (std::size_t i = 0; i < reached.size(); ++i) {
      const auto [state, first] = reached[i];
      if (state == to) return first;
      for (const esc::AlState next : kStates) {
        const bool known =
            std::any_of(reached.begin(), reached.end(), [&](const auto& row) { return row.first == next; });
        if (!known && family.AllowsAl(state, next)) reached.emplace_back(next, i == 0 ? next : first);
      }
    }
    return std::nullopt;
  }

  /// The row of the manual that binds the acknowledge to the edge of bit 4 of AL Control; null if there is none.
  static const device::RegisterBits* AcknowledgeEdge(const device::DeviceDescription& family) {
    constexpr EscAddress kAlControl = 0x0120;
    constexpr std::uint8_t kAcknowledge = 4;
    for (const device::RegisterBits& row : family.register_bits) {
      if (row.address == kAlControl && row.Covers(kAcknowledge) && row.rising.value_or(false)) return &row;
    }
    return nullptr;
  }

  /// The manual states in which state a code leaves the slave.
  static void DescribeResult(Finding& finding, const Reported& reported, const device::AlStatusCode& entry,
                             const device::DeviceDescription& family) {
    const model::AlAnswered& e = reported.answer;
    const std::uint8_t before = e.request.from;
    const std::uint8_t expected = entry.resulting_state ? static_cast<std::uint8_t>(*entry.resulting_state) : before;
    if (finding.kind != &kRefused || entry.result.empty() || before == 0 || !e.state_before_known) return;
    if (expected == e.status.state()) return;
    finding.Add(kOtherResult, {{"state_now", arg::State(e.status.state())},
                               {"source", arg::Text(entry.source)},
                               {"al_status_code", CodeValue(entry.code, family)},
                               {"result", arg::Text(entry.result)},
                               {"state_before", arg::State(before)}});
  }

  void SetCodes(Finding& finding, const Reported& reported) const {
    if (reported.codes.empty()) return;
    const device::DeviceDescription& family = *context().slave(finding.slave).profile;
    finding.Set("al_status_code", CodeValue(reported.codes.front(), family));
    std::vector<Value> later;
    for (std::size_t i = 1; i < reported.codes.size(); ++i) later.push_back(CodeValue(reported.codes[i], family));
    if (!later.empty()) finding.Set("later_codes", arg::List(std::move(later)));
    const device::AlStatusCode* entry = family.al_status_code(reported.codes.front());
    if (!finding.arguments.Has("requirement") && entry != nullptr && !entry->source.empty()) {
      finding.reference = ReferenceTo(entry->source);
    }
    if (entry != nullptr && reported.codes.size() == 1) DescribeResult(finding, reported, *entry, family);
    const bool no_boot = std::find(reported.codes.begin(), reported.codes.end(), esc::al_code::kBootNotSupported) !=
                         reported.codes.end();
    if (no_boot) finding.Set("no_boot", arg::Flag());
    SetCodeAdvice(finding, reported.codes.front());
    if (DemandsRestart(reported.codes.front())) finding.Set("restarts", arg::Flag());
    const std::uint8_t demanded = DemandedState(reported.codes.front());
    if (demanded != 0 && finding.kind == &kRefused && demanded != reported.answer.request.control.state()) {
      finding.Set("first", arg::State(demanded)).Set("state_now", arg::State(reported.answer.status.state()));
    }
  }

  std::vector<FindingIndex> open_;  // of each slave: whose repetitions and code are awaited
  std::map<FindingIndex, Reported> reported_;
  InitCommandWatch init_commands_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlRefused>};

}  // namespace
}  // namespace ecaudit::al_refused
