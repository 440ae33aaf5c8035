#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/drive_events.h"
#include "analyzers/model/process_image.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/progress/axis_view.h"
#include "analyzers/progress/progress_model.h"
#include "decoder/base/bytes.h"
#include "decoder/mailbox/events.h"
#include "decoder/track/events.h"

namespace ecaudit::drive_sdo_control_word {
namespace {

constexpr FindingKind kOverwritten{
    .name = "overwritten",
    .title = "Control word {control_word} written by SDO, but {object:number} is mapped",
    .message = R"(The master writes {control_word} to {object} by SDO in {frame}, in OP. The object is in the outputs as
well, and {cyclic_frame} overwrites what the SDO wrote with {cyclic_word}. The drive accepted the download, so the
master gets no error.)",
    .next = "Command the drive in the outputs, or take {object:number} out of the mapping.",
    .identity = "object"};

constexpr FindingKind kSetPoint{
    .name = "set-point-overwritten",
    .title = "{object:number} = {by_sdo} by SDO, but the process data send {cyclic}",
    .message = R"(The master writes {by_sdo} to {object} by SDO in {frame}, in OP. The object is in the outputs as well.
They hold {cyclic} from {cyclic_frame} to {last_cyclic_frame}, for {lasted_ms}. The drive takes its set point from the
outputs. It accepted the download, so the master gets no error.)",
    .next = "Write the set point into the process data, or take {object:number} out of the mapping.",
    .identity = "object"};

constexpr const FindingKind* kKinds[] = {&kOverwritten, &kSetPoint};

constexpr Word kOutputMapping{"output-mapping", "the mapping of the outputs"};

constexpr RuleInfo kInfo{.id = "drive-sdo-control-word",
                         .group = "Drive profile (DS402)",
                         .severity = Severity::kInfo,
                         .title = "A control word or set point is written by SDO while it is in the outputs",
                         .needs = "SDO downloads of these objects, the mapping of the outputs, AL state OP",
                         .source = "AKD-2011, 3.5.3; MKD, 3.7.3",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Downloads of the control word (6040h) and of the targets of position, velocity and torque (607Ah, 60FFh, 6071h, 6042h)
of each axis, in OP, while the outputs hold the same object with another value.

## Why it matters
The next cycle overwrites it. A service tool that enables the drive or resets a fault in this way has no effect, though
each download is accepted.

## How it is decided
- The slave is in OP, and the master exchanges outputs with it.
- The object is in the mapping of the outputs, and the last control word there is another one.
- The next outputs that the slave accepts have another word than the download. They are sent within 1 s after its
  answer: a master that stopped the exchange before overwrites nothing.
- A download that repeats the value of the outputs is ignored.
- One that asks for more than the outputs do (enable) is reported by drive-not-enabled if the drive stays disabled.
- A target is a warning. It counts if the outputs keep one other value for 100 ms after the download: a master that
  changes the target in the outputs uses these. The drive has to be enabled.

## Example
tests/rules/drive-sdo-control-word/violates.trace

## What to do
Command the drive in the outputs only. To work with a service tool, stop the cyclic exchange first.
)"};

class DriveSdoControlWord final : public Rule {
 public:
  DriveSdoControlWord() : Rule(kInfo) {
    Subscribe<mailbox::SdoTransfer>(&DriveSdoControlWord::On);
    Subscribe<model::OutputsTaken>(&DriveSdoControlWord::On);
    Subscribe<track::CaptureGap>(&DriveSdoControlWord::On);
    Subscribe<track::RunBegan>(&DriveSdoControlWord::On);
  }

  void On(const track::CaptureGap&) { Forget(); }
  void On(const track::RunBegan&) { Forget(); }

  void On(const mailbox::SdoTransfer& t) {
    if (t.service != mailbox::SdoService::kDownload || !t.has_object || t.subindex != 0) return;
    const auto axis = progress::AxisOf(t.index);
    if (axis && IsTarget(axis->second)) return TakeTarget(t, axis->first);
    if (!axis || axis->second != model::kControlWord || t.data.size() != sizeof(std::uint16_t)) return;
    const model::SlaveModel& slave = context().slave(t.slave);
    if (t.outcome != mailbox::SdoOutcome::kCompleted || !slave.al.SettledIn(esc::AlState::OP)) return;
    const model::ProcessLayout& outputs = slave.process.rx();
    if (slave.outputs.exchanged == 0) return;
    if (!outputs.known()) {
      NotEvaluable(t.slave, ReasonCode::kNotInCapture, kOutputMapping, t.request.number);
      return;
    }
    const progress::AxisWatch* const watch = context().progress().axis(t.slave, axis->first);
    if (outputs.Find(t.index, 0) == nullptr || watch == nullptr || !watch->now().control) return;
    const auto word = LittleEndian<std::uint16_t>(t.data, 0);
    const std::uint16_t cyclic = *watch->now().control;
    const bool enables = (word & ~cyclic & progress::kEnableWord) != 0;
    // The word of the last download is what the next outputs overwrite.
    std::erase_if(written_, [&](const Written& other) { return other.slave == t.slave && other.index == t.index; });
    if (word == cyclic || enables || written_.size() >= kMostWritten) return;
    written_.push_back({t.slave, t.index, axis->first, word, t.request, t.response, watch->now().control_since.number,
                        outputs.assumed ? Confidence::kInferred : ConfidenceOf(t.certainty)});
  }

  void On(const model::OutputsTaken& e) {
    if (!written_.empty()) Compare(e.cycle);
    if (!targets_.empty()) CompareTargets(e.cycle);
  }

 private:
  static constexpr std::size_t kMostWritten = 1024;
  /// Outputs that come later are those of a master that had stopped them.
  static constexpr TimeNs kSoonNs = 1'000'000'000;
  /// For so long the outputs have to keep another target.
  static constexpr TimeNs kKeptNs = 100'000'000;

  /// A control word by SDO, until the next outputs with this object.
  struct Written {
    SlaveId slave = kNoSlave;
    std::uint16_t index = 0;
    std::uint8_t axis = 0;
    std::uint16_t word = 0;
    FrameRef request, answer;
    FrameNo cyclic_since = 0;  ///< frame since which the outputs had their word
    Confidence confidence = Confidence::kObserved;
  };

  /// A target by SDO, and what the outputs hold for it since.
  struct Target {
    SlaveId slave = kNoSlave;
    std::uint16_t index = 0;
    std::uint8_t axis = 0;
    std::uint64_t raw = 0;
    unsigned bits = 0;  ///< of the object, at most 64
    FrameRef request, answer;
    std::optional<std::uint64_t> cyclic;
    FrameRef since;  ///< of `cyclic`
    Confidence confidence = Confidence::kObserved;
  };

  static bool IsTarget(std::uint16_t object) {
    constexpr std::array<std::uint16_t, 4> kTargets{0x6042, 0x6071, 0x607A, 0x60FF};
    return std::find(kTargets.begin(), kTargets.end(), object) != kTargets.end();
  }

  void Forget() {
    written_.clear();
    targets_.clear();
  }

  void TakeTarget(const mailbox::SdoTransfer& t, std::uint8_t axis) {
    std::erase_if(targets_, [&](const Target& other) { return other.slave == t.slave && other.index == t.index; });
    const model::SlaveModel& slave = context().slave(t.slave);
    const model::ProcessLayout& outputs = slave.process.rx();
    const model::Signal* const signal = outputs.Find(t.index, 0);
    if (t.outcome != mailbox::SdoOutcome::kCompleted || !slave.al.SettledIn(esc::AlState::OP) || signal == nullptr)
      return;
    const bool number = !t.data.empty() && t.data.size() == t.size && t.size <= sizeof(std::uint64_t);
    if (!number || 8 * t.size != signal->bits || targets_.size() >= kMostWritten) return;
    targets_.push_back({t.slave,
                        t.index,
                        axis,
                        UnsignedOf(t.data),
                        signal->bits,
                        t.request,
                        t.response,
                        std::nullopt,
                        {},
                        outputs.assumed ? Confidence::kInferred : ConfidenceOf(t.certainty)});
  }

  /// The outputs go on with one other value: nothing of the download is left.
  [[gnu::noinline]] void CompareTargets(const model::ProcessCycle& cycle) {
    std::erase_if(targets_, [&](Target& target) {
      const FrameRef& sent = cycle.sent.seen() ? cycle.sent : cycle.frame();
      if (target.slave != cycle.part.slave || sent.number <= target.answer.number) return false;
      const std::optional<std::uint64_t> value = cycle.Value(target.index, 0);
      if (!value) return false;
      const progress::AxisWatch* const axis = context().progress().axis(target.slave, target.axis);
      const bool enabled = axis != nullptr && axis->now().enabled();
      const bool other = !target.cyclic || *value == *target.cyclic;
      if (*value == target.raw || !other || !enabled || !sent.has_time) return true;
      if (!target.cyclic) {
        target.cyclic = value;
        target.since = sent;
      }
      const TimeNs held = Elapsed(target.since.time, sent.time);
      if (held < kKeptNs) return false;
      ReportTarget(target, sent, held);
      return true;
    });
  }

  void ReportTarget(const Target& target, const FrameRef& last, TimeNs held) {
    const std::uint64_t key = std::uint64_t{target.index} << 32U | AxisKey(target.axis);
    if (Repeat(target.slave, key, target.request) != kNoFinding) return;
    const model::SlaveModel& slave = context().slave(target.slave);
    Finding finding = Found(kSetPoint, target.slave, target.request);
    finding.confidence = target.confidence;
    finding.Set("object", arg::Object(target.index, 0, slave.profile->object_name(target.index, 0)))
        .Set("by_sdo", arg::Number(SignExtend(target.raw, target.bits)))
        .Set("cyclic", arg::Number(SignExtend(*target.cyclic, target.bits)))
        .Set("cyclic_frame", arg::Frame(target.since.number))
        .Set("last_cyclic_frame", arg::Frame(last.number))
        .Set("lasted_ms", arg::Ms(held));
    if (slave.profile->drive) finding.reference = ReferenceTo(slave.profile->drive->source);
    NameAxis(finding, target.axis);
    AddRelated(finding, target.since.number);
    AddRelated(finding, last.number);
    (void)Report(key, Severity::kWarning, std::move(finding));
  }

  /// With the word that the outputs hold.
  [[gnu::noinline]] void Compare(const model::ProcessCycle& cycle) {
    std::erase_if(written_, [&](const Written& written) {
      const FrameRef& sent = cycle.sent.seen() ? cycle.sent : cycle.frame();
      if (written.slave != cycle.part.slave || sent.number <= written.answer.number) return false;
      const std::optional<std::uint64_t> word = cycle.Value(written.index, 0);
      if (!word) return false;
      const bool timed = written.answer.has_time && sent.has_time;
      const bool goes_on = !timed || Elapsed(written.answer.time, sent.time) <= kSoonNs;
      const bool in_op = context().slave(written.slave).al.SettledIn(esc::AlState::OP);
      if (goes_on && in_op && *word != written.word) ReportOverwritten(written, *word, sent);
      return true;
    });
  }

  void ReportOverwritten(const Written& written, std::uint64_t cyclic, const FrameRef& frame) {
    if (Repeat(written.slave, AxisKey(written.axis), written.request) != kNoFinding) return;
    Finding finding = Found(kOverwritten, written.slave, written.request);
    finding.confidence = written.confidence;
    finding.Set("control_word", arg::Hex(written.word))
        .Set("object", arg::Object(written.index))
        .Set("cyclic_word", arg::Hex(cyclic, 4))
        .Set("cyclic_frame", arg::Frame(frame.number));
    const device::DeviceDescription& family = *context().slave(written.slave).profile;
    if (family.drive) finding.reference = ReferenceTo(family.drive->source);
    NameAxis(finding, written.axis);
    AddRelated(finding, written.cyclic_since);
    AddRelated(finding, frame.number);
    (void)Report(AxisKey(written.axis), std::move(finding));
  }

  std::vector<Written> written_;
  std::vector<Target> targets_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveSdoControlWord>};

}  // namespace
}  // namespace ecaudit::drive_sdo_control_word
