#include "analyzers/collect/broadcast_counter.h"
#include "analyzers/judge/rule.h"

namespace ecaudit::many_broadcasts {
namespace {

constexpr FindingKind kTen{.name = "ten",
                           .title = "Ten broadcasts",
                           .message = "The slaves answered ten broadcasts. The tenth is {frame}.",
                           .next = "Nothing is to be done."};
constexpr const FindingKind* kKinds[] = {&kTen};

constexpr RuleInfo kInfo{.id = "many-broadcasts",
                         .group = "Frame and bus",
                         .severity = Severity::kInfo,
                         .title = "Ten broadcasts were answered",
                         .needs = "returned frames",
                         .source = "ETG1000.4, broadcast commands",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
How many broadcasts the slaves answered.

## Why it matters
It does not: the rule shows how rules are added.

## How it is decided
By counting.

## Example
Any capture.

## What to do
Nothing.
)"};

class ManyBroadcasts final : public Rule {
 public:
  ManyBroadcasts() : Rule(kInfo) { Subscribe(&ManyBroadcasts::Counted); }

  void Counted(const TenBroadcasts& event) {
    if (Repeat(kNoSlave, 0, event.frame) != kNoFinding) return;
    Report(0, Found(kTen, kNoSlave, event.frame));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<ManyBroadcasts>};

}  // namespace
}  // namespace ecaudit::many_broadcasts
