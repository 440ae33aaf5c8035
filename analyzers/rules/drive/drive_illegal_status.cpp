#include <set>
#include <utility>

#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/drive_text.h"

namespace ecaudit::drive_illegal_status {
namespace {

constexpr FindingKind kNoState{
    .name = "no-state",
    .title = "Status word {status_word} is no state of the drive ({status_words})",
    .message =
        R"(The status word is {status_word} in {frame} and matches no state up to {last_frame} ({status_words}).[ Up to
{before_frame} it showed {state_before}.][{!state_before} No state was seen before.] Bits 0 to 3, 5 and 6 must form one of
the states of the manual.)",
    .next = "Compare the PDO mapping in the drive with the mapping of the master.",
    .identity = "status_word"};
constexpr const FindingKind* kKinds[] = {&kNoState};

constexpr RuleInfo kInfo{.id = "drive-illegal-status",
                         .group = "Drive profile (DS402)",
                         .severity = Severity::kError,
                         .history = History::kNone,
                         .title = "The status word matches no state of the drive for longer than a cycle",
                         .needs = "status word 6041h, in the process data or by SDO",
                         .source = "CIA402, state machine; AKD-2011, 4.4; MKD, 4.4; PILZ, 4.4",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Whether the state bits of the status word (6041h: 0 to 3, 5 and 6) are those of one of the eight states.

## Why it matters
A master that waits for a state never sees it. A master that evaluates single bits may take the drive for enabled or
ready. Usually the word is no status word: the mappings of master and drive differ, or bytes are swapped.

## How it is decided
By the states of the family's manual, from the first status word on.

- At least two status words in a row match no state. A drive may show a mixture for one cycle between two states.
- 0 before any other word is the content of unused memory.
- Evaluated only where the drive shows its status word (SAFEOP and OP, unless its manual states otherwise).

## Example
samples/captures/drive-illegal-status.pcapng: 0x0235 for 20 cycles.

## What to do
Compare the PDO mapping in the drive with the mapping of the master, and check the words beside it.
)"};

class DriveIllegalStatus final : public Rule {
 public:
  DriveIllegalStatus() : Rule(kInfo) { Subscribe<model::DriveStateChanged>(&DriveIllegalStatus::On); }

  void On(const model::DriveStateChanged& e) {
    const Axis axis{e.slave, e.axis};
    if (!e.to) {
      open_.insert(axis);
    } else if (open_.erase(axis) > 0) {
      ReportRun(axis);
    }
  }

  void Finish() override {
    for (const Axis& axis : open_) ReportRun(axis);
    NotEvaluableFor([](const model::SlaveModel& slave) { return DriveWordsMissing(slave, false); });
  }

 private:
  using Axis = std::pair<SlaveId, std::uint8_t>;

  void ReportRun(const Axis& of) {
    const auto& [slave, axis] = of;
    const model::DriveStatus::WithoutState& run = context().slave(slave).drives.axis(axis).status().without_state;
    if (run.words < 2) return;
    const std::uint64_t key = AxisKey(axis) | run.word;
    if (Repeat(slave, key, run.last) != kNoFinding) return;
    const device::DeviceDescription& family = *context().slave(slave).profile;
    Finding finding = Found(kNoState, slave, run.first);
    finding.last = run.last;
    finding.confidence = run.inferred ? Confidence::kInferred : Confidence::kObserved;
    if (run.before) {
      finding.Set("state_before", StateValue(run.before)).Set("before_frame", arg::Frame(run.before_last));
      AddRelated(finding, run.before_last);
    }
    finding.Set("status_word", arg::Hex(run.word)).Set("status_words", arg::Count(run.words, "status word"));
    if (family.drive) finding.reference = ReferenceTo(family.drive->source);
    NameAxis(finding, axis);
    Report(key, std::move(finding));
  }

  std::set<Axis> open_;  // whose status word matches no state
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveIllegalStatus>};

}  // namespace
}  // namespace ecaudit::drive_illegal_status
