#include <algorithm>
#include <iterator>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/wrapping.h"
#include "decoder/mailbox/events.h"
#include "decoder/mailbox/foe.h"
#include "decoder/pipeline.h"

namespace ecaudit::foe_error {
namespace {

constexpr FindingKind kFailed{
    .name = "failed",
    .title = "FoE {service} failed: {error_code}",
    .message =
        R"({error_by} ends the FoE {service} of [file "{file_name}"][{!file_name}a file whose name is not in the
capture] with error {error_code}[ and the text "{error_text}"].[{?undefined} The standard does not define this code.]
{bytes} {bytes?was|were} transferred in {packets}.[ The transfer includes {busy}.][ {packet_errors}
{packet_errors?is|are} out of order, first in {packet_error_frame}.])",
    .next = "{advice}.",
    .identity = "service file_name error_code"};

constexpr FindingKind kUnfinished{
    .name = "unfinished",
    .title =
        "[{?no_packet}FoE {service} stops after the request, before packet 1]"
        "[{!no_packet}[{?many_busy}FoE {service} stops after {busy}][{!many_busy}FoE {service} not finished {ended}]]",
    .message = R"(The FoE {service} of [file "{file_name}"][{!file_name}a file whose name is not in the capture] was not
finished {ended}. {bytes} {bytes?was|were} transferred in {packets}, up to {frame}.[{?no_packet} The slave acknowledged the
request and waits for packet 1: a file without contents needs one, too, with no data.][ Nothing of it follows for
{silent_ms}.][ The transfer includes {busy}.][ {packet_errors} {packet_errors?is|are} out of order, first in
{packet_error_frame}.])",
    .next = "Finish the transfer, or end it with an error message, before the next request.",
    .identity = "service file_name ended"};

constexpr FindingKind kWrongState{
    .name = "wrong-state",
    .title = "FoE {service} of a {file_kind} in {state}, allowed in {states}",
    .message =
        R"(The master requests the FoE {service} of file "{file_name}" in {request_frame}. The slave is then in {state}.
By its manual a {file_kind} ({suffix}) is transferred in {states} only.[{?failed} The transfer fails.][{!failed} The
capture does not show that it fails.])",
    .next = "Request {first_state} before the transfer.",
    .identity = "service file_name state"};

constexpr const FindingKind* kKinds[] = {&kFailed, &kUnfinished, &kWrongState};

constexpr Word kRead{"read", "upload"};
constexpr Word kWrite{"write", "download"};
constexpr Word kNextBegan{"superseded", "before the next one began"};
constexpr Word kSentToInit{"reset", "before the slave was sent to INIT"};
constexpr Word kNothingFollows{"capture-end", "by the end of the capture"};
constexpr Word kTransfer{"file-transfer", "a file transfer"};
constexpr Word kEndOfTransfer{"end-of-file-transfer", "the end of a file transfer"};
constexpr Word kAnswers{"file-transfer-answers", "the answers to a file transfer", true};

constexpr Word kCheckName{"check-file-name",
                          "Check the name of the file: many devices accept only the names in their manual"};
constexpr Word kCheckPassword{"check-password", "Check the password of the request, and whether the device is locked"};
constexpr Word kCheckMemory{"check-memory",
                            "Compare the size of the file with the memory of the device: the device cannot store it"};
constexpr Word kOtherOperation{"other-operation",
                               "Do not use this operation: the device does not offer it for this file"};
constexpr Word kCheckPackets{"check-packet-numbers", "Check the packet numbers: one was lost or sent twice"};
constexpr Word kDeleteFirst{"delete-file", "Delete the file first, or use another name"};
constexpr Word kGoToBoot{"go-to-boot", "Bring the slave to BOOT first"};
constexpr Word kGoToPreop{"go-to-preop", "Bring the slave to PREOP first: it does not accept this file in BOOT"};
constexpr Word kCompareFile{
    "compare-file", "Compare version and checksum of the file: it is damaged, or it is not made for this device"};
constexpr Word kFindInManual{"find-in-manual", "Find the code in the manual of the device"};

constexpr RuleInfo kInfo{.id = "foe-error",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .history = History::kNone,
                         .title = "A file transfer fails, never ends, or comes in a wrong AL state",
                         .needs = "the FoE messages of both directions",
                         .source = "ETG1000.6, file access over EtherCAT; MKD, 3.7.4",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
File transfers (FoE) that end with an error message of the slave or the master, and transfers that the slave answered
but that never finished. The finding has the error code and its meaning, the text of the slave, the file name, and the
number of bytes transferred.

## Why it matters
After a partial transfer the device has no firmware or parameter file. It may stay in BOOT until the download is
repeated.

## How it is decided
An error message (operation 5) ends the transfer. Codes with and without the leading 0x8000 mean the same.

A transfer is unfinished in these cases:

- The next transfer begins before its last packet is acknowledged.
- The slave is sent to INIT before.
- Nothing of it follows for 1 s before the capture ends (limit `foe-error`).

A file whose ending the manual of the family names (MKD parameter files: .akd) is checked against the AL states in which
the manual allows its transfer (INIT, PREOP, SAFEOP).

Not reported are:

- a request that the slave never answered (mailbox-no-response)
- a request that it answered with a mailbox error (mailbox-error-reply)
- the end of a transfer if the capture misses packets since its begin, or all answers

## Example
tests/rules/foe-error/violates.trace: a download that ends with 0x8002.

## What to do
Use the error code:

- 0x8001: name of the file
- 0x8002, 0x8007, 0x800A: rights and password
- 0x8003, 0x8011: memory of the device
- 0x8005: lost or repeated packets
- 0x8008: bring the slave to BOOT first
- 0x800C, 0x800D, 0x8010, 0x8012: the file is damaged or not made for this device
)"};

class FoeError final : public Rule {
 public:
  FoeError() : Rule(kInfo) { Subscribe<mailbox::FoeTransfer>(&FoeError::On); }

  void On(const mailbox::FoeTransfer& t) {
    using Outcome = mailbox::FoeTransfer::Outcome;
    const FrameRef& frame = t.last.seen() ? t.last : t.request;
    CheckState(t, frame);
    switch (t.outcome) {
      case Outcome::kCompleted:
      case Outcome::kMailboxError:
        return;
      case Outcome::kNotCaptured:
        NotEvaluable(t.slave, ReasonCode::kNotInCapture, kAnswers, frame.number);
        return;
      case Outcome::kGap:
        NotEvaluable(t.slave, ReasonCode::kMissesPackets, kEndOfTransfer, frame.number);
        return;
      case Outcome::kCaptureEnd:
        if (t.answered && !Stalled(t, frame)) {
          NotEvaluable(t.slave, ReasonCode::kCaptureEnds, kTransfer, frame.number);
          return;
        }
        break;
      case Outcome::kError:
      case Outcome::kSuperseded:
      case Outcome::kReset:
        break;
    }
    if (t.outcome != Outcome::kError && !t.answered) return;
    if (t.outcome != Outcome::kError && t.answer_lost) {
      NotEvaluable(t.slave, ReasonCode::kNeverReturned, kEndOfTransfer, frame.number);
      return;
    }
    constexpr FrameNo kNow = ~FrameNo{0};
    if (t.outcome != Outcome::kError && context().network().MissesBetween(t.request.number, kNow)) {
      NotEvaluable(t.slave, ReasonCode::kMissesPackets, kEndOfTransfer, frame.number);
      return;
    }
    ReportTransfer(t, frame);
  }

  void Finish() override { (void)NotEvaluableWithoutReturns(); }

 private:
  /// What the manual of the family states of files with this ending.
  void CheckState(const mailbox::FoeTransfer& t, const FrameRef& frame) {
    const model::SlaveModel& slave = context().slave(t.slave);
    for (const device::MailboxFile& file : slave.profile->mailbox.files) {
      if (!t.write || !t.file_name.ends_with(file.suffix)) continue;
      const bool settled = std::any_of(std::begin(kStates), std::end(kStates), [&](esc::AlState state) {
        const bool allowed = std::find(file.states.begin(), file.states.end(), state) != file.states.end();
        if (allowed || !slave.al.SettledIn(state)) return false;
        ReportState(t, frame, file, state);
        return true;
      });
      if (settled) return;
    }
  }

  void ReportState(const mailbox::FoeTransfer& t, const FrameRef& frame, const device::MailboxFile& file,
                   esc::AlState state) {
    const std::uint64_t key = KeyOf(t) ^ (std::uint64_t{1} << 63U);
    if (Repeat(t.slave, key, frame) != kNoFinding) return;
    Finding finding = Found(kWrongState, t.slave, frame);
    finding.confidence = ConfidenceOf(t.certainty);
    finding.reference = ReferenceTo(file.source);
    std::vector<Value> states;
    for (const esc::AlState allowed : file.states) states.push_back(arg::State(static_cast<std::uint8_t>(allowed)));
    const bool failed = t.outcome == mailbox::FoeTransfer::Outcome::kError;
    if (!states.empty()) finding.Set("first_state", states.back());
    finding.Set("service", arg::Of(t.write ? kWrite : kRead))
        .Set("file_name", arg::Text(t.file_name))
        .Set("file_kind", arg::Text(file.name))
        .Set("suffix", arg::Text(file.suffix))
        .Set("state", arg::State(static_cast<std::uint8_t>(state)))
        .Set("states", arg::List(std::move(states)))
        .Set("request_frame", arg::Frame(t.request.seen() ? t.request.number : frame.number))
        .Set("failed", arg::Flag(failed));
    AddRelated(finding, t.request.number);
    Report(key, failed ? Severity::kError : Severity::kWarning, std::move(finding));
  }

  static constexpr esc::AlState kStates[] = {esc::AlState::INIT, esc::AlState::PREOP, esc::AlState::BOOT,
                                             esc::AlState::SAFEOP, esc::AlState::OP};

  /// Nothing of it follows although the capture continues.
  [[nodiscard]] bool Stalled(const mailbox::FoeTransfer& t, const FrameRef& frame) const {
    const FrameRef& end = context().statistics().last;
    return frame.has_time && end.has_time && t.answered &&
           end.time - frame.time >= context().Limit(kInfo.id, kMailboxAnswerLimit);
  }

  static std::uint64_t KeyOf(const mailbox::FoeTransfer& t) {
    std::uint64_t key = 0xCBF29CE484222325ULL;  // FNV-1a
    const auto add = [&key](std::uint64_t byte) { key = WrappingProduct(key ^ byte, std::uint64_t{0x100000001B3}); };
    for (const char c : t.file_name) add(static_cast<std::uint8_t>(c));
    add(static_cast<std::uint64_t>(t.outcome));
    add(t.write ? 1 : 0);
    for (unsigned i = 0; i < 4; ++i) add(t.error_code >> (8 * i) & 0xFFU);
    return key;
  }

  static const Word& EndOf(const mailbox::FoeTransfer& t) {
    using Outcome = mailbox::FoeTransfer::Outcome;
    if (t.outcome == Outcome::kSuperseded) return kNextBegan;
    return t.outcome == Outcome::kReset ? kSentToInit : kNothingFollows;
  }

  void ReportTransfer(const mailbox::FoeTransfer& t, const FrameRef& frame) {
    const std::uint64_t key = KeyOf(t);
    if (const FindingIndex known = Repeat(t.slave, key, frame); known != kNoFinding) {
      AddRelated(context().store[known], t.request.number);
      return;
    }
    const bool failed = t.outcome == mailbox::FoeTransfer::Outcome::kError;
    Finding finding = Found(failed ? kFailed : kUnfinished, t.slave, frame);
    finding.confidence = ConfidenceOf(t.certainty);
    finding.Set("service", arg::Of(t.write ? kWrite : kRead));
    if (!t.file_name.empty()) finding.Set("file_name", arg::Text(t.file_name));
    finding.Set("bytes", arg::Count(t.bytes, "byte")).Set("packets", arg::Count(t.packets, "packet"));
    if (failed) {
      SetError(finding, t);
    } else {
      finding.Set("ended", arg::Of(EndOf(t)));
      if (t.write && t.packets == 0) finding.Set("no_packet", arg::Flag());
      if (t.outcome == mailbox::FoeTransfer::Outcome::kCaptureEnd) {
        finding.Set("silent_ms", arg::Ms(context().statistics().last.time - frame.time));
      }
    }
    constexpr std::uint32_t kManyBusy = 10;
    if (t.busy > 0) finding.Set("busy", arg::Count(t.busy, "busy message"));
    if (t.busy >= kManyBusy) finding.Set("many_busy", arg::Flag());
    if (t.packet_errors > 0) {
      finding.Set("packet_errors", arg::Count(t.packet_errors, "packet number"))
          .Set("packet_error_frame", arg::Frame(t.packet_error.number));
      AddRelated(finding, t.packet_error.number);
    }
    AddRelated(finding, t.request.number);
    Report(key, std::move(finding));
  }

  static void SetError(Finding& finding, const mailbox::FoeTransfer& t) {
    const std::string_view meaning = mailbox::FoeErrorText(t.error_code);
    finding.Set("error_code", arg::Code(t.error_code, meaning))
        .Set("error_by", SenderValue(t.error_by))
        .Set("undefined", arg::Flag(meaning.empty()))
        .Set("advice", arg::Of(AdviceFor(t.error_code)));
    if (!t.error_text.empty()) finding.Set("error_text", arg::Text(t.error_text));
  }

  static const Word& AdviceFor(std::uint32_t code) {
    switch (code & ~std::uint32_t{0x8000}) {
      case 1:
      case 0xF:
        return kCheckName;
      case 2:
      case 7:
      case 0xA:
        return kCheckPassword;
      case 3:
      case 0x11:
        return kCheckMemory;
      case 4:
        return kOtherOperation;
      case 5:
        return kCheckPackets;
      case 6:
        return kDeleteFirst;
      case 8:
        return kGoToBoot;
      case 9:
        return kGoToPreop;
      case 0xC:
      case 0xD:
      case 0x10:
      case 0x12:
        return kCompareFile;
      default:
        return kFindInManual;
    }
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<FoeError>};

}  // namespace
}  // namespace ecaudit::foe_error
