#include <algorithm>
#include <array>
#include <string>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/text.h"
#include "decoder/base/time.h"
#include "decoder/bus/direction.h"
#include "decoder/pipeline.h"

namespace ecaudit::bus_no_answer {
namespace {

/// So many frames, for so long, without one return: longer than any frame is under way, and masters wait for one.
constexpr std::uint64_t kEnoughFrames = 3;
constexpr std::int64_t kLongEnoughNs = 20'000'000;

constexpr std::uint64_t kForGood = 0;
constexpr std::uint64_t kInVain = 1;

constexpr RuleInfo kInfo{.id = "bus-no-answer",
                         .group = "Frame and bus",
                         .severity = Severity::kError,
                         .needs_no_history = true,
                         .title = "Frames are sent, and none comes back",
                         .needs = "frames that the master repeats after a time-out, or returns before",
                         .source = "ETG1000.4, frame processing: each frame returns to its sender",
                         .doc = R"(
## What it checks
Outbound frames that are repeated after a time-out and never come back, in the whole capture, or from some frame on
until its end; and those that are sent in vain until somebody answers.

## Why it matters
The ring is open towards the master: no slave gets anything, and those in OP fall by their watchdogs.

## How it is decided
Where nothing ever came back, the master must have repeated frames under one index after a pause: else the capture may
hold one direction only (capture-one-direction). Where frames came back before, three frames or more within at least 20
ms must have been sent behind the last return, by masters that were answered before: of others nobody knows whether
anything comes back. Three and more in more than 50 ms before the first one that came back are
an info: the slaves may have been switched on later than the master.

## Example
tests/rules/bus-no-answer/violates.trace

## What to do
Look at the cable between the master and the first slave, the master's port (link, right interface), and the power of
the first slave.
)"};

class BusNoAnswer final : public Rule {
 public:
  BusNoAnswer() : Rule(kInfo) { Subscribe<FrameSeen>(&BusNoAnswer::On); }

  void On(const FrameSeen& e) {
    // What cannot be read, and may have passed slaves, came back for all that anybody knows.
    if (e.direction == bus::Direction::kReturned || e.direction == bus::Direction::kByPair) {
      if (!last_returned_.seen()) {
        first_returned_ = e.frame.ref();
        first_in_vain_ = since_.first;
        last_in_vain_ = sent_before_last_;
      }
      last_returned_ = e.frame.ref();
      NoteAnswered(bus::SenderOf(e.frame));
      since_.count = since_answered_.count = 0;
    } else if (e.direction == bus::Direction::kOutbound) {
      sent_before_last_ = since_.last.seen() ? since_.last : e.frame.ref();
      since_.Add(e.frame.ref());
      if (WasAnswered(bus::SenderOf(e.frame))) since_answered_.Add(e.frame.ref());
    }
  }

  void Finish() override {
    const bus::PairingStatistics& pairing = context().pairing();
    if (pairing.outbound == 0) {
      NotEvaluableWithoutSent();
      return;
    }
    const bool ever = pairing.returned > 0;
    if (!ever && !pairing.no_answers) {
      NotEvaluable(kNoSlave, "no returned frame is in the capture, and none is seen to be repeated after a time-out");
      return;
    }
    TellInVain(pairing);
    // Of frames of a sender to whom nothing ever came back nobody knows whether they do; unless what comes back has
    // another address than what was sent.
    const Sent& sent = since_answered_.first.seen() ? since_answered_ : since_;
    if (pairing.undecided[static_cast<std::size_t>(bus::Undecided::kNoReturns)] > 0 && since_.count >= kEnoughFrames &&
        !since_answered_.first.seen() && ever) {
      NotEvaluable(kNoSlave,
                   "the returned frames are of another master: of those of the one that sent last, none is in the "
                   "capture",
                   since_.first.number);
      return;
    }
    if (sent.count < kEnoughFrames) return;
    const bool timed = sent.first.has_time && sent.last.has_time;
    const std::int64_t silence = timed ? Elapsed(sent.first.time, sent.last.time) : 0;
    if (ever && silence < kLongEnoughNs) return;
    Finding finding;
    finding.first = sent.first;
    finding.last = sent.last;
    finding.count = sent.count;
    finding.title = ever ? "No frame comes back any more" : "No frame comes back: nobody answers";
    finding.message = (ever ? "The last frame that came back is " + std::to_string(last_returned_.number) +
                                  "; from frame " + std::to_string(sent.first.number) + " on "
                            : std::string("The master repeats its frames after a time-out; ")) +
                      Count(sent.count, "frame") + " went out" +
                      (timed ? " within " + Duration(silence) : std::string()) +
                      " and none returned. Look at the cable between master and first slave, at the master's port, and "
                      "at the power of the first slave.";
    if (ever) AddRelated(finding, last_returned_.number);
    finding.evidence = {Number("frames", static_cast<std::int64_t>(sent.count)),
                        Real("silence_ms", static_cast<double>(silence) / 1e6)};
    Report(kForGood, std::move(finding));
  }

 private:
  struct Sent {
    std::uint64_t count = 0;
    FrameRef first, last;
    void Add(const FrameRef& frame) {
      if (count++ == 0) first = frame;
      last = frame;
    }
  };

  void NoteAnswered(std::uint64_t sender) {
    if (answered_count_ < answered_.size() && !WasAnswered(sender)) answered_[answered_count_++] = sender;
  }
  [[nodiscard]] bool WasAnswered(std::uint64_t sender) const {
    const auto end = answered_.begin() + static_cast<std::ptrdiff_t>(answered_count_);
    return std::find(answered_.begin(), end, sender) != end;
  }

  void TellInVain(const bus::PairingStatistics& pairing) {
    const std::uint64_t in_vain = pairing.undecided[static_cast<std::size_t>(bus::Undecided::kNoAnswers)];
    if (in_vain == 0 || !first_returned_.seen() || !first_in_vain_.seen()) return;
    Finding finding;
    finding.first = first_in_vain_;
    finding.last = last_in_vain_;
    finding.count = in_vain;
    finding.title = "Nobody answers before frame " + std::to_string(first_returned_.number);
    finding.message =
        Count(in_vain, "frame") + " went out before the first one that came back, frame " +
        std::to_string(first_returned_.number) +
        ": nobody was reached, because the slaves were switched on later or the link came up late; or the capture "
        "does not hold the returns of its beginning.";
    AddRelated(finding, first_returned_.number);
    finding.evidence = {Number("frames", static_cast<std::int64_t>(in_vain))};
    const FindingIndex index = Report(kInVain, std::move(finding));
    if (index != kNoFinding) context().store.Regrade(index, Severity::kInfo);
  }

  FrameRef first_returned_, first_in_vain_, last_in_vain_, sent_before_last_;
  FrameRef last_returned_;
  std::array<std::uint64_t, 2 * bus::DirectionLearner::kMaxMasters> answered_{};  ///< to whom something came back
  std::size_t answered_count_ = 0;
  Sent since_, since_answered_;  ///< behind the last return: by anybody, and by those
};

const RuleRegistration kRegistration{kInfo, MakeRule<BusNoAnswer>};

}  // namespace
}  // namespace ecaudit::bus_no_answer
