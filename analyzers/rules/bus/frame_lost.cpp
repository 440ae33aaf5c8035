#include <algorithm>
#include <cstdint>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/text.h"
#include "decoder/base/time.h"
#include "decoder/capture/frame_source.h"
#include "decoder/pipeline.h"
#include "decoder/track/events.h"

namespace ecaudit::frame_lost {
namespace {

constexpr FindingKind kLost{
    .name = "lost",
    .title = "{lost_frames} of {outbound_frames:number} never returned",
    .message = R"({lost_frames:number} outbound {lost_frames?frame|frames} never returned although
[{?master_went_on}the master went on sending][{!master_went_on}later ones did]. {lost_frames?It is|The first is} {frame}.[[{?all_in_a_row} They
are all in a row, up to {in_a_row_last_frame}][{!all_in_a_row} {in_a_row} of them are in a row, from
{in_a_row_first_frame} to {in_a_row_last_frame}][, within {in_a_row_ms}].][[{?each_followed}
{lost_frames?It is|Each of them is}][{!each_followed} {followed_by_other_traffic} of them {followed_by_other_traffic?is|are}] directly followed by a packet
of another protocol.][ The capturing machine dropped {dropped_by_capture} by its own count; {lost_frames?this loss|these losses} may be
among them.][ {returned_without_outbound} {returned_without_outbound?has|have} no outbound copy: the capture misses packets, and
{lost_frames?this loss|these losses} may be among them.][{?with_change} {lost_frames?The frame was|The frames were} in flight when the number of slaves on the bus changed.])",
    .next = R"([{?each_followed}Keep other traffic off the EtherCAT port. ][{?some_followed}Keep other traffic off the
EtherCAT port. ][{?with_change}Correct the change of the number of slaves first.][{!with_change}Check cables and connectors,
and the error counters (0x0300-0x0313) of the slaves.])"};
constexpr FindingKind kRegular{
    .name = "capture-misses-regularly",
    .title = "The capture misses every {dropped_every_ordinal} packet: {lost_frames} without a return",
    .message = R"({lost_frames:number} outbound {lost_frames?frame|frames} have no return in the capture. The first is
{frame}. Packets are missing at a regular distance of {dropped_every}: the recorder left them out.[ The capturing machine
dropped {dropped_by_capture} by its own count.][ {returned_without_outbound} {returned_without_outbound?has|have} no outbound
copy.])",
    .next = "Capture with a probe or with larger buffers before you check the bus for losses."};
constexpr FindingKind kMissed{
    .name = "capture-misses",
    .title = "The capture misses packets: {lost_frames} without a return",
    .message = R"({lost_frames:number} outbound {lost_frames?frame|frames} have no return in the capture. The first is
{frame}. {returned_without_outbound} {returned_without_outbound?has|have} no outbound copy, so the capture misses packets.
These losses may be among them.[ The capturing machine dropped {dropped_by_capture} by its own count.])",
    .next = "Capture with a probe or with larger buffers before you check the bus for losses."};
constexpr const FindingKind* kKinds[] = {&kLost, &kRegular, &kMissed};

constexpr Word kReturnsInGaps{"returns-in-gaps", "returns of frames in flight", true};
constexpr Word kReturnBeforePause{"return-before-pause", "a missing return before a long pause of the master"};

// Frames in flight are lost when slaves leave.
constexpr std::string_view kAfter[] = {"bus-slave-count-changed"};

constexpr RuleInfo kInfo{.id = "frame-lost",
                         .group = "Frame and bus",
                         .severity = Severity::kError,
                         .history = History::kNone,
                         .title = "An outbound frame never returned",
                         .needs = "outbound and returned frames",
                         .source = "ETG1000.4, frame processing: every frame returns to its master",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Whether each outbound frame returns; frames cannot overtake each other on the wire. All losses are one finding with
their number and the first frames.

## Why it matters
A lost frame is a cycle without set points and actual values. The master gets no working counter. Drives count missing
frames and leave OP.

## How it is decided
By content and order, not by time. A frame is lost if frames that were sent later returned, or if nothing returns any
more while the master goes on sending. A frame that the master sends again is lost too, however long the time-out was.

Not lost are:

- frames still in flight at the end of the capture
- frames that returned damaged
- frames that were sent before the first slave answered (bus-no-answer)
- frames in flight at a capture gap. There the indices of a master that numbers its frames skip, or a master that does
  not number them was silent for much longer than before.

A capture at the master does not show whether a frame was lost on the way out or back. A capturing machine that drops
packets looks the same. If its file counts drops, the message gives their number. Frames that returned without an
outbound copy prove that the capture misses packets: the message gives their number too.

The finding is an info if the recorder explains the losses:

- A recorder leaves out as many packets of one direction as of the other. The limit is the number of returns without an
  outbound copy, plus the gaps in the indices, plus three times the root of the sum for chance. If the file has several
  interfaces, the limit is three times as many.
- Packets are missing at a regular distance, for example every 124th, while others return.

## Example
samples/captures/lost-frames.pcapng

## What to do
Check for other traffic on the EtherCAT port (the message reports packets that follow the lost frames directly), loose
connectors, and link errors at the slaves (0x0300-0x0313).
)"};

/// One frame of that number may be lost without being what stopped the machine.
constexpr std::uint64_t kRareOneIn = 300;
/// From this number in a row on, they are reported.
constexpr std::uint64_t kManyInARow = 3;

/// A recorder that leaves out packets at random takes about as many of one direction as of the other. If each direction
/// has an interface of its own, the numbers may differ by this factor.
constexpr std::uint64_t kFair = 3;
/// By chance they differ by no more than this many times the root of their sum.
constexpr std::uint64_t kRoots = 3;

/// True when a recorder that missed `missed` outbound copies may well have missed `lost` returns.
bool MayBeTheRecorders(std::uint64_t lost, std::uint64_t missed, bool interface_each) {
  if (missed == 0) return false;
  if (interface_each) return missed * kFair >= lost;
  const std::uint64_t more = lost > missed ? lost - missed : 0;
  return more * more <= kRoots * kRoots * (lost + missed);
}

class FrameLost final : public Rule {
 public:
  FrameLost() : Rule(kInfo) { Subscribe<track::FrameLost>(&FrameLost::On); }

  void On(const track::FrameLost& e) {
    ++total_;
    if (e.followed_by_other) ++followed_by_other_;
    if (e.loss == bus::Loss::kSilence) ++silent_;
    const FrameRef& frame = e.sent.ref();
    if (index_ == kNoFinding) {
      index_ = Report(0, Found(kLost, kNoSlave, frame));
      first_ = frame;
    } else {
      Finding& finding = context().store[index_];
      ++finding.count;
      if (frame.number > finding.last.number) finding.last = frame;
    }
    if (index_ != kNoFinding && frame.number != first_.number) AddRelated(context().store[index_], frame.number);
    CountRow(frame);
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns() || NotEvaluableWithoutSent()) return;
    AddNotEvaluable(context().pairing());
    if (index_ == kNoFinding) return;
    const FindingIndex change = ChangeOfTheBus(context().store[index_]);
    Describe(context().pairing(), context().store[index_], change != kNoFinding);
    context().store[index_].caused_by = change;
  }

 private:
  /// Lost frames with nothing between them.
  struct Row {
    std::uint64_t frames = 0;
    FrameRef first, last;
  };

  void CountRow(const FrameRef& frame) {
    if (row_.frames == 0 || frame.number != row_.last.number + 1) row_ = {0, frame, frame};
    ++row_.frames;
    row_.last = frame;
    if (row_.frames > longest_.frames) longest_ = row_;
  }

  /// Drives tolerate a single one: their reaction depends on how many were lost in a row.
  void DescribeRow(Finding& finding) const {
    if (longest_.frames < kManyInARow) return;
    finding.Set("in_a_row", arg::Number(static_cast<std::int64_t>(longest_.frames)))
        .Set("in_a_row_first_frame", arg::Frame(longest_.first.number))
        .Set("in_a_row_last_frame", arg::Frame(longest_.last.number))
        .Set("all_in_a_row", arg::Flag(longest_.frames >= total_));
    if (longest_.first.has_time && longest_.last.has_time) {
      finding.Set("in_a_row_ms", arg::Ms(Elapsed(longest_.first.time, longest_.last.time)));
    }
  }

  void AddNotEvaluable(const bus::PairingStatistics& pairing) {
    if (pairing.gaps > 0) {
      NotEvaluable(kNoSlave, ReasonCode::kMissesPackets, kReturnsInGaps, pairing.first_gap.number);
    } else if (pairing.of(bus::Undecided::kCaptureGap) > 0) {
      NotEvaluable(kNoSlave, ReasonCode::kMissesPackets, kReturnsInGaps);
    }
    if (pairing.of(bus::Undecided::kSilence) > 0) {
      NotEvaluable(kNoSlave, ReasonCode::kAmbiguous, kReturnBeforePause);
    }
  }

  /// The change of the number of slaves that lost all of these frames: frames in flight are lost when a cable is
  /// pulled or a slave goes down.
  [[nodiscard]] FindingIndex ChangeOfTheBus(const Finding& lost) const {
    constexpr FrameNo kAround = 64;
    if (lost.related_frames.size() + 1 != total_) return kNoFinding;  // not all of them are known
    std::vector<FrameNo> changes;
    FindingIndex first = kNoFinding;
    const std::vector<Finding>& findings = context().store.findings();
    for (std::size_t i = 0; i < findings.size(); ++i) {
      const Finding& f = findings[i];
      if (f.rule != "bus-slave-count-changed") continue;
      changes.push_back(f.first.number);
      changes.insert(changes.end(), f.related_frames.begin(), f.related_frames.end());
      if (first == kNoFinding || f.first.number < findings[first].first.number) first = static_cast<FindingIndex>(i);
    }
    const auto near = [&](FrameNo frame) {
      return std::ranges::any_of(changes, [frame](FrameNo change) {
        return frame > change ? frame - change <= kAround : change - frame <= kAround;
      });
    };
    const bool all = near(lost.first.number) && std::ranges::all_of(lost.related_frames, near);
    return all ? first : kNoFinding;
  }

  void Describe(const bus::PairingStatistics& pairing, Finding& finding, bool with_change) {
    finding.Set("lost_frames", arg::Count(total_, "frame"))
        .Set("outbound_frames", arg::Count(pairing.outbound, "frame"))
        .Set("master_went_on", arg::Flag(silent_ == total_));
    DescribeRow(finding);
    finding.aside = !with_change && longest_.frames < kManyInARow && total_ * kRareOneIn <= pairing.outbound;
    if (followed_by_other_ > 0) {
      finding.Set("followed_by_other_traffic", arg::Number(static_cast<std::int64_t>(followed_by_other_)))
          .Set("each_followed", arg::Flag(followed_by_other_ == total_))
          .Set("some_followed", arg::Flag(followed_by_other_ != total_));
    }
    std::uint64_t dropped = 0;
    for (const capture::Interface& i : context().source().info().interfaces) dropped += i.dropped.value_or(0);
    if (dropped > 0) finding.Set("dropped_by_capture", arg::Count(dropped, "packet"));
    const std::uint64_t missed = pairing.missed_outbound;
    if (missed > 0) {
      finding.confidence = Confidence::kInferred;
      finding.Set("returned_without_outbound", arg::Count(missed, "returned frame"));
    }
    if (pairing.lost == 0 && pairing.dropped_every > 0) {
      context().store.Regrade(index_, Severity::kInfo);
      finding.kind = &kRegular;
      finding.aside = true;
      finding.confidence = Confidence::kInferred;
      finding.Set("dropped_every", arg::Count(pairing.dropped_every, "packet"))
          .Set("dropped_every_ordinal", arg::Text(Ordinal(pairing.dropped_every)));
    } else if (missed > 0 &&
               MayBeTheRecorders(total_, missed + pairing.gaps, context().source().info().interfaces.size() > 1)) {
      context().store.Regrade(index_, Severity::kInfo);
      finding.kind = &kMissed;
      finding.aside = true;  // the headline shows that the capture misses packets, also after another finding
    } else if (with_change) {
      finding.Set("with_change", arg::Flag());
    }
  }

  FindingIndex index_ = kNoFinding;
  FrameRef first_;
  Row row_, longest_;
  std::uint64_t total_ = 0;
  std::uint64_t followed_by_other_ = 0;
  std::uint64_t silent_ = 0;
};

const RuleRegistration kRegistration{kInfo, MakeRule<FrameLost>};

}  // namespace
}  // namespace ecaudit::frame_lost
