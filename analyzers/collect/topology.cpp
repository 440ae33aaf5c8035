#include "analyzers/collect/topology.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "analyzers/model/entry_port.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/wrapping.h"
#include "decoder/esc/register_addresses.h"

namespace ecaudit {
namespace {

using model::EntryPort;

/// The port through which a frame leaves a slave, after the port at which it came in.
constexpr std::array<std::uint8_t, 3> kOrder{3, 1, 2};

/// A node whose ports after the first may still lead to a slave.
struct Open {
  std::size_t node = 0;
  bool known = false;  ///< its ports are
  std::vector<std::uint8_t> ports;
};

Open OpenOf(const TopologySummary& topology, std::size_t node) {
  Open open{node, false, {}};
  const auto& ports = topology.nodes[node].ports;
  for (const std::uint8_t port : kOrder) {
    if (!ports[port].communication) continue;
    open.known = true;
    if (*ports[port].communication) open.ports.push_back(port);
  }
  return open;
}

/// Time that a frame spent downstream of `port`: from the stamp of the port before it, in the order of frames, to its
/// own.
std::optional<std::int64_t> RoundTrip(const TopologyNode& node, const DcSummary& dc, std::uint8_t port) {
  std::uint8_t before = 0;
  for (const std::uint8_t next : kOrder) {
    if (next == port) break;
    if (node.ports[next].communication.value_or(false)) before = next;
  }
  if (!dc.receive_times_ns[before] || !dc.receive_times_ns[port]) return std::nullopt;
  return static_cast<std::int32_t>(WrappingDifference(*dc.receive_times_ns[port], *dc.receive_times_ns[before]));
}

/// Time that a frame spent in the slave and downstream of it.
std::optional<std::int64_t> OwnRoundTrip(const TopologyNode& node, const DcSummary& dc) {
  std::uint8_t last = 0;
  for (const std::uint8_t next : kOrder) {
    if (node.ports[next].communication.value_or(false)) last = next;
  }
  if (last == 0) return 0;
  if (!dc.receive_times_ns[0] || !dc.receive_times_ns[last]) return std::nullopt;
  return static_cast<std::int32_t>(WrappingDifference(*dc.receive_times_ns[last], *dc.receive_times_ns[0]));
}

void AddDelays(const AnalysisResult& result, TopologySummary& topology) {
  const auto dc_of = [&](const TopologyNode& node) -> const DcSummary* {
    const SlaveSummary* slave = result.slave(node.slave);
    return slave != nullptr && slave->dc ? &*slave->dc : nullptr;
  };
  for (TopologyNode& node : topology.nodes) {
    if (node.above != TopologyNode::Above::kSlave) continue;
    const TopologyNode& parent = topology.nodes[node.parent];
    const DcSummary* above = dc_of(parent);
    const DcSummary* own = dc_of(node);
    if (above == nullptr || own == nullptr) continue;
    if (above->delay_ns && own->delay_ns) {
      node.delay_ns = static_cast<std::int64_t>(*own->delay_ns) - static_cast<std::int64_t>(*above->delay_ns);
    }
    if (!node.parent_port) continue;
    const auto branch = RoundTrip(parent, *above, *node.parent_port);
    const auto inside = OwnRoundTrip(node, *own);
    if (!branch || !inside) continue;
    const std::int64_t hop = (*branch - *inside) / 2;
    if (*branch > 0 && *inside >= 0 && hop >= 0 && hop < EntryPort::kLongestWayNs) node.measured_ns = hop;
  }
}

}  // namespace

Topology::Topology(const model::BusModel& model, EventBus& bus) : model_(model) {
  bus.Listen<track::SlaveAccess>(Stage::kAfterModel, *this, &Topology::On, MemoryRange::Of(0, kCountersEnd));
  bus.ListenTo<track::CaptureGap>(Stage::kAfterModel, *this);
}

Topology::Slave& Topology::Get(SlaveId slave) {
  while (slaves_.size() <= slave) slaves_.emplace_back();
  return slaves_[slave];
}

void Topology::On(const track::SlaveAccess& access) {
  if (access.address >= kCountersEnd || access.broadcast) return;
  if (access.address <= esc::kDlStatus && !access.read.empty()) OnDlStatus(access);
  if (access.address + access.length() > kCounters) OnCounters(Get(access.slave), access);
}

void Topology::On(const track::CaptureGap& gap) {
  if (!gap.certain) return;
  for (Slave& slave : slaves_) {
    slave.links.reset();
    slave.counters = {};
  }
}

void Topology::OnDlStatus(const track::SlaveAccess& access) {
  const ByteSpan low = access.Covered(access.read, esc::kDlStatus, 1);
  if (low.empty()) return;
  Slave& slave = Get(access.slave);
  TopologyNode& node = slave.node;
  ++node.dl_status_reads;
  const auto links = static_cast<std::uint8_t>(low[0] >> 4U);
  for (std::size_t port = 0; port < EntryPort::kPorts; ++port) {
    const bool link = (links >> port & 1U) != 0;
    PortSummary& summary = node.ports[port];
    const bool changed = slave.links && (*slave.links >> port & 1U) != (links >> port & 1U);
    if (changed && summary.changes.size() < kMaxChanges) {
      summary.changes.push_back({slave.links_read, access.frame(), link});
    }
  }
  slave.links = links;
  slave.links_read = access.frame();
  const EntryPort& ports = model_.slave(access.slave).entry_port;
  if (const auto& status = ports.status()) {
    node.dl_status_frame = ports.status_frame().number;
    for (std::size_t port = 0; port < EntryPort::kPorts; ++port) {
      node.ports[port].link = (*status >> (4U + port) & 1U) != 0;
      node.ports[port].communication = model::FramesPass(*status, port);
    }
  } else if (node.dl_status_frame == 0) {
    node.dl_status_frame = access.frame().number;
    for (std::size_t port = 0; port < EntryPort::kPorts; ++port) node.ports[port].link = (links >> port & 1U) != 0;
  }
}

void Topology::OnCounters(Slave& slave, const track::SlaveAccess& access) {
  TopologyNode& node = slave.node;
  bool any = false;
  for (std::size_t i = 0; i < slave.counters.size(); ++i) {
    const ByteSpan value = access.Covered(access.read, static_cast<EscAddress>(kCounters + i), 1);
    if (value.empty()) continue;
    any = true;
    const std::optional<std::uint8_t> before = std::exchange(slave.counters[i], value[0]);
    if (!before || value[0] <= *before) continue;
    const unsigned rise = value[0] - *before;
    std::optional<std::size_t> port;
    if (i < 8) {
      port = i / 2;
      (i % 2 == 0 ? node.ports[*port].errors.invalid_frames : node.ports[*port].errors.receive_errors) += rise;
    } else if (i < 12) {
      port = i - 8;
      node.ports[*port].errors.forwarded_errors += rise;
    } else if (i == 12) {
      node.processing_errors += rise;
    } else if (i >= 16) {
      port = i - 16;
      node.ports[*port].errors.lost_links += rise;
    }
    if (port && !node.ports[*port].errors_frame.seen()) {
      node.ports[*port].errors_before = slave.counters_read;
      node.ports[*port].errors_frame = access.frame();
    }
  }
  if (any) {
    ++node.counter_reads;
    slave.counters_read = access.frame();
  }
  if (access.written.empty() || !access.done()) return;
  // Any write to a group clears the whole group.
  const auto clears = [&](std::size_t first, std::size_t end) {
    if (access.address >= kCounters + end || access.address + access.written.size() <= kCounters + first) return;
    for (std::size_t i = first; i < end; ++i) slave.counters[i] = std::uint8_t{0};
  };
  clears(0, 12);
  clears(12, 13);
  clears(16, 20);
}

void Topology::Summarise(AnalysisResult& result) {
  TopologySummary& topology = result.bus.topology;
  for (const SlaveSummary& slave : result.slaves) {
    TopologyNode node = slave.id < slaves_.size() ? slaves_[slave.id].node : TopologyNode{};
    node.slave = slave.id;
    node.position = slave.position;
    topology.nodes.push_back(std::move(node));
  }
  BuildTree(topology);
  AddDelays(result, topology);
}

void TakeEntryPorts(AnalysisResult& result) {
  for (const Finding& finding : result.findings) {
    const Value* port = finding.rule == "bus-port-order" ? finding.arguments.Find("port") : nullptr;
    if (port == nullptr) continue;
    for (TopologyNode& node : result.bus.topology.nodes) {
      if (node.slave == finding.slave) node.entry_port = static_cast<std::uint8_t>(port->number);
    }
  }
}

void BuildTree(TopologySummary& topology) {
  std::vector<Open> open;  // from the master to the slave before
  for (std::size_t i = 0; i < topology.nodes.size(); ++i) {
    TopologyNode& node = topology.nodes[i];
    const bool in_a_row = i > 0 && topology.nodes[i - 1].position + 1 == node.position;
    if (i == 0) {
      node.above = node.position == 0 ? TopologyNode::Above::kMaster : TopologyNode::Above::kUnknown;
    } else if (in_a_row) {
      while (!open.empty() && open.back().known && open.back().ports.empty()) open.pop_back();
      if (!open.empty() && open.back().known) {
        node.above = TopologyNode::Above::kSlave;
        node.parent = open.back().node;
        node.parent_port = open.back().ports.front();
        open.back().ports.erase(open.back().ports.begin());
      } else if (!open.empty()) {
        // Ports that were not read: it is this slave only where none of those before has a port left.
        const bool alone = std::all_of(open.begin(), open.end() - 1,
                                       [](const Open& other) { return other.known && other.ports.empty(); });
        if (alone) {
          node.above = TopologyNode::Above::kSlave;
          node.parent = open.back().node;
        }
        open.clear();
      }
    }
    if (node.above == TopologyNode::Above::kUnknown) open.clear();
    open.push_back(OpenOf(topology, i));
  }
}

}  // namespace ecaudit
