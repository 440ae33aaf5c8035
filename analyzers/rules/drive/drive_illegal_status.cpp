#include <set>
#include <string>
#include <utility>

#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/drive_text.h"
#include "decoder/base/text.h"

namespace ecaudit::drive_illegal_status {
namespace {

constexpr RuleInfo kInfo{.id = "drive-illegal-status",
                         .group = "Drive profile (DS402)",
                         .severity = Severity::kError,
                         .needs_no_history = true,
                         .title = "The status word matches none of the states of the family for longer than a cycle",
                         .needs = "status word 6041h, in the process data or by SDO",
                         .source = "CIA402, state machine; AKD-2011, 4.4; MKD, 4.4; PILZ, 4.4",
                         .doc = R"(
## What it checks
Whether the state bits of the status word (6041h: 0 to 3, 5 and 6) are those of one of the eight states.

## Why it matters
A master that waits for a state never sees it, and one that looks at single bits may take the drive for enabled or for
ready when it is neither. Usually it is no status word at all that stands there: the mapping of master and drive differ,
or the bytes are swapped.

## How it is decided
By the states of the family's manual, from the first status word on. Two status words in a row have to fit none: a drive
that goes on from one state to the next may show a mixture for one cycle. Before any other word, 0 is what unused
memory holds. Only where the drive shows its status word (SAFEOP and OP, if its manual does not say otherwise).

## Example
samples/captures/drive-illegal-status.pcapng: 0x0235 for 20 cycles.

## What to do
Compare the PDO mapping that the drive holds with the one that the master works by, and look at the words beside.
)"};

class DriveIllegalStatus final : public Rule {
 public:
  DriveIllegalStatus() : Rule(kInfo) { Subscribe<model::DriveStateChanged>(&DriveIllegalStatus::On); }

  void On(const model::DriveStateChanged& e) {
    const Axis axis{e.slave, e.axis};
    if (!e.to) {
      open_.insert(axis);
    } else if (open_.erase(axis) > 0) {
      Tell(axis);
    }
  }

  void Finish() override {
    for (const Axis& axis : open_) Tell(axis);
    NotEvaluableFor([](const model::SlaveModel& slave) { return DriveWordsMissing(slave, false); });
  }

 private:
  using Axis = std::pair<SlaveId, std::uint8_t>;

  void Tell(const Axis& of) {
    const auto& [slave, axis] = of;
    const model::DriveUnit::WithoutState& run = context().slave(slave).drives.axis(axis).without_state();
    if (run.words < 2) return;
    const std::uint64_t key = AxisKey(axis) | run.word;
    if (Repeat(slave, key, run.last) != kNoFinding) return;
    const device::DeviceDescription& family = *context().slave(slave).profile;
    Finding finding;
    finding.slave = slave;
    finding.first = run.first;
    finding.last = run.last;
    finding.confidence = run.inferred ? Confidence::kInferred : Confidence::kObserved;
    finding.title =
        "Status word " + Hex(run.word) + " is no state of the drive, for " + Count(run.words, "status word");
    finding.message = "The status word is " + Hex(run.word) + " in frame " + std::to_string(run.first.number) +
                      " and fits no state up to frame " + std::to_string(run.last.number) + " (" +
                      Count(run.words, "status word") + "). ";
    if (run.before) {
      finding.message +=
          "Before, up to frame " + std::to_string(run.before_last) + ", it was " + StateText(run.before) + ". ";
      finding.evidence.push_back(Text("state_before", StateText(run.before)));
      AddRelated(finding, run.before_last);
    } else {
      finding.message += "No state was seen before. ";
    }
    finding.message +=
        "Bits 0 to 3, 5 and 6 of the word have to form one of the states of the manual. Compare the PDO mapping in the "
        "drive with the one that the master works by.";
    finding.evidence.push_back(HexNumber("status_word", run.word));
    finding.evidence.push_back(Number("status_words", static_cast<std::int64_t>(run.words)));
    if (family.drive) finding.reference = ReferenceTo(family.drive->source);
    NameAxis(finding, axis);
    Report(key, std::move(finding));
  }

  std::set<Axis> open_;  // whose status word fits no state
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveIllegalStatus>};

}  // namespace
}  // namespace ecaudit::drive_illegal_status
