#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/status_code_watcher.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_text.h"

namespace ecaudit::al_undocumented_status_code {
namespace {

constexpr FindingKind kNotInManual{
    .name = "not-in-manual",
    .title = "AL status code {al_status_code:number} is not in the manual of the slave",
    .message = R"(The slave gives AL status code {al_status_code:number} in {frame}. The manual ({manual}) lists only
{documented}[, and {more}].[ In the EtherCAT standard the code means: {standard_name}.][{!standard_name} The EtherCAT
standard does not define it either.])",
    .next = "Ask for the manual of the firmware in use.",
    .identity = "al_status_code",
    .next_stays = true};

constexpr FindingKind kNotInStandard{
    .name = "not-in-standard",
    .title = "AL status code {al_status_code:number} is not in the EtherCAT standard",
    .message =
        R"(The slave gives AL status code {al_status_code:number} in {frame}. The EtherCAT standard does not define
it. Codes of vendors begin at 0x8000.)",
    .next = "Ask for the manual of the firmware in use.",
    .identity = "al_status_code",
    .next_stays = true};

constexpr const FindingKind* kKinds[] = {&kNotInManual, &kNotInStandard};

constexpr Word kAllStatusCodes{"all-status-codes", "a complete list of AL status codes"};

// They are its causes.
constexpr std::string_view kAfter[] = {"al-refused", "al-unexpected-change"};

constexpr RuleInfo kInfo{.id = "al-undocumented-status-code",
                         .group = "AL state machine",
                         .severity = Severity::kWarning,
                         .history = History::kNone,
                         .of_family = true,
                         .title = "The slave gives an AL status code that its manual does not list",
                         .needs = "the AL status code, read while the error bit is set",
                         .source = "ETG1000.6, AL Status Code register 0x0134",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
AL status codes (0x0134) of refused requests and of errors that appear by themselves. They are compared with the list of
codes in the manual of the drive family. For slaves without a family, the list of the EtherCAT standard applies.

## Why it matters
The manual does not explain such a code. The slave may run another version of the firmware than the one described. The
name shown comes from the standard.

## How it is decided
The error bit is set, and the code is not in the list. These codes are ignored:

- codes read while the error bit is clear: they belong to an earlier error
- codes that the profile tolerates for the transition (0x0013 for slaves without BOOT)
- codes from 0x8000 on of slaves without a family: they are the vendor's own

## Example
samples/captures/undocumented-status-code.pcapng: 0x001D. Real AKD firmware gives it, although its manual lists only
0x0000, 0x0011 and 0x0017.

## What to do
Use the meaning of the code in the standard. Ask for the manual of the firmware in use.
)"};

class AlUndocumentedStatusCode final : public StatusCodeWatcher {
 public:
  AlUndocumentedStatusCode() : StatusCodeWatcher(kInfo) {}

 private:
  /// The range of vendors counts only for slaves without a manual: a manual lists all of its codes.
  static bool Documents(const device::DeviceDescription& family, std::uint16_t code) {
    if (!family.al.status_codes_complete || family.al_status_code(code) != nullptr) return true;
    return FollowsStandard(family) && family.DocumentsAlStatusCode(code);
  }

  void OnCode(const Context& c) override {
    const device::DeviceDescription& family = *context().slave(c.slave).profile;
    if (!family.al.status_codes_complete) NotEvaluable(c.slave, ReasonCode::kNotInProfile, kAllStatusCodes);
    if (c.code == 0 || Documents(family, c.code) || Tolerates(family, c)) return;
    if (Repeat(c.slave, c.code, c.frame) != kNoFinding) return;
    const bool standard = FollowsStandard(family);
    Finding finding = Found(standard ? kNotInStandard : kNotInManual, c.slave, c.frame);
    finding.Set("al_status_code", arg::Code(c.code));
    const std::string_view name = esc::AlStatusCodeName(c.code);
    if (!name.empty()) finding.Set("standard_name", arg::Text(name));
    SetManual(finding, family);
    if (!standard) SetDocumented(finding, family.al.status_codes);
    finding.reference = ReferenceTo(family.al.source);
    Report(c.code, std::move(finding));
  }

  static void SetDocumented(Finding& finding, const std::vector<device::AlStatusCode>& codes) {
    constexpr std::size_t kNamed = 8;
    std::vector<Value> named;
    for (const device::AlStatusCode& entry : codes) {
      if (named.size() < kNamed) named.push_back(arg::Hex(entry.code));
    }
    finding.Set("documented", arg::List(std::move(named)));
    if (codes.size() > kNamed) finding.Set("more", arg::Count(codes.size() - kNamed, "other"));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlUndocumentedStatusCode>};

}  // namespace
}  // namespace ecaudit::al_undocumented_status_code
