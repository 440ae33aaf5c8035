#include <utility>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/pipeline.h"
#include "decoder/track/events.h"

namespace ecaudit::frame_duplicated {
namespace {

constexpr FindingKind kTwiceReturned{
    .name = "twice",
    .title = "{count:number} {count?frame|frames} returned twice",
    .message = R"({frame} is byte for byte the same as {original_frame}, which returned before. No outbound frame is
left that it could answer.)",
    .next = "Check whether the recorder captures packets twice, and check the port order of the slaves."};
constexpr FindingKind kPacketsTwice{
    .name = "packets-twice",
    .title = "The capture has packets twice: {count:number} returned, {outbound_twice:number} outbound",
    .message = R"({frame} is byte for byte the same as {original_frame}, which returned before. {outbound_twice}
{outbound_twice?is|are} in the capture twice, too. No slave can do that: the recorder captured packets twice.)",
    .next = "Record each packet once: mirror one direction of each port."};
constexpr FindingKind kReturnsTwice{
    .name = "returns-twice",
    .title = "The capture has {count:number} returned frames twice",
    .message = R"({frame} is byte for byte the same as {original_frame}, which returned before. Nearly every returned
frame is in the capture twice, and none has the circulating bit. So the recorder captured them twice, for example at a
mirror port.)",
    .next = "Record each packet once: mirror one direction of each port."};
constexpr FindingKind kCirculate{
    .name = "circulating",
    .title = "Frames circulate",
    .message = R"(The circulating bit is set in returned datagrams from {frame} on. So a slave has no link at its port
towards the master and sends frames back into the ring.)",
    .next = "Check for a broken ring and for slaves whose ports are swapped."};
constexpr const FindingKind* kKinds[] = {&kTwiceReturned, &kPacketsTwice, &kReturnsTwice, &kCirculate};

constexpr RuleInfo kInfo{.id = "frame-duplicated",
                         .group = "Frame and bus",
                         .severity = Severity::kWarning,
                         .history = History::kWhole,
                         .title = "A frame returned twice, or circulates",
                         .needs = "outbound and returned frames",
                         .source = "ESC-1, circulating frames",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
- Returned frames that are byte for byte the same as an earlier return, with no outbound frame left that they could
  answer.
- The circulating bit. A slave sets it if its port towards the master has no link.

## Why it matters
Slaves may have processed the frame twice, the ring is broken or its cables are in the wrong order, or the capture
set-up records packets twice.

## How it is decided
By content. Repetitions by the master have an outbound copy of their own and are not counted.

- If outbound frames are in the capture twice as well, one directly after the other, the recorder captured packets
  twice. Then the finding is an info. A frame of which both copies are there twice is counted once and not reported.
- The finding is an info as well if nearly every returned frame is there twice, none with the circulating bit: a mirror
  port does that.
- A single circulating frame during a redundancy switch-over is no finding.

## Example
samples/captures/duplicated-frames.pcapng

## What to do
Check the port order of the slaves (the master belongs at port 0) and the capture set-up: mirror ports may record both
directions of both ports.
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
    Finding finding = Found(kTwiceReturned, kNoSlave, e.returned.ref());
    finding.Set("original_frame", arg::Frame(e.original));
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
    const std::uint64_t sent_twice = context().pairing().outbound_twice;
    if (twice_ != kNoFinding && sent_twice * 4 >= context().store[twice_].count) {
      Finding& finding = context().store[twice_];
      context().store.Regrade(twice_, Severity::kInfo);
      finding.kind = &kPacketsTwice;
      finding.confidence = Confidence::kInferred;
      finding.Set("outbound_twice", arg::Count(sent_twice, "outbound frame"));
    } else if (twice_ != kNoFinding && circulating_ == 0 && IsNearlyEach(context().store[twice_].count)) {
      Finding& finding = context().store[twice_];
      context().store.Regrade(twice_, Severity::kInfo);
      finding.kind = &kReturnsTwice;
      finding.confidence = Confidence::kInferred;
    }
    if (NotEvaluableWithoutReturns()) return;
    if (context().pairing().outbound == 0 && context().pairing().returned > 0) {
      NotEvaluable(kNoSlave, ReasonCode::kNoOutboundFrames);
    }
  }

 private:
  /// A slave that sends frames back sets the circulating bit, or does so only sometimes.
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
    Finding finding = Found(kCirculate, kNoSlave, first_circulating_);
    finding.last = returned;
    finding.count = circulating_;
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
