#include <map>
#include <utility>

#include "analyzers/judge/pdo_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_text.h"
#include "decoder/base/text.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit::pdo_object_mapped_twice {
namespace {

/// Data types as objects: masters and slaves fill gaps with them.
constexpr std::uint16_t kLastDummyObject = 0x001F;

constexpr RuleInfo kInfo{.id = "pdo-object-mapped-twice",
                         .group = "PDO mapping",
                         .severity = Severity::kWarning,
                         .title = "An object stands more than once in the assigned PDOs of one direction",
                         .needs = "the assignment and the contents of the assigned PDOs",
                         .source = "ETG1000.6, PDO mapping; MKD, 4.6",
                         .doc = R"(
## What it checks
When SAFEOP is requested: whether an object (index and subindex) is mapped more than once in the assigned Rx PDOs, or
more than once in the assigned Tx PDOs.

## Why it matters
Of several outputs for one object the last wins, and which that is the master does not know. Drives may refuse SAFEOP
for it. It is typical of a default assignment of all PDOs that a master keeps.

## How it is decided
From SDO transfers in the capture, or an ENI file. Gaps (index 0), data-type dummies (up to 001Fh) and the padding
objects of the manual do not count. A default that the drive offers and the master keeps is marked inferred; where the
drive goes to SAFEOP with it, it becomes an info. Where SAFEOP is refused with 0x0017, 0x001D, 0x001E, 0x0024 or
0x0025 and nothing else explains it, the refusal names this finding as cause, as an inference.

## Example
samples/captures/pdo-mapped-twice.pcapng

## What to do
Assign only the PDOs that are needed: write 0 to 1C12h:0 (1C13h:0), the PDO indices, and their number.
)"};

class PdoObjectMappedTwice final : public PdoRule {
 public:
  using PdoRule::On;
  PdoObjectMappedTwice() : PdoRule(kInfo, WhenAccepted::kStands) {
    Subscribe<model::AlErrorCode>(&PdoObjectMappedTwice::On);
  }

  void On(const model::AlAnswered& e) override {
    PdoRule::On(e);
    defaults_.On(context(), e);
    if (const auto ripe = suspicions_.On(context(), e)) Blame(e.slave, *ripe);
  }
  void On(const model::AlErrorCode& e) {
    if (const auto ripe = suspicions_.On(context(), e)) Blame(e.slave, *ripe);
  }
  void Finish() override {
    PdoRule::Finish();
    suspicions_.Finish(context());
  }

 private:
  /// One object and how often it stands where.
  struct Times {
    std::uint32_t count = 0;
    std::string pdos;
    std::string name;
  };

  void OnSafeopRequest(const model::AlRequestJudged& e) override {
    std::vector<MappingSuspicions::Suspect> suspects;
    for (const auto direction : {device::PdoDirection::kRx, device::PdoDirection::kTx}) {
      const model::ProcessLayout& layout = context().slave(e.slave).process.Layout(direction);
      const bool given = layout.source == model::LayoutSource::kObserved || layout.source == model::LayoutSource::kEni;
      if (!given || !layout.known()) {
        NotEvaluable(e.slave, "what PDOs are assigned and mapped is not known", e.request.frame.number);
        continue;
      }
      std::map<std::pair<std::uint16_t, std::uint8_t>, Times> objects;
      for (const model::Signal& signal : layout.signals) {
        if (signal.index <= kLastDummyObject || IsPadding(e.slave, direction, signal)) continue;
        Times& times = objects[{signal.index, signal.subindex}];
        ++times.count;
        times.pdos += (times.pdos.empty() ? "" : ", ") + ObjectName(signal.pdo);
        times.name = signal.name;
      }
      for (const auto& [object, times] : objects) {
        if (times.count < 2) continue;
        const FindingIndex index = Judge(e, direction, layout, object, times);
        suspects.push_back({direction,
                            ObjectName(object.first, object.second) + " stands " + std::to_string(times.count) +
                                " times in the " + std::string(DirectionName(direction)) + " mapping",
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

  FindingIndex Judge(const model::AlRequestJudged& e, device::PdoDirection direction,
                     const model::ProcessLayout& layout, const std::pair<std::uint16_t, std::uint8_t>& object,
                     const Times& times) {
    const bool rx = direction == device::PdoDirection::kRx;
    const bool written = WrittenByMaster(e.slave, direction, layout.pdos);
    const std::uint64_t key = std::uint64_t{object.first} << 32U | std::uint64_t{object.second} << 24U |
                              std::uint64_t{times.count} << 8U | (rx ? 2U : 0U) | (written ? 1U : 0U);
    FindingIndex index = Repeat(e.slave, key, e.request.frame);
    if (index == kNoFinding) {
      const std::string name = ObjectName(object.first, object.second);
      const std::string assignment = ObjectName(rx ? process::kRxAssignment : process::kTxAssignment);
      Finding finding;
      finding.slave = e.slave;
      finding.first = e.request.frame;
      finding.title = name + " is mapped " + std::to_string(times.count) + " times in the " +
                      std::string(DirectionName(direction)) + " PDOs";
      finding.message = "When the master requests SAFEOP in frame " + std::to_string(e.request.frame.number) + ", " +
                        name + (times.name.empty() ? "" : " " + Printable(times.name)) + " stands " +
                        std::to_string(times.count) + " times in the PDOs assigned in " + assignment + ": in " +
                        times.pdos + ". ";
      if (!written) {
        finding.message += "It is the drive's own default, which the master keeps. ";
        finding.confidence = Confidence::kInferred;
      }
      finding.message += rx ? "Which of the values the drive takes is not defined. "
                            : "The value is sent several times in each cycle. ";
      finding.message += "Assign only the PDOs that are needed, in PREOP: " + assignment +
                         ":0 = 0, then their indices, then their number.";
      finding.evidence.push_back(Text("object", name));
      finding.evidence.push_back(Number("times", times.count));
      finding.evidence.push_back(Text("pdos", times.pdos));
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
      suspicions_.Blame(context(), suspicion, index);
      const device::DeviceDescription& family = *context().slave(slave).profile;
      context().store[index].message += " SAFEOP was then refused with AL status code " +
                                        CodeText(suspicion.code, family) + "; that this is why is an inference.";
      if (suspicion.refusal != kNoFinding) {
        AddRelated(context().store[index], context().store[suspicion.refusal].first.number);
      }
    }
  }

  RefusalPredictions defaults_;  ///< kept by the master: no harm where the drive accepts them
  MappingSuspicions suspicions_;
  std::map<std::pair<SlaveId, device::PdoDirection>, FindingIndex> findings_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<PdoObjectMappedTwice>};

}  // namespace
}  // namespace ecaudit::pdo_object_mapped_twice
