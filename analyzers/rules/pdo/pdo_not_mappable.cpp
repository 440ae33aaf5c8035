#include "analyzers/judge/pdo_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/objects/relatives.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit::pdo_not_mappable {
namespace {

constexpr RuleInfo kInfo{
    .id = "pdo-not-mappable",
    .group = "PDO mapping",
    .severity = Severity::kError,
    .subject = Subject::kMappingWrites,
    .title = "An object is mapped that cannot be, or with a wrong length, or in the wrong direction",
    .needs = "the family's list of objects that can be mapped: dictionary, cyclic objects, or an ESI file",
    .source = "ETG1000.6, PDO mapping; MKD, 4.6; MKD, 5.3",
    .doc = R"(
## What it checks
Each entry that the master writes to a mapping object (1600h-17FFh, 1A00h-1BFFh): the object must be mappable, in this
direction (Rx: the drive takes it, Tx: it gives it), and the length in bits must be that of its type.

## Why it matters
The drive aborts the download (0x06040041, 0x06040042, 0x06070010) or refuses SAFEOP; the process data keep their old
contents.

## How it is decided
Against the "PDO mapping" column of the family's object dictionary and its list of cyclic objects; either one's yes is a
yes. Index 0 and the padding objects of the manual fill gaps and may have any length. Objects that no source mentions
are judged only where a source claims to be complete. Only what the master writes counts. Where the drive goes to SAFEOP
with the mapping, the finding becomes an info: it can do more than its manual says. A drive whose manual describes no
free mapping (AKD) may map what one of the same maker can, unless it aborts the download.

## Example
samples/captures/pdo-not-mappable.pcapng

## What to do
Map an object that the dictionary marks as mappable, with the length of its type; for a gap use the padding of the
manual.
)"};

class PdoNotMappable final : public PdoRule {
 public:
  PdoNotMappable() : PdoRule(kInfo, WhenAccepted::kBecomesInfo) {}

 private:
  void OnDownload(const mailbox::SdoTransfer& e, const std::vector<Write>& writes) override {
    if (process::IsAssignment(e.index) || AbortedAsReadOnly(e)) return;
    for (const Write& write : writes) {
      if (write.subindex != 0 && write.value != 0) Judge(e, write);
    }
  }

  static device::PdoDirection Other(device::PdoDirection direction) {
    return direction == device::PdoDirection::kRx ? device::PdoDirection::kTx : device::PdoDirection::kRx;
  }

  void Judge(const mailbox::SdoTransfer& e, const Write& write) {
    const device::DeviceDescription& family = *context().slave(e.slave).profile;
    const auto entry = process::MappingEntry::FromValue(write.value);
    const device::PdoDirection direction = DirectionOf(e.index);
    if (entry.index == 0) return;
    const device::Mappable mappable = family.MappableIn(direction, entry.index, entry.subindex);
    const std::string name = ObjectName(entry.index, entry.subindex);
    if (mappable == device::Mappable::kUnknown) {
      NotEvaluable(e.slave, "no source says whether an object that was mapped may be", FrameOf(e).number);
      return;
    }
    if (mappable == device::Mappable::kNo) {
      if (e.outcome != mailbox::SdoOutcome::kAborted && MappableInRelative(family, direction, entry)) return;
      const bool wrong_way = family.MappableIn(Other(direction), entry.index, entry.subindex) != device::Mappable::kNo;
      const bool exists = family.object(entry.index, entry.subindex) != nullptr;
      Describe(e, write,
               name + (wrong_way ? " is mapped in the wrong direction"
                       : exists  ? " is mapped although it cannot be"
                                 : " is mapped, which the drive does not list"),
               wrong_way ? "it can be mapped in " + std::string(DirectionName(Other(direction))) + " PDOs only"
               : exists  ? "it cannot be mapped"
                         : "it is not among the objects that can be mapped");
      return;
    }
    const std::optional<std::uint32_t> wanted = WrongLength(family, direction, entry);
    if (!wanted) return;
    Describe(e, write, name + " is mapped with " + Count(entry.bits, "bit") + " instead of " + std::to_string(*wanted),
             "it has " + Count(*wanted, "bit"));
  }

  /// The manual describes no free mapping, the drive takes it, and a drive of the same maker can map the object.
  static bool MappableInRelative(const device::DeviceDescription& family, device::PdoDirection direction,
                                 const process::MappingEntry& entry) {
    if (family.pdo.flexible) return false;
    for (const device::DeviceDescription* relative : events::Relatives(family)) {
      const device::Mappable there = relative->MappableIn(direction, entry.index, entry.subindex);
      if (there == device::Mappable::kYes || there == device::Mappable::kConditional) return true;
    }
    return false;
  }

  /// The length it has, where no source allows the one mapped.
  static std::optional<std::uint32_t> WrongLength(const device::DeviceDescription& family,
                                                  device::PdoDirection direction, const process::MappingEntry& entry) {
    std::optional<std::uint32_t> wanted;
    if (const device::CyclicObject* cyclic = family.pdo.FindCyclic(direction, entry.index, entry.subindex)) {
      if (cyclic->bits == 0 || cyclic->bits == entry.bits) return std::nullopt;
      wanted = cyclic->bits;
    }
    if (const device::DictionaryObject* row =
            family.dictionary ? family.dictionary->Find(entry.index, entry.subindex) : nullptr) {
      if (row->AllowsBits(entry.subindex, entry.bits)) return std::nullopt;
      const std::uint16_t bits = device::BitsOf(row->TypeOf(entry.subindex));
      if (bits != 0) wanted = bits;
    }
    // Padding may be of any length, unless a source states one.
    if (!wanted && family.pdo.flexible) {
      for (const device::Padding& padding : family.pdo.flexible->paddings) {
        if (padding.direction == direction && padding.index == entry.index && padding.bits != 0 &&
            entry.subindex >= padding.first_subindex && entry.subindex <= padding.last_subindex &&
            padding.bits != entry.bits) {
          wanted = padding.bits;
        }
      }
    }
    return wanted;
  }

  void Describe(const mailbox::SdoTransfer& e, const Write& write, std::string title, const std::string& law) {
    const device::DeviceDescription& family = *context().slave(e.slave).profile;
    const auto entry = process::MappingEntry::FromValue(write.value);
    Finding finding;
    finding.title = std::move(title) + " (" + ObjectName(e.index) + ")";
    finding.message = "In frame " + std::to_string(FrameOf(e).number) + " the master maps " +
                      EntryText(write.value, family) + ", in " + ObjectName(e.index, write.subindex) + ", a " +
                      std::string(DirectionName(DirectionOf(e.index))) + " PDO." + OutcomeText(e) + " By " +
                      family.title + " " + law + ".";
    finding.evidence.push_back(Text("mapped", ObjectName(entry.index, entry.subindex)));
    finding.evidence.push_back(Number("bits", entry.bits));
    finding.evidence.push_back(Text("in", ObjectName(e.index, write.subindex)));
    if (const device::DictionaryObject* row = family.object(entry.index, entry.subindex); row != nullptr) {
      if (!row->source.empty()) finding.reference = ReferenceTo(row->source);
    }
    if (finding.reference.document.empty() && !family.pdo.source.empty()) {
      finding.reference = ReferenceTo(family.pdo.source);
    }
    Tell(e, e.index, std::uint64_t{e.index} << 32U | write.value, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<PdoNotMappable>};

}  // namespace
}  // namespace ecaudit::pdo_not_mappable
