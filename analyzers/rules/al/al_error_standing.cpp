#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/bus_model.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_text.h"
#include "decoder/base/text.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::al_error_standing {
namespace {

constexpr RuleInfo kInfo{.id = "al-error-standing",
                         .group = "AL state machine",
                         .severity = Severity::kError,
                         .needs_no_history = true,
                         .title = "The error bit is set when the slave is first seen, and stays",
                         .needs = "AL Status of the slave, or of all slaves by a broadcast",
                         .source = "ETG1000.6, AL Status register 0x0130 and AL Status Code register 0x0134",
                         .doc = R"(
## What it checks
Whether the error bit (bit 4 of AL Status 0x0130) is set from the first read of a slave on and stays, and what the AL
status code (0x0134) says. One finding a slave; further reads of the same error count as repetitions.

## Why it matters
What is wrong need not have begun in the capture. The slave refused or left a state before, and as long as its error
stands it follows no request: the machine does not run.

## How it is decided
The slave was never seen without error before, or not since it was lost from sight (it had left the bus, or the capture
has a hole there); an error whose beginning the capture shows belongs to al-refused or al-unexpected-change. It *stays*
when one of these holds:

- the capture ends with it, and nobody acknowledged it;
- the slave still shows it after the master requested another state without acknowledging, spoke to its mailbox, or
  exchanged its process data;
- the slave stands in SAFEOP with it, and the master does not begin anew by INIT: process data were exchanged on the
  bus before the slave was first read, or behind the acknowledge the master asks for OP at once;
- the slave stands in PREOP with it and names a code, and behind the acknowledge the master asks for SAFEOP or OP at
  once, without INIT.

A master that finds an error at its scan and acknowledges it (bit 4 of AL Control, or a request of INIT) before it does
any of these, so that the error goes away, does what every start-up does: nothing is said. Nor is it where the capture
ends before the acknowledge is answered.

Slaves without a processor (0x0141 bit 0, device emulation) echo the acknowledge bit; that is no error. Where neither
an AL status code nor a mailbox nor the family tells that the slave has a processor, an error bit in PREOP or SAFEOP
gives an inferred finding; one in INIT or OP, where such echoes are usual, or with the code 0, which slaves without a
processor leave there, is not judged.

A broadcast read with the working counter of all slaves that shows the error bit from the first one on, while none of
the slaves is known to have it, gives a finding of the bus; not so where it stayed while all of them were in OP and they
may be slaves without a processor: no error lets a slave be there.

## Example
samples/captures/error-standing.pcapng

## What to do
Correct what the code names (0x001B: process data stopped; 0x001D, 0x001E: sync manager settings; 0x001A, 0x002C,
0x0032, 0x0034: synchronisation), acknowledge by bit 4 of AL Control, and request the states in order. To see how it
began, capture from power-on or from the start of the master.
)"};

constexpr const char* kNotShownGone =
    "the error that stood there was acknowledged, and the capture does not show it gone";

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
      s.exchanged = Exchanged(e.slave);
      s.well_until = e.well_until;
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
      all_ = {};  // that slave is told of, by this or another rule
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
      // Acknowledged where it stood: a master that goes on from there goes on with a run.
      if (GoesOn(s, control)) (void)Tell(e.slave, s);
      s.Close();
      return;
    }
    (acknowledges ? s.acknowledged : s.ignored) = true;
    if (control.state() == static_cast<std::uint8_t>(esc::AlState::INIT)) s.anew = true;
  }

  void On(const model::AlErrorCleared& e) {
    if (e.slave >= slaves_.size() || !slaves_[e.slave].open()) return;
    Standing& s = slaves_[e.slave];
    if (!e.echo && !s.stays && s.acknowledged && !s.anew && !(s.flowing && InSafeop(s)) &&
        (InSafeop(s) || InPreop(s))) {
      s.gone = true;
      return;
    }
    if (!e.echo && Stood(s) && (s.acknowledged || s.certain)) (void)Tell(e.slave, s);
    s.Close();
  }

  void On(const model::AlAnswered& e) {
    if (e.slave >= slaves_.size() || !slaves_[e.slave].open()) return;
    Standing& s = slaves_[e.slave];
    if (s.gone) return;
    if (e.outcome == model::AlAnswered::Outcome::kRefused && s.stays) {
      // That it stays after its acknowledge follows from that it stands.
      const FindingIndex index = Tell(e.slave, s);
      if (index != kNoFinding) context().ExplainRequest(e.slave, e.request.frame.number, index);
    }
    s.Close();
  }

  /// What all slaves say together.
  void On(const track::Answered& e) {
    if (e.command == wire::Command::BWR) {
      const std::size_t at = static_cast<std::size_t>(esc::kAlControl - e.address);
      if (track::CoversByte(e.address, e.length, esc::kAlControl) && at < e.sent_data.size()) OnControlOfAll(e, at);
      return;
    }
    if (e.command != wire::Command::BRD || !track::CoversByte(e.address, e.length, esc::kAlStatus)) return;
    const std::size_t at = static_cast<std::size_t>(esc::kAlStatus - e.address);
    if (all_well_ && !all_.open()) return;
    const std::uint16_t* count = context().network().slave_count().if_known();
    if (!e.returned.seen() || count == nullptr || e.wkc != *count || at >= e.returned_data.size()) return;
    // Bits that the master sent set would be taken for answers; and a single slave tells by itself.
    if (e.sent_data.empty() || std::any_of(e.sent_data.begin(), e.sent_data.end(), [](auto b) { return b != 0; })) {
      return;
    }
    if (*count == 1 && context().slave_count() > 0) return;
    const esc::AlWord status{static_cast<std::uint16_t>(e.returned_data[at] & 0x1FU)};
    if (!status.bit4()) {
      if (all_.open() && Stood(all_)) TellBus();
      all_ = {};
      all_well_ = true;
      return;
    }
    if (all_well_ || (status.state() & acknowledged_states_) != 0) return;
    if (std::find(owners_.begin(), owners_.end(), true) != owners_.end()) return;
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
      if (slaves_[i].acknowledged && !Stood(slaves_[i])) {
        NotEvaluable(slave, kNotShownGone, slaves_[i].first.number);
      } else {
        (void)Tell(slave, slaves_[i]);
      }
    }
    if (all_.open() && all_.acknowledged && !Stood(all_)) {
      NotEvaluable(kNoSlave, kNotShownGone, all_.first.number);
    } else if (all_.open()) {
      TellBus();
    }
    NotEvaluableWhere([](const model::SlaveModel& s) { return s.al.status_reads() == 0; },
                      "AL Status of the slave was not read");
  }

 private:
  struct Standing {
    FrameRef first, last;
    esc::AlWord status;  ///< as shown last
    std::optional<std::uint16_t> code;
    std::uint64_t reads = 0;
    std::uint64_t exchanged = 0;  ///< process data of the slave up to the first read
    FrameNo well_until = 0;       ///< it was seen without error until there, and not since; 0: never
    std::uint16_t slaves = 0;     ///< of the bus: who counted
    bool flowing = false;         ///< process data flowed before the first read
    bool ignored = false;         ///< the master did something else since
    bool acknowledged = false;
    bool anew = false;  ///< by a request of INIT
    bool gone = false;  ///< acknowledged, and whether the master goes on from there is to be seen
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
    if (init) all_.anew = true;
  }

  static void OnCode(Standing& s, std::uint16_t code) {
    s.no_code = s.no_code || code == 0;
    if (code == 0) return;
    if (!s.code) s.code = code;
    s.certain = true;  // who copies AL Control into AL Status has no code
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

  /// A start-up from there would ask for INIT first.
  static bool GoesOn(const Standing& s, esc::AlWord control) {
    const bool op = control.state() == static_cast<std::uint8_t>(esc::AlState::OP);
    return op || (InPreop(s) && control.state() == static_cast<std::uint8_t>(esc::AlState::SAFEOP));
  }

  /// It was there when the master did something else than to find and to acknowledge it at the start of a run.
  static bool Stood(const Standing& s) { return s.stays || (s.flowing && InSafeop(s) && !s.anew); }

  /// A slave that is none of those that copy AL Control into AL Status.
  [[nodiscard]] bool HasProcessor(SlaveId slave) const {
    return (slave < slaves_.size() && slaves_[slave].has_mailbox) || !JudgedByStandard(*context().slave(slave).profile);
  }

  /// Echoes stand in INIT behind a scan, and in OP where a master always sets the acknowledge bit.
  [[nodiscard]] static bool MayWellBeEcho(esc::AlWord status) {
    return status.state() == static_cast<std::uint8_t>(esc::AlState::INIT) ||
           status.state() == static_cast<std::uint8_t>(esc::AlState::OP);
  }

  static std::string SinceText(const Standing& s) {
    return (s.reads > 1 ? std::string(s.well_until != 0 ? "From frame " : "From the first read in frame ") +
                              std::to_string(s.first.number) + " to frame " + std::to_string(s.last.number) + " (" +
                              std::to_string(s.reads) + " reads)"
                        : "In frame " + std::to_string(s.first.number) + ", the only read" +
                              (s.well_until != 0 ? " since," : ",")) +
           " AL Status ";
  }

  Finding Begin(const Standing& s, bool certain) const {
    Finding finding;
    finding.first = s.first;
    finding.last = s.last;
    finding.count = s.reads;
    finding.confidence = certain ? Confidence::kObserved : Confidence::kInferred;
    finding.evidence.push_back(HexNumber("al_status", s.status.raw));
    return finding;
  }

  FindingIndex Tell(SlaveId slave, const Standing& s) {
    const bool certain = s.certain || HasProcessor(slave);
    if (!certain && (MayWellBeEcho(s.status) || s.no_code)) {
      NotEvaluable(slave,
                   std::string("AL Status shows the error bit from the first read on, but ") +
                       (s.no_code ? "the AL status code is 0" : "no code was read") +
                       ": a slave without a processor echoes an acknowledge so",
                   s.first.number);
      return kNoFinding;
    }
    const device::DeviceDescription& family = *context().slave(slave).profile;
    const std::string status = esc::StatusText(s.status.raw);
    Finding finding = Begin(s, certain);
    finding.slave = slave;
    const bool again = s.well_until != 0;
    finding.title = "Slave stands in " + status + " since it is " + (again ? "seen again" : "first seen");
    finding.message = SinceText(s) + "shows " + status + " (" + Hex(s.status.raw) + "): the error began ";
    if (again) {
      finding.message +=
          "while nothing was seen of the slave, which frame " + std::to_string(s.well_until) + " shows without error. ";
      AddRelated(finding, s.well_until);
    } else {
      finding.message += "before the capture saw the slave. ";
    }
    finding.reference = ReferenceTo(kInfo.source);
    if (s.code) {
      finding.title += ", AL status code " + CodeText(*s.code, family);
      finding.message += "AL status code " + CodeText(*s.code, family) + ". ";
      finding.evidence.push_back(HexNumber("al_status_code", *s.code));
      if (const device::AlStatusCode* entry = family.al_status_code(*s.code); entry && !entry->source.empty()) {
        finding.reference = ReferenceTo(entry->source);
      }
      for (const device::SpontaneousAlChange& known : family.al.spontaneous) {
        if (static_cast<std::uint8_t>(known.to) != s.status.state() ||
            std::find(known.codes.begin(), known.codes.end(), *s.code) == known.codes.end()) {
          continue;
        }
        finding.message += LawText(family) + " gives as cause, where a slave does so by itself: " + known.cause + ". ";
        finding.reference = ReferenceTo(known.source);
        break;
      }
    } else if (s.no_code) {
      finding.message += "The AL status code (0x0134) is 0: the slave gives no reason. ";
    } else {
      finding.message += "The AL status code (0x0134) was not read, so the slave's reason is not in the capture. ";
    }
    if (!certain) {
      finding.message +=
          "Whether the slave has a processor of its own does not show; one without only echoes an acknowledge. ";
    }
    if (s.ignored) finding.message += "The master went on without acknowledging it. ";
    finding.message += s.code ? "Correct what the code names" : "Let the master read the code";
    finding.message += ", then acknowledge (bit 4 of AL Control) and request the states in order.";
    if (!again) finding.message += " How it began a capture from the start of the master on would show.";
    return Report(s.status.raw, std::move(finding));
  }

  void TellBus() {
    const std::size_t known = context().slave_count();
    bool certain = known == all_.slaves;
    for (std::size_t i = 0; i < known && certain; ++i) certain = HasProcessor(static_cast<SlaveId>(i));
    const Standing s = std::exchange(all_, {});
    if (!certain && (s.in_op || MayWellBeEcho(s.status))) {
      NotEvaluable(kNoSlave,
                   "AL Status of all slaves shows the error bit, but slaves without a processor echo an acknowledge so",
                   s.first.number);
      return;
    }
    const std::string status = StatesOfAll(s.status);
    Finding finding = Begin(s, certain);
    finding.title = "Some slave has the error bit set since the capture began";
    finding.message = SinceText(s) + "as all " + std::to_string(s.slaves) + " slaves answer it is " +
                      Hex(s.status.raw, 2) + ": " + status +
                      ", and the error bit of at least one of them; which one, a broadcast does not tell. ";
    if (!certain) {
      finding.message +=
          "Whether these slaves have a processor of their own does not show; those without only echo an acknowledge. ";
    }
    finding.message +=
        "Let the master read six bytes from 0x0130 of each slave, correct what the AL status code names, then "
        "acknowledge (bit 4 of AL Control).";
    finding.evidence.push_back(Number("slaves", s.slaves));
    Report(0, std::move(finding));
  }

  /// "all of them in SAFEOP", "some in SAFEOP, some in OP".
  static std::string StatesOfAll(esc::AlWord status) {
    constexpr std::array<std::uint8_t, 4> kStates{1, 2, 4, 8};
    if (esc::IsAlState(status.state()) && status.state() != static_cast<std::uint8_t>(esc::AlState::BOOT)) {
      return "all of them in " + esc::StateName(status.state());
    }
    std::string out;
    for (const std::uint8_t state : kStates) {
      if ((status.state() & state) != 0) out += (out.empty() ? "some in " : ", some in ") + esc::StateName(state);
    }
    return out;
  }

  std::vector<Standing> slaves_;
  std::vector<bool> owners_;              // of each slave: its last read showed the error bit
  Standing all_;                          // what broadcasts show of no slave in particular
  bool all_well_ = false;                 // a broadcast showed all slaves without error
  std::uint8_t acknowledged_states_ = 0;  // requested with the acknowledge bit: slaves may echo it there
  bool flows_ = false;                    // process data were exchanged
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlErrorStanding>};

}  // namespace
}  // namespace ecaudit::al_error_standing
