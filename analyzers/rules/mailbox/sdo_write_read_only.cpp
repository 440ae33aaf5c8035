#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::sdo_write_read_only {
namespace {

constexpr RuleInfo kInfo{.id = "sdo-write-read-only",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .needs_no_history = true,
                         .subject = Subject::kCoe,
                         .title = "A download to an object that is read-only",
                         .needs = "the object in the dictionary of the family or of the standard",
                         .source = "ETG1000.6, CoE objects; CIA402, standard objects; MKD, 5.2, 5.3",
                         .doc = R"(
## What it checks
SDO downloads to objects that the dictionary marks read-only or constant.

## Why it matters
The drive aborts with 0x06010002 and keeps its value. In a configuration this is a line that belongs to another drive or
firmware, or a typing error in the index.

## How it is decided
By the dictionary of the slave's family; where its manual prints none (AKD, Pilz), by the objects that the standards
define alike for all devices (1000h, 1018h, 6041h, ...). What neither says is not judged. Where the slave aborts with
"object" or "subindex does not exist", the dictionary does not fit it and nothing is said. Where the slave accepts the
download, the drive offers more than its manual says: an info. Not seen whether it does: inferred. A download by
complete access is judged when every entry of the object is read-only.

## Example
samples/captures/sdo-aborts.pcapng: a download to 1018h:1, the vendor ID.

## What to do
Take the download out of the configuration, or look up which object was meant.
)"};

class SdoWriteReadOnly final : public Rule {
 public:
  SdoWriteReadOnly() : Rule(kInfo) { Subscribe<mailbox::SdoTransfer>(&SdoWriteReadOnly::On); }

  void On(const mailbox::SdoTransfer& t) {
    if (t.service != mailbox::SdoService::kDownload || !t.has_object || !t.request.seen()) return;
    if (DeniesObject(t)) return;
    const device::DeviceDescription& family = *context().slave(t.slave).profile;
    const device::DictionaryObject* object = Lookup(t, family);
    if (object == nullptr || (object->access == device::Access::kUnknown && !object->constant)) {
      NotEvaluable(t.slave, "the access rights of an object are not known", t.request.number);
      return;
    }
    if (object->access != device::Access::kRead && !object->constant) return;
    const bool accepted = t.outcome == mailbox::SdoOutcome::kCompleted;
    const bool aborted = t.outcome == mailbox::SdoOutcome::kAborted;
    const std::uint64_t key = static_cast<std::uint64_t>(t.index) | static_cast<std::uint64_t>(t.subindex) << 16U |
                              (accepted ? 1ULL << 24U : 0U) | (t.complete_access ? 1ULL << 25U : 0U);
    FindingIndex index = Repeat(t.slave, key, t.request);
    if (index == kNoFinding) {
      Finding finding;
      finding.slave = t.slave;
      finding.first = t.request;
      finding.confidence = aborted || accepted ? ConfidenceOf(t.certainty) : Confidence::kInferred;
      finding.title =
          "Download to " + ObjectText(t, family) + ", which is " + (object->constant ? "constant" : "read-only");
      finding.message = "The master writes " + Count(t.size, "byte") + " to " + ObjectText(t, family) + " in frame " +
                        std::to_string(t.request.number) + ", but the object is " +
                        (object->constant ? "constant" : "read-only") + " (" + object->source + "). ";
      if (accepted) {
        finding.message += "The slave accepted it: it allows more than the document says.";
      } else if (aborted) {
        finding.message +=
            "The slave aborted with " + Hex(t.abort_code, 8) + ". Take the download out of the configuration.";
      } else {
        finding.message += "Take the download out of the configuration.";
      }
      finding.reference = ReferenceTo(object->source);
      finding.evidence.push_back(HexNumber("index", t.index));
      finding.evidence.push_back(Number("subindex", t.subindex));
      finding.evidence.push_back(Text("access", object->constant ? "const" : "ro"));
      finding.evidence.push_back(Text("outcome", std::string(Name(t.outcome))));
      AddRelated(finding, t.response.number);
      index = Report(key, accepted ? Severity::kInfo : Severity::kError, std::move(finding));
    }
    ExplainAbort(context(), t, index);
  }

 private:
  static bool DeniesObject(const mailbox::SdoTransfer& t) {
    constexpr std::uint32_t kNoObject = 0x06020000;
    constexpr std::uint32_t kNoSubindex = 0x06090011;
    return t.outcome == mailbox::SdoOutcome::kAborted && (t.abort_code == kNoObject || t.abort_code == kNoSubindex);
  }

  /// The row that decides: of the whole object one that may be written, if there is any.
  static const device::DictionaryObject* Lookup(const mailbox::SdoTransfer& t,
                                                const device::DeviceDescription& family) {
    if (!t.complete_access) return family.object(t.index, t.subindex);
    const device::DictionaryObject* decisive = nullptr;
    for (unsigned sub = 0; sub <= 0xFF; ++sub) {
      const device::DictionaryObject* row = family.object(t.index, static_cast<std::uint8_t>(sub));
      if (row == nullptr) continue;
      if (row->access != device::Access::kRead && !row->constant) return row;
      decisive = row;
    }
    return decisive;
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<SdoWriteReadOnly>};

}  // namespace
}  // namespace ecaudit::sdo_write_read_only
