#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/mailbox/events.h"
#include "decoder/pipeline.h"

namespace ecaudit::mailbox_not_active {
namespace {

constexpr FindingKind kInInit{
    .name = "in-init",
    .title = "Mailbox written while the slave is in INIT, PREOP required",
    .message = R"(The master writes a mailbox message ({protocol}) in {frame}. The slave is in INIT, where it serves no
mailbox.)",
    .next = "Request PREOP first, and wait until AL Status (0x0130) shows it."};

constexpr FindingKind kSwitchedOff{
    .name = "switched-off",
    .title = "Mailbox written while sync manager 0 is switched off",
    .message =
        R"(The master writes a mailbox message ({protocol}) in {frame}. Sync manager 0 is switched off, so the slave
cannot receive the message.)",
    .next = "Set up sync manager 0, request PREOP, and wait until AL Status (0x0130) shows it."};

constexpr NoteKind kRefusedBefore{.name = "refused-before",
                                  .text = "The slave refused to leave INIT before, last in {refused_frame}."};

constexpr const FindingKind* kKinds[] = {&kInInit, &kSwitchedOff};
constexpr const NoteKind* kNotes[] = {&kRefusedBefore};

constexpr Word kStateAtMessage{"state-at-message", "the state of the slave at the time of a message"};

// It is its cause.
constexpr std::string_view kAfter[] = {"al-refused"};

constexpr RuleInfo kInfo{.id = "mailbox-not-active",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .history = History::kWhole,
                         .title = "A mailbox message is written while the mailbox is not active",
                         .needs = "the AL state of the slave, or the settings of sync manager 0",
                         .source = "ETG1000.6, EtherCAT state machine",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Whether the master writes a mailbox message while the slave is known to be in INIT, or while sync manager 0 is known to
be switched off.

## Why it matters
A slave serves its mailbox only in BOOT, PREOP, SAFEOP and OP. In INIT the message is refused, or it stays in the
mailbox and is lost at the next start.

## How it is decided
The AL state decides: only INIT is possible, and no open request may have changed it. A write that is refused (working
counter 0) counts, too. If the slave stayed in INIT because it refused another state, caused_by names that refusal.

## Example
The slave refuses PREOP with 0x0016, and the master continues with its SDO configuration.

## What to do
Wait for PREOP in AL Status (0x0130) before the first mailbox message, and check the error bit.
)"};

class MailboxNotActive final : public Rule {
 public:
  MailboxNotActive() : Rule(kInfo) {
    Subscribe<mailbox::MailboxMessage>(&MailboxNotActive::On);
    Subscribe<mailbox::MailboxRefused>(&MailboxNotActive::On);
  }

  void On(const mailbox::MailboxMessage& m) {
    if (m.direction == mailbox::Direction::kOut && !m.late) {
      Evaluate(m.slave, m.frame(), m.returned, m.header, m.mailbox_off, m.assumed, m.window_inferred);
    }
  }
  void On(const mailbox::MailboxRefused& e) { Evaluate(e.slave, e.frame(), e.returned, e.header, e.off, false, false); }

  void Finish() override { (void)NotEvaluableWithoutReturns(); }

 private:
  static constexpr std::size_t kMailboxOut = 0;  ///< sync manager

  void Evaluate(SlaveId slave, const FrameRef& frame, const FrameRef& returned, const mailbox::Header& header, bool off,
                bool assumed, bool window_inferred) {
    const model::StateSet possible = context().slave(slave).al.possible();
    const bool init = possible.single() == static_cast<std::uint8_t>(esc::AlState::INIT);
    if (!init && !off) {
      if (possible.empty() && !assumed) {
        NotEvaluable(slave, ReasonCode::kNotInCapture, what::kAlState, frame.number);
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
    // A message that never returned is reported late: what is known then may be from after the message.
    if (learned > (returned.seen() ? returned : frame).number) {
      NotEvaluable(slave, ReasonCode::kNotInCapture, kStateAtMessage, frame.number);
      return;
    }
    if (network.MayMissBetween(learned, frame.number)) {
      NotEvaluable(slave, ReasonCode::kCaptureGap, what::kHistory, frame.number);
      return;
    }
    const std::uint64_t key = init ? 1 : 2;
    if (Repeat(slave, key, frame) != kNoFinding) return;
    Finding finding = Found(init ? kInInit : kSwitchedOff, slave, frame);
    finding.confidence = assumed || window_inferred ? Confidence::kInferred : Confidence::kObserved;
    finding.Set("protocol", ProtocolValue(header.protocol)).Set("mailbox_off", arg::Boolean(off));
    if (init) {
      finding.Set("al_state", arg::State(static_cast<std::uint8_t>(esc::AlState::INIT)));
      finding.caused_by = RefusalBefore(slave, frame.number);
      if (finding.caused_by != kNoFinding) {
        const FrameNo refused = context().store[finding.caused_by].last.number;
        finding.Add(kRefusedBefore, {{"refused_frame", arg::Frame(refused)}});
        AddRelated(finding, refused);
      }
    }
    Report(key, std::move(finding));
  }

  /// The latest refusal: the slave is still in the state before it.
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
