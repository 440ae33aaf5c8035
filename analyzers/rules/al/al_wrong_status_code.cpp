#include "analyzers/core/al_text.h"
#include "analyzers/core/rule.h"
#include "analyzers/core/status_code_watcher.h"
#include "analyzers/model/bus_model.h"
#include "decoder/base/text.h"

namespace ecaudit {
namespace {

constexpr RuleInfo kInfo{
    .id = "al-wrong-status-code",
    .group = "AL state machine",
    .severity = Severity::kWarning,
    .title = "The AL status code is documented, but not for this transition",
    .needs = "the AL status code and the transition it refuses",
    .source = "ETG.1000.6, AL Status Code register 0x0134",
    .doc = R"(
## What it checks
Whether the AL status code of a refused request is one that the manual of the family gives for this transition; and for
an error that appears by itself, one that it gives for this state.

## Why it matters
The code points the wrong way: 0x0017 (sync manager) for a request that is simply not allowed sends the engineer to the
wrong place.

## How it is decided
Only where the manual binds the code to certain transitions. Codes that the manual does not list at all are
al-undocumented-status-code. Silent while the state before the request is not known.

## Example
samples/captures/wrong-status-code.pcapng

## What to do
Trust what the capture shows of the request more than the code, and tell the vendor.
)"};

class AlWrongStatusCode final : public StatusCodeWatcher {
 public:
  AlWrongStatusCode() : StatusCodeWatcher(kInfo) {}

 private:
  void OnCode(const Context& c) override {
    const device::DeviceDescription& family = *context().bus.slave(c.slave).profile;
    const device::AlStatusCode* entry = family.al_status_code(c.code);
    if (c.code == 0 || entry == nullptr || !entry->exclusive || c.from == 0) return;
    const auto from = static_cast<esc::AlState>(c.from);
    if (c.to == 0) {
      if (entry->AppliesIn(from)) return;
    } else {
      if (!esc::IsAlState(c.to)) return;
      if (entry->AppliesTo(from, static_cast<esc::AlState>(c.to))) return;
      if (const device::AlTransition* row = family.al_transition(from, static_cast<esc::AlState>(c.to))) {
        for (const std::uint16_t tolerated : row->tolerated_codes) {
          if (tolerated == c.code) return;
        }
      }
    }
    const std::uint64_t key = static_cast<std::uint64_t>(c.code) << 16U | static_cast<std::uint64_t>(c.from) << 8U | c.to;
    if (Repeat(c.slave, key, c.frame) != kNoFinding) return;
    const std::string what = c.to == 0 ? "an error in " + esc::StateName(c.from)
                                       : esc::StateName(c.from) + " to " + esc::StateName(c.to);
    Finding finding;
    finding.slave = c.slave;
    finding.first = c.frame;
    finding.title = "AL status code " + Hex(c.code) + " does not belong to " + what;
    finding.message = "The slave gives AL status code " + CodeText(c.code, family) + " for " + what +
                      ". The manual gives it for other transitions only";
    std::string others;
    for (const auto& t : entry->transitions) {
      others += (others.empty() ? ": " : ", ") + std::string(esc::StateName(t.from)) + " to " +
                std::string(esc::StateName(t.to));
    }
    finding.message += others + ". Trust what the capture shows of the request more than the code.";
    finding.evidence.push_back(HexNumber("al_status_code", c.code));
    finding.evidence.push_back(Text("transition", what));
    finding.reference = {family.document, entry->source};
    Report(key, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlWrongStatusCode>};

}  // namespace
}  // namespace ecaudit
