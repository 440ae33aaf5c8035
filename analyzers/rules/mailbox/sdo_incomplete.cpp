#include <map>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/mailbox/events.h"
#include "decoder/pipeline.h"

namespace ecaudit::sdo_incomplete {
namespace {

constexpr FindingKind kUnfinished{
    .name = "unfinished",
    .title =
        "SDO {service}[ of {object:number}] left unfinished after [{bytes:number} of {announced}][{!announced}{bytes}]",
    .message =
        R"(The segmented {service} of [{object}[{?complete_access} (complete access)]][{!object}an object that is not in
the capture] reached [{bytes:number} of {announced}][{!announced}{bytes}] in {last_segment_frame}. Then {ended}. The
transfer was neither finished nor aborted.[{?open} The slave keeps it open.])",
    .next = "Finish the transfer, or abort it (0x05040000 or 0x08000000).",
    .identity = "service object"};

constexpr FindingKind kOtherSize{
    .name = "other-size",
    .title = "SDO {service}[ of {object:number}] ends after {bytes:number} of {announced}",
    .message = R"(The [{?upload}slave][{!upload}master] announced {announced} for the segmented {service} of
[{object}[{?complete_access} (complete access)]][{!object}an object that is not in the capture]. The last segment, in
{frame}, ends it after {bytes}.[{?upload}[{?less} Either the value is not complete, or the slave announced the size of
its buffer.][{!less} A master that reserved only the announced size has lost the rest.]][{!upload} The slave accepted
the transfer. The capture does not show which value it used.])",
    .next =
        R"([{?upload}Compare the value with the one that the slave should have.][{!upload}Correct the size that the
master announces, or the data that it sends.])",
    .identity = "service object"};

constexpr const FindingKind* kKinds[] = {&kUnfinished, &kOtherSize};

constexpr Word kSegmentedTransfer{"segmented-transfer", "a segmented transfer"};
constexpr Word kFrameOfTransfer{"frame-of-transfer", "a frame of a segmented transfer"};

// ExplainRequest(): the later rule names the nearer cause.
constexpr std::string_view kAfter[] = {"mailbox-no-response"};

constexpr RuleInfo kInfo{.id = "sdo-incomplete",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kWarning,
                         .history = History::kWhole,
                         .subject = Subject::kCoe,
                         .title = "A segmented SDO transfer does not finish, or not with its size",
                         .needs = "the initiate of the transfer and its answer",
                         .source = "ETG1000.6, SDO services",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Segmented SDO transfers, which have more data than one mailbox holds:

- transfers that begin and are neither finished nor aborted: the master begins another transfer, takes the slave back
  to INIT, or stops
- transfers whose last segment comes with more or less data than the initiate announced

## Why it matters
The value is not complete. The slave keeps the transfer open, and some slaves then reject every later request ("no
memory", "service already in work").

## How it is decided
The slave answered the initiate or a segment, and the transfer did not reach the announced size.

- At the end of the capture the transfer counts only if the master was silent for more than 1 s before it (the limit of
  mailbox-no-response). Otherwise the rest may be missing from the capture.
- An upload that ends with another size is an info: some slaves announce the size of the buffer, not of the text.
- If a segment request got no answer, caused_by names mailbox-no-response.
- Requests in one piece without an answer belong to mailbox-no-response.

## Example
A master whose buffer is too small for the announced size reads no segment and requests the next object.

## What to do
Finish the transfer, or abort it (command 0x80 with 0x05040000 or 0x08000000).
)"};

class SdoIncomplete final : public Rule {
 public:
  SdoIncomplete() : Rule(kInfo) { Subscribe<mailbox::SdoTransfer>(&SdoIncomplete::On); }

  void On(const mailbox::SdoTransfer& t) {
    if (t.kind != mailbox::SdoTransferKind::kSegmented || !t.answered) return;
    if (t.outcome == mailbox::SdoOutcome::kGap) {
      NotEvaluable(t.slave, ReasonCode::kMissesPackets, kFrameOfTransfer, t.last.number);
    }
    // Otherwise sdo-toggle reports the reason, or the missing part is missing from the capture.
    const bool whole = t.toggle_errors == 0 && !t.answer_lost && !MissesPackets(context().pairing());
    if (t.size_mismatch && t.declared_size && whole) ReportOtherSize(t);
    if (!t.incomplete()) return;
    if (t.answer_lost) {
      NotEvaluable(t.slave, ReasonCode::kNeverReturned, kFrameOfTransfer, t.last.number);
      return;
    }
    if (t.outcome == mailbox::SdoOutcome::kCaptureEnd && !SilentSince(t.last)) {
      NotEvaluable(t.slave, ReasonCode::kCaptureEnds, kSegmentedTransfer, t.last.number);
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

  void ReportOtherSize(const mailbox::SdoTransfer& t) {
    constexpr std::uint64_t kEnded = 1ULL << 40U;
    const std::uint64_t key = KeyOf(t) | kEnded;
    if (Repeat(t.slave, key, t.last) != kNoFinding) return;
    const bool upload = t.service == mailbox::SdoService::kUpload;
    const bool less = t.size < *t.declared_size;
    Finding finding = Found(kOtherSize, t.slave, t.last);
    finding.confidence = ConfidenceOf(t.certainty);
    SetTransfer(finding, t);
    finding.Set("upload", arg::Flag(upload)).Set("less", arg::Flag(less));
    AddRelated(finding, t.request.number);
    Report(key, upload ? Severity::kInfo : Severity::kWarning, std::move(finding));
  }

  void SetTransfer(Finding& finding, const mailbox::SdoTransfer& t) const {
    finding.Set("service", ServiceValue(t.service));
    SetObject(finding, t, *context().slave(t.slave).profile);
    finding.Set("bytes", arg::Count(t.size, "byte"));
    if (t.declared_size) finding.Set("announced", arg::Count(*t.declared_size, "byte"));
  }

  static std::uint64_t KeyOf(const mailbox::SdoTransfer& t) {
    return static_cast<std::uint64_t>(t.index) | static_cast<std::uint64_t>(t.subindex) << 16U |
           static_cast<std::uint64_t>(t.service) << 24U;
  }

  [[nodiscard]] Finding Describe(const mailbox::SdoTransfer& t, const FrameRef& frame) const {
    Finding finding = Found(kUnfinished, t.slave, frame);
    finding.confidence = ConfidenceOf(t.certainty);
    SetTransfer(finding, t);
    finding.Set("ended", OutcomeValue(t.outcome))
        .Set("last_segment_frame", arg::Frame(t.last.number))
        .Set("open", arg::Flag(t.outcome != mailbox::SdoOutcome::kReset));
    return finding;
  }

  std::map<FindingIndex, FrameNo> waiting_;  // last frame of each: a request that was perhaps not answered
};

const RuleRegistration kRegistration{kInfo, MakeRule<SdoIncomplete>};

}  // namespace
}  // namespace ecaudit::sdo_incomplete
