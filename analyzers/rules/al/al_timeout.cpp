#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "analyzers/judge/esi_notes.h"
#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_text.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/mailbox/events.h"
#include "decoder/track/access.h"

namespace ecaudit::al_timeout {
namespace {

constexpr FindingKind kNotReached{
    .name = "not-reached",
    .title =
        "{requested} not reached within {limit_ms}[{?no_pdi}: its PDI is not operational][{?eeprom_held}: maybe the "
        "EEPROM is not released][{!other_reason}[{?mode}: maybe SYNC0 has to be on][{!mode}, and no error]]",
    .message = R"(The master requested {requested} (AL Control {al_control}) in {request_frame}[, {times} up to
{last_request_frame}]. Since then it read AL Status {polls}. After {waited_ms} ({frame}) AL Status is still
{al_status:number} ({al_status}), without the error bit.[ The limit of {limit_ms} comes from {limit_source}.][ The outputs
select mode {mode}, which works with SYNC0, and SYNC0 is off.])",
    .next =
        "[{?no_pdi}Check EEPROM and processor of the slave: its firmware has to start, and use the PDI that the EEPROM "
        "names.][{?eeprom_held}Write 1 to 0x0500 before PREOP is requested.][{!other_reason}[{?mode}Set up distributed "
        "clocks and activate SYNC0 (0x0981) before SAFEOP is requested. If that does not help: ]Check whether the "
        "slave runs, and whether it waits for power, inputs or synchronisation.]",
    .identity = "requested"};

constexpr FindingKind kGivenUp{
    .name = "given-up",
    .title =
        "[{?allowed_ms}{requested} given up after {waited_ms}: the ESI allows {allowed_ms}][{!allowed_ms}{requested} "
        "not reached in {waited_ms}[{?no_pdi}: its PDI is not operational][{?eeprom_held}: maybe the EEPROM is not "
        "released][{!other_reason}[{?mode}: maybe SYNC0 has to be on][{!mode}, then the master gave up]]]",
    .message = R"(The master requested {requested} (AL Control {al_control}) in {request_frame}[, {times} up to
{last_request_frame}]. It read AL Status {polls}. Up to {frame} these reads show {shown}, without the error bit. In
{next_frame} the master requests a lower state.[ The outputs select mode {mode}, which works with SYNC0, and SYNC0 is
off.])",
    .next =
        "[{?allowed_ms}Let the master wait {allowed_ms} for {requested}.][{!allowed_ms}[{?no_pdi}Check EEPROM and "
        "processor of the slave.][{?eeprom_held}Write 1 to 0x0500 before PREOP is requested.][{!other_reason}[{?mode}"
        "Set up distributed clocks and activate SYNC0 (0x0981) before SAFEOP is requested. If that does not help: ]"
        "Configure a longer wait in the master, or check the slave.]]",
    .identity = "requested"};

constexpr FindingKind kNotReachedOnBus{
    .name = "not-reached-on-bus",
    .title =
        "[{!one}[{?all_asked}Not all of {slaves} reach {requested}][{!all_asked}No slave reaches {requested}]]"
        "[{?one}The slave does not reach {requested}] within {limit_ms}",
    .message =
        R"(The master requested {requested} [{?all_asked}of all slaves, last ]in {request_frame}. It read AL Status of
all slaves by broadcast. From {frame} ({waited_ms} after the request) to {last_read_frame} these reads show
{al_status_of_all}. [{!one}A broadcast read does not show which slave it is.])",
    .next = "Read six bytes from 0x0130 of each slave.",
    .identity = "requested"};

constexpr FindingKind kGivenUpOnBus{
    .name = "given-up-on-bus",
    .title =
        "[{!one}[{?all_asked}Not all of {slaves} reach {requested}][{!all_asked}No slave reaches {requested}]]"
        "[{?one}The slave does not reach {requested}] in {waited_ms}, given up",
    .message =
        R"(The master requested {requested} [{?all_asked}of all slaves, last ]in {request_frame}. It read AL Status of
all slaves by broadcast. Up to {last_read_frame} ({waited_ms} after the request) these reads show {al_status_of_all}.
Then the master requested a lower state. [{!one}A broadcast read does not show which slave it is.])",
    .next = "Read six bytes from 0x0130 of each slave.",
    .identity = "requested"};

constexpr NoteKind kNotDescribed{
    .name = "transition-not-described",
    .text = "The manual lists this transition, but does not describe what the slave does.",
};

constexpr const FindingKind* kKinds[] = {&kNotReached, &kGivenUp, &kNotReachedOnBus, &kGivenUpOnBus};
constexpr NoteKind kHangs{
    .name = "does-not-run",
    .text =
        R"(The slave did not read the request of {mailbox_frame} from its mailbox either, and answered none since: its
application does not run, or hangs.)",
};

constexpr NoteKind kNoPdi{
    .name = "pdi-not-operational",
    .text = R"(Bit 0 of DL Status (0x0110) is 0 in {dl_status_frame}: the slave controller has not loaded its EEPROM, or
its PDI is not operational. Then its processor does not see the request.)",
};
constexpr NoteKind kEepromHeld{
    .name = "eeprom-not-released",
    .text =
        R"(Bit 0 of 0x0500 is 0[ since {owner_frame}]: the master holds the EEPROM. A slave whose processor reads it on
the way to PREOP waits for it, which may be the reason.)",
};
constexpr const NoteKind* kNotes[] = {&kNotDescribed, &kHangs,          &kNoPdi,
                                      &kEepromHeld,   &kEsiDemandUnmet, &kFurtherEsiDemands};

constexpr Word kEni{"eni", "the ENI"};
constexpr Word kEsi{"esi", "the ESI of the slave"};
constexpr Word kReadAfterLimit{"al-status-after-limit", "a read of AL Status after the time limit"};
constexpr Word kWaitForState{"wait-for-state", "the wait for the requested state"};

// It asks what explains the request.
constexpr std::string_view kAfter[] = {"al-invalid-request", "mailbox-no-response"};

constexpr RuleInfo kInfo{.id = "al-timeout",
                         .group = "AL state machine",
                         .severity = Severity::kError,
                         .subject = Subject::kAlRequest,
                         .title = "Neither the requested state nor an error appears in time",
                         .needs = "AL Status reads after the request, and time stamps",
                         .source = "ETG2000, state machine time-outs",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .after = kAfter,
                         .doc = R"(
## What it checks
The time from a request that the slave accepted to the state or the error bit in AL Status. The limits are, in this
order:

- the wait that the ENI (--eni) gives the master
- those of the ESI of the device (--esi)
- PREOP and BOOT 3 s, SAFEOP and OP 10 s, downwards 5 s

## Why it matters
The slave neither follows nor gives a reason. Its firmware may hang, it may wait for synchronisation or power, or its
processor never read the request.

## How it is decided
AL Status is read and still shows the old state after the limit.

- A master that stops reading before the limit gives no finding.
- A master that requests a lower state instead gave up. That is a warning, if it waited 0.2 s and read three times. With
  an ESI (--esi) the finding compares this wait with the time that the ESI allows.
- A request that the slave leaves in its mailbox, without an answer since, shows that its application does not run.
- SYNC0 that is off is named if OP is requested, and the outputs select an interpolated or cyclic synchronous mode.
- If the slave does not reach PREOP and the master holds the EEPROM (0x0500 bit 0 is 0), this is named as possible.
- If DL Status (0x0110) was read and its bit 0 is 0, the finding states that the PDI is not operational.
- With an ESI, the finding lists what the ESI requires before this request and the start-up does not meet.
- A request that the slave has to ignore (see al-error-not-acknowledged) is not waited for.
- A wait goes on over a capture gap of at most 0.5 s if the slave shows the same state after it. The finding is inferred
  then: another request may be in the gap. The same holds for broadcasts, and if the capture misses many packets.
- After a long pause without frames, or if the clock was set, the wait counts from the next read on.
- If the master only reads by broadcast, the OR of all slaves decides. The finding belongs to the bus if all slaves were
  asked for a state and not all show it, or if no slave shows a requested state.

## Example
samples/captures/al-timeout.pcapng

## What to do
Check the slave: display, LEDs, emergencies. The limits can be changed in the configuration file: al-timeout.preop,
al-timeout.safeop-op, al-timeout.down (milliseconds).
)"};

class AlTimeout final : public Rule {
 public:
  AlTimeout() : Rule(kInfo) {
    Subscribe<model::AlOverdue>(&AlTimeout::On);
    Subscribe<model::AlRequestJudged>(&AlTimeout::On);
    Subscribe<model::BusAlOverdue>(&AlTimeout::On);
    Subscribe<model::AlGivenUp>(&AlTimeout::On);
    Subscribe<mailbox::MailboxAnswered>(&AlTimeout::On);
    Subscribe<mailbox::MailboxUnanswered>(&AlTimeout::On);
    Subscribe<model::AlAnswered>(&AlTimeout::On);
    Subscribe<track::SlaveAccess>(&AlTimeout::On, MemoryRange::Of(esc::kDlStatus, 1));
  }

  void On(const model::AlOverdue& e) {
    if (Repeat(e.slave, RequestKey(e.request), e.frame) != kNoFinding) return;
    Finding finding = Found(kNotReached, e.slave, e.frame);
    SetRequest(finding, e.request);
    finding.Set("al_status", arg::Status(e.status.raw))
        .Set("waited_ms", arg::Ms(e.waited_ns))
        .Set("limit_ms", arg::Ms(e.limit_ns))
        .Set("polls", arg::Count(e.polls, "time"));
    if (e.request.over_gap) finding.confidence = Confidence::kInferred;
    if (const Word* source = LimitSource(e)) finding.Set("limit_source", arg::Of(*source));
    finding.caused_by = context().ExplanationOf(e.slave, e.request.frame.number);
    AddRelated(finding, e.request.frame.number);
    if (e.request.transition != nullptr && !e.request.transition->performed) finding.Add(kNotDescribed);
    AddPdi(finding, e.slave);
    AddEeprom(finding, e.request);
    Remember(Report(RequestKey(e.request), std::move(finding)), e.slave, e.request);
  }
  void On(const model::AlGivenUp& e) {
    const std::uint64_t key = kOfGivenUp | RequestKey(e.request);
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    Finding finding = Found(kGivenUp, e.slave, e.frame);
    SetRequest(finding, e.request);
    finding.Set("waited_ms", arg::Ms(e.waited_ns))
        .Set("polls", arg::Count(e.polls, "time"))
        .Set("shown", arg::State(e.shown))
        .Set("next_frame", arg::Frame(e.next.number));
    if (e.request.over_gap) finding.confidence = Confidence::kInferred;
    finding.caused_by = context().ExplanationOf(e.slave, e.request.frame.number);
    AddRelated(finding, e.request.frame.number);
    AddRelated(finding, e.next.number);
    if (const auto allowed = AllowedByEsi(e.slave, e.request); allowed && *allowed > e.waited_ns) {
      finding.Set("allowed_ms", arg::Ms(*allowed));
    }
    AddPdi(finding, e.slave);
    AddEeprom(finding, e.request);
    Remember(Report(key, Severity::kWarning, std::move(finding)), e.slave, e.request);
  }

  /// Broadcast reads do not show which of the slaves it is.
  void On(const model::BusAlOverdue& e) {
    const std::uint64_t key = kOfAll | (e.given_up ? kOfGivenUp : 0) | e.control.raw;
    if (Repeat(kNoSlave, key, e.frame) != kNoFinding) return;
    Finding finding = Found(e.given_up ? kGivenUpOnBus : kNotReachedOnBus, kNoSlave, e.frame);
    AddRelated(finding, e.request.number);
    if (e.over_gap || MissesPackets(context().pairing())) finding.confidence = Confidence::kInferred;
    finding.Set("requested", arg::State(e.control.state()))
        .Set("al_status_of_all", arg::StatusOfAll(e.status.raw))
        .Set("waited_ms", arg::Ms(e.waited_ns))
        .Set("limit_ms", arg::Ms(e.limit_ns))
        .Set("slaves", arg::Count(e.slaves, "slave"))
        .Set("one", arg::Flag(e.slaves == 1))
        .Set("all_asked", arg::Flag(e.all_asked))
        .Set("request_frame", arg::Frame(e.request.number))
        .Set("last_read_frame", arg::Frame(e.last.number));
    Report(key, e.given_up ? Severity::kWarning : Severity::kError, std::move(finding));
  }
  void On(const model::AlRequestJudged& e) {
    if (!e.request.frame.has_time) {
      NotEvaluable(e.slave, ReasonCode::kNoStamps, e.request.frame.number);
    }
  }
  void On(const mailbox::MailboxAnswered& e) {
    mail_[e.slave].answered = std::max(mail_[e.slave].answered, e.answer.number);
  }
  void On(const mailbox::MailboxUnanswered& e) {
    Mail& mail = mail_[e.slave];
    if (e.not_accepted && mail.unread == 0) mail.unread = e.request.frame.number;
  }
  /// A slave that changes its state has a PDI that works.
  void On(const model::AlAnswered& e) {
    if (e.request.from != e.request.control.state()) not_operational_.erase(e.slave);
  }
  void On(const track::SlaveAccess& e) {
    if (!e.done() || e.broadcast) return;
    const ByteSpan dl_status = e.Covered(e.read, esc::kDlStatus, 1);
    if (dl_status.empty()) return;
    if ((dl_status[0] & 1U) != 0) {
      not_operational_.erase(e.slave);
    } else {
      not_operational_[e.slave] = e.returned.number;
    }
  }
  void Finish() override {
    NotEvaluableWhereRequestsAreNotFollowed();
    for (const auto& [index, request] : reported_) {
      (void)AddEsiDemands(context(), request, context().store[index]);
      NameHang(index, request);
    }
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      const model::AlMachine& al = context().slave(id).al;
      const model::AlRequestRecord* open = al.waits_for();
      if (open == nullptr || !open->frame.has_time) continue;
      NotEvaluable(id, ReasonCode::kNotInCapture, kReadAfterLimit, open->frame.number);
    }
    if (const FrameRef& since = context().bus().al_wait().unfinished(); since.seen()) {
      NotEvaluable(kNoSlave, ReasonCode::kCaptureEnds, kWaitForState, since.number);
    }
  }

 private:
  static constexpr std::uint64_t kOfAll = std::uint64_t{1} << 63U;
  static constexpr std::uint64_t kOfGivenUp = std::uint64_t{1} << 62U;

  void AddPdi(Finding& finding, SlaveId slave) const {
    const auto shown = not_operational_.find(slave);
    const auto mail = mail_.find(slave);
    if (shown == not_operational_.end()) return;
    if (mail != mail_.end() && mail->second.answered > shown->second) return;
    finding.Set("no_pdi", arg::Flag()).Set("other_reason", arg::Flag());
    finding.Add(kNoPdi, {{"dl_status_frame", arg::Frame(shown->second)}});
    AddRelated(finding, shown->second);
  }

  void AddEeprom(Finding& finding, const model::AlRequestRecord& request) const {
    const track::SlaveState& state = context().network().state(finding.slave);
    const auto owned_by_pdi = state.sii.owned_by_pdi();
    const bool preop = request.control.state() == static_cast<std::uint8_t>(esc::AlState::PREOP);
    if (!preop || !owned_by_pdi || *owned_by_pdi || finding.arguments.Has("no_pdi")) return;
    Arguments arguments;
    if (const FrameNo since = context().slave(finding.slave).set_up.eeprom_owner_since(); since != 0) {
      arguments.Set("owner_frame", arg::Frame(since));
    }
    finding.Set("eeprom_held", arg::Flag()).Set("other_reason", arg::Flag()).Add(kEepromHeld, std::move(arguments));
  }

  /// A slave whose mailbox stays full as well: its application serves neither.
  void NameHang(FindingIndex index, const UnfollowedRequest& request) {
    const auto mail = mail_.find(request.slave);
    if (mail == mail_.end() || mail->second.unread == 0) return;
    Finding& finding = context().store[index];
    const FrameNo unread = mail->second.unread;
    if (unread > finding.first.number || mail->second.answered > unread) return;
    finding.Add(kHangs, {{"mailbox_frame", arg::Frame(unread)}});
    AddRelated(finding, unread);
    if (finding.caused_by != kNoFinding) return;
    for (FindingIndex i = 0; i < context().store.findings().size(); ++i) {
      const Finding& other = context().store[i];
      if (other.rule != "mailbox-no-response" || other.slave != request.slave || other.first.number != unread) continue;
      finding.caused_by = i;
      return;
    }
  }

  void SetRequest(Finding& finding, const model::AlRequestRecord& request) const {
    const bool op = request.control.state() == static_cast<std::uint8_t>(esc::AlState::OP);
    if (const auto mode = ModeWithoutSync0(context(), finding.slave); op && mode) {
      finding.Set("mode", arg::Number(*mode));
    }
    finding.Set("requested", arg::State(request.control.state()))
        .Set("al_control", arg::Hex(request.control.raw))
        .Set("request_frame", arg::Frame(request.frame.number));
    SetRepetition(finding, request);
  }

  void Remember(FindingIndex finding, SlaveId slave, const model::AlRequestRecord& request) {
    if (finding == kNoFinding) return;
    reported_.emplace(finding, UnfollowedRequest{.slave = slave,
                                                 .first = request.frame.number,
                                                 .last = request.last.number,
                                                 .requested = request.control.state()});
  }

  /// The time that the ESI of the slave gives it for the state.
  [[nodiscard]] std::optional<TimeNs> AllowedByEsi(SlaveId slave, const model::AlRequestRecord& request) const {
    const device::DeviceDescription& device = *context().slave(slave).profile;
    if (!device.esi) return std::nullopt;
    switch (static_cast<esc::AlState>(request.control.state())) {
      case esc::AlState::PREOP:
        return device.esi->timeouts.preop;
      case esc::AlState::SAFEOP:
      case esc::AlState::OP:
        return device.esi->timeouts.safeop_op;
      case esc::AlState::INIT:
      case esc::AlState::BOOT:
        break;
    }
    return std::nullopt;
  }

  /// Null for the limits of the rule.
  [[nodiscard]] const Word* LimitSource(const model::AlOverdue& e) const {
    const model::SlaveModel& slave = context().slave(e.slave);
    const auto gives = [&e](const device::StateTimeouts& timeouts) {
      return timeouts.preop == e.limit_ns || timeouts.safeop_op == e.limit_ns || timeouts.back_to_init == e.limit_ns;
    };
    if (slave.eni != nullptr && gives(slave.eni->Waits())) return &kEni;
    return slave.profile->esi && gives(slave.profile->esi->timeouts) ? &kEsi : nullptr;
  }

  struct Mail {
    FrameNo unread = 0;    ///< the first request that stays in the mailbox of the slave
    FrameNo answered = 0;  ///< the last answer
  };
  std::map<SlaveId, Mail> mail_;
  std::map<SlaveId, FrameNo> not_operational_;  ///< slaves whose last DL status has bit 0 = 0, with its frame
  std::map<FindingIndex, UnfollowedRequest> reported_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlTimeout>};

}  // namespace
}  // namespace ecaudit::al_timeout
