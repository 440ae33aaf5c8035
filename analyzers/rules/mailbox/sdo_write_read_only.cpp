#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::sdo_write_read_only {
namespace {

constexpr FindingKind kWritten{
    .name = "written",
    .title = "Download to {object:number}, which is {access}",
    .message = R"(The master writes {size} to {object}[{?complete_access} (complete access)] in {frame}. The object is
{access} ({source}).[ The slave aborted the download with {abort_code}.])",
    .next = "Remove the download from the configuration, or check which object is meant.",
    .identity = "object"};

constexpr FindingKind kAccepted{
    .name = "accepted",
    .title = "Download to {object:number} accepted, documented as {access}",
    .message = R"(The master writes {size} to {object}[{?complete_access} (complete access)] in {frame}, and the slave
accepts it. The object is {access} ({source}): the slave allows more than the document.)",
    .next = "",
    .identity = "object"};

constexpr const FindingKind* kKinds[] = {&kWritten, &kAccepted};

constexpr Word kReadOnly{"ro", "read-only"};
constexpr Word kConstant{"const", "constant"};
constexpr Word kAccessRights{"access-rights", "the access rights of an object", true};

// Several rules may explain one finding: the first that does so wins.
constexpr std::string_view kAfter[] = {"sdo-unknown-object"};

constexpr RuleInfo kInfo{.id = "sdo-write-read-only",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .history = History::kNone,
                         .subject = Subject::kCoe,
                         .title = "A download to an object that is read-only",
                         .needs = "the object in the dictionary of the family or of the standard",
                         .source = "ETG1000.6, CoE objects; CIA402, standard objects; MKD, 5.2, 5.3",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
SDO downloads to objects that the dictionary marks as read-only or constant.

## Why it matters
The drive aborts with 0x06010002 and keeps its value. In a configuration this line belongs to another drive or
firmware, or the index is mistyped.

## How it is decided
The dictionary of the slave's family decides. If the manual of the family lists no access rights (AKD, Pilz), the
objects that the standards define for all devices decide (1000h, 1018h, 6041h, ...).

- An object that neither of them lists is not evaluated.
- If the slave aborts because the object or subindex does not exist, the dictionary does not fit: no finding.
- If the slave accepts the download, the drive allows more than its manual: an info.
- If the capture does not show the answer, the finding is inferred.
- A download by complete access is evaluated only if every entry of the object is read-only.

## Example
samples/captures/sdo-aborts.pcapng: a download to 1018h:1, the vendor ID.

## What to do
Remove the download from the configuration, or check which object is meant.
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
      NotEvaluable(t.slave, ReasonCode::kNotInProfile, kAccessRights, t.request.number);
      return;
    }
    if (object->access != device::Access::kRead && !object->constant) return;
    const bool accepted = t.outcome == mailbox::SdoOutcome::kCompleted;
    const bool aborted = t.outcome == mailbox::SdoOutcome::kAborted;
    const std::uint64_t key = static_cast<std::uint64_t>(t.index) | static_cast<std::uint64_t>(t.subindex) << 16U |
                              (accepted ? 1ULL << 24U : 0U) | (t.complete_access ? 1ULL << 25U : 0U);
    FindingIndex index = Repeat(t.slave, key, t.request);
    if (index == kNoFinding) {
      Finding finding = Found(accepted ? kAccepted : kWritten, t.slave, t.request);
      finding.confidence = aborted || accepted ? ConfidenceOf(t.certainty) : Confidence::kInferred;
      finding.reference = ReferenceTo(object->source);
      SetObject(finding, t, family);
      finding.Set("access", arg::Of(object->constant ? kConstant : kReadOnly))
          .Set("outcome", OutcomeValue(t.outcome))
          .Set("size", arg::Count(t.size, "byte"))
          .Set("source", arg::Text(object->source));
      if (aborted) finding.Set("abort_code", arg::Code(t.abort_code, mailbox::AbortCodeText(t.abort_code), 8));
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

  /// The row that decides; of the whole object a writable one, if there is any.
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
