#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::sdo_unknown_object {
namespace {

constexpr FindingKind kUnknown{
    .name = "unknown",
    .title = "{service} of {object}, which is not in the dictionary of the drive",
    .message = R"(The master {access} {object} in {frame}. The dictionary of {family} ({source}) does not have this
object.)",
    .next = "Check that the configuration belongs to this drive and its firmware.",
    .identity = "service object"};

constexpr FindingKind kAccepted{
    .name = "accepted",
    .title = "{object} exists, but is not in the dictionary of the drive",
    .message =
        R"(The master {access} {object} in {frame}, and the slave [{?read}answers][{!read}accepts it]. The dictionary of {family} ({source}) does
not have this object. The firmware of the slave may be newer than the manual.)",
    .next = "",
    .identity = "service object"};

constexpr const FindingKind* kKinds[] = {&kUnknown, &kAccepted};

constexpr Word kWrites{"writes", "writes"};
constexpr Word kReads{"reads", "reads"};
constexpr Word kCompleteDictionary{"complete-dictionary", "a complete object dictionary"};

// Several rules may explain one finding: the first that does so wins.
constexpr std::string_view kAfter[] = {"sdo-toggle"};

constexpr RuleInfo kInfo{.id = "sdo-unknown-object",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kWarning,
                         .history = History::kNone,
                         .subject = Subject::kCoe,
                         .title = "The dictionary of the family does not have an accessed object",
                         .needs = "a dictionary that claims to be complete",
                         .source = "MKD, 5.2",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
SDO transfers of objects whose index is not in the dictionary of the slave's family.

## Why it matters
The drive aborts with 0x06020000. In a configuration this line belongs to another drive.

## How it is decided
The manual of the family has to state that its table lists all objects (MKD-C).

- A download is a warning.
- A download that the slave accepts is an info: the drive has more objects than its manual lists.
- An upload is an info: masters read optional objects to find out whether they exist.

## Example
A download of 6060h:0 to an MKD-C, which is a power supply.

## What to do
Check that the configuration belongs to this drive and its firmware.
)"};

class SdoUnknownObject final : public Rule {
 public:
  SdoUnknownObject() : Rule(kInfo) { Subscribe<mailbox::SdoTransfer>(&SdoUnknownObject::On); }

  void On(const mailbox::SdoTransfer& t) {
    if (!t.has_object || t.service == mailbox::SdoService::kUnknown) return;
    const device::DeviceDescription& family = *context().slave(t.slave).profile;
    if (!family.dictionary || !family.dictionary->complete) {
      NotEvaluable(t.slave, ReasonCode::kNotInProfile, kCompleteDictionary, t.request.number);
      return;
    }
    if (family.dictionary->FindIndex(t.index) != nullptr) return;
    const bool accepted = t.outcome == mailbox::SdoOutcome::kCompleted;
    const bool download = t.service == mailbox::SdoService::kDownload;
    const FrameRef& frame = t.request.seen() ? t.request : t.last;
    const std::uint64_t key = static_cast<std::uint64_t>(t.index) | static_cast<std::uint64_t>(t.service) << 16U |
                              (accepted ? 1ULL << 24U : 0U);
    FindingIndex index = Repeat(t.slave, key, frame);
    if (index == kNoFinding) {
      Finding finding = Found(accepted ? kAccepted : kUnknown, t.slave, frame);
      finding.confidence = ConfidenceOf(t.certainty);
      finding.reference = ReferenceTo(family.dictionary->source);
      finding.Set("object", arg::Object(t.index))
          .Set("index", arg::Hex(t.index))
          .Set("service", ServiceValue(t.service))
          .Set("access", arg::Of(download ? kWrites : kReads))
          .Set("read", arg::Flag(!download))
          .Set("outcome", OutcomeValue(t.outcome))
          .Set("family", arg::Text(family.title))
          .Set("source", arg::Text(family.dictionary->source));
      AddRelated(finding, t.response.number);
      index = Report(key, download && !accepted ? Severity::kWarning : Severity::kInfo, std::move(finding));
    }
    ExplainAbort(context(), t, index);
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<SdoUnknownObject>};

}  // namespace
}  // namespace ecaudit::sdo_unknown_object
