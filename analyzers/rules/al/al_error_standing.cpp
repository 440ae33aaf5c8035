#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/judge/pause_reason.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/bus_model.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_code_advice.h"
#include "analyzers/words/al_text.h"
#include "analyzers/words/what.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::al_error_standing {
namespace {

// Of one slave.
constexpr std::string_view kMessage =
    R"(AL Status is {al_status:number} ({al_status}) [from {frame} to {last_read_frame}
({reads})][{!last_read_frame}in {frame}, the only read].[ {no_error_frame} is the last that shows the slave without
error. The error began after it, while the capture does not show the slave.][{!no_error_frame} The error began before
the capture shows the slave.][ The AL status code (0x0134) is {al_status_code}.][{?no_code} The AL status code (0x0134)
is 0: the slave gives no reason.][{!al_status_code}{!no_code} The master did not read the AL status code (0x0134), so
the reason of the slave is not in the capture.][ If the slave set the error by itself, the cause by [{?manual}the
manual ({manual})][{!manual}the EtherCAT standard] is: {known_cause}.])";
constexpr std::string_view kNext =
    R"([{code_advice}.][{!code_advice}[{?al_status_code}Correct what the AL status code names.]][{!al_status_code}{!no_code}Read the AL status
code (0x0134).] Acknowledge the error (bit 4 of AL Control), then request the states in order.[{?reason} Find
out why the master paused.][{!no_error_frame}{!reason} To see how the error began, capture from the start of the master
on.])";

constexpr FindingKind kActiveWhenFirstSeen{.name = "active-when-first-seen",
                                           .title =
                                               "{al_status}[{!reason} active] when first seen[{?reason} "
                                               "({al_status_code:number}): maybe {reason}[ ({reason_value})]]"
                                               "[{!reason}[, AL status code {al_status_code}]]",
                                           .message = kMessage,
                                           .next = kNext,
                                           .identity = "al_status al_status_code"};

constexpr FindingKind kActiveWhenSeenAgain{
    .name = "active-when-seen-again",
    .title = "{al_status} active when seen again[, AL status code {al_status_code}]",
    .message = kMessage,
    .next = kNext,
    .identity = "al_status al_status_code",
    .next_stays = true};

constexpr FindingKind kActiveOnBus{
    .name = "active-on-bus",
    .title = "Error bit of [{?one}the slave][{!one}at least one of {slaves}] already set when first seen",
    .message = R"(Broadcast reads of AL Status show {al_status:number} ({al_status})[ from the first read in {frame} to
{last_read_frame} ({reads})][{!last_read_frame} in {frame}, the only read]. Their working counter is {slaves:number}. A broadcast read does not show which slave has the error bit set.)",
    .next =
        R"(Read six bytes from 0x0130 of each slave. Correct what the AL status code names, then acknowledge the error
(bit 4 of AL Control).)"};

constexpr NoteKind kMayBeEcho{.name = "may-be-echo",
                              .text =
                                  "The capture does not show whether a processor set the bit. Slaves without a "
                                  "processor only echo an acknowledge."};
constexpr NoteKind kNotAcknowledged{.name = "not-acknowledged",
                                    .text = "The master went on without acknowledging the error."};

constexpr const FindingKind* kKinds[] = {&kActiveWhenFirstSeen, &kActiveWhenSeenAgain, &kActiveOnBus};
constexpr const NoteKind* kNotes[] = {&kMayBeEcho, &kNotAcknowledged, &kAllPaused};

constexpr Word kErrorBit{"error-bit", "the error bit in AL Status"};
constexpr Word kAfterAcknowledge{"al-status-after-acknowledge", "AL Status after the acknowledge"};

// ExplainRequest(): the later rule names the nearer cause.
constexpr std::string_view kAfter[] = {"al-error-not-acknowledged"};

constexpr RuleInfo kInfo{.id = "al-error-standing",
                         .group = "AL state machine",
                         .severity = Severity::kError,
                         .history = History::kNone,
                         .title = "The error bit is already set when the slave is first seen, and stays",
                         .needs = "AL Status of the slave, or of all slaves by a broadcast read",
                         .source = "ETG1000.6, AL Status register 0x0130 and AL Status Code register 0x0134",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Whether the error bit (bit 4 of AL Status 0x0130) is set from the first read of a slave on and stays, and which AL
status code (0x0134) the slave gives. One finding for each slave. Further reads of the same error count as repetitions.

## Why it matters
The error began before the capture: the slave refused a state, or left one. While its error is active, it follows no
request, and the machine does not run.

## How it is decided
The capture never shows the slave without error before, or not since it was out of sight (it had left the bus, or there
is a capture gap). An error whose beginning the capture shows belongs to al-refused or al-unexpected-change. The error
*stays* if one of these holds:

- The capture ends with it, and the master did not acknowledge it.
- The slave still shows it after the master requested another state without acknowledging, used its mailbox, or
  exchanged its process data.
- The slave is in SAFEOP with it, and the master does not start over with INIT. Either process data were exchanged on
  the bus before the first read of the slave, or the master requests OP directly after the acknowledge.
- The slave is in PREOP with it and gives a code, and the master requests SAFEOP or OP directly after the acknowledge,
  without INIT.

Many masters find an error when they scan the bus. They acknowledge it (bit 4 of AL Control, or a request of INIT)
before any of these, and the error ends. That is a normal start-up and no finding. There is no finding either if the
capture ends before the answer to the acknowledge.

For 0x001B of a slave whose FMMUs are not in the capture, a pause of all process data before the first read is named as
possible cause.

Slaves without a processor (0x0141 bit 0, device emulation) echo the acknowledge bit. That is no error. A slave has a
processor if it gives an AL status code, has a mailbox, or belongs to a known family. For other slaves:

- An error bit in PREOP or SAFEOP gives an inferred finding.
- An error bit in INIT or OP, where such echoes are usual, is not evaluated.
- An error bit with code 0 is not evaluated: slaves without a processor leave that code there.

The finding belongs to the bus if a broadcast read with the working counter of all slaves shows the error bit from the
first one on, and no slave is known to have it. It is not reported if the error bit stays while all slaves are in OP and
may have no processor: with an error no slave can be in OP.

## Example
samples/captures/error-standing.pcapng

## What to do
Correct what the code names:

- 0x001B: process data stopped
- 0x001D, 0x001E: sync manager settings
- 0x001A, 0x002C, 0x0032, 0x0034: synchronisation

Then acknowledge the error by bit 4 of AL Control, and request the states in order. To see how it began, capture from
power-on or from the start of the master.
)"};

class AlErrorStanding final : public Rule {
 public:
  AlErrorStanding() : Rule(kInfo) {
    Subscribe<track::AlStatusRead>(&AlErrorStanding::On);
    Subscribe<track::AlStatusCodeRead>(&AlErrorStanding::On);
    Subscribe<track::Answered>(&AlErrorStanding::On, MemoryRange{esc::kAlControl, esc::kAlStatus});
    Subscribe<track::LogicalAccess>(&AlErrorStanding::On);
    Subscribe<mailbox::MailboxMessage>(&AlErrorStanding::On);
    Subscribe<model::AlErrorStands>(&AlErrorStanding::On);
    Subscribe<model::AlErrorCleared>(&AlErrorStanding::On);
    Subscribe<model::AlRequestJudged>(&AlErrorStanding::On);
    Subscribe<model::AlAnswered>(&AlErrorStanding::On);
  }

  void On(const track::LogicalAccess& e) { flows_ = flows_ || (e.returned.seen() && e.wkc > 0); }

  void On(const model::AlErrorStands& e) {
    Standing& s = Of(e.slave);
    if (!s.open()) {
      s.first = s.last = e.frame;
      s.status = e.status;
      s.reads = 1;
      s.flowing = flows_;
      s.paused = PauseReason(context(), e.slave, e.well_until, e.frame);
      s.exchanged = Exchanged(e.slave);
      s.no_error_until = e.well_until;
    }
    s.certain = s.certain || e.certain;
    if (e.code && *e.code != 0) s.code = e.code;
    s.no_code = s.no_code || e.code == 0;
  }

  void On(const track::AlStatusRead& e) {
    if (!e.error_bit_known) return;
    if (owners_.size() <= e.slave) owners_.resize(std::size_t{e.slave} + 1, false);
    owners_[e.slave] = e.status.bit4();
    if (e.status.bit4()) {
      all_ = {};  // this or another rule reports that slave
    }
    if (e.slave >= slaves_.size() || !slaves_[e.slave].open() || slaves_[e.slave].gone || !e.status.bit4()) return;
    Standing& s = slaves_[e.slave];
    ++s.reads;
    s.last = e.frame;
    s.status = e.status;
    if (e.status_code) OnCode(s, *e.status_code);
    s.stays = s.stays || s.ignored || Exchanged(e.slave) > s.exchanged;
  }

  void On(const track::AlStatusCodeRead& e) {
    if (e.slave < slaves_.size() && slaves_[e.slave].open() && !slaves_[e.slave].gone) OnCode(slaves_[e.slave], e.code);
  }

  void On(const mailbox::MailboxMessage& e) {
    Standing& s = Of(e.slave);
    s.has_mailbox = true;
    if (s.open()) s.ignored = true;
  }

  void On(const model::AlRequestJudged& e) {
    const esc::AlWord control = e.request.control;
    if (control.bit4()) acknowledged_states_ = Mask(acknowledged_states_, control);
    const bool acknowledges = control.bit4() || control.state() == static_cast<std::uint8_t>(esc::AlState::INIT);
    if (acknowledges && e.broadcast) all_.acknowledged = true;
    if (e.slave >= slaves_.size() || !slaves_[e.slave].open()) return;
    Standing& s = slaves_[e.slave];
    if (s.gone) {
      // Acknowledged in its state: a master that goes on from there continues a run.
      if (GoesOn(s, control)) (void)ReportSlave(e.slave, s);
      s.Close();
      return;
    }
    (acknowledges ? s.acknowledged : s.ignored) = true;
    if (control.state() == static_cast<std::uint8_t>(esc::AlState::INIT)) s.from_init = true;
  }

  void On(const model::AlErrorCleared& e) {
    if (e.slave >= slaves_.size() || !slaves_[e.slave].open()) return;
    Standing& s = slaves_[e.slave];
    if (!e.echo && !s.stays && s.acknowledged && !s.from_init && !(s.flowing && InSafeop(s)) &&
        (InSafeop(s) || InPreop(s))) {
      s.gone = true;
      return;
    }
    if (!e.echo && Stayed(s) && (s.acknowledged || s.certain)) (void)ReportSlave(e.slave, s);
    s.Close();
  }

  void On(const model::AlAnswered& e) {
    if (e.slave >= slaves_.size() || !slaves_[e.slave].open()) return;
    Standing& s = slaves_[e.slave];
    if (s.gone) return;
    if (e.outcome == model::AlAnswered::Outcome::kRefused && s.stays) {
      // That the error stays after its acknowledge is a consequence.
      const FindingIndex index = ReportSlave(e.slave, s);
      if (index != kNoFinding) context().ExplainRequest(e.slave, e.request.frame.number, index);
    }
    s.Close();
  }

  /// What all slaves answer together.
  void On(const track::Answered& e) {
    if (e.command == wire::Command::BWR) {
      const std::size_t at = static_cast<std::size_t>(esc::kAlControl - e.address);
      if (track::CoversByte(e.address, e.length, esc::kAlControl) && at < e.sent_data.size()) OnControlOfAll(e, at);
      return;
    }
    if (e.command != wire::Command::BRD || !track::CoversByte(e.address, e.length, esc::kAlStatus)) return;
    const std::size_t at = static_cast<std::size_t>(esc::kAlStatus - e.address);
    if (all_without_error_ && !all_.open()) return;
    const std::uint16_t* count = context().network().slave_count().if_known();
    if (!e.returned.seen() || count == nullptr || e.wkc != *count || at >= e.returned_data.size()) return;
    // Bits that the master sent as 1 cannot be separated from answers. A single slave is read by itself.
    if (e.sent_data.empty() || std::ranges::any_of(e.sent_data, [](auto b) { return b != 0; })) {
      return;
    }
    if (*count == 1 && context().slave_count() > 0) return;
    const esc::AlWord status{static_cast<std::uint16_t>(e.returned_data[at] & 0x1FU)};
    if (!status.bit4()) {
      if (all_.open() && Stayed(all_)) ReportBus();
      all_ = {};
      all_without_error_ = true;
      return;
    }
    if (all_without_error_ || (status.state() & acknowledged_states_) != 0) return;
    if (std::ranges::find(owners_, true) != owners_.end()) return;
    if (!all_.open()) {
      all_.first = e.returned;
      all_.flowing = flows_;
      all_.slaves = *count;
    }
    all_.last = e.returned;
    all_.status = status;
    all_.in_op = all_.in_op || status.state() == static_cast<std::uint8_t>(esc::AlState::OP);
    ++all_.reads;
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    for (std::size_t i = 0; i < slaves_.size(); ++i) {
      if (!slaves_[i].open() || slaves_[i].gone) continue;
      const auto slave = static_cast<SlaveId>(i);
      if (slaves_[i].acknowledged && !Stayed(slaves_[i])) {
        NotEvaluable(slave, ReasonCode::kNotInCapture, kAfterAcknowledge, slaves_[i].first.number);
      } else {
        (void)ReportSlave(slave, slaves_[i]);
      }
    }
    if (all_.open() && all_.acknowledged && !Stayed(all_)) {
      NotEvaluable(kNoSlave, ReasonCode::kNotInCapture, kAfterAcknowledge, all_.first.number);
    } else if (all_.open()) {
      ReportBus();
    }
    NotEvaluableWhere([](const model::SlaveModel& s) { return s.al.status_reads() == 0; },
                      Reason::Of(ReasonCode::kNotRead, what::kAlStatus));
  }

 private:
  struct Standing {
    FrameRef first, last;
    esc::AlWord status;  ///< as shown last
    std::optional<std::uint16_t> code;
    std::uint64_t reads = 0;
    std::uint64_t exchanged = 0;  ///< process data of the slave up to the first read
    FrameNo no_error_until = 0;   ///< last frame that shows it without error, out of sight since; 0: none
    std::uint16_t slaves = 0;     ///< of the bus: how many counted
    bool flowing = false;         ///< process data flowed before the first read
    std::optional<sync::ProcessDataPauses::Pause> paused;  ///< ... and paused
    bool ignored = false;                                  ///< the master did something else since
    bool acknowledged = false;
    bool from_init = false;  ///< by a request of INIT
    bool gone = false;       ///< acknowledged; the next request shows whether the master goes on from there
    bool stays = false;
    bool certain = false;      ///< no echo of an acknowledge
    bool no_code = false;      ///< the code was read, and it was 0
    bool in_op = false;        ///< of the bus: all were in OP with it
    bool has_mailbox = false;  ///< so it has a processor

    [[nodiscard]] bool open() const { return first.seen(); }
    void Close() {
      const bool mailbox = has_mailbox;
      *this = {};
      has_mailbox = mailbox;
    }
  };

  Standing& Of(SlaveId slave) {
    if (slave >= slaves_.size()) slaves_.resize(std::size_t{slave} + 1);
    return slaves_[slave];
  }

  static std::uint8_t Mask(std::uint8_t states, esc::AlWord control) {
    return static_cast<std::uint8_t>(states | (control.state() & 0x0FU));
  }

  void OnControlOfAll(const track::Answered& e, std::size_t at) {
    const esc::AlWord control{e.sent_data[at]};
    if (control.bit4()) acknowledged_states_ = Mask(acknowledged_states_, control);
    const bool init = control.state() == static_cast<std::uint8_t>(esc::AlState::INIT);
    if (control.bit4() || init) all_.acknowledged = true;
    if (init) all_.from_init = true;
  }

  static void OnCode(Standing& s, std::uint16_t code) {
    s.no_code = s.no_code || code == 0;
    if (code == 0) return;
    if (!s.code) s.code = code;
    s.certain = true;  // slaves that copy AL Control into AL Status have no code
  }

  [[nodiscard]] std::uint64_t Exchanged(SlaveId slave) const {
    const model::SlaveModel& model = context().slave(slave);
    return model.outputs.exchanged + model.inputs.exchanged;
  }

  static bool InSafeop(const Standing& s) {
    return s.status.state() == static_cast<std::uint8_t>(esc::AlState::SAFEOP);
  }

  static bool InPreop(const Standing& s) {
    return s.certain && s.status.state() == static_cast<std::uint8_t>(esc::AlState::PREOP);
  }

  /// A start-up would request INIT first.
  static bool GoesOn(const Standing& s, esc::AlWord control) {
    const bool op = control.state() == static_cast<std::uint8_t>(esc::AlState::OP);
    return op || (InPreop(s) && control.state() == static_cast<std::uint8_t>(esc::AlState::SAFEOP));
  }

  /// It was set while the master did something else than find and acknowledge it at the start of a run.
  static bool Stayed(const Standing& s) { return s.stays || (s.flowing && InSafeop(s) && !s.from_init); }

  /// The slave does not copy AL Control into AL Status.
  [[nodiscard]] bool HasProcessor(SlaveId slave) const {
    return (slave < slaves_.size() && slaves_[slave].has_mailbox) || !FollowsStandard(*context().slave(slave).profile);
  }

  /// Echoes occur in INIT after a scan, and in OP if a master always sets the acknowledge bit.
  [[nodiscard]] static bool MayWellBeEcho(esc::AlWord status) {
    return status.state() == static_cast<std::uint8_t>(esc::AlState::INIT) ||
           status.state() == static_cast<std::uint8_t>(esc::AlState::OP);
  }

  static Finding Begin(const FindingKind& kind, SlaveId slave, const Standing& s, bool certain) {
    Finding finding = Found(kind, slave, s.first);
    finding.last = s.last;
    finding.count = s.reads;
    finding.confidence = certain ? Confidence::kObserved : Confidence::kInferred;
    finding.Set("reads", arg::Count(s.reads, "read"));
    if (s.reads > 1) finding.Set("last_read_frame", arg::Frame(s.last.number));
    if (!certain) finding.Add(kMayBeEcho);
    return finding;
  }

  FindingIndex ReportSlave(SlaveId slave, const Standing& s) {
    const bool certain = s.certain || HasProcessor(slave);
    if (!certain && (MayWellBeEcho(s.status) || s.no_code)) {
      if (s.no_code) {
        NotEvaluable(slave, ReasonCode::kAmbiguous, kErrorBit, s.first.number);
      } else {
        NotEvaluable(slave, ReasonCode::kNotRead, what::kAlStatusCode, s.first.number);
      }
      return kNoFinding;
    }
    const bool again = s.no_error_until != 0;
    Finding finding = Begin(again ? kActiveWhenSeenAgain : kActiveWhenFirstSeen, slave, s, certain);
    finding.Set("al_status", arg::Status(s.status.raw));
    if (again) {
      finding.Set("no_error_frame", arg::Frame(s.no_error_until));
      AddRelated(finding, s.no_error_until);
    }
    finding.reference = ReferenceTo(kInfo.source);
    if (s.code) {
      SetCode(finding, s, *context().slave(slave).profile);
    } else if (s.no_code) {
      finding.Set("no_code", arg::Flag());
    }
    if (s.ignored) finding.Add(kNotAcknowledged);
    if (s.paused && s.code == esc::al_code::kWatchdog && InSafeop(s)) {
      finding.Set("reason", arg::Of(kWhyPaused)).Set("reason_value", arg::Ms(s.paused->length()));
      finding.notes.push_back(NoteOf(context(), slave, *s.paused));
    }
    return Report(s.status.raw, std::move(finding));
  }

  /// The code, and what it means if a slave leaves its state by itself.
  static void SetCode(Finding& finding, const Standing& s, const device::DeviceDescription& family) {
    finding.Set("al_status_code", CodeValue(*s.code, family));
    SetCodeAdvice(finding, *s.code);
    if (const device::AlStatusCode* entry = family.al_status_code(*s.code); entry && !entry->source.empty()) {
      finding.reference = ReferenceTo(entry->source);
    }
    SetKnownCause(finding, family, std::nullopt, s.status, *s.code);
  }

  void ReportBus() {
    const std::size_t known = context().slave_count();
    bool certain = known == all_.slaves;
    for (std::size_t i = 0; i < known && certain; ++i) certain = HasProcessor(static_cast<SlaveId>(i));
    const Standing s = std::exchange(all_, {});
    if (!certain && (s.in_op || MayWellBeEcho(s.status))) {
      NotEvaluable(kNoSlave, ReasonCode::kAmbiguous, kErrorBit, s.first.number);
      return;
    }
    Finding finding = Begin(kActiveOnBus, kNoSlave, s, certain);
    finding.Set("al_status", arg::StatusOfAll(s.status.raw))
        .Set("slaves", arg::Count(s.slaves, "slave"))
        .Set("one", arg::Flag(s.slaves == 1));
    Report(0, std::move(finding));
  }

  std::vector<Standing> slaves_;
  std::vector<bool> owners_;              // of each slave: its last read showed the error bit
  Standing all_;                          // what broadcast reads show of all slaves
  bool all_without_error_ = false;        // a broadcast showed all slaves without error
  std::uint8_t acknowledged_states_ = 0;  // requested with the acknowledge bit: slaves may echo it there
  bool flows_ = false;                    // process data were exchanged
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlErrorStanding>};

}  // namespace
}  // namespace ecaudit::al_error_standing
