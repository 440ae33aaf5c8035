#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/entry_port.h"
#include "analyzers/model/slave_model.h"
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
                         .needs_no_history = true,
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
- Without receive times the ports of all slaves decide. The slaves must all have answered before DL status was read, or
  a slave may have joined later.
- The read of DL status with most open ports counts: masters close ports while they scan.
- An open port at the last slave alone is no finding: a second network card or another device may be connected there.

## Example
tests/rules/bus-port-order/violates.trace

## What to do
Swap the two cables of the slave that the finding names, and let the master scan the bus again.
)"};

constexpr Word kDlStatus{"dl-status", "DL status (0x0110) of the slave"};
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
    if (ports.status_frame().number == access.frame().number) known_then_[access.slave] = context().slave_count();
    if (const auto evidence = ports.evidence()) ReportEntry(access.slave, *evidence, access.frame());
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    if (!reported_) FollowLine();
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

  void ReportEntry(SlaveId id, const model::EntryPort::Evidence& entry, const FrameRef& frame) {
    reported_ = true;
    if (Repeat(id, entry.port, frame) != kNoFinding) return;
    Finding finding = Found(entry.ahead_ns ? kPort0Later : kPort0Unused, id, frame);
    finding.Set("port", arg::Number(entry.port)).Set("status_frame", arg::Frame(entry.status.number));
    AddRelated(finding, entry.status.number);
    if (entry.ahead_ns) {
      finding.Set("ahead_ns", arg::Ns(*entry.ahead_ns)).Set("times_frame", arg::Frame(entry.times.number));
      AddRelated(finding, entry.times.number);
    }
    Report(entry.port, std::move(finding));
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
  void FollowLine() {
    const std::vector<SlaveId> line = Line();
    if (line.size() < 2) return;
    std::size_t free = 1;  // ports that lead on; the first is that of the master
    for (std::size_t p = 0; p < line.size(); ++p) {
      const model::EntryPort& ports = PortsOf(line[p]);
      if (free == 0) return ReportEnd(line, p - 1);
      if (ports.open_ports() == 0) return;
      free += ports.open_ports();
      free -= 2;  // the port of the slave before, and its own port 0
    }
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
  bool reported_ = false;
};

const RuleRegistration kRegistration{kInfo, MakeRule<BusPortOrder>};

}  // namespace
}  // namespace ecaudit::bus_port_order
