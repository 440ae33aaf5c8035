#include <algorithm>

#include "analyzers/judge/pdo_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/objects/relatives.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit::pdo_unsupported {
namespace {

constexpr RuleInfo kInfo{
    .id = "pdo-unsupported",
    .group = "PDO mapping",
    .severity = Severity::kError,
    .needs_no_history = true,
    .subject = Subject::kMappingWrites,
    .title = "A PDO is assigned that the drive does not have",
    .needs = "a complete list of the PDOs that may be assigned: the manual of the family, or an ESI file",
    .source = "ETG1000.6, PDO assignment; MKD, 4.5; AKD-2011, 4.5",
    .doc = R"(
## What it checks
Each PDO index that the master writes to 1C12h or 1C13h against the PDOs that the manual of the family (or an ESI file)
lists as selectable, those for free mapping included.

## Why it matters
The drive aborts the download and keeps what was assigned before, or refuses SAFEOP: the process data then have another
length and meaning than the master believes.

## How it is decided
Only for families whose list is complete, and only for what the master writes: what a drive reports itself is never the
master's mistake. A drive may have more PDOs than its manual: where it goes to SAFEOP with the assignment, the finding
becomes an info. A PDO whose mapping the drive itself has shown (uploaded), or that a drive of the same maker has for
free mapping, is reported only when the drive aborts the download.

## Example
samples/captures/pdo-unsupported.pcapng

## What to do
Assign a PDO of the list (`ecaudit profiles NAME` prints it), in its direction: 1C12h takes Rx PDOs, 1C13h Tx PDOs.
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
        NotEvaluable(e.slave, "no complete list of the slave's PDOs is known", FrameOf(e).number);
        return;
      }
      if (family.pdo.IsAssignable(direction, pdo)) continue;
      // The drive shows it by itself: it offers more than its manual.
      const process::PdoObject* shown = context().slave(e.slave).process.seen().Find(pdo);
      const bool aborted = e.outcome == mailbox::SdoOutcome::kAborted;
      if (!aborted && (shown != nullptr || FreeInRelative(family, direction, pdo))) continue;
      Describe(e, write, pdo, direction, family);
    }
  }

  /// True for a PDO of free mapping by the manual of a drive of the same maker: newer firmware of this one has it, too.
  static bool FreeInRelative(const device::DeviceDescription& family, device::PdoDirection direction,
                             std::uint16_t pdo) {
    if (family.pdo.flexible) return false;
    for (const device::DeviceDescription* relative : events::Relatives(family)) {
      const auto& free = relative->pdo.flexible;
      if (!free) continue;
      const auto& pdos = direction == device::PdoDirection::kRx ? free->rx_pdos : free->tx_pdos;
      if (std::find(pdos.begin(), pdos.end(), pdo) != pdos.end()) return true;
    }
    return false;
  }

  void Describe(const mailbox::SdoTransfer& e, const Write& write, std::uint16_t pdo, device::PdoDirection direction,
                const device::DeviceDescription& family) {
    std::string list;
    std::string source = family.pdo.source;
    for (const device::SelectablePdo& known : family.pdo.selectable) {
      if (known.direction != direction || known.example_only) continue;
      list += (list.empty() ? "" : ", ") + ObjectName(known.index);
      source = known.source;
    }
    if (family.pdo.flexible) {
      const auto& free =
          direction == device::PdoDirection::kRx ? family.pdo.flexible->rx_pdos : family.pdo.flexible->tx_pdos;
      for (const std::uint16_t index : free) list += (list.empty() ? "" : ", ") + ObjectName(index);
    }
    const bool other_way = family.pdo.IsAssignable(
        direction == device::PdoDirection::kRx ? device::PdoDirection::kTx : device::PdoDirection::kRx, pdo);
    Finding finding;
    finding.title = "PDO " + ObjectName(pdo) + " assigned in " + ObjectName(e.index) +
                    (other_way ? ": it is of the other direction" : " is none of the drive's");
    finding.message = "In frame " + std::to_string(FrameOf(e).number) + " the master downloads " + Hex(pdo) + " to " +
                      ObjectName(e.index, write.subindex) + "." + OutcomeText(e) + " The " +
                      std::string(DirectionName(direction)) + " PDOs of " + family.title + " are " +
                      (list.empty() ? "not listed" : list) + ". Assign one of these.";
    finding.evidence.push_back(HexNumber("pdo", pdo));
    finding.evidence.push_back(Text("assignment", ObjectName(e.index, write.subindex)));
    finding.reference = ReferenceTo(source);
    Tell(e, e.index, std::uint64_t{e.index} << 16U | pdo, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<PdoUnsupported>};

}  // namespace
}  // namespace ecaudit::pdo_unsupported
