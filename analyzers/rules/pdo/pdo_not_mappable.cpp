#include "analyzers/judge/pdo_rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/objects/relatives.h"
#include "decoder/mailbox/events.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit::pdo_not_mappable {
namespace {

constexpr FindingKind kNotMappable{
    .name = "not-mappable",
    .title = "{mapped:number} is mapped although it cannot be ({pdo})",
    .message = R"(The master maps {mapped}, {size}, to {in} in {frame}. This object cannot be mapped ({manual}).
{outcome}[ with {abort_code}].)",
    .next = "Map another object, or read and write this one by SDO.",
    .identity = "mapped pdo"};

constexpr FindingKind kWrongDirection{
    .name = "wrong-direction",
    .title = "{mapped:number} is mapped in the wrong direction ({pdo})",
    .message = R"(The master maps {mapped}, {size}, to {in}, {direction} PDO, in {frame}. It can be mapped in
{right_direction} PDOs only ({manual}). {outcome}[ with {abort_code}].)",
    .next = "Map the object in {right_direction} PDOs, or map another one.",
    .identity = "mapped pdo"};

constexpr FindingKind kNotListed{
    .name = "not-listed",
    .title = "{mapped:number} is mapped, but is not in the manual's list ({pdo})",
    .message = R"(The master maps {mapped}, {size}, to {in} in {frame}. It is not among the objects that can be
mapped ({manual}). {outcome}[ with {abort_code}].)",
    .next = "Check the index and the firmware, or map another object.",
    .identity = "mapped pdo"};

constexpr FindingKind kWrongLength{
    .name = "wrong-length",
    .title = "{mapped:number} is mapped with {size} instead of {expected_bits} ({pdo})",
    .message = R"(The master maps {mapped}, {size}, to {in} in {frame}. It has {expected_size} ({manual}). {outcome}[
with {abort_code}].)",
    .next = "Map the object with {expected_size}.",
    .identity = "mapped pdo"};

constexpr FindingKind kNoBits{
    .name = "no-bits",
    .title = "{mapped:number} is mapped with 0 bits ({pdo})",
    .message = R"(The master maps {mapped} with a length of 0 bits to {in} in {frame}. Such an entry takes no place in
the process data. {outcome}[ with {abort_code}].)",
    .next = "Write the length of the object into bits 0 to 7 of the entry[: {expected_size}].",
    .identity = "mapped pdo"};

constexpr const FindingKind* kKinds[] = {&kNotMappable, &kWrongDirection, &kNotListed, &kWrongLength, &kNoBits};

constexpr Word kMappableObjects{"mappable-objects", "the list of objects that can be mapped"};

// ExplainRequest(): the later rule names the nearer cause.
constexpr std::string_view kAfter[] = {"pdo-mapping-rule"};

constexpr RuleInfo kInfo{
    .id = "pdo-not-mappable",
    .group = "PDO mapping",
    .severity = Severity::kError,
    .subject = Subject::kMappingWrites,
    .title = "An object is mapped that cannot be, with a wrong length or direction",
    .needs = "the family's list of objects that can be mapped: dictionary, cyclic objects, or an ESI file",
    .source = "ETG1000.6, PDO mapping; MKD, 4.6; MKD, 5.3",
    .kinds = kKinds,
    .after = kAfter,
    .doc = R"(
## What it checks
Each entry that the master writes to a mapping object (1600h-17FFh, 1A00h-1BFFh):

- The object can be mapped, and in this direction (Rx: the drive reads it, Tx: the drive sends it).
- The length in bits is that of its type.

## Why it matters
The drive aborts the download (0x06040041, 0x06040042, 0x06070010) or refuses SAFEOP. The process data keep their old
contents.

## How it is decided
The entry is compared with the "PDO mapping" column of the family's object dictionary and with its list of cyclic
objects. It is right if one of them allows it.

- Index 0 and the padding objects of the manual fill gaps and may have any length.
- An object that is mapped with 0 bits is wrong for every drive. All such entries of a PDO are one finding.
- An object that no source mentions is evaluated only if a source claims to be complete.
- Only what the master writes counts.
- If the drive goes to SAFEOP with the mapping, the finding becomes an info: it offers more than its manual.
- A drive whose manual describes no free mapping (AKD) may map what one of the same maker can, unless it aborts the
  download.

## Example
samples/captures/pdo-not-mappable.pcapng

## What to do
Map an object that the dictionary marks as mappable, with the length of its type. For a gap use the padding of the
manual.
)"};

class PdoNotMappable final : public PdoRule {
 public:
  PdoNotMappable() : PdoRule(kInfo, WhenAccepted::kBecomesInfo) {}

 private:
  void OnDownload(const mailbox::SdoTransfer& e, const std::vector<Write>& writes) override {
    if (process::IsAssignment(e.index) || AbortedAsReadOnly(e)) return;
    for (const Write& write : writes) {
      if (write.subindex != 0 && write.value != 0) Evaluate(e, write);
    }
  }

  static device::PdoDirection Other(device::PdoDirection direction) {
    return direction == device::PdoDirection::kRx ? device::PdoDirection::kTx : device::PdoDirection::kRx;
  }

  void Evaluate(const mailbox::SdoTransfer& e, const Write& write) {
    const device::DeviceDescription& family = *context().slave(e.slave).profile;
    const auto entry = process::MappingEntry::FromValue(write.value);
    const device::PdoDirection direction = DirectionOf(e.index);
    if (entry.index == 0) return;
    if (entry.bits == 0) {
      ReportEntry(e, write, kNoBits, LengthOf(family, entry));
      return;
    }
    const device::Mappable mappable = family.MappableIn(direction, entry.index, entry.subindex);
    if (mappable == device::Mappable::kUnknown) {
      NotEvaluable(e.slave, ReasonCode::kNotInProfile, kMappableObjects, FrameOf(e).number);
      return;
    }
    if (mappable == device::Mappable::kNo) {
      if (e.outcome != mailbox::SdoOutcome::kAborted && MappableInRelative(family, direction, entry)) return;
      const bool wrong_way = family.MappableIn(Other(direction), entry.index, entry.subindex) != device::Mappable::kNo;
      const bool exists = family.object(entry.index, entry.subindex) != nullptr;
      ReportEntry(e, write, wrong_way ? kWrongDirection : exists ? kNotMappable : kNotListed);
      return;
    }
    const std::optional<std::uint32_t> wanted = WrongLength(family, direction, entry);
    if (!wanted) return;
    ReportEntry(e, write, kWrongLength, *wanted);
  }

  /// The manual describes no free mapping, and a drive of the same maker can map the object.
  static bool MappableInRelative(const device::DeviceDescription& family, device::PdoDirection direction,
                                 const process::MappingEntry& entry) {
    if (family.pdo.flexible) return false;
    for (const device::DeviceDescription* relative : events::Relatives(family)) {
      const device::Mappable there = relative->MappableIn(direction, entry.index, entry.subindex);
      if (there == device::Mappable::kYes || there == device::Mappable::kConditional) return true;
    }
    return false;
  }

  /// The length of the object, if no source allows the mapped one.
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

  /// Bits of the object; 0: not known.
  static std::uint16_t LengthOf(const device::DeviceDescription& family, const process::MappingEntry& entry) {
    const device::DictionaryObject* const row = family.object(entry.index, entry.subindex);
    return row != nullptr ? device::BitsOf(row->TypeOf(entry.subindex)) : std::uint16_t{0};
  }

  /// @param expected_bits  0: not known
  void ReportEntry(const mailbox::SdoTransfer& e, const Write& write, const FindingKind& kind,
                   std::uint32_t expected_bits = 0) {
    const device::DeviceDescription& family = *context().slave(e.slave).profile;
    const auto entry = process::MappingEntry::FromValue(write.value);
    const device::PdoDirection direction = DirectionOf(e.index);
    Finding finding = Found(kind, e.slave, FrameOf(e));
    finding.Set("mapped", MappedValue(write.value, family))
        .Set("bits", arg::Number(entry.bits))
        .Set("in", arg::Object(e.index, write.subindex))
        .Set("size", arg::Count(entry.bits, "bit"))
        .Set("pdo", arg::Object(e.index))
        .Set("manual", arg::Text(family.title));
    if (&kind == &kWrongDirection) {
      finding.Set("direction", PdoDirectionValue(direction))
          .Set("right_direction", PdoDirectionValue(Other(direction)));
    } else if (expected_bits != 0) {
      finding.Set("expected_bits", arg::Number(expected_bits)).Set("expected_size", arg::Count(expected_bits, "bit"));
    }
    if (const device::DictionaryObject* row = family.object(entry.index, entry.subindex); row != nullptr) {
      if (!row->source.empty()) finding.reference = ReferenceTo(row->source);
    }
    if (finding.reference.document.empty() && !family.pdo.source.empty()) {
      finding.reference = ReferenceTo(family.pdo.source);
    }
    // Entries without bits have one cause: one finding for all of a PDO.
    const std::uint32_t entry_key = &kind == &kNoBits ? 0 : write.value;
    ReportDownload(e, e.index, std::uint64_t{e.index} << 32U | entry_key, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<PdoNotMappable>};

}  // namespace
}  // namespace ecaudit::pdo_not_mappable
