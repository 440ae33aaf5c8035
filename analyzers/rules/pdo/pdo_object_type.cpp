#include <algorithm>
#include <set>
#include <utility>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/progress/progress_model.h"
#include "analyzers/words/what.h"
#include "decoder/device/object_dictionary.h"
#include "decoder/mailbox/events.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit::pdo_object_type {
namespace {

using device::PdoDirection;

constexpr FindingKind kLength{
    .name = "length",
    .title = "{object:number} is mapped with {mapped}, its type has {expected}",
    .message =
        R"(The mapping of {pdo} holds {object} with {mapped}.[{?standard} By CiA 402 the object has
{expected}.][{!standard} By its dictionary the object has {expected}.][ What follows it in the process data
({following}) may be read {shift} beside its place.][ The drive confirms this: 6061h is {by_sdo} by SDO and
{by_process_data} in the process data ({differs_frame}).])",
    .next = "Map {object:number} with {expected}.",
    .identity = "object mapped"};

constexpr FindingKind kDiffers{
    .name = "value-differs",
    .title = "6061h is {by_sdo} by SDO, but {by_process_data} in the process data",
    .message =
        R"(The master read {by_sdo} from 6061h by SDO in {frame}. The process data show {by_process_data} for the same
object from {since_frame} on, for {lasted_ms}. The master reads the inputs at a wrong place.)",
    .next = "Compare the PDO mapping (1A00h to 1BFFh) and the length of SM3 with what the drive sends.",
    .identity = "by_sdo by_process_data"};

constexpr const FindingKind* kKinds[] = {&kLength, &kDiffers};

constexpr RuleInfo kInfo{
    .id = "pdo-object-type",
    .group = "PDO mapping",
    .severity = Severity::kError,
    .subject = Subject::kMapping,
    .title = "A mapped object has another length than its type, or another value than by SDO",
    .needs = "the mapping, and the type of the object from the slave, an ESI, the manual or CiA 402",
    .source = "CIA402, object dictionary; ETG1000.6, 5.6.7.4",
    .kinds = kKinds,
    .doc = R"(
## What it checks
Whether each entry that the master maps is as long as the type of its object. Whether the drive shows the same mode of
operation (6061h) by SDO and in the process data.

## Why it matters
The drive sends as many bits as its object has. All that follows in the process data is then read at a wrong place,
although lengths and working counters are right.

## How it is decided
- The type comes from the slave's own dictionary, its ESI or manual. A wrong length is a warning: some slaves fill the
  entry.
- If none of them has the object, and the axis shows a control or status word, the type of CiA 402 counts. A wrong
  length is then an inferred info: the slave accepted the mapping, and its object may be longer than in the standard.
- A difference of 6061h counts if the process data held the other value for at least 100 ms.
- A wrong length is an error if 6061h differs as well.

## Example
tests/rules/pdo-object-type/violates.trace: 6077h with 32 bits.

## What to do
Correct the length of the entry in the start-up list of the master, or choose a PDO that the slave offers.
)"};

class PdoObjectType final : public Rule {
 public:
  PdoObjectType() : Rule(kInfo) { Subscribe<mailbox::SdoTransfer>(&PdoObjectType::On); }

  void On(const mailbox::SdoTransfer& transfer) {
    const bool mapping = process::IsRxMapping(transfer.index) || process::IsTxMapping(transfer.index);
    if (!transfer.has_object || !mapping || transfer.service != mailbox::SdoService::kDownload ||
        transfer.outcome != mailbox::SdoOutcome::kCompleted) {
      return;
    }
    written_.emplace(transfer.slave, transfer.index);
  }

  void Finish() override {
    for (SlaveId id = 0; id < context().slave_count(); ++id) {
      const model::SlaveModel& slave = context().slave(id);
      bool reported = false;
      for (const PdoDirection direction : {PdoDirection::kRx, PdoDirection::kTx}) {
        reported = Evaluate(id, slave, direction) || reported;
      }
      if (!reported) ReportDifference(id);
    }
  }

 private:
  /// @return whether a length is wrong
  bool Evaluate(SlaveId id, const model::SlaveModel& slave, PdoDirection direction) {
    const model::ProcessLayout& layout = slave.process.Layout(direction);
    const model::ProcessTraffic& traffic = direction == PdoDirection::kRx ? slave.outputs : slave.inputs;
    if (traffic.exchanged == 0) return false;
    if (!layout.known()) {
      NotEvaluable(id, ReasonCode::kNotInCapture, what::kMapping);
      return false;
    }
    bool wrong = false;
    for (std::size_t i = 0; i < layout.signals.size(); ++i) {
      const model::Signal& signal = layout.signals[i];
      // What the slave offers by itself is its own affair.
      if (signal.gap() || !written_.contains({id, signal.pdo})) continue;
      bool standard = false;
      const std::uint16_t bits = BitsOfType(slave, signal, standard);
      if (bits == 0 || bits == signal.bits || (bits == 1 && signal.bits == 8)) continue;
      wrong = true;
      Finding finding = Found(kLength, id, traffic.first);
      finding.Set("object", arg::Object(signal.index, signal.subindex, signal.name));
      finding.Set("mapped", arg::Count(signal.bits, "bit")).Set("expected", arg::Count(bits, "bit"));
      finding.Set("pdo", arg::Object(signal.pdo));
      if (standard) finding.Set("standard", arg::Flag());
      SetFollowing(finding, layout, i, signal.bits, bits);
      AddRelated(finding, layout.since);
      const progress::AxisRecord* const differs = direction == PdoDirection::kTx ? DifferenceOf(id) : nullptr;
      if (differs != nullptr) {
        finding.Set("by_sdo", arg::Number(differs->a)).Set("by_process_data", arg::Number(differs->b));
        finding.Set("differs_frame", arg::Frame(differs->frame.number));
        AddRelated(finding, differs->frame.number);
      }
      if (standard && differs == nullptr) finding.confidence = Confidence::kInferred;
      const Severity alone = standard ? Severity::kInfo : Severity::kWarning;
      const std::uint64_t key = std::uint64_t{signal.index} << 8U | signal.subindex;
      (void)Report(key, differs != nullptr ? Severity::kError : alone, std::move(finding));
    }
    return wrong;
  }

  static void SetFollowing(Finding& finding, const model::ProcessLayout& layout, std::size_t at, std::uint16_t mapped,
                           std::uint16_t expected) {
    constexpr std::size_t kMost = 4;
    std::vector<Value> following;
    for (std::size_t i = at + 1; i < layout.signals.size() && following.size() < kMost; ++i) {
      const model::Signal& signal = layout.signals[i];
      if (!signal.gap()) following.push_back(arg::Object(signal.index, signal.subindex));
    }
    if (following.empty()) return;
    finding.Set("following", arg::List(std::move(following)));
    finding.Set("shift",
                arg::Count(static_cast<std::uint64_t>(std::max(mapped, expected) - std::min(mapped, expected)), "bit"));
  }

  /// The slave's own word where there is one; 0: not known.
  static std::uint16_t BitsOfType(const model::SlaveModel& slave, const model::Signal& signal, bool& standard) {
    const std::uint16_t own = device::BitsOf(device::DataTypeFromCode(static_cast<std::uint16_t>(signal.type)));
    if (own != 0 && !signal.type_standard) return own;
    const auto axis = progress::AxisOf(signal.index);
    if (!axis || !slave.profile->drive || !slave.drives.seen()) return 0;
    const auto seen = [&](const model::DriveUnit& unit) { return unit.axis() == axis->first; };
    if (!slave.drives.Any(seen)) return 0;
    standard = true;
    for (const device::DictionaryObject& object : slave.profile->drive->objects) {
      if (object.index == axis->second && object.Covers(signal.subindex)) {
        return device::BitsOf(object.TypeOf(signal.subindex));
      }
    }
    return 0;
  }

  [[nodiscard]] const progress::AxisRecord* DifferenceOf(SlaveId id) const {
    const progress::AxisRecord* found = nullptr;
    context().progress().ForEachAxis([&](SlaveId slave, std::uint8_t, const progress::AxisWatch& axis) {
      if (slave != id || found != nullptr) return;
      found = axis.records().Find(progress::AxisFact::kModeShifted);
    });
    return found;
  }

  void ReportDifference(SlaveId id) {
    const progress::AxisRecord* const differs = DifferenceOf(id);
    if (differs == nullptr) return;
    Finding finding = Found(kDiffers, id, differs->frame);
    finding.Set("by_sdo", arg::Number(differs->a)).Set("by_process_data", arg::Number(differs->b));
    finding.Set("since_frame", arg::Frame(differs->since.number)).Set("lasted_ms", arg::Ms(differs->lasted));
    AddRelated(finding, differs->since.number);
    (void)Report(1, Severity::kWarning, std::move(finding));
  }

  std::set<std::pair<SlaveId, std::uint16_t>> written_;  ///< mapping objects that the master wrote
};

const RuleRegistration kRegistration{kInfo, MakeRule<PdoObjectType>};

}  // namespace
}  // namespace ecaudit::pdo_object_type
