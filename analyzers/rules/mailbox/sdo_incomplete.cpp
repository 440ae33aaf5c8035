#include <map>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"
#include "decoder/pipeline.h"

namespace ecaudit::sdo_incomplete {
namespace {

constexpr RuleInfo kInfo{.id = "sdo-incomplete",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kWarning,
                         .subject = Subject::kCoe,
                         .title = "A segmented SDO transfer never finishes, or not with the size it began with",
                         .needs = "the initiate of the transfer and its answer",
                         .source = "ETG1000.6, SDO services",
                         .doc = R"(
## What it checks
Segmented SDO transfers (more data than one mailbox holds) that begin and are neither finished nor aborted: the master
begins another transfer, takes the slave back to INIT, or simply stops. And those whose last segment comes with more or
less data than the initiate announced.

## Why it matters
The value is not whole. The slave keeps the transfer open, and some reject every later request ("no memory", "service
already in work").

## How it is decided
The slave answered the initiate or a segment, and the announced size was not reached. At the end of the capture only
when the master was silent for longer than 1 s (the limit of mailbox-no-response) before it; otherwise the rest may just
be missing. What ends with another size is an info where the slave sent it: some announce the room for a text, not its
length. Where a segment request got no answer, caused_by names mailbox-no-response. Requests in one piece without an
answer are no matter of this rule.

## Example
A master whose buffer is too small for the announced size reads no segment and asks for the next object.

## What to do
Finish the transfer, or abort it (command 0x80 with 0x05040000 or 0x08000000).
)"};

class SdoIncomplete final : public Rule {
 public:
  SdoIncomplete() : Rule(kInfo) { Subscribe<mailbox::SdoTransfer>(&SdoIncomplete::On); }

  void On(const mailbox::SdoTransfer& t) {
    if (t.kind != mailbox::SdoTransferKind::kSegmented || !t.answered) return;
    if (t.outcome == mailbox::SdoOutcome::kGap) {
      NotEvaluable(t.slave, "frames are missing from the capture during a segmented transfer", t.last.number);
    }
    // Else sdo-toggle says why, or what is missing is missing from the capture.
    const bool whole = t.toggle_errors == 0 && !t.answer_lost && !MissesPackets(context().pairing());
    if (t.size_mismatch && t.declared_size && whole) EndedOtherwise(t);
    if (!t.incomplete()) return;
    if (t.answer_lost) {
      NotEvaluable(t.slave, "a lost frame may have carried the rest of a segmented transfer", t.last.number);
      return;
    }
    if (t.outcome == mailbox::SdoOutcome::kCaptureEnd && !SilentSince(t.last)) {
      NotEvaluable(t.slave, "the capture ends during a segmented transfer", t.last.number);
      return;
    }
    const FrameRef& frame = t.request.seen() ? t.request : t.last;
    const std::uint64_t key = KeyOf(t);
    FindingIndex index = Repeat(t.slave, key, frame);
    if (index == kNoFinding) index = Report(key, Describe(t, frame));
    if (index == kNoFinding) return;
    AddRelated(context().store[index], t.last.number);
    // For mailbox errors that the slave gives because of it.
    context().ExplainRequest(t.slave, frame.number, index);
    waiting_.emplace(index, t.last.number);
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    for (const auto& [index, request] : waiting_) {
      Finding& finding = context().store[index];
      const FindingIndex cause = context().ExplanationOf(finding.slave, request);
      if (cause != index) finding.caused_by = cause;
    }
  }

 private:
  [[nodiscard]] bool SilentSince(const FrameRef& last) const {
    const FrameRef& end = context().statistics().last;
    return end.has_time && last.has_time &&
           end.time - last.time >= context().Limit("mailbox-no-response", kMailboxAnswerLimit);
  }

  void EndedOtherwise(const mailbox::SdoTransfer& t) {
    constexpr std::uint64_t kEnded = 1ULL << 40U;
    const std::uint64_t key = KeyOf(t) | kEnded;
    if (Repeat(t.slave, key, t.last) != kNoFinding) return;
    const bool upload = t.service == mailbox::SdoService::kUpload;
    const bool less = t.size < *t.declared_size;
    const std::string service(Name(t.service));
    const std::string object = ObjectOf(t);
    Finding finding;
    finding.slave = t.slave;
    finding.first = t.last;
    finding.confidence = ConfidenceOf(t.certainty);
    finding.title = "SDO " + service + " of " + object + " ends after " + std::to_string(t.size) + " of " +
                    std::to_string(*t.declared_size) + " bytes announced";
    finding.message = "The segmented " + service + " of " + object + " was begun with " +
                      Count(*t.declared_size, "byte") + (upload ? " by the slave" : " by the master") +
                      "; the segment marked as the last one (frame " + std::to_string(t.last.number) +
                      ") ends it after " + std::to_string(t.size) + ". ";
    if (upload) {
      finding.message +=
          less ? "Either the value is not whole, or the slave announced the room it has for it."
               : "The slave announced too little, and a master that reserved that much has lost the rest.";
    } else {
      finding.message += "The slave accepted it; what it made of the value is not known.";
    }
    AddTransfer(finding, t);
    AddRelated(finding, t.request.number);
    Report(key, upload ? Severity::kInfo : Severity::kWarning, std::move(finding));
  }

  [[nodiscard]] std::string ObjectOf(const mailbox::SdoTransfer& t) const {
    return t.has_object ? ObjectText(t, *context().slave(t.slave).profile)
                        : std::string("an object not in the capture");
  }

  static void AddTransfer(Finding& finding, const mailbox::SdoTransfer& t) {
    finding.evidence.push_back(Text("service", std::string(Name(t.service))));
    if (t.has_object) {
      finding.evidence.push_back(HexNumber("index", t.index));
      finding.evidence.push_back(Number("subindex", t.subindex));
    }
    finding.evidence.push_back(Number("bytes", static_cast<std::int64_t>(t.size)));
    if (t.declared_size) finding.evidence.push_back(Number("announced", *t.declared_size));
  }

  static std::uint64_t KeyOf(const mailbox::SdoTransfer& t) {
    return static_cast<std::uint64_t>(t.index) | static_cast<std::uint64_t>(t.subindex) << 16U |
           static_cast<std::uint64_t>(t.service) << 24U;
  }

  [[nodiscard]] Finding Describe(const mailbox::SdoTransfer& t, const FrameRef& frame) const {
    const std::string object = ObjectOf(t);
    const std::string service(Name(t.service));
    const std::string of = t.declared_size ? " of " + std::to_string(*t.declared_size) : std::string();
    Finding finding;
    finding.slave = t.slave;
    finding.first = frame;
    finding.confidence = ConfidenceOf(t.certainty);
    finding.title = "SDO " + service + " of " + object + " left unfinished";
    finding.message = "The segmented " + service + " of " + object + " got as far as " + std::to_string(t.size) + of +
                      " bytes (frame " + std::to_string(t.last.number) + "), then ";
    switch (t.outcome) {
      case mailbox::SdoOutcome::kSuperseded:
        finding.message += "the master began another transfer";
        break;
      case mailbox::SdoOutcome::kReset:
        finding.message += "the mailbox was reset";
        break;
      default:
        finding.message += "nothing followed until the end of the capture";
        break;
    }
    finding.message += t.outcome == mailbox::SdoOutcome::kReset
                           ? ". It was neither finished nor aborted before."
                           : ". It was not aborted, so the slave still holds it open. Finish or abort it.";
    AddTransfer(finding, t);
    finding.evidence.push_back(Text("ended", std::string(Name(t.outcome))));
    return finding;
  }

  std::map<FindingIndex, FrameNo> waiting_;  // last frame of each: a request that was perhaps not answered
};

const RuleRegistration kRegistration{kInfo, MakeRule<SdoIncomplete>};

}  // namespace
}  // namespace ecaudit::sdo_incomplete
