#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "decoder/base/text.h"

namespace ecaudit::al_status_code_unread {
namespace {

constexpr RuleInfo kInfo{.id = "al-status-code-unread",
                         .group = "AL state machine",
                         .severity = Severity::kInfo,
                         .needs_no_history = true,
                         .title = "The error bit was seen but the AL status code was never read",
                         .needs = "AL Status with the error bit",
                         .source = "ETG1000.6, AL Status Code register 0x0134",
                         .doc = R"(
## What it checks
Whether the master reads 0x0134 between the appearance of the error bit and its end (or the end of the capture).

## Why it matters
The slave had a reason, and it is not in the capture. A master that does not read it cannot show it to anybody.

## How it is decided
Only for error bits that al-refused or al-unexpected-change report; the echo of an acknowledge is no error.

## Example
samples/captures/unexpected-error-unread.pcapng

## What to do
Let the master read six bytes from 0x0130 instead of two: state and code in one access.
)"};

class AlStatusCodeUnread final : public Rule {
 public:
  AlStatusCodeUnread() : Rule(kInfo) {
    Subscribe<model::AlAnswered>(&AlStatusCodeUnread::On);
    Subscribe<model::AlChangedByItself>(&AlStatusCodeUnread::On);
    Subscribe<model::AlErrorCode>(&AlStatusCodeUnread::On);
    Subscribe<model::AlErrorCleared>(&AlStatusCodeUnread::On);
  }

  void On(const model::AlAnswered& e) {
    Close(e.slave);
    if (e.outcome == model::AlAnswered::Outcome::kRefused && !e.code) Open(e.slave, e.frame);
  }
  void On(const model::AlChangedByItself& e) {
    Close(e.slave);
    if (e.status.bit4() && !e.code) Open(e.slave, e.frame);
  }
  void On(const model::AlErrorCode& e) {
    if (e.slave < open_.size()) open_[e.slave] = {};
  }
  void On(const model::AlErrorCleared& e) { Close(e.slave); }
  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    for (std::size_t s = 0; s < open_.size(); ++s) Close(static_cast<SlaveId>(s));
    std::vector<Finding>& findings = context().store.findings();
    for (Finding& own : findings) {
      if (own.rule != kInfo.id) continue;
      for (std::size_t i = 0; i < findings.size(); ++i) {
        const Finding& f = findings[i];
        if (f.slave == own.slave && f.first.number <= own.first.number && own.first.number <= f.last.number &&
            (f.rule == "al-refused" || f.rule == "al-unexpected-change")) {
          own.caused_by = static_cast<FindingIndex>(i);
        }
      }
    }
  }

 private:
  void Open(SlaveId slave, const FrameRef& frame) {
    if (slave >= open_.size()) open_.resize(static_cast<std::size_t>(slave) + 1);
    open_[slave] = frame;
  }
  void Close(SlaveId slave) {
    if (slave >= open_.size() || !open_[slave].seen()) return;
    const FrameRef frame = open_[slave];
    open_[slave] = {};
    if (Repeat(slave, 0, frame) != kNoFinding) return;
    Finding finding;
    finding.slave = slave;
    finding.first = frame;
    finding.title = "The master never read the AL status code of this error";
    finding.message = "AL Status shows the error bit from frame " + std::to_string(frame.number) +
                      " on, and 0x0134 was not read until it was cleared or the capture ended. The slave's reason is "
                      "not in the capture. Let the master read six bytes from 0x0130 instead of two.";
    Report(0, std::move(finding));
  }

  std::vector<FrameRef> open_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlStatusCodeUnread>};

}  // namespace
}  // namespace ecaudit::al_status_code_unread
