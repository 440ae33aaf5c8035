#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "analyzers/judge/pending_findings.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/entry_port.h"
#include "analyzers/model/slave_model.h"
#include "decoder/bus/pairing_statistics.h"
#include "decoder/bus/slave_set.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/access.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::bus_port_order {
namespace {

constexpr FindingKind kPort0Later{
    .name = "port-0-later",
    .title = "Frames enter at port {port}, not at port 0 (cables swapped)",
    .message =
        R"(The receive times (0x0900) in {times_frame} show the frame {ahead_ns} earlier at port {port} than at port 0. DL
status (0x0110) in {status_frame} shows both ports open. A frame from the master has to enter at port 0 (IN).)",
    .next =
        R"(Connect the cable from the master to port 0 (IN) and the cable to the next slave to port {port}. Then let the
master scan the bus again: positions and propagation delays change.)",
    .identity = "port"};
constexpr FindingKind kPort0Unused{
    .name = "port-0-unused",
    .title = "Frames enter at port {port}: port 0 has no link",
    .message =
        R"(DL status (0x0110) in {status_frame} shows a link at port {port} only. The slave answers, so the frames
from the master enter there. They have to enter at port 0 (IN).)",
    .next =
        R"(Connect the cable from the master to port 0 (IN). If the bus is a ring with redundancy, find where the ring
is open.)",
    .identity = "port"};
constexpr FindingKind kLineEndsEarly{
    .name = "line-ends-early",
    .title = "The line ends at position {end_position}, but more slaves follow",
    .message =
        R"(DL status (0x0110) of the slave at position {end_position} shows no open port downstream ({end_frame}).
No slave before it has a free one, and slaves at later positions answer.[ The slave at position {last_position} is the
last one and has {last_open} open ({frame}).] So a slave has its cables in the wrong sockets[{?last_open}: probably that
one].)",
    .next =
        R"([{?last_open}Swap the cables of the slave at position {last_position}. ]Check at each slave that the cable from the
master is in port 0 (IN). Read the receive times (0x0900 to
0x090F) of all slaves: they show at which port frames enter.)"};
constexpr const FindingKind* kKinds[] = {&kPort0Later, &kPort0Unused, &kLineEndsEarly};

constexpr RuleInfo kInfo{.id = "bus-port-order",
                         .group = "Frame and bus",
                         .severity = Severity::kWarning,
                         .history = History::kNone,
                         .subject = Subject::kSlave,
                         .title = "Frames enter a slave at another port than port 0",
                         .needs = "reads of DL status (0x0110), and of the receive times (0x0900 to 0x090F)",
                         .source = "ESC-1, frame processing order; ESC-2, DL status 0x0110, receive times 0x0900",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
- The receive times of the ports (0x0900 to 0x090F) after one latch: port 0 has to be the first.
- DL status (0x0110): a slave that answers needs a link at port 0.
- DL status of all slaves: the line must not end before the last slave.

## Why it matters
With IN and OUT swapped, a slave processes frames only when they return from the slaves after it. Its position is
wrong, so the master configures other slaves than the project names. Its receive times are in the wrong order. Masters
then compute propagation delays that cannot be true, and SYNC0 is off.

## How it is decided
- Receive times count if both ports are open, if they were latched by one frame, and if they differ by less than 1 ms.
- Without receive times the ports of all slaves decide. All slaves must have answered when DL status was read: others
  may have joined later, or a cable may have been pulled.
- The read of DL status with most open ports counts: masters close ports while they scan.
- In a ring with redundancy, frames of the second port of the master enter each slave at its last port. The rule is not
  evaluated if the capture shows both ports. Nor is it if the last slaves, at least two, all have frames at another port
  first and the last one has a second open port.
- An open port at the last slave alone is no finding: a second network card or another device may be connected there.

## Example
tests/rules/bus-port-order/violates.trace

## What to do
Swap the two cables of the slave that the finding names, and let the master scan the bus again.
)"};

constexpr Word kDlStatus{"dl-status", "DL status (0x0110) of the slave"};
constexpr Word kRing{"redundant-ring", "whether cables are swapped, or a redundant port sends to these slaves"};
constexpr Word kReceiveTimes{"receive-times", "the receive times of its ports (0x0900)", true};

class BusPortOrder final : public Rule {
 public:
  BusPortOrder() : Rule(kInfo) {
    Subscribe<track::SlaveAccess>(&BusPortOrder::On, MemoryRange::Of(esc::kDlStatus, 2), Stage::kAfterModel);
    Subscribe<track::SlaveAccess>(&BusPortOrder::On, MemoryRange::Of(esc::kReceiveTimes, esc::kReceiveTimesBytes),
                                  Stage::kAfterModel);
  }

  void On(const track::SlaveAccess& access) {
    if (access.read.empty() || access.broadcast) return;
    if (access.slave >= known_then_.size()) known_then_.resize(std::size_t{access.slave} + 1);
    const model::EntryPort& ports = PortsOf(access.slave);
    if (ports.status_frame().number == access.frame().number) known_then_[access.slave] = AnsweringNow();
    if (const auto evidence = ports.evidence()) Keep(access.slave, *evidence, access.frame());
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    const std::vector<SlaveId> line = Line();
    const bool ring = MayBeRing(line);
    pending_.Release([&](std::uint64_t key, Finding&& finding) {
      if (ring) {
        NotEvaluable(finding.slave, ReasonCode::kAmbiguous, kRing, finding.first.number);
      } else {
        reported_ = true;
        Report(key, std::move(finding));
      }
    });
    if (ring) return;
    if (const auto end = EndOf(line); end && !reported_) ReportEnd(line, *end);
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      const model::EntryPort& ports = PortsOf(id);
      if (!ports.status()) {
        NotEvaluable(id, ReasonCode::kNotRead, kDlStatus);
      } else if (ports.open_ports() > 1 && !ports.compared() && !reported_) {
        NotEvaluable(id, ReasonCode::kNotRead, kReceiveTimes);
      }
    }
  }

 private:
  [[nodiscard]] const model::EntryPort& PortsOf(SlaveId id) const { return context().slave(id).entry_port; }

  void Keep(SlaveId slave, const model::EntryPort::Evidence& evidence, const FrameRef& frame) {
    if (pending_.Repeat(slave, evidence.port, frame)) return;
    Finding finding = Found(evidence.ahead_ns ? kPort0Later : kPort0Unused, slave, frame);
    finding.Set("port", arg::Number(evidence.port)).Set("status_frame", arg::Frame(evidence.status.number));
    AddRelated(finding, evidence.status.number);
    if (evidence.ahead_ns) {
      finding.Set("ahead_ns", arg::Ns(*evidence.ahead_ns)).Set("times_frame", arg::Frame(evidence.times.number));
      AddRelated(finding, evidence.times.number);
    }
    if (slave >= elsewhere_.size()) elsewhere_.resize(std::size_t{slave} + 1);
    elsewhere_[slave] = true;
    pending_.Keep(evidence.port, std::move(finding));
  }

  /// How many slaves answer, by the last broadcast; without one, how many have answered.
  [[nodiscard]] std::size_t AnsweringNow() const {
    const std::uint16_t* counted = context().network().slave_count().if_known();
    const std::size_t met = context().slave_count();
    return counted != nullptr ? std::min<std::size_t>(*counted, met) : met;
  }

  /// From the second port of a master with redundancy frames enter each slave at its last port. They reach the slaves
  /// at the end of the line first, and those after a break alone.
  [[nodiscard]] bool MayBeRing(const std::vector<SlaveId>& line) const {
    constexpr std::ptrdiff_t kNoCoincidence = 2;
    if (context().pairing().one_port || context().pairing().other_end > 0) return true;
    if (line.empty() || PortsOf(line.back()).open_ports() < 2 || EndOf(line)) return false;
    const auto enters_elsewhere = [&](SlaveId slave) { return slave < elsewhere_.size() && elsewhere_[slave]; };
    const auto first = std::ranges::find_if(line, enters_elsewhere);
    return line.end() - first >= kNoCoincidence && std::all_of(first, line.end(), enters_elsewhere);
  }

  /// The slaves in the order of positions, if DL status of all of them is known and no slave joined later.
  [[nodiscard]] std::vector<SlaveId> Line() const {
    std::vector<SlaveId> line;
    const bus::SlaveSet& set = context().network().slaves();
    std::size_t count = 0;
    for (std::size_t s = 0; s < set.size(); ++s) count += set[static_cast<SlaveId>(s)].replaced ? 0 : 1;
    for (std::size_t p = 0; p < count; ++p) {
      const SlaveId id = set.AtPosition(static_cast<SlavePos>(p));
      const bool read = id < known_then_.size() && PortsOf(id).status() && known_then_[id] >= count;
      if (!read) return {};
      line.push_back(id);
    }
    return line;
  }

  /// A frame leaves a slave at each open port after port 0, and each of them leads to the next slave.
  /// @return place in the line of a slave after which nothing can follow, though slaves do
  [[nodiscard]] std::optional<std::size_t> EndOf(const std::vector<SlaveId>& line) const {
    std::size_t free = 1;  // ports that lead on; the first is that of the master
    for (std::size_t p = 0; p < line.size(); ++p) {
      const model::EntryPort& ports = PortsOf(line[p]);
      if (free == 0) return p - 1;
      if (ports.open_ports() == 0) return std::nullopt;
      free += ports.open_ports();
      free -= 2;  // the port of the slave before, and its own port 0
    }
    return std::nullopt;
  }

  void ReportEnd(const std::vector<SlaveId>& line, std::size_t end) {
    const model::EntryPort& at_end = PortsOf(line[end]);
    const model::EntryPort& last = PortsOf(line.back());
    const bool last_is_open = last.open_ports() > 1;
    const SlaveId id = last_is_open ? line.back() : line[end];
    Finding finding = Found(kLineEndsEarly, id, last_is_open ? last.status_frame() : at_end.status_frame());
    finding.confidence = Confidence::kInferred;
    finding.Set("end_position", arg::Number(static_cast<std::int64_t>(end)))
        .Set("end_frame", arg::Frame(at_end.status_frame().number));
    if (last_is_open) {
      finding.Set("last_position", arg::Number(static_cast<std::int64_t>(line.size() - 1)))
          .Set("last_open", arg::Count(last.open_ports(), "port"));
    }
    AddRelated(finding, at_end.status_frame().number);
    reported_ = true;
    Report(model::EntryPort::kPorts, std::move(finding));
  }

  std::vector<std::size_t> known_then_;  ///< by slave: slaves when its DL status was read
  PendingFindings pending_;              ///< until it is known whether the line may be a ring
  std::vector<bool> elsewhere_;          ///< by slave: frames enter at another port than 0
  bool reported_ = false;
};

const RuleRegistration kRegistration{kInfo, MakeRule<BusPortOrder>};

}  // namespace
}  // namespace ecaudit::bus_port_order
