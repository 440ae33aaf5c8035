#include <map>
#include <string_view>
#include <utility>

#include "analyzers/judge/pending_findings.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/mailbox/eoe.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::eoe_settings {
namespace {

constexpr FindingKind kRefused{
    .name = "refused",
    .title = "Slave refuses its IP settings with {result}",
    .message = R"(The master sends IP settings for EoE to the slave[ in {request_frame}]. The slave answers in {frame}
with {result}[ ({meaning})]. So these settings do not apply.[ It accepts other settings, or the same, in
{accepted_frame}.])",
    .next =
        "[{!accepted_frame}Correct the EoE settings of the slave in the master, or switch EoE off for it.]"
        "[{?accepted_frame}Check whether the slave has the settings that are intended for it.]",
    .identity = "result"};

constexpr FindingKind kIncomplete{
    .name = "incomplete",
    .title = "IP settings without {missing}",
    .message =
        R"(The master sends IP settings for EoE to the slave in {frame} (flags {flags}). Not among them: {missing}.
Ethernet over the bus needs both an IP address and a subnet mask. The slave may have the missing one already.)",
    .next = "Complete the EoE settings of the slave in the master.",
    .identity = "missing"};

constexpr const FindingKind* kKinds[] = {&kRefused, &kIncomplete};

/// Where it is stated that a slave needs both.
constexpr std::string_view kBothNeeded = "MKD, 3.5.2";

constexpr Word kAddress{"ip-address", "IP address"};
constexpr Word kMask{"subnet-mask", "subnet mask"};
constexpr Word kBoth{"ip-address-and-subnet-mask", "IP address and subnet mask"};

constexpr RuleInfo kInfo{.id = "eoe-settings",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kWarning,
                         .history = History::kNone,
                         .subject = Subject::kEoe,
                         .title = "The IP settings for EoE are refused or incomplete",
                         .needs = "EoE messages that set the IP address, and their answers",
                         .source = "ETG1000.6, EoE; MKD, 3.5.2",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
The EoE message by which the master sets the IP address of a slave ("set IP"), and the result in the answer.

## Why it matters
Service tools reach a drive by Ethernet over the bus only with these settings. The bus itself works without them, so
nothing else shows the mistake.

## How it is decided
- A result other than 0 is a warning. It is an info if the slave accepts settings later: result 0.
- A message without the IP address or the subnet mask is an info: the slave may have the missing one already.
- A message is ignored if it sets no IP address, subnet mask or gateway, or if it ends before its fields.

## Example
tests/rules/eoe-settings/violates.trace

## What to do
Correct the EoE settings of the slave in the master.
)"};

class EoeSettings final : public Rule {
 public:
  EoeSettings() : Rule(kInfo) { Subscribe<mailbox::EoeControl>(&EoeSettings::On); }

  void On(const mailbox::EoeControl& e) {
    if (e.type == mailbox::EoeType::kSetIpResponse && e.result) Answered(e);
    if (e.type == mailbox::EoeType::kSetIpRequest) Requested(e);
  }

  void Finish() override {
    (void)NotEvaluableWithoutReturns();
    refused_.Release([this](std::uint64_t key, Finding finding) {
      const auto accepted = accepted_.find(finding.slave);
      const FrameRef& last = finding.last.seen() ? finding.last : finding.first;
      if (accepted == accepted_.end() || accepted->second < last.number) {
        (void)Report(key, std::move(finding));
        return;
      }
      finding.Set("accepted_frame", arg::Frame(accepted->second));
      AddRelated(finding, accepted->second);
      (void)Report(key, Severity::kInfo, std::move(finding));
    });
  }

 private:
  void Answered(const mailbox::EoeControl& e) {
    if (*e.result == 0) {
      accepted_[e.slave] = e.frame.number;
      return;
    }
    const std::uint64_t key = std::uint64_t{1} << 32U | *e.result;
    if (refused_.Repeat(e.slave, key, e.frame)) return;
    Finding finding = Found(kRefused, e.slave, e.frame);
    finding.Set("result", arg::Hex(*e.result));
    if (const std::string_view text = mailbox::EoeResultText(*e.result); !text.empty()) {
      finding.Set("meaning", arg::Text(text));
    }
    if (e.request.seen()) {
      finding.Set("request_frame", arg::Frame(e.request.number));
      AddRelated(finding, e.request.number);
    }
    refused_.Keep(key, std::move(finding));
  }

  void Requested(const mailbox::EoeControl& e) {
    // A message may set the MAC address or the name only.
    if (e.ip.cut || (!e.ip.ip && !e.ip.subnet_mask && !e.ip.gateway)) return;
    if (e.ip.ip && e.ip.subnet_mask) return;
    const Word& missing = e.ip.ip ? kMask : e.ip.subnet_mask ? kAddress : kBoth;
    const std::uint64_t key = e.ip.flags;
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    Finding finding = Found(kIncomplete, e.slave, e.frame);
    finding.Set("missing", arg::Of(missing)).Set("flags", arg::Hex(e.ip.flags, 8));
    finding.reference = ReferenceTo(kBothNeeded);
    Report(key, Severity::kInfo, std::move(finding));
  }

  PendingFindings refused_;              // the slave may accept settings later
  std::map<SlaveId, FrameNo> accepted_;  // last
};

const RuleRegistration kRegistration{kInfo, MakeRule<EoeSettings>};

}  // namespace
}  // namespace ecaudit::eoe_settings
