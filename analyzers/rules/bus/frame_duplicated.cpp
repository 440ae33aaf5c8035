#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/text.h"
#include "decoder/pipeline.h"
#include "decoder/track/events.h"

namespace ecaudit::frame_duplicated {
namespace {

constexpr RuleInfo kInfo{.id = "frame-duplicated",
                         .group = "Frame and bus",
                         .severity = Severity::kWarning,
                         .title = "A frame came back twice, or circulates",
                         .needs = "outbound and returned frames",
                         .source = "ESC-1, circulating frames",
                         .doc = R"(
## What it checks
Returned frames that are byte for byte what came back before, with no outbound frame left that they could answer; and
the circulating bit, which a slave sets when its port towards the master has no link.

## Why it matters
Slaves may have processed the frame twice, the ring is broken or cabled in the wrong order, or the capture set-up
records packets twice.

## How it is decided
By content: repeats by the master have an outbound copy of their own and are not counted. Where outbound frames stand
twice in the capture, too, one right behind the other, it is the capture that holds packets twice: then the finding is
an info, and where both copies of a frame stand there twice it is counted once and nothing is said. So is nearly every
returned frame twice, none of them with the circulating bit: a mirror port does that. A single circulating frame during
a redundancy switch-over is no finding.

## Example
samples/captures/duplicated-frames.pcapng

## What to do
Check the port order of the slaves (the master belongs at port 0) and the capture set-up (mirror ports that see both
directions of both ports).
)"};

class FrameDuplicated final : public Rule {
 public:
  FrameDuplicated() : Rule(kInfo) {
    Subscribe<track::FrameDuplicated>(&FrameDuplicated::On);
    Subscribe<track::Answered>(&FrameDuplicated::On);
    Subscribe<track::LogicalAccess>(&FrameDuplicated::On);
  }

  void On(const track::FrameDuplicated& e) {
    if (FindingIndex index = Repeat(kNoSlave, kTwice, e.returned.ref()); index != kNoFinding) {
      AddRelated(context().store[index], e.returned.ref().number);
      return;
    }
    Finding finding;
    finding.first = e.returned.ref();
    finding.title = "Frame came back twice";
    finding.message = "Frame " + std::to_string(e.returned.ref().number) + " is byte for byte what frame " +
                      std::to_string(e.original) +
                      " already brought back, and no outbound frame is left that it could answer. Check whether the "
                      "capture set-up records packets twice, and the port order of the slaves.";
    finding.evidence.push_back(Number("original_frame", static_cast<std::int64_t>(e.original)));
    AddRelated(finding, e.original);
    twice_ = Report(kTwice, std::move(finding));
  }

  void On(const track::Answered& e) {
    if (e.circulating) OnCirculating(e.returned);
  }
  void On(const track::LogicalAccess& e) {
    if (e.circulating) OnCirculating(e.returned);
  }

  void Finish() override {
    if (twice_ != kNoFinding && context().store[twice_].count > 1) {
      context().store[twice_].title = Count(context().store[twice_].count, "frame") + " came back twice";
    }
    const std::uint64_t sent_twice = context().pairing().outbound_twice;
    if (twice_ != kNoFinding && sent_twice * 4 >= context().store[twice_].count) {
      Finding& finding = context().store[twice_];
      context().store.Regrade(twice_, Severity::kInfo);
      finding.title = "The capture holds packets twice: " + Count(finding.count, "returned frame") + " and " +
                      Grouped(sent_twice) + " outbound";
      finding.message += " " + Count(sent_twice, "outbound frame") + (sent_twice == 1 ? " stands" : " stand") +
                         " there twice, too, which no slave can do: it is the capture.";
      finding.confidence = Confidence::kInferred;
      finding.evidence.push_back(Number("outbound_twice", static_cast<std::int64_t>(sent_twice)));
    } else if (twice_ != kNoFinding && circulating_ == 0 && IsNearlyEach(context().store[twice_].count)) {
      Finding& finding = context().store[twice_];
      context().store.Regrade(twice_, Severity::kInfo);
      finding.title = "The capture holds returned frames twice: " + Grouped(finding.count);
      finding.message +=
          " Nearly every returned frame stands there twice, and none has the circulating bit: it is the capture (a "
          "mirror port, for example).";
      finding.confidence = Confidence::kInferred;
    }
    if (NotEvaluableWithoutReturns()) return;
    if (context().pairing().outbound == 0 && context().pairing().returned > 0) {
      NotEvaluable(kNoSlave, "no outbound frames in the capture; only the circulating bit is judged");
    }
  }

 private:
  /// What loops frames back does so with the circulating bit, or now and then.
  [[nodiscard]] bool IsNearlyEach(std::uint64_t count) const {
    constexpr std::uint64_t kMany = 64;
    return count >= kMany && count * 10 >= context().pairing().paired * 9;
  }

  void OnCirculating(const FrameRef& returned) {
    if (returned.number == last_circulating_) return;  // another datagram of the same frame
    last_circulating_ = returned.number;
    ++circulating_;
    if (!first_circulating_.seen()) first_circulating_ = returned;
    if (circulating_ < 2) return;
    if (Repeat(kNoSlave, kCirculating, returned) != kNoFinding) return;
    Finding finding;
    finding.first = first_circulating_;
    finding.last = returned;
    finding.count = circulating_;
    finding.title = "Frames circulate";
    finding.message =
        "The circulating bit is set in returned datagrams from frame " + std::to_string(first_circulating_.number) +
        " on: a slave has no link at its port towards the master and loops frames back. Check for a broken "
        "ring and for slaves whose ports are swapped.";
    Report(kCirculating, std::move(finding));
  }

  static constexpr std::uint64_t kTwice = 1;
  static constexpr std::uint64_t kCirculating = 2;
  FindingIndex twice_ = kNoFinding;
  FrameRef first_circulating_;
  FrameNo last_circulating_ = 0;
  std::uint64_t circulating_ = 0;
};

const RuleRegistration kRegistration{kInfo, MakeRule<FrameDuplicated>};

}  // namespace
}  // namespace ecaudit::frame_duplicated
