#include <algorithm>
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

constexpr RuleInfo kInfo{.id = "frame-lost",
                         .group = "Frame and bus",
                         .severity = Severity::kError,
                         .needs_no_history = true,
                         .title = "An outbound frame never came back",
                         .needs = "outbound and returned frames",
                         .source = "ETG1000.4, frame processing: every frame returns to its master",
                         .doc = R"(
## What it checks
Whether each outbound frame comes back, as frames cannot overtake each other on the wire. All losses are one finding
with their number and the first frames.

## Why it matters
A lost frame is a cycle without set points and actual values. The master sees a working counter of nothing, drives
count missing frames and leave operation.

## How it is decided
By content and order, not by time: a frame is lost when frames sent later have come back, or when nothing comes back any
more while the master goes on sending. Frames still under way at the end of the capture are not lost, and a frame that
came back damaged is not lost either. Whether it was lost on the way out or back, a capture at the master cannot show. A
capture machine that drops packets looks the same; where its file counts drops, the message says so. Frames that came
back without an outbound copy prove that the capture misses packets: the message gives their number. A recorder that
leaves out packets takes as many of one direction as of the other: where the lost frames are no more than these, the
places where indices skip, and what chance adds (three times the root of the sum; where the file has several interfaces,
three times as many), nothing says that any was lost on the bus, and the finding is an info; so it is where
packets are missing at a regular distance, every 124th say, while others come back. Nor is a frame lost that was sent
before anybody answered (bus-no-answer), or that was under way where the capture has a hole: where the indices of a
master that numbers its frames skip, or where a master that does not was silent for much longer than before. A frame
that its master sends once more is lost, however long the time-out was.

## Example
samples/captures/lost-frames.pcapng

## What to do
Look for other traffic on the EtherCAT port (the message says when other packets follow the lost frames), loose
connectors, and link errors at the slaves (0x0300-0x0313).
)"};

/// So many lost in a row are worth telling.
constexpr std::uint64_t kManyInARow = 3;

/// A recorder that leaves out packets here and there takes as many of one direction as of the other, give or take.
/// Where the directions have an interface each, these may differ by so much.
constexpr std::uint64_t kFair = 3;
/// By chance they differ by no more than so many times the root of their sum.
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
      Finding finding;
      finding.first = frame;
      index_ = Report(0, std::move(finding));
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
    TellWhatIsOpen(context().pairing());
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

  /// Drives get over a single one: how many there were at once says what they make of it.
  void DescribeRow(Finding& finding) const {
    if (longest_.frames < kManyInARow) return;
    const bool timed = longest_.first.has_time && longest_.last.has_time;
    const TimeNs took = timed ? Elapsed(longest_.first.time, longest_.last.time) : 0;
    if (longest_.frames < total_) {
      finding.message += Count(longest_.frames, "frame") + " of them in a row, from frame " +
                         std::to_string(longest_.first.number) + " to frame " + std::to_string(longest_.last.number);
    } else {
      finding.message += "They are all in a row, up to frame " + std::to_string(longest_.last.number);
    }
    finding.message += timed ? ", within " + Duration(took) + ". " : ". ";
    finding.evidence.push_back(Number("in_a_row", static_cast<std::int64_t>(longest_.frames)));
    finding.evidence.push_back(Number("in_a_row_last_frame", static_cast<std::int64_t>(longest_.last.number)));
    if (timed) finding.evidence.push_back(Real("in_a_row_ms", static_cast<double>(took) / 1e6));
  }

  void TellWhatIsOpen(const bus::PairingStatistics& pairing) {
    if (pairing.gaps > 0) {
      NotEvaluable(kNoSlave,
                   "the capture misses frames in " + Count(pairing.gaps, "place") +
                       " (the indices of the frames skip): whether what was under way there came back is not known",
                   pairing.first_gap.number);
    }
    const std::uint64_t silent = pairing.undecided[static_cast<std::size_t>(bus::Undecided::kSilence)];
    if (silent > 0) {
      NotEvaluable(kNoSlave, "the master was silent for long behind " + Count(silent, "frame") +
                                 " without a return: whether it came back, the capture may not hold");
    }
  }

  /// The change of the number of slaves that took all of these frames with it: what is under way where a cable comes
  /// out or a slave goes down is lost.
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
      return std::any_of(changes.begin(), changes.end(), [frame](FrameNo change) {
        return frame > change ? frame - change <= kAround : change - frame <= kAround;
      });
    };
    const bool all =
        near(lost.first.number) && std::all_of(lost.related_frames.begin(), lost.related_frames.end(), near);
    return all ? first : kNoFinding;
  }

  void Describe(const bus::PairingStatistics& pairing, Finding& finding, bool with_change) {
    const std::uint64_t outbound = pairing.outbound;
    finding.title = Count(total_, "frame") + " of " + Grouped(outbound) + " never came back";
    finding.message = Count(total_, "outbound frame") + " never came back although ";
    finding.message += silent_ == total_ ? "the master went on sending" : "later ones did";
    finding.message += ", the first is frame " + std::to_string(first_.number) + ". ";
    DescribeRow(finding);
    if (followed_by_other_ > 0) {
      finding.message +=
          "Right behind " +
          (followed_by_other_ == total_ ? std::string("each of them") : Grouped(followed_by_other_) + " of them") +
          " the capture has a packet of another protocol: keep other traffic off the EtherCAT port. ";
    }
    std::uint64_t dropped = 0;
    for (const capture::Interface& i : context().source().info().interfaces) dropped += i.dropped.value_or(0);
    if (dropped > 0) {
      finding.message += "The capture file says that the capturing machine itself dropped " + Count(dropped, "packet") +
                         "; these losses may be among them. ";
      finding.evidence.push_back(Number("dropped_by_capture", static_cast<std::int64_t>(dropped)));
    }
    const std::uint64_t missed = pairing.missed_outbound;
    if (missed > 0) {
      finding.message += "But " + Count(missed, "returned frame") + " " + (missed == 1 ? "has" : "have") +
                         " no outbound copy: the capture itself misses packets, and these losses may be among them. ";
      finding.confidence = Confidence::kInferred;
      finding.evidence.push_back(Number("returned_without_outbound", static_cast<std::int64_t>(missed)));
    }
    if (pairing.lost == 0 && pairing.dropped_every > 0) {
      context().store.Regrade(index_, Severity::kInfo);
      finding.title = "The capture misses every " + Ordinal(pairing.dropped_every) +
                      " packet: " + Count(total_, "frame") + " without a return";
      finding.message += "But what is missing is missing at a regular distance of " +
                         Count(pairing.dropped_every, "packet") +
                         ": the recorder left it out. Capture with a probe or with larger buffers before looking for "
                         "losses on the bus.";
      finding.confidence = Confidence::kInferred;
      finding.evidence.push_back(Number("dropped_every", static_cast<std::int64_t>(pairing.dropped_every)));
    } else if (missed > 0 &&
               MayBeTheRecorders(total_, missed + pairing.gaps, context().source().info().interfaces.size() > 1)) {
      context().store.Regrade(index_, Severity::kInfo);
      finding.title = "The capture misses packets: " + Count(total_, "frame") + " without a return, " +
                      Grouped(missed) + " without an outbound copy";
      finding.message += "Capture with a probe or with larger buffers before looking for losses on the bus.";
    } else if (with_change) {
      finding.message += "They were under way when the number of slaves on the bus changed.";
    } else {
      finding.message += "Check cables and connectors, and the error counters 0x0300-0x0313 of the slaves.";
    }
    finding.evidence.push_back(Number("lost_frames", static_cast<std::int64_t>(total_)));
    finding.evidence.push_back(Number("outbound_frames", static_cast<std::int64_t>(outbound)));
    if (followed_by_other_ > 0) {
      finding.evidence.push_back(Number("followed_by_other_traffic", static_cast<std::int64_t>(followed_by_other_)));
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
