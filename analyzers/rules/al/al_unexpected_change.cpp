#include <algorithm>
#include <map>
#include <optional>
#include <vector>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_text.h"
#include "decoder/base/text.h"
#include "decoder/pipeline.h"

namespace ecaudit::al_unexpected_change {
namespace {

constexpr RuleInfo kInfo{.id = "al-unexpected-change",
                         .group = "AL state machine",
                         .severity = Severity::kError,
                         .title = "The state falls, or the error bit appears, without a request",
                         .needs = "AL Status before and after",
                         .source = "ETG1000.6, EtherCAT state machine",
                         .doc = R"(
## What it checks
AL Status (0x0130) that shows a lower state than before, or the error bit, although the master asked for neither.

## Why it matters
The drive left operation by itself: watchdog, loss of synchronisation, power cycle, local control. This is usually the
moment at which the machine stopped.

## How it is decided
The state before was read, no request that was sent since then leads to the new one, not even over intermediate states,
and no request is under way or lost. The frames between the last good read and this one are the time of the event. A
broadcast read counts where its result tells the state of every slave. Where it is a mixture (0x001C: some in SAFEOP,
some in OP, somebody's error bit), it tells that some slave fell or set its error bit: unless that slave shows it by
itself before the next request, the finding belongs to the bus and names the slaves that it cannot be. Where it shows
all slaves in one lower state and the error bit (0x14: all in SAFEOP), that is one finding of the bus, too, unless
slaves are read before the next request. A value that is no state at all counts as a fall where two reads in a row show
it. Where the capture misses many packets (returned frames without an outbound
copy, indices that skip) the request may be among them, and nothing is said. Nor is it where the state fell without
the error bit while nobody sent anything for long and the indices do not tell whether frames are missing there. No
slave rises by itself: where one did before, without a request in the capture, the capture does not hold all requests (a
filter chose its packets), and a fall without the error bit is not judged.

## Example
samples/captures/falls-out-of-op.pcapng: 0x001B after the process data paused.

## What to do
Look at the AL status code: 0x001B process data stopped (watchdog), 0x001A, 0x002C, 0x0032, 0x0034 synchronisation. Look
at what happened between the two frames named: gaps in the process data, lost frames, link errors, other requests.
)"};

constexpr const char* kLoose =
    "between two looks at AL Status the indices of the frames do not follow each other: the capture may not hold each "
    "of them, and a request may have asked for the fall";
constexpr const char* kAfterPause =
    "between two looks at AL Status nobody sent anything for long: what is missing there may be a request, a restart, "
    "or "
    "the end of another capture";

class AlUnexpectedChange final : public Rule {
 public:
  AlUnexpectedChange() : Rule(kInfo) {
    Subscribe<model::AlChangedByItself>(&AlUnexpectedChange::On);
    Subscribe<model::AlErrorRepeated>(&AlUnexpectedChange::On);
    Subscribe<model::AlErrorCode>(&AlUnexpectedChange::On);
    Subscribe<model::AlErrorCleared>(&AlUnexpectedChange::On);
    Subscribe<model::AlAnswered>(&AlUnexpectedChange::On);
    Subscribe<model::BusAlChanged>(&AlUnexpectedChange::On);
  }

  void On(const model::AlChangedByItself& e) {
    const bool of_all = e.error_of_some && !e.after_pause && context().slave_count() > 1;
    if (!of_all || (!pending_.empty() && pending_.front().frame.number != e.frame.number)) Settle();
    if (of_all) {
      pending_.push_back(e);
    } else {
      Tell(e);
    }
  }
  void On(const model::AlErrorRepeated& e) {
    Flush();
    const FindingIndex index = OpenOf(e.slave);
    if (index == kNoFinding) return;
    ++context().store[index].count;
    context().store[index].last = e.frame;
    // A broadcast showed the state only; now this slave shows its error bit.
    Told& told = told_[index];
    if (told.change.status.state() == e.status.state() && !told.change.status.bit4()) {
      told.change.status = e.status;
      Describe(context().store[index], told);
    }
  }
  void On(const model::AlErrorCode& e) {
    Flush();
    if (const FindingIndex index = OpenOf(e.slave); index != kNoFinding) AddCode(index, e.frame, e.code);
  }
  void On(const model::BusAlChanged& e) {
    if (MissesPackets(context().pairing())) {
      NotEvaluable(kNoSlave, ReasonCode::kMissesPackets, e.frame.number);
      return;
    }
    if (e.after_pause && !e.unexplained.bit4()) {
      NotEvaluable(kNoSlave, kAfterPause, e.frame.number);
      return;
    }
    if (MayLackRequest(e.before_since, e.frame.number) && !e.unexplained.bit4()) {
      NotEvaluable(kNoSlave, kLoose, e.frame.number);
      return;
    }
    if (e.rose_unasked != 0 && !e.unexplained.bit4()) {
      NotEvaluable(kNoSlave, RoseUnasked("slaves", e.rose_unasked), e.frame.number);
      return;
    }
    const std::uint64_t key = static_cast<std::uint64_t>(e.before.raw) << 16U | e.status.raw;
    const SlaveId only = OnlyOneLeft(e);
    if (const FindingIndex repeated = Repeat(only, key, e.last); repeated != kNoFinding) {
      AddRelated(context().store[repeated], e.frame.number);
      return;
    }
    Finding finding;
    finding.slave = only;
    finding.first = e.frame;
    finding.last = e.last;
    AddRelated(finding, e.before_since);
    const std::string slaves =
        e.slaves == 1 || only != kNoSlave ? "The slave" : "One or more of " + std::to_string(e.slaves) + " slaves";
    const std::uint8_t state = e.unexplained.state();
    finding.title =
        slaves +
        (state != 0 ? " fell to " + esc::StatesOfAllText(state) + (e.unexplained.bit4() ? " with an error" : "")
                    : std::string(" set the error bit")) +
        " by itself, as broadcasts show";
    finding.message = "A broadcast read of AL Status that " +
                      (e.slaves == 1 ? std::string("the slave") : "all " + std::to_string(e.slaves) + " slaves") +
                      " counted for showed " + esc::StatesOfAllText(e.before.raw) + " in frame " +
                      std::to_string(e.before_since) + " and shows " + esc::StatesOfAllText(e.status.raw) +
                      " from frame " + std::to_string(e.frame.number) + " to frame " + std::to_string(e.last.number) +
                      "; no request of the master asked for it. " + WhoItIs(only, e.excluded) +
                      "Look at what happened between the first two frames.";
    finding.evidence.push_back(HexNumber("al_status_of_all_before", e.before.raw));
    finding.evidence.push_back(HexNumber("al_status_of_all", e.status.raw));
    (void)Report(key, std::move(finding));
  }
  void On(const model::AlErrorCleared& e) {
    Settle();
    Close(e.slave);
  }
  void On(const model::AlAnswered& e) {
    Settle();
    Close(e.slave);
  }

  void Finish() override {
    Settle();
    if (NotEvaluableWithoutReturns()) return;
    NotEvaluableWhere([](const model::SlaveModel& s) { return s.al.status_reads() < 2; },
                      "AL Status of the slave was not read twice");
  }

 private:
  /// What the text of a finding tells: its first occasion, and the code read then or later.
  struct Told {
    model::AlChangedByItself change;
    std::optional<std::uint16_t> code;
  };

  /// True when the indices of the frames between two looks do not show that each of them is in the capture.
  [[nodiscard]] bool MayLackRequest(FrameNo before, FrameNo now) const {
    const FrameNo loose = context().pairing().last_loose;
    return before < loose && loose <= now;
  }

  /// A slave never rises by itself: the capture does not hold every request.
  [[nodiscard]] static std::string RoseUnasked(const char* who, FrameNo frame) {
    return std::string(who) + " rose to a higher state in frame " + std::to_string(frame) +
           " without a request in the capture, so it does not hold all requests: one may have asked for the fall, too";
  }

  /// The one of the slaves that was not read, where all others were and showed nothing of it.
  [[nodiscard]] SlaveId OnlyOneLeft(const model::BusAlChanged& e) const {
    const std::size_t slaves = context().network().slaves().size();
    if (slaves != e.slaves || e.excluded.empty() || e.excluded.size() + 1 != slaves) return kNoSlave;
    for (std::size_t s = 0; s < slaves; ++s) {
      const auto slave = static_cast<SlaveId>(s);
      if (std::find(e.excluded.begin(), e.excluded.end(), slave) == e.excluded.end()) return slave;
    }
    return kNoSlave;
  }

  [[nodiscard]] std::string WhoItIs(SlaveId only, std::span<const SlaveId> excluded) const {
    if (only != kNoSlave) {
      return "It is " + context().Label(only) + ": all others were read and showed nothing of it. ";
    }
    return "Which slave it is, such a read does not tell" + ExcludedText(excluded) +
           ". Read AL Status (0x0130) and its code (0x0134) from each slave. ";
  }

  /// "; it is none of 0x1001 and 0x1003, which showed nothing of it"
  [[nodiscard]] std::string ExcludedText(std::span<const SlaveId> excluded) const {
    constexpr std::size_t kNamed = 8;
    if (excluded.empty()) return {};
    std::string text = "; it is none of ";
    for (std::size_t i = 0; i < excluded.size() && i < kNamed; ++i) {
      if (i > 0) text += ", ";
      text += context().Label(excluded[i]);
    }
    if (excluded.size() > kNamed) text += " and " + std::to_string(excluded.size() - kNamed) + " more";
    return text + ", which were read and showed nothing of it";
  }
  [[nodiscard]] FindingIndex OpenOf(SlaveId slave) const { return slave < open_.size() ? open_[slave] : kNoFinding; }
  void Close(SlaveId slave) {
    if (slave < open_.size()) open_[slave] = kNoFinding;
  }

  void Tell(const model::AlChangedByItself& e) {
    if (e.slave >= open_.size()) open_.resize(static_cast<std::size_t>(e.slave) + 1, kNoFinding);
    open_[e.slave] = kNoFinding;
    if (MissesPackets(context().pairing())) {
      NotEvaluable(e.slave, ReasonCode::kMissesPackets, e.frame.number);
      return;
    }
    if (e.after_pause && !e.status.bit4()) {
      NotEvaluable(e.slave, kAfterPause, e.frame.number);
      return;
    }
    // The acknowledge bit comes back as error bit from who only mirrors AL Control.
    const bool no_error = !e.error_of_some && (!e.status.bit4() || e.code == std::uint16_t{0});
    if (MayLackRequest(e.before_since, e.frame.number) && no_error) {
      NotEvaluable(e.slave, kLoose, e.frame.number);
      return;
    }
    if (e.rose_unasked != 0 && !e.status.bit4() && !e.error_of_some) {
      NotEvaluable(e.slave, RoseUnasked("the slave", e.rose_unasked), e.frame.number);
      return;
    }
    const std::uint64_t key = static_cast<std::uint64_t>(e.before.raw) << 16U | e.status.raw;
    FindingIndex index = Repeat(e.slave, key, e.frame);
    if (index == kNoFinding) {
      Finding finding;
      finding.slave = e.slave;
      finding.first = e.frame;
      AddRelated(finding, e.before_since);
      index = Report(key, std::move(finding));
      if (index == kNoFinding) return;
      if (told_.emplace(index, Told{e, {}}).second) Describe(context().store[index], told_[index]);
    } else {
      AddRelated(context().store[index], e.frame.number);
    }
    open_[e.slave] = index;
    if (e.code && e.status.bit4()) AddCode(index, e.frame, *e.code);
  }

  /// A read of a slave shows what is its own.
  void Flush() {
    for (const model::AlChangedByItself& e : pending_) Tell(e);
    pending_.clear();
  }

  /// Nobody read the slaves: what one broadcast shows of all of them is one matter, of the bus.
  void Settle() {
    if (pending_.empty()) return;
    const auto alike = [&](const model::AlChangedByItself& e) { return e.before.raw == pending_.front().before.raw; };
    if (pending_.size() < context().slave_count() || MissesPackets(context().pairing()) ||
        !std::all_of(pending_.begin(), pending_.end(), alike)) {
      return Flush();
    }
    const model::AlChangedByItself e = pending_.front();
    pending_.clear();
    const std::uint64_t key = kOfAll | static_cast<std::uint64_t>(e.before.raw) << 16U | e.status.raw;
    if (Repeat(kNoSlave, key, e.frame) != kNoFinding) return;
    const std::string from = esc::StatusText(e.before.raw);
    const std::string to = esc::StatusText(e.status.raw);
    const std::string all = "All " + std::to_string(context().slave_count()) + " slaves";
    Finding finding;
    finding.first = e.frame;
    AddRelated(finding, e.before_since);
    finding.title = all + " left " + from + " for " + to + " by themselves, one at least with an error";
    finding.message = all + " were in " + from + " in frame " + std::to_string(e.before_since) + "; from frame " +
                      std::to_string(e.frame.number) + " on a broadcast read of AL Status shows all of them in " + to +
                      ", and the error bit of at least one; no request of the master asked for it. Read AL Status "
                      "(0x0130) and its code (0x0134) from each slave, and look at what happened between these two "
                      "frames.";
    finding.evidence.push_back(HexNumber("al_status_before", e.before.raw));
    finding.evidence.push_back(HexNumber("al_status_of_all", e.status.raw | kErrorBit));
    (void)Report(key, std::move(finding));
  }

  void AddCode(FindingIndex index, const FrameRef& frame, std::uint16_t code) {
    Told& told = told_[index];
    if (told.code) return;
    told.code = code;
    Describe(context().store[index], told);
    AddRelated(context().store[index], frame.number == context().store[index].first.number ? 0 : frame.number);
  }

  void Describe(Finding& finding, const Told& told) const {
    const model::AlChangedByItself& e = told.change;
    const device::DeviceDescription& family = *context().slave(e.slave).profile;
    const std::string from = esc::StatusText(e.before.raw);
    const std::string to = esc::StatusText(e.status.raw);
    finding.title = "Slave left " + from + " for " + to + " by itself";
    if (e.before.state() == e.status.state()) finding.title = "Error bit appeared in " + from + " by itself";
    finding.message = "AL Status was " + from + " in frame " + std::to_string(e.before_since) + " and is " + to +
                      " in frame " + std::to_string(e.frame.number) + "; no request of the master asked for it. ";
    finding.evidence.clear();
    finding.evidence.push_back(HexNumber("al_status_before", e.before.raw));
    finding.evidence.push_back(HexNumber("al_status", e.status.raw));
    if (told.code) {
      finding.title += ", AL status code " + CodeText(*told.code, family);
      finding.message += "AL status code " + CodeText(*told.code, family) + ". ";
      finding.evidence.push_back(HexNumber("al_status_code", *told.code));
      for (const device::SpontaneousAlChange& known : family.al.spontaneous) {
        if (static_cast<std::uint8_t>(known.from) != e.before.state() ||
            static_cast<std::uint8_t>(known.to) != e.status.state() ||
            std::find(known.codes.begin(), known.codes.end(), *told.code) == known.codes.end()) {
          continue;
        }
        finding.message += LawText(family) + " gives as cause: " + known.cause + ". ";
        finding.reference = ReferenceTo(known.source);
        break;
      }
    } else if (e.status.bit4()) {
      finding.message += "The AL status code (0x0134) was not read. ";
    } else if (e.error_of_some) {
      finding.message +=
          "The broadcast that shows it shows the error bit, too: one slave at least has it set, and no read of a "
          "single "
          "slave tells which. ";
    } else if (!esc::IsAlState(e.status.state())) {
      finding.message +=
          "That value is none of 1, 2, 3, 4 and 8: what the slave's processor should write there it did not write, or "
          "not as the standard has it. ";
    } else {
      finding.message += "Without the error bit this is typical of a restart of the slave, or of another master. ";
    }
    finding.message += "Look at what happened between these two frames.";
  }

  static constexpr std::uint64_t kOfAll = std::uint64_t{1} << 40U;
  static constexpr std::uint16_t kErrorBit = 0x10;

  std::vector<model::AlChangedByItself> pending_;  // shown by one broadcast: of all slaves, or to be told one by one
  std::vector<FindingIndex> open_;                 // of each slave: whose repetitions and code are awaited
  std::map<FindingIndex, Told> told_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlUnexpectedChange>};

}  // namespace
}  // namespace ecaudit::al_unexpected_change
