#include <algorithm>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_text.h"

namespace ecaudit::sync_op_before_sync {
namespace {

constexpr FindingKind kRefused{
    .name = "refused",
    .title = "OP refused with {al_status_code:number}: the drive is not synchronised yet",
    .message = R"(The master requested OP in {request_frame}. In {frame} the slave refused it with AL status code
{al_status_code}. [The manual ({manual})][{!manual}The EtherCAT standard] requires for OP that synchronisation has
succeeded.)",
    .next = R"(Send process data in SAFEOP with the configured cycle before OP is requested. Check cycle and jitter.)"};

constexpr FindingKind kHeld{
    .name = "held-in-safeop",
    .title = "Still in SAFEOP {waited_ms} after the request of OP: not synchronised",
    .message = R"(The master requested OP in {request_frame}. After {waited_ms}, in {frame}, the slave still reports
SAFEOP, without an error. [The manual ({manual})][{!manual}The EtherCAT standard] requires for OP that synchronisation
has succeeded.)",
    .next = R"(Send process data in SAFEOP with the configured cycle before OP is requested. Check cycle and jitter.)"};

constexpr const FindingKind* kKinds[] = {&kRefused, &kHeld};

// Several rules may explain one finding: the first that does so wins.
constexpr std::string_view kAfter[] = {"sync-not-activated"};

constexpr RuleInfo kInfo{
    .id = "sync-op-before-sync",
    .group = "Synchronisation",
    .severity = Severity::kError,
    .history = History::kWhole,
    .subject = Subject::kAlRequest,
    .title = "OP requested before the drive was synchronised",
    .needs = "a family whose manual makes synchronisation a condition of OP; AL Status and AL status code",
    .source = "PILZ, 4.3.4",
    .kinds = kKinds,
    .after = kAfter,
    .doc = R"(
## What it checks
A request of OP, where the manual of the family requires synchronisation before OP, and the drive

- refuses it with AL status code 0x001A (synchronisation error), or
- stays in SAFEOP without an error until the timeout.

## Why it matters
The drive checks the cycle of the master in SAFEOP. If the master requests OP at once, or the drive cannot follow its
cycle, the drive never reaches OP.

## How it is decided
- Only families whose manual lists 0x001A for SAFEOP to OP (Pilz) are evaluated. By the standard a slave may refuse with
  0x001A, but needs no clock to reach OP.
- A refusal with 0x001A is reported by the drive itself: the finding is observed.
- Staying in SAFEOP is a warning and inferred: the manual does not give the time that the drive waits for
  synchronisation.

## Example
tests/rules/sync-op-before-sync/violates.trace

## What to do
Send process data in SAFEOP with the configured cycle for about 1 s before OP is requested. Check cycle, jitter and the
mean deviation of the cycle (Pilz: 1000 ppm).
)"};

class SyncOpBeforeSync final : public Rule {
 public:
  SyncOpBeforeSync() : Rule(kInfo) {
    Subscribe<model::AlAnswered>(&SyncOpBeforeSync::On);
    Subscribe<model::AlErrorCode>(&SyncOpBeforeSync::On);
    Subscribe<model::AlOverdue>(&SyncOpBeforeSync::On);
  }

  void On(const model::AlAnswered& e) {
    Open& open = OpenOf(e.slave);
    open = {};
    if (e.outcome != model::AlAnswered::Outcome::kRefused || !NeedsSync(e.slave, e.request)) return;
    open = {e.request, e.frame};
    if (e.code) Refused(e.slave, *e.code);
  }
  void On(const model::AlErrorCode& e) {
    if (OpenOf(e.slave).answer.seen()) Refused(e.slave, e.code);
  }
  void On(const model::AlOverdue& e) {
    if (!NeedsSync(e.slave, e.request) || e.status.state() != static_cast<std::uint8_t>(esc::AlState::SAFEOP)) return;
    FindingIndex index = Repeat(e.slave, 1, e.frame);
    if (index == kNoFinding) {
      Finding finding = FindingOf(kHeld, e.slave, e.request, e.frame);
      finding.confidence = Confidence::kInferred;
      finding.Set("waited_ms", arg::Ms(e.waited_ns));
      index = Report(1, Severity::kWarning, std::move(finding));
    }
    AddConsequence("al-timeout", e.slave, e.frame.number, index);
  }

  void Finish() override {
    for (const auto& c : consequences_) NameCause(context(), c.rule, c.slave, c.frame, c.cause);
    NotEvaluableWhereRequestsAreNotFollowed();
  }

 private:
  struct Open {
    model::AlRequestRecord request;
    FrameRef answer;
  };
  struct Consequence {
    std::string_view rule;
    SlaveId slave = kNoSlave;
    FrameNo frame = 0;
    FindingIndex cause = kNoFinding;
  };

  Open& OpenOf(SlaveId slave) {
    if (slave >= open_.size()) open_.resize(static_cast<std::size_t>(slave) + 1);
    return open_[slave];
  }

  /// The standard lists what any slave may refuse with; only a manual makes it a condition.
  [[nodiscard]] bool NeedsSync(SlaveId, const model::AlRequestRecord& request) const {
    if (request.control.state() != static_cast<std::uint8_t>(esc::AlState::OP) || request.transition == nullptr)
      return false;
    if (request.transition->basis != device::Basis::kPrinted) return false;
    const auto& codes = request.transition->refusal_codes;
    return request.verdict == model::AlVerdict::kLegal &&
           std::ranges::find(codes, esc::al_code::kSynchronization) != codes.end();
  }

  void Refused(SlaveId slave, std::uint16_t code) {
    const Open open = OpenOf(slave);
    OpenOf(slave) = {};
    if (code != esc::al_code::kSynchronization) return;
    FindingIndex index = Repeat(slave, 0, open.answer);
    if (index == kNoFinding) {
      Finding finding = FindingOf(kRefused, slave, open.request, open.answer);
      finding.Set("al_status_code", CodeValue(code, *context().slave(slave).profile));
      index = Report(0, std::move(finding));
    }
    AddConsequence("al-refused", slave, open.answer.number, index);
  }

  [[nodiscard]] Finding FindingOf(const FindingKind& kind, SlaveId slave, const model::AlRequestRecord& request,
                                  const FrameRef& frame) const {
    Finding finding = Found(kind, slave, frame);
    AddRelated(finding, request.frame.number);
    finding.Set("request_frame", arg::Frame(request.frame.number));
    SetManual(finding, *context().slave(slave).profile);
    finding.reference = ReferenceTo(request.transition->source);
    return finding;
  }
  void AddConsequence(std::string_view rule, SlaveId slave, FrameNo frame, FindingIndex cause) {
    constexpr std::size_t kMost = 256;
    if (consequences_.size() < kMost) consequences_.push_back({rule, slave, frame, cause});
  }

  std::vector<Open> open_;
  std::vector<Consequence> consequences_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncOpBeforeSync>};

}  // namespace
}  // namespace ecaudit::sync_op_before_sync
