#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/mailbox/coe.h"
#include "decoder/mailbox/events.h"
#include "decoder/track/network.h"

namespace ecaudit::coe_service_mismatch {
namespace {

constexpr FindingKind kRequest{
    .name = "request-service",
    .title = "SDO request is marked as a response, CoE service 2 expected",
    .message =
        R"(The master marks the SDO message in {frame} as an SDO response. The message belongs to the {service}[ of
{object}[{?complete_access} (complete access)]]. SDO requests have CoE service {expected_service}.)",
    .next = "Correct the master: put CoE service 2 into requests."};

constexpr FindingKind kResponse{
    .name = "response-service",
    .title = "SDO response is marked with CoE service 2, service 3 expected",
    .message = R"(The slave marks the SDO message in {frame} as an SDO request. The message belongs to the {service}[ of
{object}[{?complete_access} (complete access)]]. SDO responses have CoE service {expected_service}. The example in the
vendor manuals (byte 7 = 0x20) is wrong.)",
    .next = "Correct the slave: put CoE service 3 into responses."};

constexpr FindingKind kSlaveRequests{
    .name = "request-of-slave",
    .title = "Slave requests {object:number} from station {station}: has to be forwarded",
    .message =
        R"(The message of the slave in {frame} is an SDO request for [{object}], with station address {station} in
its mailbox header. No request of the master belongs to it. So the slave wants this object of another slave, and the
master has to forward the message. A slave that gets no answer may report a time-out (abort code 0x05040000) by
emergency.)",
    .next = R"(Let the master forward mailbox messages between slaves (slave-to-slave, mailbox gateway), or switch the
request off in the slave.)",
    .identity = "object station"};

constexpr FindingKind kHeaderBits{
    .name = "header-bits",
    .title =
        "CoE header {coe_header}: [PDO number {number} in a message that is no PDO][{!number}reserved bits are set]",
    .message = R"(The CoE header of the message in {frame} is {coe_header} (service {coe_service}).[ It has PDO number
{number}, which only PDO services have.][ Its reserved bits 9 to 11 have the value {reserved}.])",
    .next =
        "Correct the [{?from_master}master][{!from_master}slave]: [{?number}bits 0 to 11 of the CoE header are 0 in "
        "this message.][{!number}bits 9 to 11 of the CoE header are 0.]",
    .identity = "coe_header"};

constexpr const FindingKind* kKinds[] = {&kRequest, &kResponse, &kSlaveRequests, &kHeaderBits};

constexpr RuleInfo kInfo{.id = "coe-service-mismatch",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kWarning,
                         .history = History::kNone,
                         .subject = Subject::kCoe,
                         .title = "The CoE header contradicts the SDO command",
                         .needs = "the CoE header of the message",
                         .source = "ETG1000.6, CoE header; AKD-2011, 4.12; MKD, 4.13; PILZ, 4.10",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
The upper four bits of the CoE header against the SDO command that follows:

- 2 (SDO request) in messages of the master
- 3 (SDO response) in messages of the slave

Further, bits 0 to 11: a PDO number in a message that is no PDO, and reserved bits.

## Why it matters
Masters that check the service drop the response. Slaves may ignore the request. The vendor manuals print a response
with service 2 (byte 7 = 0x20). A slave or a test that follows this example is wrong.

## How it is decided
A message of a slave with service 2, with the station address of another device in its mailbox header, and without a
request of the master, is a request of the slave: it wants an object of another slave, and the master has to forward it.

All messages of a transfer are evaluated, except aborts: real slaves send them with service 2 or 3. A PDO number
or reserved bits in the header are an info: most receivers ignore them.

## Example
An upload response 0x43 with CoE header 0x2000.

## What to do
Put service 2 into requests and service 3 into responses.
)"};

class CoeServiceMismatch final : public Rule {
 public:
  CoeServiceMismatch() : Rule(kInfo) {
    Subscribe<mailbox::SdoTransfer>(&CoeServiceMismatch::On);
    Subscribe<mailbox::MailboxMessage>(&CoeServiceMismatch::On);
  }

  /// Only PDO services have a number.
  void On(const mailbox::MailboxMessage& m) {
    const bool whole = m.problem == mailbox::Problem::kNone && !m.repeated && !m.window_inferred &&
                       m.payload.size() >= mailbox::kCoeHeaderBytes;
    if (m.header.protocol != mailbox::Protocol::kCoE || !whole) return;
    const mailbox::CoeHeader header = mailbox::ParseCoeHeader(m.payload);
    if (m.direction == mailbox::Direction::kIn && header.service == mailbox::CoeService::kSdoRequest) {
      addressed_ = {m.slave, m.frame().number, m.header.address};
    }
    const bool number = header.number != 0 && !IsPdo(header.service);
    if (!number && header.reserved == 0) return;
    const auto word = LittleEndian<std::uint16_t>(m.payload, 0);
    const bool from_master = m.direction == mailbox::Direction::kOut;
    const std::uint64_t key = std::uint64_t{word} << 8U | (from_master ? 4U : 8U);
    if (Repeat(m.slave, key, m.frame()) != kNoFinding) return;
    Finding finding = Found(kHeaderBits, m.slave, m.frame());
    finding.Set("coe_header", arg::Hex(word))
        .Set("coe_service", arg::Number(static_cast<int>(header.service)))
        .Set("from_master", arg::Flag(from_master));
    if (number) finding.Set("number", arg::Number(header.number));
    if (header.reserved != 0) finding.Set("reserved", arg::Number(header.reserved));
    Report(key, Severity::kInfo, std::move(finding));
  }

  void On(const mailbox::SdoTransfer& t) {
    if (!t.request_service_mismatch && !t.response_service_mismatch) return;
    const bool request = t.request_service_mismatch;
    if (!request && !t.request.seen() && ReportRequest(t)) return;
    const std::uint64_t key = request ? 1 : 2;
    if (Repeat(t.slave, key, t.service_mismatch) != kNoFinding) return;
    Finding finding = Found(request ? kRequest : kResponse, t.slave, t.service_mismatch);
    finding.Set("by", SenderValue(request ? mailbox::Direction::kOut : mailbox::Direction::kIn))
        .Set("expected_service", arg::Number(request ? 2 : 3))
        .Set("service", ServiceValue(t.service));
    SetObject(finding, t, *context().slave(t.slave).profile);
    AddRelated(finding, t.request.number);
    Report(key, std::move(finding));
  }

  void Finish() override { (void)NotEvaluableWithoutReturns(); }

 private:
  /// A message of a slave with service 2.
  struct Addressed {
    SlaveId slave = kNoSlave;
    FrameNo frame = 0;
    std::uint16_t station = 0;
  };

  /// Nothing of the master belongs to it, and it is addressed to another station.
  bool ReportRequest(const mailbox::SdoTransfer& t) {
    const bool addressed = addressed_.slave == t.slave && addressed_.frame == t.service_mismatch.number;
    const std::uint16_t* const own = context().network().slaves()[t.slave].station.if_known();
    if (!addressed || addressed_.station == 0 || own == nullptr || *own == addressed_.station) return false;
    const std::uint64_t key =
        std::uint64_t{1} << 40U | std::uint64_t{addressed_.station} << 24U | std::uint64_t{t.index} << 8U | t.subindex;
    if (Repeat(t.slave, key, t.service_mismatch) != kNoFinding) return true;
    Finding finding = Found(kSlaveRequests, t.slave, t.service_mismatch);
    finding.Set("station", arg::Hex(addressed_.station));
    SetObject(finding, t, *context().slave(t.slave).profile);
    Report(key, std::move(finding));
    return true;
  }

  Addressed addressed_;  ///< the last one

  static bool IsPdo(mailbox::CoeService service) {
    using enum mailbox::CoeService;
    return service == kTxPdo || service == kRxPdo || service == kTxPdoRequest || service == kRxPdoRequest;
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<CoeServiceMismatch>};

}  // namespace
}  // namespace ecaudit::coe_service_mismatch
