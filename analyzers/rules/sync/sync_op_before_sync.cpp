#include <algorithm>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_text.h"
#include "decoder/base/text.h"

namespace ecaudit::sync_op_before_sync {
namespace {

constexpr std::uint16_t kSyncError = 0x001A;

constexpr RuleInfo kInfo{
    .id = "sync-op-before-sync",
    .group = "Synchronisation",
    .severity = Severity::kError,
    .subject = Subject::kAlRequest,
    .title = "OP requested before the drive was synchronised",
    .needs = "a family whose manual makes synchronisation a condition of OP; AL Status and AL status code",
    .source = "PILZ, 4.3.4",
    .doc = R"(
## What it checks
A request of OP that a drive refuses with AL status code 0x001A (synchronisation error), or that it does not answer
until the time-out, where the family's manual requires that synchronisation has succeeded before OP.

## Why it matters
The drive checks the master's cycle in SAFEOP. A master that requests OP at once, or whose cycle the drive cannot
follow, never gets the drive into operation.

## How it is decided
Only for families whose manual lists 0x001A for SAFEOP to OP (Pilz): a slave that is judged by the standard may refuse
with it, but needs no clock to reach OP. The refusal with 0x001A is the drive's own word. Staying in SAFEOP without an
answer is reported as inferred: the drive waits for synchronisation for a time that the manual does not state.

## Example
tests/rules/sync-op-before-sync/violates.trace

## What to do
Send process data in SAFEOP in the configured cycle for a second or so before OP is requested. Check cycle, jitter
and the mean deviation of the cycle (Pilz: 1000 ppm).
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
      Finding finding = About(e.slave, e.request, e.frame);
      finding.confidence = Confidence::kInferred;
      finding.title = "Held in SAFEOP: the drive is not synchronised";
      finding.message = "OP was requested in frame " + std::to_string(e.request.frame.number) + "; after " +
                        Duration(e.waited_ns) + " the slave still shows SAFEOP, without an error. " + Advice(e.slave);
      index = Report(1, Severity::kWarning, std::move(finding));
    }
    Consequence("al-timeout", e.slave, e.frame.number, index);
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
  struct Caused {
    std::string_view rule;
    SlaveId slave = kNoSlave;
    FrameNo frame = 0;
    FindingIndex cause = kNoFinding;
  };

  Open& OpenOf(SlaveId slave) {
    if (slave >= open_.size()) open_.resize(static_cast<std::size_t>(slave) + 1);
    return open_[slave];
  }

  /// The standard's list holds what any slave may refuse with; only a manual makes it a condition.
  [[nodiscard]] bool NeedsSync(SlaveId, const model::AlRequestRecord& request) const {
    if (request.control.state() != static_cast<std::uint8_t>(esc::AlState::OP) || request.transition == nullptr)
      return false;
    if (request.transition->basis != device::Basis::kPrinted) return false;
    const auto& codes = request.transition->refusal_codes;
    return request.verdict == model::AlVerdict::kLegal &&
           std::find(codes.begin(), codes.end(), kSyncError) != codes.end();
  }

  void Refused(SlaveId slave, std::uint16_t code) {
    const Open open = OpenOf(slave);
    OpenOf(slave) = {};
    if (code != kSyncError) return;
    FindingIndex index = Repeat(slave, 0, open.answer);
    if (index == kNoFinding) {
      Finding finding = About(slave, open.request, open.answer);
      finding.title = "OP requested before the drive was synchronised";
      finding.message = "OP was requested in frame " + std::to_string(open.request.frame.number) +
                        " and refused with AL status code 0x001a, synchronisation error, in frame " +
                        std::to_string(open.answer.number) + ". " + Advice(slave);
      finding.evidence = {HexNumber("al_status_code", code)};
      index = Report(0, std::move(finding));
    }
    Consequence("al-refused", slave, open.answer.number, index);
  }

  [[nodiscard]] static Finding About(SlaveId slave, const model::AlRequestRecord& request, const FrameRef& frame) {
    Finding finding;
    finding.slave = slave;
    finding.first = frame;
    AddRelated(finding, request.frame.number);
    finding.reference = ReferenceTo(request.transition->source);
    return finding;
  }
  [[nodiscard]] std::string Advice(SlaveId slave) const {
    return LawText(*context().slave(slave).profile) +
           " requires for OP that synchronisation has succeeded. Let process data run in SAFEOP in the configured "
           "cycle "
           "before OP is requested, and check cycle and jitter.";
  }
  void Consequence(std::string_view rule, SlaveId slave, FrameNo frame, FindingIndex cause) {
    constexpr std::size_t kMost = 256;
    if (consequences_.size() < kMost) consequences_.push_back({rule, slave, frame, cause});
  }

  std::vector<Open> open_;
  std::vector<Caused> consequences_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncOpBeforeSync>};

}  // namespace
}  // namespace ecaudit::sync_op_before_sync
