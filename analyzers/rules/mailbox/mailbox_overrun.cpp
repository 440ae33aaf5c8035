#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::mailbox_overrun {
namespace {

constexpr FindingKind kRefused{
    .name = "refused",
    .title = "{protocol} message refused: the out mailbox (SM0) is still full",
    .message = R"(The {protocol} message in {frame} returned with working counter {working_counter}. The [{?sdo}SDO
request for ]{outstanding}[{?request} request][{?message} message] of {full_since} is still in the mailbox.)",
    .next = R"(Before the next message, wait for the response, or until 0x0805 shows an empty mailbox.)",
    .identity = "protocol"};

constexpr NoteKind kRepeatsLost{
    .name = "repeats-lost",
    .text =
        R"(That message repeats the one of {lost_frame}, which never returned. If the slave already has that one, the
repetition blocks its mailbox.)"};
constexpr NoteKind kAcceptedLater{
    .name = "accepted-later",
    .text = R"(The master wrote the refused message again, unchanged, until the slave accepted it, last in
{accepted_frame}. No message was lost.)"};

constexpr const FindingKind* kKinds[] = {&kRefused};
constexpr const NoteKind* kNotes[] = {&kRepeatsLost, &kAcceptedLater};

constexpr Word kMessageInMailbox{"message-in-mailbox", "the message that fills the mailbox"};

// It asks what explains the request.
constexpr std::string_view kAfter[] = {"sdo-incomplete", "frame-lost"};

constexpr RuleInfo kInfo{.id = "mailbox-overrun",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .history = History::kWhole,
                         .title = "A request is written while the one before is still in the mailbox",
                         .needs = "the working counter of the write, and the request before",
                         .source = "ESC-1, mailbox",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Writes of a mailbox message that the sync manager refuses (working counter 0) because the slave has not yet read the
message before.

## Why it matters
A mailbox holds one message. The refused message is lost unless the master detects this and writes it again.

## How it is decided
The write returned with working counter 0, the mailbox is switched on, and a request is outstanding. The same message
again, byte for byte, is a repetition after a time-out and no overrun.

The finding is an info, because nothing is lost, in two cases. In both the master writes the refused message unchanged
until the slave accepts it:

- A message of another protocol fills the mailbox.
- The repetition of a message fills the mailbox, and the frame of the first one was lost. The slave may already have
  that message. caused_by names frame-lost.

If the outstanding request was never answered, caused_by names mailbox-no-response: the slave does not read its mailbox.

## Example
samples/captures/mailbox-no-response.pcapng: the second request returns with working counter 0.

## What to do
Before the next message, wait for the response, or until sync manager 0 shows an empty mailbox (bit 3 of 0x0805).
)"};

class MailboxOverrun final : public Rule {
 public:
  MailboxOverrun() : Rule(kInfo) {
    Subscribe<mailbox::MailboxRefused>(&MailboxOverrun::On);
    Subscribe<mailbox::MailboxMessage>(&MailboxOverrun::On);
  }

  void On(const mailbox::MailboxRefused& e) {
    if (e.same_as_last || e.off) return;
    const model::StateSet possible = context().slave(e.slave).al.possible();
    if (possible.single() == static_cast<std::uint8_t>(esc::AlState::INIT)) return;  // mailbox-not-active
    const bool requested = e.outstanding.frame.seen();
    if (!requested && e.last_message == 0) {
      NotEvaluable(e.slave, ReasonCode::kNotInCapture, kMessageInMailbox, e.frame().number);
      return;
    }
    const mailbox::Protocol full_of = requested ? e.outstanding.protocol : e.last_protocol;
    const bool beside = full_of != e.header.protocol;
    const std::uint64_t key = (requested ? RequestKey(e.outstanding) : static_cast<std::uint64_t>(full_of)) |
                              static_cast<std::uint64_t>(beside) << 63U;
    FindingIndex index = Repeat(e.slave, key, e.frame());
    if (index == kNoFinding) index = ReportRefused(e, key, requested);
    if (index == kNoFinding) return;
    std::set<FindingIndex>& open = open_[e.slave];
    if (e.attempt == 1) open.clear();  // another message: the one before is lost
    Fate& fate = fates_[index];
    fate.beside = beside;
    if (open.insert(index).second) ++fate.open;
    Remember(e.slave, index);
  }

  /// The refused message is accepted after all.
  void On(const mailbox::MailboxMessage& e) {
    if (e.direction != mailbox::Direction::kOut) return;
    Follow(e);
    if (e.refused_before == 0) return;
    for (const FindingIndex index : std::exchange(open_[e.slave], {})) {
      Fate& fate = fates_[index];
      --fate.open;
      fate.accepted = e.frame().number;
    }
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    for (const auto& [index, fate] : fates_) {
      Finding& finding = context().store[index];
      if (fate.request != 0) finding.caused_by = context().ExplanationOf(finding.slave, fate.request);
      if (fate.open > 0) continue;
      const bool repeats = fate.by_repetition == fate.fillings;
      if (!fate.beside && !repeats) continue;
      if (repeats) {
        finding.Add(kRepeatsLost, {{"lost_frame", arg::Frame(fate.lost)}});
        AddRelated(finding, fate.lost);
        if (finding.caused_by == kNoFinding) finding.caused_by = LostFrames();
      }
      // A master that serves two protocols independently does not know of the other message, and retries until there is
      // room.
      context().store.Regrade(index, Severity::kInfo);
      finding.Add(kAcceptedLater, {{"accepted_frame", arg::Frame(fate.accepted)}});
      AddRelated(finding, fate.accepted);
    }
  }

 private:
  /// What happened to the refused messages of one finding.
  struct Fate {
    FrameNo request = 0;
    bool beside = false;     ///< of another protocol than what filled the mailbox
    std::uint64_t open = 0;  ///< not accepted yet
    FrameNo accepted = 0;
    std::uint64_t fillings = 0, by_repetition = 0;  ///< messages that filled the mailbox
    FrameNo lost = 0;  ///< the first frame of the message whose repetition filled the mailbox
  };
  /// A message of the master.
  struct Message {
    FrameNo frame = 0;
    std::uint8_t counter = 0;
    std::vector<std::uint8_t> data;
    FindingIndex refused = kNoFinding;  ///< reports that another message was refused while this one filled the mailbox

    [[nodiscard]] bool RepeatsOf(const Message& other) const {
      return frame > other.frame && counter == other.counter && data == other.data;
    }
  };
  struct Written {
    std::deque<Message> last;  ///< that returned, the newest last
    Message lost;              ///< whose frame never returned
  };
  /// A loss is detected within a few messages.
  static constexpr std::size_t kReach = 8;

  /// Records what was written to the slave, and which message fills its mailbox a second time.
  void Follow(const mailbox::MailboxMessage& e) {
    Message message{e.frame().number, e.header.counter, {e.payload.begin(), e.payload.end()}};
    Written& written = written_[e.slave];
    if (e.certainty == Certainty::kUnknown) {
      written.lost = std::move(message);
      for (const Message& again : written.last) CountRepetition(again, written.lost);
      return;
    }
    written.last.push_back(std::move(message));
    if (written.last.size() > kReach) written.last.pop_front();
  }

  /// The slave refused another message while the newest one was still in its mailbox.
  void Remember(SlaveId slave, FindingIndex index) {
    Written& written = written_[slave];
    if (!written.last.empty() && written.last.back().refused != kNoFinding) return;
    ++fates_[index].fillings;
    if (written.last.empty()) return;
    written.last.back().refused = index;
    CountRepetition(written.last.back(), written.lost);
  }

  void CountRepetition(const Message& again, const Message& lost) {
    if (again.refused == kNoFinding || lost.frame == 0 || !again.RepeatsOf(lost)) return;
    Fate& fate = fates_[again.refused];
    ++fate.by_repetition;
    if (fate.lost == 0) fate.lost = lost.frame;
  }

  [[nodiscard]] FindingIndex LostFrames() const {
    const std::vector<Finding>& findings = context().store.findings();
    for (std::size_t i = 0; i < findings.size(); ++i) {
      if (findings[i].rule == "frame-lost") return static_cast<FindingIndex>(i);
    }
    return kNoFinding;
  }

  FindingIndex ReportRefused(const mailbox::MailboxRefused& e, std::uint64_t key, bool requested) {
    const FrameNo full_since = requested ? e.outstanding.frame.number : e.last_message;
    Arguments request;
    if (requested) SetRequest(request, e.outstanding);
    const Value* object = request.Find("object");
    Finding finding = Found(kRefused, e.slave, e.frame());
    finding.Set("protocol", ProtocolValue(e.header.protocol))
        .Set("working_counter", arg::Number(0))
        .Set("outstanding",
             object != nullptr ? *object : ProtocolValue(requested ? e.outstanding.protocol : e.last_protocol))
        .Set("full_since", arg::Frame(full_since))
        .Set("counter", arg::Number(e.header.counter))
        .Set("sdo", arg::Flag(object != nullptr))
        .Set("request", arg::Flag(requested && object == nullptr))
        .Set("message", arg::Flag(!requested));
    AddRelated(finding, full_since);
    const FindingIndex index = Report(key, std::move(finding));
    if (index != kNoFinding && requested) fates_[index].request = full_since;
    return index;
  }

  std::map<FindingIndex, Fate> fates_;
  std::map<SlaveId, Written> written_;
  std::map<SlaveId, std::set<FindingIndex>> open_;  ///< about the message that the slave refused last
};

const RuleRegistration kRegistration{kInfo, MakeRule<MailboxOverrun>};

}  // namespace
}  // namespace ecaudit::mailbox_overrun
