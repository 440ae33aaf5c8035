#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::sdo_unknown_object {
namespace {

constexpr RuleInfo kInfo{.id = "sdo-unknown-object",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kWarning,
                         .needs_no_history = true,
                         .subject = Subject::kCoe,
                         .title = "An object is accessed that the family's dictionary does not have",
                         .needs = "a dictionary that claims to be complete",
                         .source = "MKD, 5.2",
                         .doc = R"(
## What it checks
SDO transfers for objects whose index is missing from the dictionary of the slave's family.

## Why it matters
The drive aborts with 0x06020000. In a configuration the line belongs to another drive.

## How it is decided
Only where the manual says that its table lists all objects (MKD-C). A download is a warning, unless the slave accepts
it: then the drive has more than its manual says, an info. An upload is an info in any case: masters ask for optional
objects to find out what there is.

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
      NotEvaluable(t.slave, "no dictionary of this family claims to be complete", t.request.number);
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
      const std::string object = ObjectName(t.index);
      Finding finding;
      finding.slave = t.slave;
      finding.first = frame;
      finding.confidence = ConfidenceOf(t.certainty);
      finding.title = object + " is not in the dictionary of this drive";
      finding.message = std::string(download ? "The master writes " : "The master reads ") + object + " in frame " +
                        std::to_string(frame.number) + ", but the dictionary of " + family.title + " (" +
                        family.dictionary->source + ") does not have it. ";
      finding.message += accepted ? "The slave has it all the same: its firmware is newer than the manual."
                                  : "Check that the configuration belongs to this drive.";
      finding.reference = ReferenceTo(family.dictionary->source);
      finding.evidence.push_back(HexNumber("index", t.index));
      finding.evidence.push_back(Text("service", std::string(Name(t.service))));
      finding.evidence.push_back(Text("outcome", std::string(Name(t.outcome))));
      AddRelated(finding, t.response.number);
      index = Report(key, download && !accepted ? Severity::kWarning : Severity::kInfo, std::move(finding));
    }
    ExplainAbort(context(), t, index);
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<SdoUnknownObject>};

}  // namespace
}  // namespace ecaudit::sdo_unknown_object
