#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/pipeline.h"
#include "decoder/track/access.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::bus_slave_count_changed {
namespace {

constexpr EscAddress kPortControl = 0x0101;  // DL control

constexpr FindingKind kFewer{
    .name = "fewer",
    .title = "Slaves on the bus: {slaves_now:number} instead of {slaves_before:number}",
    .message =
        R"({frame} passed {slaves_now}, frames before it {slaves_before}.[{!still_answers} Missing: {missing}[ and
{more_missing}].][ {missing_slaves} {missing_slaves?is|are} missing, but {still_answers} still answers in
{still_answers_frame}: a branch in the middle has left.])",
    .next =
        R"([{?still_answers}Check the branches, their power and cables.][{!still_answers}[{?last_position}Check power
and cable between position {last_position} and position {first_missing_position}.][{!last_position}Check the cable between
the master and the first slave.]])"};
constexpr FindingKind kMore{.name = "more",
                            .title = "Slaves on the bus: {slaves_now:number} instead of {slaves_before:number}",
                            .message = "{frame} passed {slaves_now}, frames before it {slaves_before}.",
                            .next = "[{!started_up_frame}Start the new {new_slaves?slave|slaves} up.]"};
constexpr FindingKind kReturned{
    .name = "returned",
    .title = "Slaves on the bus: {slaves_now:number} instead of {slaves_before:number}",
    .message = R"({frame} passed {slaves_now}, frames before it {slaves_before}.[ The returning
{new_slaves?slave|slaves} may have power-cycled.])",
    .next = "[{!started_up_frame}Check the AL state of the returning {new_slaves?slave|slaves}.]",
    .next_stays = true};
constexpr const FindingKind* kKinds[] = {&kFewer, &kMore, &kReturned};

constexpr NoteKind kStartedUp{
    .name = "started-up",
    .text = "The master started {new_slaves?this slave|all of these slaves} up by {started_up_frame}."};
constexpr NoteKind kOneFrame{
    .name = "one-frame-only",
    .text = "Only one frame shows this, and the capture misses packets: it may be the return of another frame."};
constexpr const NoteKind* kNotes[] = {&kStartedUp, &kOneFrame};

constexpr Word kWhoIsWhere{"slave-at-position", "which slave is at a position after the change"};
constexpr Word kNumberOfSlaves{"number-of-slaves", "the number of slaves"};

constexpr RuleInfo kInfo{.id = "bus-slave-count-changed",
                         .group = "Frame and bus",
                         .severity = Severity::kError,
                         .history = History::kWhole,
                         .title = "The number of slaves changes while the bus is in use",
                         .needs = "returned broadcasts or position-addressed datagrams",
                         .source = "ETG1000.4, auto-increment and broadcast addressing",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .doc = R"(
## What it checks
Every slave adds one to the position counter of broadcasts and of position-addressed datagrams, whether or not it takes
part. The difference between the sent and the returned counter is the number of slaves on the wire.

## Why it matters
A slave lost power, a cable or a link, or a slave returned in a state that the master does not know.

## How it is decided
From returned frames only. The bus is in use after a slave accepted a request for a state above INIT, or after process
data were exchanged (a logical datagram with a working counter above 0). It is not in use while the master scans: after
the master opened or closed ports (0x0101) or requested INIT by broadcast.

- If the capture misses packets, the return of a frame may be taken for that of another one to another position. There a
  number that one frame shows and the next ones do not is an info.
- New slaves are an info once the master starts them up.
- A broadcast shows how many slaves are left, not which. The missing ones are the last by position, unless one of these
  still answers at its station address. Then a branch in the middle has left.
- A slave keeps its station address while it has power, but its position changes with each slave that joins or leaves
  before it. After a change the slave at a position is therefore unknown, until it shows its station address or alias,
  or gets an address.

## Example
samples/captures/slave-count-changes.pcapng

## What to do
Check the slave after the last one that still answers, and the cable to it. The message names both.
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
    if (e.slaves_passed && *e.slaves_passed == left_.first && left_.answers != kNoSlave) ReportBranch();
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
    StartedUp(e);
    if (e.control.state() != static_cast<std::uint8_t>(esc::AlState::INIT)) {
      in_use_ = true;
    } else if (e.broadcast) {
      in_use_ = false;
    }
  }

  void On(const track::SlaveCount& e) {
    left_ = {};
    if (e.first || !in_use_) return;
    const Change before = std::exchange(last_, Change{e.previous, e.count, e.frame.number, kNoFinding});
    const bool back = before.to == e.previous && before.from == e.count && e.frame.number - before.frame <= kBrief;
    if (back && before.finding != kNoFinding) ++brief_[before.finding];
    last_.finding = ReportChange(e);
    if (back && last_.finding != kNoFinding) ++brief_[last_.finding];
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    if (unknown_.seen()) {
      NotEvaluable(kNoSlave, ReasonCode::kNotInCapture, kWhoIsWhere, unknown_.number);
    }
    if (context().pairing().returned > 0 && context().network().slave_count().if_known() == nullptr) {
      NotEvaluable(kNoSlave, ReasonCode::kNotInCapture, kNumberOfSlaves);
    }
    if (!MissesAny(context().pairing())) return;
    for (const auto& [index, times] : brief_) {
      Finding& finding = context().store[index];
      if (times < finding.count) continue;
      context().store.Regrade(index, Severity::kInfo);
      finding.confidence = Confidence::kInferred;
      finding.Add(kOneFrame);
    }
  }

 private:
  struct Change {
    std::uint16_t from = 0;
    std::uint16_t to = 0;
    FrameNo frame = 0;
    FindingIndex finding = kNoFinding;
  };

  FindingIndex ReportChange(const track::SlaveCount& e) {
    const std::uint64_t key = static_cast<std::uint64_t>(e.previous) << 16U | e.count;
    const bool fewer = e.count < e.previous;
    if (!fewer && drop_ != kNoFinding && context().store[drop_].until == Finding::kCaptureEnds) {
      context().store[drop_].until = e.frame.number;
    }
    if (FindingIndex index = Repeat(kNoSlave, key, e.frame); index != kNoFinding) {
      AddRelated(context().store[index], e.frame.number);
      if (fewer) context().store[index].until = Finding::kCaptureEnds;
      return index;
    }
    Finding finding = Found(fewer ? kFewer : drop_ != kNoFinding ? kReturned : kMore, kNoSlave, e.frame);
    finding.Set("slaves_before", arg::Count(e.previous, "slave")).Set("slaves_now", arg::Count(e.count, "slave"));
    if (fewer) {
      finding.until = Finding::kCaptureEnds;
      AddMissing(finding, e);
    } else {
      finding.Set("new_slaves", arg::Number(e.count - e.previous));
    }
    if (e.count > e.previous) finding.caused_by = drop_;  // the slaves that left have returned
    const FindingIndex index = Report(key, std::move(finding));
    if (fewer) {
      drop_ = index;
      more_ = {};
      left_ = {index, e.count, e.previous, kNoSlave, 0};
    } else {
      more_ = {index, e.previous, e.count, {}, {}};
    }
    return index;
  }

  /// The master handles the new or returned slaves: it starts them up.
  void StartedUp(const track::AlRequest& e) {
    if (more_.finding == kNoFinding || e.broadcast ||
        e.control.state() == static_cast<std::uint8_t>(esc::AlState::INIT))
      return;
    const SlavePos* position = context().network().slaves()[e.slave].position.if_known();
    const bool at_the_end = position != nullptr && *position >= more_.first && *position < more_.end;
    if (!at_the_end && !more_.met.contains(e.slave)) return;
    more_.asked.insert(e.slave);
    if (more_.asked.size() < static_cast<std::size_t>(more_.end - more_.first)) return;
    Finding& finding = context().store[more_.finding];
    const Value started_up = arg::Frame(e.frame().number);
    finding.Set("started_up_frame", started_up);
    finding.Add(kStartedUp, {{"new_slaves", arg::Number(more_.end - more_.first)}, {"started_up_frame", started_up}});
    AddRelated(finding, e.frame().number);
    // The return of slaves that had left is a consequence of that.
    if (finding.caused_by == kNoFinding) context().store.Regrade(more_.finding, Severity::kInfo);
    more_ = {};
  }

  /// One of the slaves that should be missing answers, and the following broadcast still counts as few.
  void ReportBranch() {
    Finding& finding = context().store[left_.finding];
    finding.Set("missing_slaves", arg::Count(static_cast<std::uint64_t>(left_.end - left_.first), "slave"))
        .Set("still_answers", arg::Slave(left_.answers, context().Label(left_.answers)))
        .Set("still_answers_frame", arg::Frame(left_.answer));
    AddRelated(finding, left_.answer);
    left_ = {};
  }

  /// Slaves that have left, by their positions.
  struct Left {
    FindingIndex finding = kNoFinding;
    std::uint16_t first = 0, end = 0;
    SlaveId answers = kNoSlave;  ///< one of them that does
    FrameNo answer = 0;
  };

  /// Slaves at these positions are new or returned, or others that were found since.
  struct More {
    FindingIndex finding = kNoFinding;
    std::uint16_t first = 0, end = 0;
    std::set<SlaveId> met;
    std::set<SlaveId> asked;  ///< for a state above INIT since
  };

  /// The slaves that are missing, and the place where the bus ends now.
  void AddMissing(Finding& finding, const track::SlaveCount& e) const {
    constexpr std::uint32_t kNamed = 8;
    const bus::SlaveSet& slaves = context().network().slaves();
    std::vector<Value> missing;
    const auto end = std::min<std::uint32_t>(e.previous, e.count + kNamed);
    for (std::uint32_t p = e.count; p < end; ++p) {
      const SlaveId id = slaves.AtPosition(static_cast<SlavePos>(p));
      missing.push_back(arg::Slave(id, id != kNoSlave ? context().Label(id) : context().names().Of(p)));
    }
    finding.Set("missing", arg::List(std::move(missing)));
    if (end < e.previous) finding.Set("more_missing", arg::Count(e.previous - end, "other"));
    if (e.count == 0) return;
    finding.Set("last_position", arg::Number(e.count - 1)).Set("first_missing_position", arg::Number(e.count));
  }

  bool in_use_ = false;
  FrameRef unknown_;  ///< the first with an answer from a position whose slave is unknown
  More more_;
  Left left_;
  FindingIndex drop_ = kNoFinding;
  Change last_;
  std::map<FindingIndex, std::uint64_t> brief_;  ///< findings: how often the next frame contradicted them
};

const RuleRegistration kRegistration{kInfo, MakeRule<BusSlaveCountChanged>};

}  // namespace
}  // namespace ecaudit::bus_slave_count_changed
