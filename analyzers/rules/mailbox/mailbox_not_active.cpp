#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"
#include "decoder/pipeline.h"

namespace ecaudit::mailbox_not_active {
namespace {

constexpr RuleInfo kInfo{.id = "mailbox-not-active",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .title = "A mailbox message is written to a slave whose mailbox is not active",
                         .needs = "the AL state of the slave, or the settings of sync manager 0",
                         .source = "ETG1000.6, EtherCAT state machine",
                         .doc = R"(
## What it checks
Whether the master writes a mailbox message while the slave is known to be in INIT, or while sync manager 0 is known to
be switched off.

## Why it matters
A slave serves its mailbox in BOOT, PREOP, SAFEOP and OP only. In INIT nobody reads the message: it is refused, or stays
in the mailbox and is lost with the next start.

## How it is decided
From the AL state the slave may be in: only INIT, with no request open that may have brought it further. A write that is
refused (working counter 0) counts, too. Where the slave stayed in INIT because it refused another state, caused_by
names that refusal.

## Example
PREOP is refused with 0x0016, and the master goes on with its SDO configuration all the same.

## What to do
Wait for PREOP in AL Status (0x0130) before the first mailbox message, and look at the error bit.
)"};

class MailboxNotActive final : public Rule {
 public:
  MailboxNotActive() : Rule(kInfo) {
    Subscribe<mailbox::MailboxMessage>(&MailboxNotActive::On);
    Subscribe<mailbox::MailboxRefused>(&MailboxNotActive::On);
  }

  void On(const mailbox::MailboxMessage& m) {
    if (m.direction == mailbox::Direction::kOut && !m.late) {
      Judge(m.slave, m.frame(), m.returned, m.header, m.mailbox_off, m.assumed, m.window_inferred);
    }
  }
  void On(const mailbox::MailboxRefused& e) { Judge(e.slave, e.frame(), e.returned, e.header, e.off, false, false); }

  void Finish() override { (void)NotEvaluableWithoutReturns(); }

 private:
  static constexpr std::size_t kMailboxOut = 0;  ///< sync manager

  void Judge(SlaveId slave, const FrameRef& frame, const FrameRef& returned, const mailbox::Header& header, bool off,
             bool assumed, bool window_inferred) {
    const model::StateSet possible = context().slave(slave).al.possible();
    const bool init = possible.single() == static_cast<std::uint8_t>(esc::AlState::INIT);
    if (!init && !off) {
      if (possible.empty() && !assumed) {
        NotEvaluable(slave, "AL state not known when the mailbox was written", frame.number);
      }
      return;
    }
    if (MissesPackets(context().pairing())) {
      NotEvaluable(slave, ReasonCode::kMissesPackets, frame.number);
      return;
    }
    const track::Network& network = context().network();
    const FrameNo learned =
        init ? context().slave(slave).al.last_seen() : network.state(slave).sync_manager_since[kMailboxOut];
    // That a message did not come back shows late: what is known by now may be from behind it.
    if (learned > (returned.seen() ? returned : frame).number) {
      NotEvaluable(slave,
                   "what became of a message is not in the capture, and what is known of the slave is from behind it",
                   frame.number);
      return;
    }
    if (network.MayMissBetween(learned, frame.number)) {
      NotEvaluable(slave, ReasonCode::kCaptureGap, what::kHistory, frame.number);
      return;
    }
    const std::uint64_t key = init ? 1 : 2;
    if (Repeat(slave, key, frame) != kNoFinding) return;
    Finding finding;
    finding.slave = slave;
    finding.first = frame;
    finding.confidence = assumed || window_inferred ? Confidence::kInferred : Confidence::kObserved;
    finding.title = init ? "Mailbox written while the slave is in INIT" : "Mailbox written while it is switched off";
    finding.message = "The master writes " + WithArticle(header.protocol) + " message in frame " +
                      std::to_string(frame.number) +
                      (init ? " although the slave is in INIT, where no mailbox is served"
                            : " although sync manager 0 is switched off, so that the slave cannot hear it") +
                      ". Request PREOP first and wait until AL Status shows it.";
    finding.evidence.push_back(Text("al_state", init ? "INIT" : "not judged"));
    finding.evidence.push_back({"mailbox_off", off, Evidence::Notation::kDecimal});
    if (init) {
      finding.caused_by = RefusalBefore(slave, frame.number);
      if (finding.caused_by != kNoFinding) {
        finding.message += " The slave refused to leave INIT before.";
        AddRelated(finding, context().store[finding.caused_by].last.number);
      }
    }
    Report(key, std::move(finding));
  }

  /// The refusal seen last: the slave is still where it was.
  [[nodiscard]] FindingIndex RefusalBefore(SlaveId slave, FrameNo frame) const {
    const std::vector<Finding>& findings = context().store.findings();
    FindingIndex last = kNoFinding;
    for (std::size_t i = 0; i < findings.size(); ++i) {
      const Finding& f = findings[i];
      if (f.rule != "al-refused" || f.slave != slave || f.last.number >= frame) continue;
      if (last == kNoFinding || f.last.number > findings[last].last.number) last = static_cast<FindingIndex>(i);
    }
    return last;
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<MailboxNotActive>};

}  // namespace
}  // namespace ecaudit::mailbox_not_active
