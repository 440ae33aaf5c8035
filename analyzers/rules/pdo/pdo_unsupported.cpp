#include <algorithm>
#include <string>
#include <vector>

#include "analyzers/judge/pdo_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/objects/relatives.h"
#include "decoder/mailbox/events.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit::pdo_unsupported {
namespace {

constexpr std::string_view kMessage =
    R"(The master downloads {pdo} to {assignment} in {frame}. {outcome}[ with {abort_code}].[ The
{direction} PDOs of the drive are {known_pdos} ({manual}).[ {other_pdos} {other_pdos?is|are} in another edition only
({other_source}).]][{!known_pdos} The drive has no {direction} PDOs ({manual}).])";
constexpr std::string_view kNext =
    "[{?known_pdos}Assign one of the listed PDOs.][{!known_pdos}Check the assignment in the master.]";

constexpr FindingKind kNotOfDrive{
    .name = "not-listed",
    .title = "PDO {pdo_object} assigned in {assignment_object}: the drive does not have it",
    .message = kMessage,
    .next = kNext,
    .identity = "pdo assignment_object"};

constexpr FindingKind kOtherDirection{
    .name = "other-direction",
    .title = "PDO {pdo_object} assigned in {assignment_object}: it is of the other direction",
    .message = kMessage,
    .next = kNext,
    .identity = "pdo assignment_object"};

constexpr const FindingKind* kKinds[] = {&kNotOfDrive, &kOtherDirection};

constexpr Word kPdoList{"pdo-list", "a complete list of the slave's PDOs"};

// ExplainRequest(): the later rule names the nearer cause.
constexpr std::string_view kAfter[] = {"pdo-object-mapped-twice"};

constexpr RuleInfo kInfo{
    .id = "pdo-unsupported",
    .group = "PDO mapping",
    .severity = Severity::kError,
    .history = History::kNone,
    .subject = Subject::kMappingWrites,
    .title = "A PDO is assigned that the drive does not have",
    .needs = "a complete list of the PDOs that may be assigned: the manual of the family, or an ESI file",
    .source = "ETG1000.6, PDO assignment; MKD, 4.5; AKD-2011, 4.5",
    .kinds = kKinds,
    .after = kAfter,
    .doc = R"(
## What it checks
Each PDO index that the master writes to 1C12h or 1C13h against the PDOs that the manual of the family (or an ESI file)
lists as selectable, those for free mapping included.

## Why it matters
The drive aborts the download and keeps the previous assignment, or refuses SAFEOP. Then the process data have another
length and meaning than the master expects.

## How it is decided
Only for families whose list is complete, and only for what the master writes. What a drive reports itself is never a
mistake of the master.

- A drive may have more PDOs than its manual: if it goes to SAFEOP with the assignment, the finding becomes an info.
- Two kinds of PDOs are reported only if the drive aborts the download: a PDO whose mapping the drive itself has shown
  (uploaded), and one that a drive of the same maker has for free mapping.

## Example
samples/captures/pdo-unsupported.pcapng

## What to do
Assign a PDO of the list (`ecaudit profiles NAME` prints it), in its direction: 1C12h lists Rx PDOs, 1C13h Tx PDOs.
)"};

class PdoUnsupported final : public PdoRule {
 public:
  PdoUnsupported() : PdoRule(kInfo, WhenAccepted::kBecomesInfo) {}

 private:
  void OnDownload(const mailbox::SdoTransfer& e, const std::vector<Write>& writes) override {
    if (!process::IsAssignment(e.index)) return;
    const device::DeviceDescription& family = *context().slave(e.slave).profile;
    const device::PdoDirection direction = DirectionOf(e.index);
    for (const Write& write : writes) {
      const auto pdo = static_cast<std::uint16_t>(write.value);
      if (write.subindex == 0 || pdo == 0) continue;
      if (!family.pdo.selectable_complete) {
        NotEvaluable(e.slave, ReasonCode::kNotInProfile, kPdoList, FrameOf(e).number);
        return;
      }
      if (family.pdo.IsAssignable(direction, pdo)) continue;
      // The drive itself shows it: it offers more than its manual.
      const process::PdoObject* shown = context().slave(e.slave).process.seen().Find(pdo);
      const bool aborted = e.outcome == mailbox::SdoOutcome::kAborted;
      if (!aborted && (shown != nullptr || FreeInRelative(family, direction, pdo))) continue;
      ReportPdo(e, write, pdo, direction, family);
    }
  }

  /// True for a PDO of free mapping in the manual of a drive of the same maker: newer firmware of this drive has it
  /// too.
  static bool FreeInRelative(const device::DeviceDescription& family, device::PdoDirection direction,
                             std::uint16_t pdo) {
    if (family.pdo.flexible) return false;
    for (const device::DeviceDescription* relative : events::Relatives(family)) {
      const auto& free = relative->pdo.flexible;
      if (!free) continue;
      const auto& pdos = direction == device::PdoDirection::kRx ? free->rx_pdos : free->tx_pdos;
      if (std::ranges::find(pdos, pdo) != pdos.end()) return true;
    }
    return false;
  }

  void ReportPdo(const mailbox::SdoTransfer& e, const Write& write, std::uint16_t pdo, device::PdoDirection direction,
                 const device::DeviceDescription& family) {
    std::vector<std::uint16_t> list;
    std::vector<std::uint16_t> elsewhere;  // rows that the family keeps from another manual
    std::string source = family.pdo.source;
    std::string other_source;
    for (const device::SelectablePdo& known : family.pdo.selectable) {
      if (known.direction != direction || known.example_only) continue;
      if (!known.source.starts_with(family.document)) {
        elsewhere.push_back(known.index);
        other_source = known.source;
        continue;
      }
      list.push_back(known.index);
      source = known.source;
    }
    if (list.empty()) list.swap(elsewhere);  // its list is another document's altogether
    if (family.pdo.flexible) {
      const auto& free =
          direction == device::PdoDirection::kRx ? family.pdo.flexible->rx_pdos : family.pdo.flexible->tx_pdos;
      list.insert(list.end(), free.begin(), free.end());
    }
    const bool other_way = family.pdo.IsAssignable(
        direction == device::PdoDirection::kRx ? device::PdoDirection::kTx : device::PdoDirection::kRx, pdo);
    Finding finding = Found(other_way ? kOtherDirection : kNotOfDrive, e.slave, FrameOf(e));
    finding.Set("pdo", arg::Hex(pdo))
        .Set("assignment", arg::Object(e.index, write.subindex))
        .Set("pdo_object", arg::Object(pdo))
        .Set("assignment_object", arg::Object(e.index))
        .Set("direction", PdoDirectionValue(direction))
        .Set("manual", arg::Text(family.title));
    if (!list.empty()) finding.Set("known_pdos", PdosValue(list));
    if (!elsewhere.empty() && !list.empty()) {
      finding.Set("other_pdos", PdosValue(elsewhere)).Set("other_source", arg::Text(other_source));
    }
    finding.reference = ReferenceTo(source);
    ReportDownload(e, e.index, std::uint64_t{e.index} << 16U | pdo, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<PdoUnsupported>};

}  // namespace
}  // namespace ecaudit::pdo_unsupported
