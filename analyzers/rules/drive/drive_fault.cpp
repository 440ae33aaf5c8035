#include <map>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/drive_text.h"
#include "decoder/base/text.h"

namespace ecaudit::drive_fault {
namespace {

constexpr RuleInfo kInfo{.id = "drive-fault",
                         .group = "Drive profile (DS402)",
                         .severity = Severity::kError,
                         .needs_no_history = true,
                         .title = "The drive goes into a fault, or is in one when first seen",
                         .needs = "status word 6041h, in the process data or by SDO",
                         .source = "CIA402, state machine; AKD-2011, 4.4; MKD, 4.4; PILZ, 4.4",
                         .doc = R"(
## What it checks
Whether the status word (6041h) changes to Fault reaction active or Fault, or shows one of them from the first status
word on, and what the drive says about the reason.

## Why it matters
The axis brakes by itself and loses its torque. Until the fault is reset the drive takes no other command.

## How it is decided
A change from a state that is none of the two; Fault reaction active followed by Fault is one fault. Explanations are an
emergency message from one second before the fault until it is left, the error code 603Fh, the error history 1003h:1
and fault numbers (2001h of the MKD) read while it lasts. caused_by names the finding of the emergency; where the
drive gave no reason, that of the lost synchronisation or of the pause of its process data just before. The same reason
again counts as repetition. A drive that is in a fault when its status word is first seen (a word of 0 before it is what
unused memory holds) is one as well: the fault *stands* since before the capture saw it, and the finding says whether it
was reset later. Captures that begin in operation need to know where the status word lies: an ENI or ESI file tells.
Inputs count where the working counter says that the slave gave them: not where it is made up as well by others alone,
for what comes back then may be the master's own words. A status word that is read by SDO counts where none is mapped,
or no inputs came for 100 ms. Each axis of a drive with several (6841h, 7041h, ...) is followed by itself, by this rule
and by the others of the group; the axis is named, behind the first one. No emergency says which axis it is about.

## Example
samples/captures/drive-fault.pcapng, and samples/captures/drive-in-fault.pcapng for one that stands

## What to do
Correct what the code names, then reset the fault: bit 7 of the control word from 0 to 1. Where the capture has no code,
read 1003h:1 (MKD also 2001h) or let the master fetch emergency messages.
)"};

class DriveFault final : public Rule {
 public:
  DriveFault() : Rule(kInfo) {
    Subscribe<model::DriveStateChanged>(&DriveFault::On);
    Subscribe<model::DriveFaultExplained>(&DriveFault::On);
  }

  void On(const model::DriveStateChanged& e) {
    if (!e.to) return;
    if (!IsFault(*e.to)) {
      Close({e.slave, e.axis}, e.frame.number);
      return;
    }
    if (e.from && IsFault(*e.from)) {
      const auto open = open_.find({e.slave, e.axis});
      if (open != open_.end() && *e.to == device::DriveState::kFault) open->second.fault = e.frame.number;
      return;
    }
    open_[{e.slave, e.axis}] = Open{e, {}, 0, !e.from || e.first_zero};
  }

  void On(const model::DriveFaultExplained& e) {
    const auto open = open_.find({e.slave, e.axis});
    if (open == open_.end() || open->second.explanations.size() >= kMaxExplanations) return;
    for (const model::DriveFaultExplained& known : open->second.explanations) {
      if (known.source == e.source && known.object == e.object && known.code == e.code) return;
    }
    open->second.explanations.push_back(e);
  }

  void Finish() override {
    while (!open_.empty()) Close(open_.begin()->first);
    for (const auto& [index, emergency] : emergencies_) LinkEmergency(index, emergency);
    NotEvaluableFor([](const model::SlaveModel& slave) { return DriveWordsMissing(slave, false); });
  }

 private:
  static constexpr std::size_t kMaxExplanations = 8;
  using Axis = std::pair<SlaveId, std::uint8_t>;
  struct Open {
    model::DriveStateChanged change;
    std::vector<model::DriveFaultExplained> explanations;
    FrameNo fault = 0;    ///< status word that showed Fault behind Fault reaction active
    bool stands = false;  ///< since before the drive was first seen
  };

  static bool IsFault(device::DriveState state) {
    return state == device::DriveState::kFault || state == device::DriveState::kFaultReactionActive;
  }

  /// All is known that the capture tells of this fault.
  /// @param left  status word that shows another state; 0: the capture ends with the fault
  void Close(const Axis& axis, FrameNo left = 0) {
    const auto found = open_.find(axis);
    if (found == open_.end()) return;
    const Open open = std::move(found->second);
    open_.erase(found);
    const model::DriveStateChanged& e = open.change;
    const SlaveId slave = e.slave;
    std::uint64_t key = 0;
    if (!open.explanations.empty()) {
      const model::DriveFaultExplained& first = open.explanations.front();
      key = (std::uint64_t{first.object} << 40U) + (std::uint64_t{first.code} << 8U) +
            static_cast<std::uint8_t>(first.source) + 1U;
    }
    if (open.stands) key |= 1ULL << 63U;
    key |= AxisKey(e.axis);
    if (Repeat(slave, key, e.frame) != kNoFinding) return;
    const device::DeviceDescription& family = *context().slave(slave).profile;
    Finding finding;
    finding.slave = slave;
    finding.first = e.frame;
    finding.confidence = e.inferred ? Confidence::kInferred : Confidence::kObserved;
    TellState(finding, open, left);
    TellReasons(finding, open, family);
    finding.reference = ReferenceTo(family.drive->source);
    NameAxis(finding, e.axis);
    const FindingIndex index = Report(key, std::move(finding));
    if (index == kNoFinding) return;
    for (const model::DriveFaultExplained& reason : open.explanations) {
      if (reason.source != model::DriveFaultExplained::Source::kEmergency) continue;
      emergencies_.emplace(index, reason.frame.number);
      break;
    }
  }

  /// What the status word shows, and how long.
  static void TellState(Finding& finding, const Open& open, FrameNo left) {
    const model::DriveStateChanged& e = open.change;
    if (open.stands) {
      finding.title = StateText(e.to) + " stands since before the capture saw the drive";
      finding.message = "The first status word, in frame " + std::to_string(e.frame.number) + ", shows " +
                        StateText(e.to) + " (" + Hex(e.word) + "): how it began is not in the capture";
    } else {
      finding.title = StateText(e.to) + " from " + StateText(e.from);
      finding.message = "The status word shows " + StateText(e.from) + " up to frame " + std::to_string(e.from_last) +
                        " and " + StateText(e.to) + " (" + Hex(e.word) + ") in frame " + std::to_string(e.frame.number);
    }
    if (open.fault != 0) finding.message += ", Fault in frame " + std::to_string(open.fault);
    finding.message += ". ";
    finding.evidence.push_back(HexNumber("status_word", e.word));
    if (!open.stands) finding.evidence.push_back(Text("state_before", StateText(e.from)));
    finding.evidence.push_back(Text("state", StateText(e.to)));
    if (!open.stands) {
      AddRelated(finding, e.from_last);
    } else if (left != 0) {
      finding.message += "It is left in frame " + std::to_string(left) + ". ";
      AddRelated(finding, left);
    } else {
      finding.message += "It lasts until the capture ends. ";
    }
  }

  /// What the drive itself says of it.
  static void TellReasons(Finding& finding, const Open& open, const device::DeviceDescription& family) {
    if (open.explanations.empty()) {
      const std::uint8_t axis = open.change.axis;
      const std::string objects = FaultObjectsText(*family.drive, axis);
      finding.message += "The drive's own reason is not in the capture: no emergency message";
      if (!objects.empty()) {
        finding.message += ", and none of " + objects + " was read. Read " + FaultObjectToRead(*family.drive, axis) +
                           " from the drive, correct the cause, then reset the fault.";
      } else {
        finding.message += ". Let the master fetch them, correct the cause, then reset the fault.";
      }
      return;
    }
    finding.message += "The drive's reason: ";
    for (std::size_t i = 0; i < open.explanations.size(); ++i) {
      const model::DriveFaultExplained& reason = open.explanations[i];
      finding.message +=
          (i == 0 ? "" : "; ") + FaultText(family, reason) + " (frame " + std::to_string(reason.frame.number) + ")";
      AddRelated(finding, reason.frame.number == open.change.frame.number ? 0 : reason.frame.number);
    }
    finding.message += ". Correct it, then reset the fault.";
    const model::DriveFaultExplained& first = open.explanations.front();
    finding.title += ": " + FaultText(family, first);
    finding.evidence.push_back(HexNumber("fault_code", first.code));
  }

  void LinkEmergency(FindingIndex index, FrameNo frame) {
    const std::vector<Finding>& findings = context().store.findings();
    for (FindingIndex i = 0; i < findings.size(); ++i) {
      const Finding& other = findings[i];
      if (other.rule != "emcy-received" || other.slave != findings[index].slave) continue;
      const bool same = other.first.number == frame || other.last.number == frame;
      if (!same || other.caused_by == index) continue;
      context().store[index].caused_by = i;
      return;
    }
  }

  std::map<Axis, Open> open_;
  std::map<FindingIndex, FrameNo> emergencies_;  // finding, frame of the emergency that explains it
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveFault>};

}  // namespace
}  // namespace ecaudit::drive_fault
