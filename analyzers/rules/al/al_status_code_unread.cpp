#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"

namespace ecaudit::al_status_code_unread {
namespace {

constexpr FindingKind kNotRead{
    .name = "not-read",
    .title = "AL status code (0x0134) never read while the error bit was set",
    .message =
        R"(AL Status shows the error bit from {frame} on. The master did not read the AL status code (0x0134) before
the error bit was cleared or the capture ended. The reason of the slave is not in the capture.)",
    .next = "Read six bytes from 0x0130 instead of two: AL Status and its code in one access.",
    .next_stays = true};

constexpr const FindingKind* kKinds[] = {&kNotRead};

// They are its causes.
constexpr std::string_view kAfter[] = {"al-refused", "al-unexpected-change"};

constexpr RuleInfo kInfo{.id = "al-status-code-unread",
                         .group = "AL state machine",
                         .severity = Severity::kInfo,
                         .history = History::kNone,
                         .title = "The master sees the error bit but never reads the AL status code",
                         .needs = "AL Status with the error bit",
                         .source = "ETG1000.6, AL Status Code register 0x0134",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Whether the master reads the AL status code (0x0134) while the error bit is set.

## Why it matters
The slave had a reason, and it is not in the capture. A master that does not read the code cannot show it.

## How it is decided
The error bit is set until it is cleared, or until the capture ends. Only error bits that al-refused or
al-unexpected-change report count. The echo of an acknowledge is no error.

## Example
samples/captures/unexpected-error-unread.pcapng

## What to do
Configure the master to read six bytes from 0x0130 instead of two: state and code in one access.
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
    Report(0, Found(kNotRead, slave, frame));
  }

  std::vector<FrameRef> open_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlStatusCodeUnread>};

}  // namespace
}  // namespace ecaudit::al_status_code_unread
