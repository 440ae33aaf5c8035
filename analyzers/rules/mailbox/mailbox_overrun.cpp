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
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::mailbox_overrun {
namespace {

constexpr RuleInfo kInfo{.id = "mailbox-overrun",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .title = "A request is written while the one before is still in the mailbox",
                         .needs = "the working counter of the write, and the request before",
                         .source = "ESC-1, mailbox",
                         .doc = R"(
## What it checks
Writes of a mailbox message that the sync manager refuses (working counter 0) because the message before has not been
taken out by the slave yet.

## Why it matters
A mailbox holds one message. The refused one is lost unless the master notices and writes it again.

## How it is decided
The write came back with working counter 0, the mailbox is switched on, and a request is outstanding. The same message
again, byte for byte, is a repetition after a time-out and no overrun. Where a message of another protocol fills the
mailbox, and the master writes the refused one unchanged until it is taken, nothing is lost: an info. So it is where
the repetition of a message fills it whose first frame was lost: the slave may have had that already, and caused_by
names frame-lost. Where the outstanding request was never answered, caused_by names mailbox-no-response: the slave
stopped taking messages.

## Example
samples/captures/mailbox-no-response.pcapng: the second request comes back with working counter 0.

## What to do
Wait for the answer, or until sync manager 0 shows the mailbox empty (0x0805 bit 3), before the next message is written.
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
      NotEvaluable(e.slave, "a refused mailbox write, and the message that fills the mailbox is not in the capture",
                   e.frame().number);
      return;
    }
    const mailbox::Protocol full_of = requested ? e.outstanding.protocol : e.last_protocol;
    const bool beside = full_of != e.header.protocol;
    const std::uint64_t key = (requested ? RequestKey(e.outstanding) : static_cast<std::uint64_t>(full_of)) |
                              static_cast<std::uint64_t>(beside) << 63U;
    FindingIndex index = Repeat(e.slave, key, e.frame());
    if (index == kNoFinding) index = Tell(e, key, requested);
    if (index == kNoFinding) return;
    std::set<FindingIndex>& open = open_[e.slave];
    if (e.attempt == 1) open.clear();  // another message: the one before is lost
    Told& told = told_[index];
    told.beside = beside;
    if (open.insert(index).second) ++told.open;
    Remember(e.slave, index);
  }

  /// What was refused is taken after all.
  void On(const mailbox::MailboxMessage& e) {
    if (e.direction != mailbox::Direction::kOut) return;
    Follow(e);
    if (e.refused_before == 0) return;
    for (const FindingIndex index : std::exchange(open_[e.slave], {})) {
      Told& told = told_[index];
      --told.open;
      told.taken = e.frame().number;
    }
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    for (const auto& [index, told] : told_) {
      Finding& finding = context().store[index];
      if (told.request != 0) finding.caused_by = context().ExplanationOf(finding.slave, told.request);
      if (told.open > 0) continue;
      const bool repeats = told.by_repetition == told.fillings;
      if (!told.beside && !repeats) continue;
      if (repeats) {
        finding.message +=
            " That message repeats the one of frame " + std::to_string(told.lost) +
            ", which never came back: where the slave had that one already, the repetition is in the way.";
        AddRelated(finding, told.lost);
        if (finding.caused_by == kNoFinding) finding.caused_by = LostFrames();
      }
      // Who serves two protocols side by side does not know of the other's message, and tries until there is room.
      context().store.Regrade(index, Severity::kInfo);
      finding.message += " The master wrote it again, unchanged, until the slave took it, last in frame " +
                         std::to_string(told.taken) + ": nothing was lost.";
      AddRelated(finding, told.taken);
    }
  }

 private:
  /// What became of the refused messages of one finding.
  struct Told {
    FrameNo request = 0;
    bool beside = false;     ///< of another protocol than what filled the mailbox
    std::uint64_t open = 0;  ///< not taken since
    FrameNo taken = 0;
    std::uint64_t fillings = 0, by_repetition = 0;  ///< messages that filled the mailbox
    FrameNo lost = 0;  ///< the first frame of the message whose repetition filled the mailbox
  };
  /// A message of the master.
  struct Message {
    FrameNo frame = 0;
    std::uint8_t counter = 0;
    std::vector<std::uint8_t> data;
    FindingIndex refused = kNoFinding;  ///< what tells that another one was refused while this one filled the mailbox

    [[nodiscard]] bool RepeatsOf(const Message& other) const {
      return frame > other.frame && counter == other.counter && data == other.data;
    }
  };
  struct Written {
    std::deque<Message> last;  ///< that came back, the newest last
    Message lost;              ///< whose frame did not
  };
  /// A loss shows within a few messages.
  static constexpr std::size_t kReach = 8;

  /// What the slave was written, and which of it fills its mailbox again although it had it.
  void Follow(const mailbox::MailboxMessage& e) {
    Message message{e.frame().number, e.header.counter, {e.payload.begin(), e.payload.end()}};
    Written& written = written_[e.slave];
    if (e.certainty == Certainty::kUnknown) {
      written.lost = std::move(message);
      for (const Message& again : written.last) TellRepetition(again, written.lost);
      return;
    }
    written.last.push_back(std::move(message));
    if (written.last.size() > kReach) written.last.pop_front();
  }

  /// The slave refused another message while it had not taken the newest one.
  void Remember(SlaveId slave, FindingIndex index) {
    Written& written = written_[slave];
    if (!written.last.empty() && written.last.back().refused != kNoFinding) return;
    ++told_[index].fillings;
    if (written.last.empty()) return;
    written.last.back().refused = index;
    TellRepetition(written.last.back(), written.lost);
  }

  void TellRepetition(const Message& again, const Message& lost) {
    if (again.refused == kNoFinding || lost.frame == 0 || !again.RepeatsOf(lost)) return;
    Told& told = told_[again.refused];
    ++told.by_repetition;
    if (told.lost == 0) told.lost = lost.frame;
  }

  [[nodiscard]] FindingIndex LostFrames() const {
    const std::vector<Finding>& findings = context().store.findings();
    for (std::size_t i = 0; i < findings.size(); ++i) {
      if (findings[i].rule == "frame-lost") return static_cast<FindingIndex>(i);
    }
    return kNoFinding;
  }

  FindingIndex Tell(const mailbox::MailboxRefused& e, std::uint64_t key, bool requested) {
    const FrameNo full_since = requested ? e.outstanding.frame.number : e.last_message;
    const std::string full_of = requested ? RequestText(e.outstanding) : "the " + Name(e.last_protocol) + " message";
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame();
    finding.title = Name(e.header.protocol) + " message refused: the mailbox is still full";
    finding.message = "The " + Name(e.header.protocol) + " message in frame " + std::to_string(e.frame().number) +
                      " came back with working counter 0: " + full_of + " of frame " + std::to_string(full_since) +
                      " is still in the mailbox. Wait for the answer, or look at 0x0805, before the next message.";
    finding.evidence.push_back(Number("working_counter", 0));
    finding.evidence.push_back(Text("outstanding", full_of));
    finding.evidence.push_back(Number("counter", e.header.counter));
    AddRelated(finding, full_since);
    const FindingIndex index = Report(key, std::move(finding));
    if (index != kNoFinding && requested) told_[index].request = full_since;
    return index;
  }

  std::map<FindingIndex, Told> told_;
  std::map<SlaveId, Written> written_;
  std::map<SlaveId, std::set<FindingIndex>> open_;  ///< those that tell of the message that the slave refused last
};

const RuleRegistration kRegistration{kInfo, MakeRule<MailboxOverrun>};

}  // namespace
}  // namespace ecaudit::mailbox_overrun
