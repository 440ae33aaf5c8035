#include <cstdint>
#include <map>
#include <tuple>
#include <utility>

#include "analyzers/judge/pending_findings.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/mailbox/aoe.h"
#include "decoder/mailbox/events.h"
#include "decoder/mailbox/soe.h"

namespace ecaudit::mailbox_service_error {
namespace {

constexpr FindingKind kSoe{
    .name = "soe",
    .title = "SoE {service} of {idn} refused: {error_code}",
    .message =
        R"(The slave answers the SoE {service} of {idn} (drive {drive})[, requested in {request_frame},] in {frame} with
error {error_code}.[{?write}[ It accepts a later write of {idn} in {accepted_frame}.][{!accepted_frame} The value of the
master does not apply.]])",
    .next =
        "[{?write}Compare the value and the AL state of this write with the manual of the drive.]"
        "[{!write}Check in the manual whether the drive has this parameter.]",
    .identity = "service idn error_code"};

constexpr FindingKind kAoe{
    .name = "aoe",
    .title = "AoE {service} refused: {error_code}",
    .message =
        R"(The slave answers the AoE {service}[, requested in {request_frame},] in {frame} with error {error_code}.)",
    .next = "Find the error code in the manual of the device. Check net id, port, index group and index offset.",
    .identity = "service error_code"};

constexpr const FindingKind* kKinds[] = {&kSoe, &kAoe};

constexpr Word kRead{"read", "read"};
constexpr Word kWrite{"write", "write"};

constexpr RuleInfo kInfo{.id = "mailbox-service-error",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .history = History::kNone,
                         .title = "The slave answers an SoE or AoE request with an error",
                         .needs = "the SoE and AoE messages of the slave",
                         .source = "ETG1000.6, SoE services; ETG1020, AoE",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
The error code in the answers to SoE requests (parameters of servo drives, S-0-0032 for example) and to AoE requests
(ADS commands).

## Why it matters
A parameter that the drive refuses keeps its old value. A drive that needs it for the next phase then refuses SAFEOP or
OP, and the code it gives there does not name the parameter.

## How it is decided
- An SoE write that is refused is an error. It is an info if the drive accepts a later write of the same parameter.
- An SoE read that is refused is an info: masters read what a drive may not have.
- An AoE request that is refused is a warning, a read an info.
- The same error for the same parameter again counts as repetition.

If the slave refuses SAFEOP or OP after a refused SoE write, caused_by of that finding names this one, unless the
settings of the slave explain the refusal.

## Example
tests/rules/mailbox-service-error/violates.trace

## What to do
Correct the value or the state in which it is written. For SoE the drive lists what it misses in S-0-0021 and S-0-0022.
)"};

class MailboxServiceError final : public Rule {
 public:
  MailboxServiceError() : Rule(kInfo) {
    Subscribe<mailbox::SoeMessage>(&MailboxServiceError::On);
    Subscribe<mailbox::AoeMessage>(&MailboxServiceError::On);
  }

  void On(const mailbox::SoeMessage& e) {
    const bool write = e.operation == mailbox::SoeOperation::kWriteResponse;
    if (e.direction != mailbox::Direction::kIn) return;
    if (!write && e.operation != mailbox::SoeOperation::kReadResponse) return;
    if (!e.idn_known || e.fragment_error) return;
    if (!e.error_code) {
      if (write) accepted_[{e.slave, e.drive, e.idn}] = e.frame.number;
      return;
    }
    const std::uint64_t key = std::uint64_t{e.idn} << 32U | std::uint64_t{*e.error_code} << 8U |
                              std::uint64_t{e.drive} << 1U | (write ? 1U : 0U);
    if (refused_.Repeat(e.slave, key, e.frame)) return;
    Finding finding = Found(kSoe, e.slave, e.frame);
    finding.Set("service", arg::Of(write ? kWrite : kRead))
        .Set("idn", arg::Text(mailbox::IdnName(e.idn)))
        .Set("drive", arg::Number(e.drive))
        .Set("error_code", arg::Code(*e.error_code, mailbox::SoeErrorText(*e.error_code)));
    if (write) finding.Set("write", arg::Flag());
    SetRequest(finding, e.request);
    refused_.Keep(key, std::move(finding));
  }

  void On(const mailbox::AoeMessage& e) {
    if (e.direction != mailbox::Direction::kIn || !e.header.response()) return;
    const std::uint32_t result = e.parameters.result.value_or(0);
    const std::uint32_t error = e.header.error != 0 ? e.header.error : result;
    if (error == 0) return;
    const std::uint64_t key =
        std::uint64_t{1} << 63U | std::uint64_t{static_cast<std::uint16_t>(e.header.command)} << 32U | error;
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    Finding finding = Found(kAoe, e.slave, e.frame);
    finding.Set("service", arg::Text(mailbox::Name(e.header.command))).Set("error_code", arg::Code(error, {}, 8));
    SetRequest(finding, e.request);
    const bool read = e.header.command == mailbox::AdsCommand::kRead ||
                      e.header.command == mailbox::AdsCommand::kReadDeviceInfo ||
                      e.header.command == mailbox::AdsCommand::kReadState;
    (void)Report(key, read ? Severity::kInfo : Severity::kWarning, std::move(finding));
  }

  void Finish() override {
    (void)NotEvaluableWithoutReturns();
    refused_.Release([this](std::uint64_t key, Finding finding) {
      const bool write = finding.arguments.Has("write");
      const auto idn = static_cast<std::uint16_t>(key >> 32U);
      const auto drive = static_cast<std::uint8_t>(key >> 1U & 0x07U);
      const auto accepted = accepted_.find({finding.slave, drive, idn});
      const FrameNo last = finding.last.seen() ? finding.last.number : finding.first.number;
      const bool later = write && accepted != accepted_.end() && accepted->second > last;
      if (later) {
        finding.Set("accepted_frame", arg::Frame(accepted->second));
        AddRelated(finding, accepted->second);
      }
      (void)Report(key, write && !later ? Severity::kError : Severity::kInfo, std::move(finding));
    });
  }

 private:
  void SetRequest(Finding& finding, const FrameRef& request) const {
    if (!request.seen()) return;
    finding.Set("request_frame", arg::Frame(request.number));
    AddRelated(finding, request.number);
  }

  PendingFindings refused_;  // the drive may accept the parameter later
  std::map<std::tuple<SlaveId, std::uint8_t, std::uint16_t>, FrameNo> accepted_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<MailboxServiceError>};

}  // namespace
}  // namespace ecaudit::mailbox_service_error
