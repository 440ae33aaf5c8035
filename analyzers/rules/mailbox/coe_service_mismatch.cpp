#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::coe_service_mismatch {
namespace {

constexpr RuleInfo kInfo{.id = "coe-service-mismatch",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kWarning,
                         .needs_no_history = true,
                         .subject = Subject::kCoe,
                         .title = "The CoE service contradicts the SDO command",
                         .needs = "the CoE header of the message",
                         .source = "ETG1000.6, CoE header; AKD-2011, 4.12; MKD, 4.13; PILZ, 4.10",
                         .doc = R"(
## What it checks
The upper four bits of the CoE header against the SDO command behind it: 2 (SDO request) for what the master sends, 3
(SDO response) for what the slave answers.

## Why it matters
Masters that look at the service drop the answer; slaves may ignore the request. The vendor manuals print an answer with
service 2 (byte 7 = 0x20); whoever builds a slave or a test after that example gets this wrong.

## How it is decided
Aborts are not judged: real slaves send them with 2 or 3. Everything else of a transfer is.

## Example
An upload answer 0x43 with CoE header 0x2000.

## What to do
Put 2 into requests and 3 into answers.
)"};

class CoeServiceMismatch final : public Rule {
 public:
  CoeServiceMismatch() : Rule(kInfo) { Subscribe<mailbox::SdoTransfer>(&CoeServiceMismatch::On); }

  void On(const mailbox::SdoTransfer& t) {
    if (!t.request_service_mismatch && !t.response_service_mismatch) return;
    const bool request = t.request_service_mismatch;
    const std::uint64_t key = request ? 1 : 2;
    if (Repeat(t.slave, key, t.service_mismatch) != kNoFinding) return;
    Finding finding;
    finding.slave = t.slave;
    finding.first = t.service_mismatch;
    finding.title = request ? "SDO request under another CoE service than 2" : "SDO response under CoE service 2";
    finding.message = std::string("The SDO message ") + (request ? "from the master" : "from the slave") +
                      " in frame " + std::to_string(t.service_mismatch.number) + ", part of the " +
                      std::string(Name(t.service)) +
                      (t.has_object ? " of " + ObjectText(t, *context().slave(t.slave).profile) : std::string()) +
                      (request ? ", is marked as an SDO response. Requests have service 2."
                               : ", is marked as an SDO request. Answers have service 3; the example that the vendor "
                                 "manuals print (byte 7 = 0x20) is wrong there.");
    finding.evidence.push_back(Text("by", request ? "master" : "slave"));
    finding.evidence.push_back(Number("expected_service", request ? 2 : 3));
    AddRelated(finding, t.request.number);
    Report(key, std::move(finding));
  }

  void Finish() override { (void)NotEvaluableWithoutReturns(); }
};

const RuleRegistration kRegistration{kInfo, MakeRule<CoeServiceMismatch>};

}  // namespace
}  // namespace ecaudit::coe_service_mismatch
