#include <string_view>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/mailbox/eoe.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::eoe_settings {
namespace {

constexpr FindingKind kRefused{
    .name = "refused",
    .title = "Slave refuses its IP settings with {result}",
    .message = R"(The master sets the IP address of the slave for EoE[ in {request_frame}]. The slave answers in {frame}
with {result}[ ({meaning})]. It is not reachable by Ethernet over the bus.)",
    .next = "Correct the EoE settings of the slave in the master, or switch EoE off for it.",
    .identity = "result"};

constexpr FindingKind kIncomplete{
    .name = "incomplete",
    .title = "IP settings without {missing}",
    .message = R"(The master sets the IP settings of the slave for EoE in {frame}. They have no {missing}: the flags are
{flags}. A drive needs both an IP address and a subnet mask before it is reachable by Ethernet over the bus.)",
    .next = "Complete the EoE settings of the slave in the master.",
    .identity = "missing"};

constexpr const FindingKind* kKinds[] = {&kRefused, &kIncomplete};

constexpr Word kAddress{"ip-address", "IP address"};
constexpr Word kMask{"subnet-mask", "subnet mask"};
constexpr Word kBoth{"ip-address-and-subnet-mask", "IP address and subnet mask"};

constexpr RuleInfo kInfo{.id = "eoe-settings",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kWarning,
                         .needs_no_history = true,
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
- A result other than 0 is a warning.
- A message without the IP address or the subnet mask is an info: the slave may have the missing one already. A message
  that sets nothing, or ends before its fields, is ignored.

## Example
tests/rules/eoe-settings/violates.trace

## What to do
Correct the EoE settings of the slave in the master.
)"};

class EoeSettings final : public Rule {
 public:
  EoeSettings() : Rule(kInfo) { Subscribe<mailbox::EoeControl>(&EoeSettings::On); }

  void On(const mailbox::EoeControl& e) {
    if (e.type == mailbox::EoeType::kSetIpResponse && e.result && *e.result != 0) Refused(e);
    if (e.type == mailbox::EoeType::kSetIpRequest) Requested(e);
  }

  void Finish() override { (void)NotEvaluableWithoutReturns(); }

 private:
  /// It announces an address that its data do not reach.
  static bool IsCut(const mailbox::EoeIpParameters& ip) {
    constexpr std::uint32_t kHasIp = 1U << 1U;
    constexpr std::uint32_t kHasMask = 1U << 2U;
    return ((ip.flags & kHasIp) != 0 && !ip.ip) || ((ip.flags & kHasMask) != 0 && !ip.subnet_mask);
  }

  void Refused(const mailbox::EoeControl& e) {
    const std::uint64_t key = std::uint64_t{1} << 32U | *e.result;
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    Finding finding = Found(kRefused, e.slave, e.frame);
    finding.Set("result", arg::Hex(*e.result));
    if (const std::string_view text = mailbox::EoeResultText(*e.result); !text.empty()) {
      finding.Set("meaning", arg::Text(text));
    }
    if (e.request.seen()) {
      finding.Set("request_frame", arg::Frame(e.request.number));
      AddRelated(finding, e.request.number);
    }
    Report(key, std::move(finding));
  }

  void Requested(const mailbox::EoeControl& e) {
    if (e.ip.flags == 0 || IsCut(e.ip) || (e.ip.ip && e.ip.subnet_mask)) return;
    const Word& missing = e.ip.ip ? kMask : e.ip.subnet_mask ? kAddress : kBoth;
    const std::uint64_t key = e.ip.flags;
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    Finding finding = Found(kIncomplete, e.slave, e.frame);
    finding.Set("missing", arg::Of(missing)).Set("flags", arg::Hex(e.ip.flags, 8));
    Report(key, Severity::kInfo, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<EoeSettings>};

}  // namespace
}  // namespace ecaudit::eoe_settings
