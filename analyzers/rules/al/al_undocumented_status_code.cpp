#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/status_code_watcher.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_text.h"
#include "decoder/base/text.h"

namespace ecaudit::al_undocumented_status_code {
namespace {

constexpr RuleInfo kInfo{.id = "al-undocumented-status-code",
                         .group = "AL state machine",
                         .severity = Severity::kWarning,
                         .needs_no_history = true,
                         .of_family = true,
                         .title = "The slave gives an AL status code that its manual does not list",
                         .needs = "the AL status code, read while the error bit is set",
                         .source = "ETG1000.6, AL Status Code register 0x0134",
                         .doc = R"(
## What it checks
AL status codes (0x0134) of refused requests and of errors that appear by themselves, against the list of supported
codes in the manual of the drive family; for slaves without a family, against the standard's list.

## Why it matters
The manual does not help with such a code, and another edition of the firmware may be at work than the one described.
The name shown comes from the standard.

## How it is decided
The error bit is set and the code is not in the family's list. A code that is left over from an earlier error (error bit
clear) is not looked at, nor one that the profile tolerates for the transition (0x0013 where there is no BOOT). For
slaves without a family, codes from 0x8000 on are the vendor's own.

## Example
samples/captures/undocumented-status-code.pcapng: 0x001D, which real AKD firmware gives although its manual lists
0x0000, 0x0011 and 0x0017 only.

## What to do
Read the code by its standard meaning, and ask for the manual of the firmware in use.
)"};

class AlUndocumentedStatusCode final : public StatusCodeWatcher {
 public:
  AlUndocumentedStatusCode() : StatusCodeWatcher(kInfo) {}

 private:
  /// A manual that lists its codes leaves no room for the vendor's own range; the standard does.
  static bool Documents(const device::DeviceDescription& family, std::uint16_t code) {
    if (!family.al.status_codes_complete || family.al_status_code(code) != nullptr) return true;
    return JudgedByStandard(family) && family.DocumentsAlStatusCode(code);
  }

  void OnCode(const Context& c) override {
    const device::DeviceDescription& family = *context().slave(c.slave).profile;
    if (!family.al.status_codes_complete) NotEvaluable(c.slave, "the profile has no complete list of AL status codes");
    if (c.code == 0 || Documents(family, c.code) || Tolerates(family, c)) return;
    if (Repeat(c.slave, c.code, c.frame) != kNoFinding) return;
    Finding finding;
    finding.slave = c.slave;
    finding.first = c.frame;
    const std::string_view name = esc::AlStatusCodeName(c.code);
    const bool standard = JudgedByStandard(family);
    finding.title = "AL status code " + Hex(c.code) + " is not in the " +
                    (standard ? "EtherCAT standard" : "manual (" + family.title + ")");
    finding.message =
        "The slave gives AL status code " + Hex(c.code) + " in frame " + std::to_string(c.frame.number) + ". ";
    if (standard) {
      finding.message +=
          "The EtherCAT standard does not define it, and it is below 0x8000, where the vendor's own codes "
          "begin.";
    } else {
      finding.message += "The manual lists";
      std::size_t listed = 0;
      for (const device::AlStatusCode& entry : family.al.status_codes) {
        if (listed++ == 8) {
          finding.message += " ...";
          break;
        }
        finding.message += (listed > 1 ? ", " : " ") + Hex(entry.code);
      }
      finding.message += name.empty() ? " only. The standard has no name for it either."
                                      : " only. In the EtherCAT standard it means: " + std::string(name) + ".";
    }
    finding.message += " Ask for the manual of the firmware in use.";
    finding.evidence.push_back(HexNumber("al_status_code", c.code));
    if (!name.empty()) finding.evidence.push_back(Text("standard_name", std::string(name)));
    finding.reference = ReferenceTo(family.al.source);
    Report(c.code, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlUndocumentedStatusCode>};

}  // namespace
}  // namespace ecaudit::al_undocumented_status_code
