#include <map>
#include <set>
#include <utility>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/pipeline.h"
#include "decoder/track/access.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::bus_slave_count_changed {
namespace {

constexpr EscAddress kPortControl = 0x0101;  // DL control

constexpr RuleInfo kInfo{.id = "bus-slave-count-changed",
                         .group = "Frame and bus",
                         .severity = Severity::kError,
                         .title = "The number of slaves changes while the bus is in use",
                         .needs = "returned broadcasts or position-addressed datagrams",
                         .source = "ETG1000.4, auto-increment and broadcast addressing",
                         .doc = R"(
## What it checks
Every slave adds one to the position counter of broadcasts and of position-addressed datagrams, whether or not it takes
part. The difference between what was sent and what came back is the number of slaves on the wire.

## Why it matters
A slave lost power, a cable or a link; or one came back, in a state the master does not know of.

## How it is decided
From returned frames only. The bus is in use once a slave took a request for a state above INIT, or process data were
exchanged (a logical datagram with a working counter above 0). It is not while the master scans: after it opened or
closed ports (0x0101) or requested INIT by broadcast.

Where the capture misses packets, the return of a frame may be taken for that of another one that was sent to another
position. So a number that one frame shows and the next ones do not is an info there. And so are slaves that are
new, once the master starts them up.

A broadcast tells how many are left, not which: the last ones by position, unless one of these still answers at its
station address. Then a branch in the middle has left.

A slave keeps its station address while it has power; its position changes with each slave that joins or leaves before
it. So behind a change a position names nobody, until the slave there shows its station address or alias, or is given
an address.

## Example
samples/captures/slave-count-changes.pcapng

## What to do
The slave behind the last one that still answers, or the cable to it, is the place to look. The message names both.
)"};

/// Packets after which the next frame shows the number of slaves again.
constexpr FrameNo kBrief = 12;

class BusSlaveCountChanged final : public Rule {
 public:
  BusSlaveCountChanged() : Rule(kInfo) {
    Subscribe<track::SlaveCount>(&BusSlaveCountChanged::On);
    Subscribe<track::LogicalAccess>(&BusSlaveCountChanged::On);
    Subscribe<track::SlaveAccess>(&BusSlaveCountChanged::On, MemoryRange::Of(kPortControl, 1));
    Subscribe<track::AlRequest>(&BusSlaveCountChanged::On);
    Subscribe<track::Answered>(&BusSlaveCountChanged::On);
    Subscribe<track::SlaveFound>(&BusSlaveCountChanged::On);
    Subscribe<track::PlaceUnknown>(&BusSlaveCountChanged::On);
  }

  void On(const track::SlaveFound& e) {
    if (more_.finding != kNoFinding) more_.met.insert(e.slave);
  }

  void On(const track::PlaceUnknown& e) {
    if (!unknown_.seen()) unknown_ = e.frame;
  }

  void On(const track::Answered& e) {
    if (left_.finding == kNoFinding || e.wkc == 0) return;
    if (e.slaves_passed && *e.slaves_passed == left_.first && left_.answers != kNoSlave) TellBranch();
    const bool by_station = e.command >= wire::Command::FPRD && e.command <= wire::Command::FPRW;
    if (!by_station || e.slave == kNoSlave || !e.returned.seen()) return;
    const SlavePos* position = context().network().slaves()[e.slave].position.if_known();
    if (position == nullptr || *position < left_.first || *position >= left_.end) return;
    left_.answers = e.slave;
    left_.answer = e.returned.number;
  }

  void On(const track::LogicalAccess& e) { in_use_ = in_use_ || (e.wkc > 0 && !e.assumed); }

  void On(const track::SlaveAccess& e) {
    // DL control: opening and closing ports changes how many slaves a frame passes, on purpose.
    const ByteSpan ports = e.Covered(e.written, kPortControl, 1);
    if (!ports.empty() && e.acceptance != track::Acceptance::kRefused) in_use_ = false;
  }

  void On(const track::AlRequest& e) {
    if (e.acceptance != track::Acceptance::kAccepted) return;
    TakenUp(e);
    if (e.control.state() != static_cast<std::uint8_t>(esc::AlState::INIT)) {
      in_use_ = true;
    } else if (e.broadcast) {
      in_use_ = false;
    }
  }

  void On(const track::SlaveCount& e) {
    if (e.first || !in_use_) return;
    const Change before = std::exchange(last_, Change{e.previous, e.count, e.frame.number, kNoFinding});
    const bool back = before.to == e.previous && before.from == e.count && e.frame.number - before.frame <= kBrief;
    if (back && before.finding != kNoFinding) ++brief_[before.finding];
    last_.finding = Tell(e);
    if (back && last_.finding != kNoFinding) ++brief_[last_.finding];
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    if (unknown_.seen()) {
      NotEvaluable(kNoSlave,
                   "slaves have joined or left, and nothing shows who is at a position since: what is read and written "
                   "by position from here on, before an address shows it, tells of no slave",
                   unknown_.number);
    }
    if (context().pairing().returned > 0 && context().network().slave_count().if_known() == nullptr) {
      NotEvaluable(kNoSlave, "no returned broadcast or position-addressed datagram shows the number of slaves");
    }
    if (!MissesAny(context().pairing())) return;
    for (const auto& [index, times] : brief_) {
      Finding& finding = context().store[index];
      if (times < finding.count) continue;
      context().store.Regrade(index, Severity::kInfo);
      finding.confidence = Confidence::kInferred;
      finding.message +=
          " But only one frame shows it, and the capture misses packets: this may be the return of another frame.";
    }
  }

 private:
  struct Change {
    std::uint16_t from = 0;
    std::uint16_t to = 0;
    FrameNo frame = 0;
    FindingIndex finding = kNoFinding;
  };

  FindingIndex Tell(const track::SlaveCount& e) {
    const std::uint64_t key = static_cast<std::uint64_t>(e.previous) << 16U | e.count;
    if (FindingIndex index = Repeat(kNoSlave, key, e.frame); index != kNoFinding) {
      AddRelated(context().store[index], e.frame.number);
      return index;
    }
    Finding finding;
    finding.first = e.frame;
    finding.title = "Slaves on the bus: " + std::to_string(e.previous) + " before, " + std::to_string(e.count) + " now";
    finding.message = "Frame " + std::to_string(e.frame.number) + " came back after " + Count(e.count, "slave") +
                      ", frames before after " + Count(e.previous, "slave") + ". ";
    if (e.count < e.previous) {
      finding.message += WhereItBroke(e);
    } else {
      finding.message += drop_ != kNoFinding
                             ? "What came back may have lost its power or its process data meanwhile: its AL state "
                               "tells whether it has to be started up again."
                             : "What is new has to be started up.";
    }
    finding.evidence.push_back(Number("slaves_before", e.previous));
    finding.evidence.push_back(Number("slaves_now", e.count));
    if (e.count > e.previous) finding.caused_by = drop_;  // what left has come back
    const FindingIndex index = Report(key, std::move(finding));
    left_ = {};
    if (e.count < e.previous) {
      drop_ = index;
      more_ = {};
      left_ = {index, e.count, e.previous, kNoSlave, 0, WhereItBroke(e)};
    } else {
      more_ = {index, e.previous, e.count, {}, {}};
    }
    return index;
  }

  /// The master knows of what is new or back: it starts it up.
  void TakenUp(const track::AlRequest& e) {
    if (more_.finding == kNoFinding || e.broadcast ||
        e.control.state() == static_cast<std::uint8_t>(esc::AlState::INIT))
      return;
    const SlavePos* position = context().network().slaves()[e.slave].position.if_known();
    const bool at_the_end = position != nullptr && *position >= more_.first && *position < more_.end;
    if (!at_the_end && !more_.met.contains(e.slave)) return;
    more_.asked.insert(e.slave);
    if (more_.asked.size() < static_cast<std::size_t>(more_.end - more_.first)) return;
    Finding& finding = context().store[more_.finding];
    finding.message += " The master does so, up to frame " + std::to_string(e.frame().number) + " of all of them.";
    AddRelated(finding, e.frame().number);
    // What had left before is told as its consequence.
    if (finding.caused_by == kNoFinding) context().store.Regrade(more_.finding, Severity::kInfo);
    more_ = {};
  }

  /// One of those that should be missing answers, and the broadcast behind that still counts as few.
  void TellBranch() {
    Finding& finding = context().store[left_.finding];
    const std::size_t at = finding.message.find(left_.text);
    if (at != std::string::npos) {
      const auto missing = static_cast<std::uint64_t>(left_.end - left_.first);
      finding.message.replace(at, left_.text.size(),
                              Count(missing, "slave") + (missing == 1 ? " is" : " are") + " missing, but " +
                                  context().Label(left_.answers) + " still answers in frame " +
                                  std::to_string(left_.answer) +
                                  ": a branch in the middle has left. Check the branches, their power and cables.");
      finding.evidence.push_back(Text("still_answers", context().Label(left_.answers)));
      AddRelated(finding, left_.answer);
    }
    left_ = {};
  }

  /// Slaves that have left, by their positions.
  struct Left {
    FindingIndex finding = kNoFinding;
    std::uint16_t first = 0, end = 0;
    SlaveId answers = kNoSlave;  ///< one of them that does
    FrameNo answer = 0;
    std::string text;  ///< what the finding says of where they were
  };

  /// Slaves at these positions are new or back, or others that were met since.
  struct More {
    FindingIndex finding = kNoFinding;
    std::uint16_t first = 0, end = 0;
    std::set<SlaveId> met;
    std::set<SlaveId> asked;  ///< for a state above INIT since
  };

  [[nodiscard]] std::string WhereItBroke(const track::SlaveCount& e) const {
    const std::string missing = "Missing: " + Missing(e) + ". ";
    if (e.count == 0) return missing + "Check the cable at the master and the first slave.";
    return missing + "Check power and cable between position " + std::to_string(e.count - 1) + " and position " +
           std::to_string(e.count) + ".";
  }

  [[nodiscard]] std::string Missing(const track::SlaveCount& e) const {
    const bus::SlaveSet& slaves = context().network().slaves();
    std::string out;
    for (std::uint32_t p = e.count; p < e.previous; ++p) {
      if (p - e.count == 8) return out + ", ...";
      const SlaveId id = slaves.AtPosition(static_cast<SlavePos>(p));
      out += (out.empty() ? "" : ", ") + (id != kNoSlave ? context().Label(id) : "slave " + std::to_string(p));
    }
    return out;
  }

  bool in_use_ = false;
  FrameRef unknown_;  ///< the first that somebody answered at a position where nothing shows who that is
  More more_;
  Left left_;
  FindingIndex drop_ = kNoFinding;
  Change last_;
  std::map<FindingIndex, std::uint64_t> brief_;  ///< findings: on how many occasions the next frame denied them
};

const RuleRegistration kRegistration{kInfo, MakeRule<BusSlaveCountChanged>};

}  // namespace
}  // namespace ecaudit::bus_slave_count_changed
