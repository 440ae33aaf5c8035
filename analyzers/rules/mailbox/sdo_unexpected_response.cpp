#include <vector>

#include "analyzers/judge/deferred_findings.h"
#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"
#include "decoder/pipeline.h"

namespace ecaudit::sdo_unexpected_response {
namespace {

constexpr RuleInfo kInfo{.id = "sdo-unexpected-response",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kWarning,
                         .subject = Subject::kCoe,
                         .title = "An SDO response does not match the outstanding request",
                         .needs = "the request before the response",
                         .source = "ETG1000.6, SDO services",
                         .doc = R"(
## What it checks
Whether each SDO answer belongs to the outstanding request: the command answers it, and index and subindex are the same.

## Why it matters
A master that does not compare takes the value of another object. Masters that do wait on, until their time-out.

## How it is decided
Aborts may leave index and subindex 0, and answers to complete access may name another subindex. An answer while nothing
is outstanding counts only when a request before it is in the capture: the first answer of a capture may belong to a
request before it. Where the frame of a request turns out to be lost, the answer may belong to that one. An answer for
an object whose request was given up before is named as late, and caused_by points to mailbox-no-response where that was
found.

## Example
The answer for 6040h:0 while 6041h:0 was asked for.

## What to do
Look at the request before: with a time-out that is too short the answers come one request late.
)"};

class SdoUnexpectedResponse final : public Rule {
 public:
  SdoUnexpectedResponse() : Rule(kInfo) {
    Subscribe<mailbox::SdoUnexpected>(&SdoUnexpectedResponse::On);
    Subscribe<mailbox::MailboxUnanswered>(&SdoUnexpectedResponse::On);
    Subscribe<mailbox::MailboxMessage>(&SdoUnexpectedResponse::On);
  }

  /// A request whose frame never came back becomes known after its answer.
  void On(const mailbox::MailboxMessage& m) {
    const bool lost = m.certainty == Certainty::kUnknown;
    if (lost && m.direction == mailbox::Direction::kOut) deferred_.Lost(m.slave, m.frame().number);
  }

  void On(const mailbox::MailboxUnanswered& e) {
    if (e.request.protocol != mailbox::Protocol::kCoE || !e.request.index) return;
    if (e.slave >= given_up_.size()) given_up_.resize(static_cast<std::size_t>(e.slave) + 1);
    given_up_[e.slave] = e.request;
  }

  void On(const mailbox::SdoUnexpected& e) {
    using Reason = mailbox::SdoUnexpected::Reason;
    if (e.request.seen() && context().network().MayMissBetween(e.request.number, e.response.number)) {
      NotEvaluable(e.slave, ReasonCode::kCaptureGap, what::kHistory, e.response.number);
      return;
    }
    const std::uint64_t key = static_cast<std::uint64_t>(e.reason) | static_cast<std::uint64_t>(e.index) << 8U |
                              static_cast<std::uint64_t>(e.subindex) << 24U |
                              static_cast<std::uint64_t>(e.expected_index) << 32U |
                              static_cast<std::uint64_t>(e.expected_subindex) << 48U;
    const std::string answer = e.has_object ? "for " + ObjectName(e.index, e.subindex) : std::string("for a segment");
    const std::string expected = ObjectName(e.expected_index, e.expected_subindex);
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.response;
    finding.title = e.reason == Reason::kNoRequest ? "SDO response " + answer + " without a request"
                                                   : "SDO response " + answer + " instead of one for " + expected;
    finding.message = "The SDO response in frame " + std::to_string(e.response.number) + " (command " +
                      Hex(e.command, 2) + ", " + answer + ") does not match: " + std::string(Describe(e.reason));
    if (e.request.seen()) {
      finding.message += ", the one for " + expected + " in frame " + std::to_string(e.request.number);
    }
    finding.message += ".";
    if (e.abort) finding.message += " It is an abort with " + Hex(e.abort_code, 8) + ".";
    if (const mailbox::RequestSummary* late = GivenUp(e); late != nullptr) {
      finding.message += " It looks like the late answer to the request in frame " +
                         std::to_string(late->frame.number) + ", which the master had given up.";
      finding.caused_by = context().ExplanationOf(e.slave, late->frame.number);
      AddRelated(finding, late->frame.number);
    }
    finding.message += " Check that the master compares index and subindex, and its time-out.";
    finding.evidence.push_back(HexNumber("command", e.command));
    if (e.has_object) {
      finding.evidence.push_back(HexNumber("index", e.index));
      finding.evidence.push_back(Number("subindex", e.subindex));
    }
    if (e.request.seen()) {
      finding.evidence.push_back(HexNumber("expected_index", e.expected_index));
      finding.evidence.push_back(Number("expected_subindex", e.expected_subindex));
    }
    AddRelated(finding, e.request.number);
    deferred_.Add({e.request.number, key, std::move(finding)});
    deferred_.SettleOld([this](DeferredFinding&& d) { Settle(std::move(d)); });
  }

  void Finish() override {
    deferred_.SettleAll([this](DeferredFinding&& d) { Settle(std::move(d)); });
    (void)NotEvaluableWithoutReturns();
  }

 private:
  void Settle(DeferredFinding&& d) {
    if (MissesPackets(context().pairing())) {
      NotEvaluable(d.finding.slave, ReasonCode::kMissesPackets, d.finding.first.number);
      return;
    }
    if (Repeat(d.finding.slave, d.key, d.finding.first) == kNoFinding) Report(d.key, std::move(d.finding));
  }

  [[nodiscard]] const mailbox::RequestSummary* GivenUp(const mailbox::SdoUnexpected& e) const {
    if (e.slave >= given_up_.size() || !e.has_object) return nullptr;
    const mailbox::RequestSummary& last = given_up_[e.slave];
    return last.index == e.index && last.subindex == e.subindex ? &last : nullptr;
  }

  std::vector<mailbox::RequestSummary> given_up_;  // the last one of each slave
  DeferredFindings deferred_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SdoUnexpectedResponse>};

}  // namespace
}  // namespace ecaudit::sdo_unexpected_response
