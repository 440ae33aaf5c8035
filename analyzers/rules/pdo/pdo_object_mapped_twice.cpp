#include <map>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/judge/pdo_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/shared_notes.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_text.h"
#include "analyzers/words/what.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit::pdo_object_mapped_twice {
namespace {

/// Data types as objects: masters and slaves fill gaps with them.
constexpr std::uint16_t kLastDummyObject = 0x001F;

constexpr FindingKind kMappedTwice{
    .name = "mapped-twice",
    .title = "{object:number} is mapped {times} in the {direction} PDOs",
    .message = R"(The master requests SAFEOP in {frame}. At this time {object} is mapped {times} in the PDOs that
{assignment} assigns: in {pdos}.[{?own_default} The master keeps this default of the drive.] [{?rx}The manual does not
define which of the values the drive uses.][{!rx}The drive sends the value several times in each cycle.])",
    .next =
        "Assign only the PDOs that are needed, in PREOP: write 0 to {assignment}:0, then the PDOs, then their number.",
    .identity = "object direction"};
constexpr const FindingKind* kKinds[] = {&kMappedTwice};

constexpr NoteKind kRefusedLater{
    .name = "refused",
    .text =
        "The slave then refused SAFEOP with AL status code {al_status_code}. That this is the reason is an "
        "inference."};
constexpr const NoteKind* kNotes[] = {&kRefusedLater};

// ExplainRequest(): the later rule names the nearer cause.
constexpr std::string_view kAfter[] = {"pdo-not-mappable"};

constexpr RuleInfo kInfo{.id = "pdo-object-mapped-twice",
                         .group = "PDO mapping",
                         .severity = Severity::kWarning,
                         .title = "An object is mapped more than once in one direction",
                         .needs = "the assignment and the contents of the assigned PDOs",
                         .source = "ETG1000.6, PDO mapping; MKD, 4.6",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .after = kAfter,
                         .doc = R"(
## What it checks
When SAFEOP is requested: whether an object (index and subindex) is mapped more than once in the assigned Rx PDOs, or
more than once in the assigned Tx PDOs.

## Why it matters
If an object has several outputs, the last one wins, and the master does not know which one that is. A drive may refuse
SAFEOP for it. It is typical of a default assignment of all PDOs that a master keeps.

## How it is decided
From SDO transfers in the capture, or an ENI file.

- Gaps (index 0), data-type dummies (up to 001Fh) and the padding objects of the manual do not count.
- A default of the drive that the master keeps is marked inferred. If the drive goes to SAFEOP with it, the finding
  becomes an info.
- If SAFEOP is refused with 0x0017, 0x001D, 0x001E, 0x0024 or 0x0025 and has no other cause, the refusal names this
  finding as its cause, as an inference.

## Example
samples/captures/pdo-mapped-twice.pcapng

## What to do
Assign only the PDOs that are needed: write 0 to 1C12h:0 (1C13h:0), the PDO indices, and their number.
)"};

class PdoObjectMappedTwice final : public PdoRule {
 public:
  using PdoRule::On;
  PdoObjectMappedTwice() : PdoRule(kInfo, WhenAccepted::kStays) {
    Subscribe<model::AlErrorCode>(&PdoObjectMappedTwice::On);
  }

  void On(const model::AlAnswered& e) override {
    PdoRule::On(e);
    defaults_.On(context(), e);
    if (const auto confirmed = suspicions_.On(context(), e)) Blame(e.slave, *confirmed);
  }
  void On(const model::AlErrorCode& e) {
    if (const auto confirmed = suspicions_.On(context(), e)) Blame(e.slave, *confirmed);
  }

 private:
  /// How often one object is mapped, and in which PDOs.
  struct Times {
    std::uint32_t count = 0;
    std::vector<std::uint16_t> pdos;
    std::string name;
  };

  void OnSafeopRequest(const model::AlRequestJudged& e) override {
    std::vector<MappingSuspicions::Suspect> suspects;
    for (const auto direction : {device::PdoDirection::kRx, device::PdoDirection::kTx}) {
      const model::ProcessLayout& layout = context().slave(e.slave).process.Layout(direction);
      const bool given = layout.source == model::LayoutSource::kObserved || layout.source == model::LayoutSource::kEni;
      if (!given || !layout.known()) {
        NotEvaluable(e.slave, ReasonCode::kNotInCapture, what::kMapping, e.request.frame.number);
        continue;
      }
      std::map<std::pair<std::uint16_t, std::uint8_t>, Times> objects;
      for (const model::Signal& signal : layout.signals) {
        if (signal.index <= kLastDummyObject || IsPadding(e.slave, direction, signal)) continue;
        Times& times = objects[{signal.index, signal.subindex}];
        ++times.count;
        times.pdos.push_back(signal.pdo);
        times.name = signal.name;
      }
      for (const auto& [object, times] : objects) {
        if (times.count < 2) continue;
        const FindingIndex index = ReportObject(e, direction, layout, object, times);
        suspects.push_back({direction,
                            &kObjectTwiceMayExplain,
                            {{"object", arg::Object(object.first, object.second)},
                             {"times", arg::Count(times.count, "time")},
                             {"direction", PdoDirectionValue(direction)}},
                            false});
        findings_[{e.slave, direction}] = index;
      }
    }
    suspicions_.Add(e.slave, e.request.frame, std::move(suspects));
  }

  [[nodiscard]] bool IsPadding(SlaveId slave, device::PdoDirection direction, const model::Signal& signal) const {
    const auto& free = context().slave(slave).profile->pdo.flexible;
    if (!free) return false;
    for (const device::Padding& padding : free->paddings) {
      if (padding.direction == direction && padding.index == signal.index &&
          signal.subindex >= padding.first_subindex && signal.subindex <= padding.last_subindex) {
        return true;
      }
    }
    return false;
  }

  FindingIndex ReportObject(const model::AlRequestJudged& e, device::PdoDirection direction,
                            const model::ProcessLayout& layout, const std::pair<std::uint16_t, std::uint8_t>& object,
                            const Times& times) {
    const bool rx = direction == device::PdoDirection::kRx;
    const bool written = WrittenByMaster(e.slave, direction, layout.pdos);
    const std::uint64_t key = std::uint64_t{object.first} << 32U | std::uint64_t{object.second} << 24U |
                              std::uint64_t{times.count} << 8U | (rx ? 2U : 0U) | (written ? 1U : 0U);
    FindingIndex index = Repeat(e.slave, key, e.request.frame);
    if (index == kNoFinding) {
      Finding finding = Found(kMappedTwice, e.slave, e.request.frame);
      finding.Set("object", arg::Object(object.first, object.second, times.name))
          .Set("times", arg::Count(times.count, "time"))
          .Set("pdos", PdosValue(times.pdos))
          .Set("direction", PdoDirectionValue(direction))
          .Set("rx", arg::Flag(rx))
          .Set("assignment", arg::Object(rx ? process::kRxAssignment : process::kTxAssignment))
          .Set("own_default", arg::Flag(!written));
      if (!written) finding.confidence = Confidence::kInferred;
      AddRelated(finding, layout.since);
      if (layout.assumed || e.request.assumed) finding.confidence = Confidence::kInferred;
      index = Report(key, std::move(finding));
    }
    if (!written) defaults_.Watch(context(), e.slave, e.request.frame.number, index);
    return index;
  }

  void Blame(SlaveId slave, const MappingSuspicions::Suspicion& suspicion) {
    for (const MappingSuspicions::Suspect& suspect : suspicion.suspects) {
      const FindingIndex index = findings_[{slave, suspect.direction}];
      if (!suspect.by_code || index == kNoFinding) continue;
      MappingSuspicions::Blame(context(), suspicion, index);
      const device::DeviceDescription& family = *context().slave(slave).profile;
      context().store[index].Add(kRefusedLater, {{"al_status_code", CodeValue(suspicion.code, family)}});
      if (suspicion.refusal != kNoFinding) {
        AddRelated(context().store[index], context().store[suspicion.refusal].first.number);
      }
    }
  }

  RefusalPredictions defaults_;  ///< kept by the master: no fault if the drive accepts them
  MappingSuspicions suspicions_;
  std::map<std::pair<SlaveId, device::PdoDirection>, FindingIndex> findings_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<PdoObjectMappedTwice>};

}  // namespace
}  // namespace ecaudit::pdo_object_mapped_twice
