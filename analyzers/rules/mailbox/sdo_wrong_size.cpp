#include <optional>

#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::sdo_wrong_size {
namespace {

constexpr FindingKind kWrongSize{.name = "wrong-size",
                                 .title = "{bytes} written to {object:number}[, which is {type} ({expected_bytes})]",
                                 .message = R"(The master writes {bytes} to {object} in {frame}. The object [is {type},
{expected_bytes} ({source})][{!type}has another size ({source})].[{?accepted} The slave accepted the download. The
capture does not show which value it used.][ The slave aborted the download with {abort_code}.])",
                                 .next = "Correct the data type in the start-up list of the master.",
                                 .identity = "object"};

constexpr FindingKind kTextTooLong{.name = "text-too-long",
                                   .title = "{bytes} written to {object:number}, at most {most_bytes} allowed",
                                   .message = R"(The master writes a text of {bytes} to {object} in {frame}. The manual
prints a length of {most_bytes} ({source}).[{?accepted} The slave accepted the download. The capture does not show how
much of the text it kept.][ The slave aborted the download with {abort_code}.])",
                                   .next = "Shorten the text in the start-up list of the master.",
                                   .identity = "object"};

constexpr const FindingKind* kKinds[] = {&kWrongSize, &kTextTooLong};

constexpr Word kType{"object-type", "the data type of an object"};

// Several rules may explain one finding: the first that does so wins.
constexpr std::string_view kAfter[] = {"sdo-write-read-only"};

constexpr RuleInfo kInfo{.id = "sdo-wrong-size",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .subject = Subject::kCoe,
                         .title = "A download has another size than the object",
                         .needs = "the object's type in the dictionary of the family or of the standard",
                         .source = "ETG1000.6, CoE objects; CIA402, standard objects; MKD, 5.2, 5.3",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
The size of SDO downloads against the type of the object: 2 bytes for INT16, and so on.

## Why it matters
The drive aborts with 0x06070010, 0x06070012 or 0x06070013, or it uses only a part of the value.

## How it is decided
The type in the dictionary of the slave's family decides. If the manual of the family has no dictionary (AKD, Pilz),
these decide: the objects that the standards define for all devices, and then its list of cyclic objects (AKD 20A4h). A
text counts if the manual prints its longest length. If the drive accepts the download, the finding is a warning.

Not evaluated are:

- texts whose length the manual does not print, records, and objects whose type is not known
- downloads by complete access, and expedited downloads that indicate no size
- uploads: the drive knows its own objects

## Example
samples/captures/sdo-aborts.pcapng: 2 bytes written to 60FFh:0, an INT32.

## What to do
Correct the data type of this line in the start-up list of the master.
)"};

class SdoWrongSize final : public Rule {
 public:
  SdoWrongSize() : Rule(kInfo) { Subscribe<mailbox::SdoTransfer>(&SdoWrongSize::On); }

  void On(const mailbox::SdoTransfer& t) {
    if (t.service != mailbox::SdoService::kDownload || !t.has_object || !t.request.seen() || t.complete_access) return;
    const std::optional<std::uint64_t> bytes = SizeOf(t);
    if (!bytes || DeniesObject(t)) return;
    const device::DeviceDescription& family = *context().slave(t.slave).profile;
    const device::DictionaryObject* object = family.object(t.index, t.subindex);
    std::optional<device::DictionaryObject> cyclic;
    if (object == nullptr || object->types.empty()) {
      cyclic = CyclicObject(family, t);
      if (cyclic) object = &*cyclic;
    }
    if (object == nullptr || object->types.empty()) {
      NotEvaluable(t.slave, ReasonCode::kNotInProfile, kType, t.request.number);
      return;
    }
    const bool too_long = object->max_bytes != 0 && *bytes > object->max_bytes;
    if (!too_long && Allows(*object, t.subindex, *bytes)) return;
    const bool accepted = t.outcome == mailbox::SdoOutcome::kCompleted;
    const bool aborted = t.outcome == mailbox::SdoOutcome::kAborted;
    const std::uint64_t key = static_cast<std::uint64_t>(t.index) | static_cast<std::uint64_t>(t.subindex) << 16U |
                              (accepted ? 1ULL << 24U : 0U) | (*bytes & 0xFFFFFFFFU) << 32U;
    FindingIndex index = Repeat(t.slave, key, t.request);
    if (index == kNoFinding) {
      const device::DataType type = object->TypeOf(t.subindex);
      Finding finding = Found(too_long ? kTextTooLong : kWrongSize, t.slave, t.request);
      finding.confidence = aborted || accepted ? ConfidenceOf(t.certainty) : Confidence::kInferred;
      finding.reference = ReferenceTo(object->source);
      SetObject(finding, t, family);
      finding.Set("bytes", arg::Count(*bytes, "byte"));
      if (too_long) {
        finding.Set("most_bytes", arg::Count(object->max_bytes, "byte"));
      } else if (type != device::DataType::kUnknown) {
        finding.Set("type", arg::Text(device::DataTypeName(type)))
            .Set("expected_bytes", arg::Count((device::BitsOf(type) + 7U) / 8U, "byte"));
      }
      finding.Set("outcome", OutcomeValue(t.outcome))
          .Set("accepted", arg::Flag(accepted))
          .Set("source", arg::Text(object->source));
      if (aborted) finding.Set("abort_code", arg::Code(t.abort_code, mailbox::AbortCodeText(t.abort_code), 8));
      AddRelated(finding, t.response.number);
      index = Report(key, accepted ? Severity::kWarning : Severity::kError, std::move(finding));
    }
    if (AbortFits(t)) ExplainAbort(context(), t, index);
  }

 private:
  /// The object in the list of cyclic objects, where a manual prints no dictionary.
  static std::optional<device::DictionaryObject> CyclicObject(const device::DeviceDescription& family,
                                                              const mailbox::SdoTransfer& t) {
    for (const device::CyclicObject& row : family.pdo.cyclic) {
      if (row.index != t.index || row.subindex != t.subindex || row.type == device::DataType::kUnknown) continue;
      device::DictionaryObject object;
      object.index = row.index;
      object.subindex = object.last_subindex = row.subindex;
      object.types = {row.type};
      object.name = row.name;
      object.source = row.source;
      return object;
    }
    return std::nullopt;
  }

  /// What the master announced, else what a download in one piece carried; nothing if only a part is in the capture.
  static std::optional<std::uint64_t> SizeOf(const mailbox::SdoTransfer& t) {
    if (t.declared_size) return *t.declared_size;
    if (t.kind == mailbox::SdoTransferKind::kNormal) return t.size;
    return std::nullopt;
  }

  static bool Allows(const device::DictionaryObject& object, std::uint8_t subindex, std::uint64_t bytes) {
    if (bytes > 0xFFFF) return object.AllowsBits(subindex, 0xFFFF'FFF8U);  // only what has no fixed size
    const auto bits = static_cast<std::uint32_t>(bytes * 8U);
    return object.AllowsBits(subindex, bits) || (bits == 8 && object.AllowsBits(subindex, 1));
  }

  static bool DeniesObject(const mailbox::SdoTransfer& t) {
    constexpr std::uint32_t kNoObject = 0x06020000;
    constexpr std::uint32_t kNoSubindex = 0x06090011;
    return t.outcome == mailbox::SdoOutcome::kAborted && (t.abort_code == kNoObject || t.abort_code == kNoSubindex);
  }

  /// False if the code names another reason, for example read-only.
  static bool AbortFits(const mailbox::SdoTransfer& t) {
    const std::uint32_t code = t.displaced_abort_code.value_or(t.abort_code);
    return code >> 16U == 0x0607 || code >> 16U == 0x0800 || mailbox::AbortCodeText(code).empty();
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<SdoWrongSize>};

}  // namespace
}  // namespace ecaudit::sdo_wrong_size
