#include <algorithm>
#include <array>
#include <map>
#include <utility>
#include <vector>

#include "analyzers/judge/axis_lead.h"
#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/progress/progress_model.h"
#include "analyzers/sync/sync_model.h"
#include "analyzers/words/drive_text.h"
#include "decoder/base/time.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::drive_fault {
namespace {

constexpr FindingKind kFault{
    .name = "fault",
    .title =
        "{state} from {state_before}[: {fault}]"
        "[{?pause_ms}[{?fault} after a pause of {pause_ms}][{!fault} after {pause_ms} without process data]]"
        "[{!pause_ms}[ after {sign}]]",
    .message =
        R"(The status word shows {state_before} up to {before_frame} and {state} ({status_word}) in {frame}[, Fault in
{fault_frame}].[{!fault} The capture does not hold the reason of the drive: no emergency message[, and no read of
{fault_objects}].][ From {pause_from_frame} to {pause_to_frame} it holds no process data of any slave, for {pause_ms}. The process data watchdog
of the drive is {watchdog_ms}.[{?shorter} A drive may supervise its cycle more closely than that.]])",
    .next =
        "[{?pause_ms}Find out why the master stopped sending.][{!pause_ms}[{!fault}Read {fault_object} from the "
        "drive.]] Reset the fault (rising edge of bit 7) after its cause is corrected.",
    .identity = "state fault_code",
    .next_stays = true};
constexpr FindingKind kAlreadyInFault{
    .name = "already-in-fault",
    .title = "Drive already in {state} when first seen[: {fault}]",
    .message =
        R"(The first status word, in {frame}, shows {state} ({status_word})[, Fault in {fault_frame}]. The capture does
not hold how it began.[ The drive leaves it in {left_frame}.][{!left_frame} It lasts until the capture ends.][{!fault} The
capture does not hold the reason of the drive: no emergency message[, and no read of {fault_objects}].])",
    .next =
        "[{!fault}Read {fault_object} from the drive.] Reset the fault (rising edge of bit 7) after its cause is "
        "corrected.",
    .identity = "state fault_code",
    .next_stays = true};
constexpr const FindingKind* kKinds[] = {&kFault, &kAlreadyInFault};

constexpr NoteKind kReported{.name = "reported", .text = "The drive reports {fault} ({at})."};
constexpr const NoteKind* kNotes[] = {&kReported, &kLeadNote};

// The emergency names the reason.
constexpr std::string_view kAfter[] = {"emcy-received"};

constexpr RuleInfo kInfo{.id = "drive-fault",
                         .group = "Drive profile (DS402)",
                         .severity = Severity::kError,
                         .history = History::kNone,
                         .title = "The drive goes into a fault, or is in one when first seen",
                         .needs = "status word 6041h, in the process data or by SDO",
                         .source = "CIA402, state machine; AKD-2011, 4.4; MKD, 4.4; PILZ, 4.4",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Whether the status word (6041h) changes to Fault reaction active or Fault, or shows one of them from the first status
word on, and which reason the drive reports.

## Why it matters
The axis brakes by itself and loses its torque. Until the fault is reset, the drive accepts no other command.

## How it is decided
A change from a state that is none of the two. Fault reaction active followed by Fault is one fault.

- Reasons are an emergency message from one second before the fault until the drive leaves it, and the error code 603Fh,
  the error history 1003h:1 and the family's fault list read while it lasts. The same reason again counts as repetition.
- Process data show what the drive received up to 50 ms before: control word, status word, mode, set point and actual
  value are in a note. The title names an active internal limit or a warning of the last status word before the fault
  if the drive gives no reason.
- caused_by names the finding of the emergency. If the drive gave no reason, it names the lost synchronisation or the
  pause of the process data just before.
- If it gave none, or only a code of the manufacturer without a known meaning, a pause right before the fault is named:
  no process data of any slave for longer than its watchdog, or for 10 ms and four times as long as usual.
- A drive that is in a fault when its status word is first seen is one as well. A word of 0 before it is the content of
  unused memory. The finding shows whether the fault was reset later.
- A mid-run capture needs to know where the status word is mapped: give an ENI or ESI file.
- Inputs count if the working counter shows that the slave gave them. They do not count if other slaves alone can
  explain the working counter: the data may be the master's own.
- A status word read by SDO counts if none is mapped, or no inputs arrived for 100 ms.
- Each axis of a drive with several (6841h, 7041h, ...) is followed by itself, by this rule and by the others of the
  group. An emergency does not name its axis.

## Example
samples/captures/drive-fault.pcapng, and samples/captures/drive-in-fault.pcapng for one that was active before

## What to do
Correct what the code names, then reset the fault: bit 7 of the control word from 0 to 1. If the capture has no code,
read 1003h:1 or the fault list of the family, or let the master fetch emergency messages.
)"};

class DriveFault final : public Rule {
 public:
  DriveFault() : Rule(kInfo) {
    Subscribe<model::DriveStateChanged>(&DriveFault::On);
    Subscribe<model::DriveFaultExplained>(&DriveFault::On);
    Subscribe<track::LogicalAccess>(&DriveFault::On);
  }

  void On(const track::LogicalAccess& e) {
    const FrameRef& frame = e.sent.seen() ? e.sent : e.returned;
    if (last_.seen() && last_.has_time && frame.has_time && frame.number > last_.number) {
      const TimeNs apart = Elapsed(last_.time, frame.time);
      if (apart >= kLeastPause) pauses_[next_pause_++ % pauses_.size()] = {last_.number, frame.number, apart};
    }
    last_ = frame;
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
    Open open{e, {}, 0, !e.from || e.first_zero, {}, 0};
    if (!open.stands) FindPause(open);
    open_[{e.slave, e.axis}] = std::move(open);
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
  static constexpr TimeNs kLeastPause = 1'000'000;  // no shorter watchdog is set
  using Axis = std::pair<SlaveId, std::uint8_t>;
  /// No process data of any slave.
  struct Pause {
    FrameNo from = 0, to = 0;
    TimeNs ns = 0;
  };
  struct Open {
    model::DriveStateChanged change;
    std::vector<model::DriveFaultExplained> explanations;
    FrameNo fault = 0;    ///< status word that showed Fault after Fault reaction active
    bool stands = false;  ///< already active when the drive was first seen
    Pause pause;          ///< longer than the watchdog, while the fault came; `from` 0: none
    TimeNs watchdog_ns = 0;
  };

  /// The longest pause between the last status word without fault and the first with one.
  void FindPause(Open& open) const {
    const TimeNs watchdog = context().sync().outputs(open.change.slave).watchdog_ns;
    const auto uncertainty = context().sync().Uncertainty(sync::TimeBase::kCapture);
    if (watchdog <= 0 || !uncertainty) return;
    for (const Pause& pause : pauses_) {
      if (pause.to <= open.change.from_last || pause.to > open.change.frame.number) continue;
      if (pause.ns - *uncertainty < watchdog || pause.ns <= open.pause.ns) continue;
      // They were sent: frame-lost reports that.
      if (context().sync().UnreturnedBetween(open.change.slave, pause.from, pause.to) > 0) continue;
      open.pause = pause;
      open.watchdog_ns = watchdog;
    }
    if (open.pause.from == 0) FindShortPause(open, watchdog);
  }

  /// One that stands out, though it is shorter than the watchdog.
  void FindShortPause(Open& open, TimeNs watchdog) const {
    const auto pause = context().sync().pauses().LongestBetween(open.change.from_last, open.change.frame);
    if (!pause || context().network().MayMissBetween(pause->from.number, pause->to.number)) return;
    if (context().sync().UnreturnedBetween(open.change.slave, pause->from.number, pause->to.number) > 0) return;
    open.pause = {pause->from.number, pause->to.number, pause->length()};
    open.watchdog_ns = watchdog;
  }

  static bool IsFault(device::DriveState state) {
    return state == device::DriveState::kFault || state == device::DriveState::kFaultReactionActive;
  }

  /// All is known that the capture shows of this fault.
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
    if (const FindingIndex again = Repeat(slave, key, e.frame); again != kNoFinding) {
      context().store[again].until = left != 0 ? left : Finding::kCaptureEnds;
      return;
    }
    const device::DeviceDescription& family = *context().slave(slave).profile;
    Finding finding = Found(open.stands ? kAlreadyInFault : kFault, slave, e.frame);
    finding.confidence = e.inferred ? Confidence::kInferred : Confidence::kObserved;
    DescribeState(finding, open, left);
    DescribeReasons(finding, open, family);
    const progress::AxisWatch* const axis_watch = context().progress().axis(slave, e.axis);
    const progress::AxisLead* const lead = axis_watch != nullptr ? axis_watch->LeadToFault(e.frame.number) : nullptr;
    if (lead != nullptr) {
      AddLead(finding, *lead, family, e.axis);
      if (open.explanations.empty()) NameSign(finding, *lead);
    }
    finding.reference = ReferenceTo(family.drive->source);
    NameAxis(finding, e.axis);
    finding.until = left != 0 ? left : Finding::kCaptureEnds;
    const FindingIndex index = Report(key, std::move(finding));
    if (index == kNoFinding) return;
    for (const model::DriveFaultExplained& reason : open.explanations) {
      if (reason.source != model::DriveFaultExplained::Source::kEmergency) continue;
      emergencies_.emplace(index, reason.frame.number);
      break;
    }
  }

  /// What the status word shows, and how long.
  static void DescribeState(Finding& finding, const Open& open, FrameNo left) {
    const model::DriveStateChanged& e = open.change;
    finding.Set("status_word", arg::Hex(e.word));
    if (!open.stands) finding.Set("state_before", StateValue(e.from));
    finding.Set("state", StateValue(e.to));
    if (open.fault != 0) finding.Set("fault_frame", arg::Frame(open.fault));
    if (!open.stands) {
      finding.Set("before_frame", arg::Frame(e.from_last));
      AddRelated(finding, e.from_last);
    } else if (left != 0) {
      finding.Set("left_frame", arg::Frame(left));
      AddRelated(finding, left);
    }
  }

  static void AddPause(Finding& finding, const Open& open) {
    if (open.pause.from == 0) return;
    finding.Set("pause_ms", arg::Ms(open.pause.ns))
        .Set("pause_from_frame", arg::Frame(open.pause.from))
        .Set("pause_to_frame", arg::Frame(open.pause.to))
        .Set("watchdog_ms", arg::Ms(open.watchdog_ns))
        .Set("shorter", arg::Flag(open.pause.ns < open.watchdog_ns));
    AddRelated(finding, open.pause.from);
    AddRelated(finding, open.pause.to);
  }

  /// What the drive itself reports as the reason.
  static void DescribeReasons(Finding& finding, const Open& open, const device::DeviceDescription& family) {
    if (open.explanations.empty() || IsUnexplained(family, open.explanations.front().code)) AddPause(finding, open);
    if (open.explanations.empty()) {
      const device::DriveProfile& drive = *family.drive;
      if (!drive.fault_objects.empty()) {
        finding.Set("fault_objects", arg::List(FaultObjects(drive, open.change.axis)));
      }
      if (const device::FaultObject* first = ToRead(drive)) {
        finding.Set("fault_object", arg::Object(model::ObjectForAxis(first->index, open.change.axis), first->subindex));
      }
      return;
    }
    for (const model::DriveFaultExplained& reason : open.explanations) {
      finding.Add(kReported,
                  {{"fault", arg::Text(FaultText(family, reason))}, {"at", arg::Frame(reason.frame.number)}});
      AddRelated(finding, reason.frame.number == open.change.frame.number ? 0 : reason.frame.number);
    }
    const model::DriveFaultExplained& first = open.explanations.front();
    finding.Set("fault_code", arg::Hex(first.code)).Set("fault", arg::Text(FaultText(family, first)));
  }

  /// What the last status word before the fault showed besides its state.
  static void NameSign(Finding& finding, const progress::AxisLead& lead) {
    static constexpr Word kLimit{"internal-limit", "an internal limit (status bit 11)"};
    static constexpr Word kWarning{"warning", "a warning (status bit 7)"};
    constexpr std::uint16_t kLimitBit = 0x0800, kWarningBit = 0x0080;
    const std::uint16_t status = lead.last.status.value_or(0);
    if ((status & kLimitBit) != 0) {
      finding.Set("sign", arg::Of(kLimit));
    } else if ((status & kWarningBit) != 0) {
      finding.Set("sign", arg::Of(kWarning));
    }
  }

  /// Where the reason of a fault can be read.
  static std::vector<Value> FaultObjects(const device::DriveProfile& drive, std::uint8_t axis) {
    std::vector<Value> objects;
    for (const device::FaultObject& object : drive.fault_objects) {
      objects.push_back(arg::Object(model::ObjectForAxis(object.index, axis)));
    }
    return objects;
  }

  /// The object to read first: the error history, if the drive has one. Null if it has none at all.
  static const device::FaultObject* ToRead(const device::DriveProfile& drive) {
    const auto& objects = drive.fault_objects;
    const auto history = std::find_if(objects.begin(), objects.end(), [](const device::FaultObject& object) {
      return object.kind == device::FaultValue::kErrorHistory;
    });
    if (history != objects.end()) return &*history;
    return objects.empty() ? nullptr : &objects.front();
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

  FrameRef last_;                   // with process data
  std::array<Pause, 16> pauses_{};  // the newest
  std::size_t next_pause_ = 0;
  std::map<Axis, Open> open_;
  std::map<FindingIndex, FrameNo> emergencies_;  // finding, frame of the emergency that explains it
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveFault>};

}  // namespace
}  // namespace ecaudit::drive_fault
