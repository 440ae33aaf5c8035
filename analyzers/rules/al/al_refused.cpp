#include <algorithm>
#include <map>
#include <vector>

#include "analyzers/judge/init_command_watch.h"
#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_text.h"
#include "decoder/base/text.h"

namespace ecaudit::al_refused {
namespace {

constexpr RuleInfo kInfo{
    .id = "al-refused",
    .group = "AL state machine",
    .severity = Severity::kError,
    .needs_no_history = true,
    .subject = Subject::kAlRequest,
    .title = "The slave answers a state request with the error bit",
    .needs = "AL Status after the request; the state before it, to tell the error from an older one",
    .source = "ETG1000.6, AL Status register 0x0130 and AL Status Code register 0x0134",
    .doc = R"(
## What it checks
Whether a request for a state is answered by the error bit (bit 4 of AL Status 0x0130), and what the AL status code
(0x0134) says. Further reads of the same error count as repetitions.

## Why it matters
This is the moment at which a start-up stops: the drive did not follow its master, and the code is its reason.

## How it is decided
The error bit appears after a request that the slave took, and was not set before. After an acknowledge it has to appear
with another code, or stay for 200 ms. Slaves without a processor echo the acknowledge bit of the request; that is no
error. Where the state before the request was never read, the error may be
older and the finding is marked inferred. Where the model knows why the slave had to refuse (an illegal transition, a
wrong sync manager), caused_by names that finding. With an ESI file (--esi) the text names the writes that it asks for
before the refused state (init commands) and that the capture, which shows the slave's way to PREOP, does not have.
Where only broadcasts show the error bit behind a request without the acknowledge bit, three times at least, the finding
belongs to the bus; not where one showed before that all had followed the request, nor where a slave that was read by
itself shows an error.

## Example
samples/captures/init-to-op-refused.pcapng: OP refused with 0x0011.

## What to do
Look at the cause where one is named. Otherwise the AL status code says what the slave checked: 0x0017, 0x001D and
0x001E sync manager settings against the assigned PDOs, 0x001B missing outputs, 0x0030-0x0037 distributed clocks.
)"};

constexpr std::uint16_t kBootNotSupported = 0x0013;

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

  /// Which of them it was, and why, broadcasts do not tell.
  void On(const model::BusAlRefused& e) {
    if (MissesPackets(context().pairing())) {
      NotEvaluable(kNoSlave, kMissesPackets, e.frame.number);
      return;
    }
    const std::uint64_t key = kOfAll | e.control.raw;
    if (const FindingIndex repeated = Repeat(kNoSlave, key, e.frame); repeated != kNoFinding) {
      AddRelated(context().store[repeated], e.request.number);
      return;
    }
    const std::string state = esc::StateName(e.control.state());
    const std::string who = e.slaves == 1 ? "The slave" : "One or more of " + std::to_string(e.slaves) + " slaves";
    Finding finding;
    finding.first = e.frame;
    finding.last = e.last;
    finding.count = e.reads;
    AddRelated(finding, e.request.number);
    finding.title = who + " refused " + state + ", as broadcasts show";
    finding.message =
        "The master requested " + state + " in frame " + std::to_string(e.request.number) + "; from frame " +
        std::to_string(e.frame.number) + " to frame " + std::to_string(e.last.number) +
        " a broadcast read of AL Status shows " + esc::StatesOfAllText(e.status.raw) +
        ", and before the request no error bit. Which slave it is and its AL status code, such a read does "
        "not tell: read six bytes from 0x0130 of each slave.";
    finding.evidence.push_back(Text("requested", state));
    finding.evidence.push_back(HexNumber("al_status_of_all", e.status.raw));
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
      Finding finding;
      finding.slave = e.slave;
      finding.first = e.frame;
      finding.confidence = e.state_before_known ? Confidence::kObserved : Confidence::kInferred;
      finding.caused_by = cause;
      AddRelated(finding, e.request.frame.number);
      index = Report(key, std::move(finding));
      if (index == kNoFinding) return;
      const device::DeviceDescription& family = *context().slave(e.slave).profile;
      Told told{e, {}, init_commands_.MissingText(e.slave, family, e.request)};
      if (told_.emplace(index, std::move(told)).second) Describe(context().store[index], told_[index]);
    } else {
      AddRelated(context().store[index], e.request.frame.number);
    }
    open_[e.slave] = index;
    if (e.code) AddCode(index, e.frame, *e.code);
  }

  void On(const model::AlAnswerUnclear& e) {
    NotEvaluable(e.slave, "the error bit may be older than the request, before which the state was not read",
                 e.frame.number);
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

  void Finish() override { NotEvaluableWhereRequestsAreNotFollowed(); }

 private:
  /// What the text of a finding tells: its first occasion, and the codes read since.
  struct Told {
    model::AlAnswered answer;
    std::vector<std::uint16_t> codes;
    std::string missing;  ///< init commands of the ESI that were not sent; empty: none
  };
  static constexpr std::size_t kMaxCodes = 4;
  static constexpr std::uint64_t kOfAll = std::uint64_t{1} << 63U;

  [[nodiscard]] FindingIndex OpenOf(SlaveId slave) const { return slave < open_.size() ? open_[slave] : kNoFinding; }
  void Close(SlaveId slave) {
    if (slave < open_.size()) open_[slave] = kNoFinding;
  }

  void AddCode(FindingIndex index, const FrameRef& frame, std::uint16_t code) {
    Told& told = told_[index];
    if (std::find(told.codes.begin(), told.codes.end(), code) != told.codes.end()) return;
    if (told.codes.size() == kMaxCodes) return;
    told.codes.push_back(code);
    Describe(context().store[index], told);
    AddRelated(context().store[index], frame.number == context().store[index].first.number ? 0 : frame.number);
  }

  void Describe(Finding& finding, const Told& told) const {
    const model::AlAnswered& e = told.answer;
    const device::DeviceDescription& family = *context().slave(e.slave).profile;
    const std::string to = esc::StateName(e.request.control.state());
    const std::string request_frame = std::to_string(e.request.frame.number);
    const bool only_acknowledge = e.request.from == e.request.control.state() && e.request.control.bit4();
    if (only_acknowledge) {
      finding.title = "Error in " + to + " stays after its acknowledge";
      finding.message = "The master acknowledged the error in " + to + " (AL Control " + Hex(e.request.control.raw) +
                        ") in frame " + request_frame + RepetitionText(e.request) + "; in frame " +
                        std::to_string(e.frame.number) + " the slave still shows ";
    } else {
      finding.title = (esc::IsAlState(e.request.control.state()) ? to : "Request of " + to) + " refused" +
                      (e.request.from != 0 ? " in " + esc::StateName(e.request.from) : "");
      finding.message = "The master requested " + RequestText(e.request) + " in frame " + request_frame +
                        RepetitionText(e.request) + "; from frame " + std::to_string(e.frame.number) +
                        " on the slave shows ";
    }
    finding.message += esc::StatusText(e.status.raw) + " (AL Status " + Hex(e.status.raw) + "). ";
    finding.evidence.clear();
    finding.evidence.push_back(Text("requested", to));
    if (e.request.from != 0) finding.evidence.push_back(Text("state_before", esc::StateName(e.request.from)));
    finding.evidence.push_back(HexNumber("al_status", e.status.raw));
    DescribeCodes(finding, told.codes, family);
    if (e.request.frame.has_time && e.frame.has_time) {
      finding.evidence.push_back(
          Real("answered_after_ms", static_cast<double>(e.frame.time - e.request.frame.time) / 1e6));
    }
    finding.reference = ReferenceTo(kInfo.source);
    if (!told.codes.empty()) {
      const device::AlStatusCode* entry = family.al_status_code(told.codes.front());
      if (entry != nullptr && !entry->source.empty()) finding.reference = ReferenceTo(entry->source);
    }
    const device::AlTransition* row = e.request.transition;
    if (row != nullptr && e.request.verdict == model::AlVerdict::kLegal && !row->requirement.empty()) {
      finding.message += "For this transition the slave needs: " + row->requirement + ". ";
      finding.reference = ReferenceTo(row->source);
    }
    finding.message += told.missing;
    finding.message +=
        finding.caused_by != kNoFinding ? "Correct the cause named first." : Advice(told.codes, to, only_acknowledge);
    if (!e.state_before_known) {
      finding.message +=
          " AL Status was not read between the start of the capture and the request: the error may be older.";
    }
  }

  static void DescribeCodes(Finding& finding, const std::vector<std::uint16_t>& codes,
                            const device::DeviceDescription& family) {
    if (codes.empty()) {
      finding.message += "The AL status code (0x0134) was not read, so the slave's reason is not in the capture. ";
      return;
    }
    finding.title += " with AL status code " + CodeText(codes.front(), family);
    finding.message += "AL status code " + CodeText(codes.front(), family);
    for (std::size_t i = 1; i < codes.size(); ++i) finding.message += ", later " + CodeText(codes[i], family);
    finding.message += ". ";
    finding.evidence.push_back(HexNumber("al_status_code", codes.front()));
  }

  /// What to do about a refusal that is nobody else's fault.
  static std::string Advice(const std::vector<std::uint16_t>& codes, const std::string& to, bool only_acknowledge) {
    const bool no_boot = !only_acknowledge && std::find(codes.begin(), codes.end(), kBootNotSupported) != codes.end();
    if (no_boot) {
      return "This slave has no " + to +
             ", so do not request it: acknowledge (bit 4 of AL Control) and go on from the state it is in.";
    }
    return std::string(codes.empty() ? "Let the master read the code" : "Check what the code names") + ", then " +
           (only_acknowledge ? "acknowledge again."
                             : "acknowledge (bit 4 of AL Control) and request " + to + " again.");
  }

  std::vector<FindingIndex> open_;  // of each slave: whose repetitions and code are awaited
  std::map<FindingIndex, Told> told_;
  InitCommandWatch init_commands_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlRefused>};

}  // namespace
}  // namespace ecaudit::al_refused
