#include "cli/report/topology_text.h"

#include <algorithm>
#include <set>

#include "cli/report/times.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

using Above = TopologyNode::Above;

constexpr std::size_t kNotesShown = 12;

std::vector<std::size_t> ChildrenOf(const TopologySummary& topology, std::size_t node) {
  std::vector<std::size_t> children;
  for (std::size_t i = 0; i < topology.nodes.size(); ++i) {
    if (topology.nodes[i].above == Above::kSlave && topology.nodes[i].parent == node) children.push_back(i);
  }
  return children;
}

/// Follows port 1, where the line goes on in most cabinets; the other neighbours begin lines of their own.
void Follow(const TopologySummary& topology, const SlaveNames& names, std::size_t node, const std::string& head,
            std::vector<std::string>& chains) {
  std::string chain = head;
  std::vector<std::pair<std::size_t, std::size_t>> branches;  // node, child
  const std::size_t place = chains.size();
  chains.emplace_back();
  // Neighbours in a row without branches are one range: a bus may have hundreds.
  std::size_t first = node;
  std::size_t last = node;
  const auto flush = [&] {
    const unsigned from = topology.nodes[first].position;
    const unsigned to = topology.nodes[last].position;
    constexpr std::size_t kOneByOne = 4;
    if (to - from < kOneByOne) {
      for (unsigned p = from; p <= to; ++p) chain += " - " + names.Number(p);
    } else {
      chain += " - " + names.Number(from) + " - ... - " + names.Number(to);
    }
  };
  while (true) {
    const std::vector<std::size_t> children = ChildrenOf(topology, node);
    if (children.empty()) break;
    std::size_t on = children.front();
    for (const std::size_t child : children) {
      if (topology.nodes[child].parent_port == 1) on = child;
    }
    for (const std::size_t child : children) {
      if (child != on) branches.emplace_back(node, child);
    }
    if (topology.nodes[on].position != topology.nodes[node].position + 1) {
      flush();
      first = on;
    }
    node = last = on;
  }
  flush();
  chains[place] = std::move(chain);
  for (const auto& [parent, child] : branches) {
    const std::optional<std::uint8_t> port = topology.nodes[child].parent_port;
    Follow(topology, names, child,
           names.Number(topology.nodes[parent].position) + " port " + (port ? std::to_string(*port) : "?"), chains);
  }
}

/// The node that is plugged into `port` of `node`.
std::optional<std::size_t> NeighbourAt(const TopologySummary& topology, std::size_t node, std::uint8_t port) {
  if (port == 0 && topology.nodes[node].above == Above::kSlave) return topology.nodes[node].parent;
  for (const std::size_t child : ChildrenOf(topology, node)) {
    if (topology.nodes[child].parent_port == port) return child;
  }
  return std::nullopt;
}

std::string ErrorsText(const PortErrors& errors) {
  std::string text;
  const auto add = [&text](std::uint64_t count, std::string_view what) {
    if (count > 0) text += (text.empty() ? "" : ", ") + Count(count, what);
  };
  add(errors.lost_links, "lost link");
  add(errors.invalid_frames, "invalid frame");
  add(errors.receive_errors, "receive error");
  add(errors.forwarded_errors, "forwarded error");
  return text;
}

std::string At(const AnalysisResult& result, const FrameRef& frame, const TextStyle& style) {
  std::string text = "frame " + std::to_string(frame.number);
  const std::string moment = MomentText(style.time, result.capture.origin, frame, 3);
  return moment.empty() ? text : text + " at " + moment;
}

}  // namespace

std::vector<std::string> TopologyChains(const TopologySummary& topology, const SlaveNames& names) {
  std::vector<std::string> chains;
  for (std::size_t i = 0; i < topology.nodes.size(); ++i) {
    if (topology.nodes[i].above == Above::kMaster) Follow(topology, names, i, "master", chains);
    if (topology.nodes[i].above == Above::kUnknown) Follow(topology, names, i, "?", chains);
  }
  return chains;
}

std::string LinkText(const TopologySummary& topology, const SlaveNames& names, std::size_t node, std::uint8_t port) {
  const TopologyNode& self = topology.nodes[node];
  const std::string own = names.Of(self.position) + " port " + std::to_string(port);
  if (port == 0 && self.above == Above::kMaster) return "between the master and " + own;
  const std::optional<std::size_t> neighbour = NeighbourAt(topology, node, port);
  if (!neighbour) return "at " + own;
  const TopologyNode& other = topology.nodes[*neighbour];
  if (port != 0) return "between " + own + " and " + names.Of(other.position) + " port 0";
  const std::string above =
      names.Of(other.position) + (self.parent_port ? " port " + std::to_string(*self.parent_port) : std::string());
  return "between " + above + " and " + own;
}

std::vector<std::string> TopologyNotes(const AnalysisResult& result, const TextStyle& style) {
  const TopologySummary& topology = result.bus.topology;
  const SlaveNames& names = result.slave_names;
  std::vector<std::string> notes;
  std::set<unsigned> without;
  std::set<unsigned> counted;
  std::uint64_t reads = 0;
  bool rose = false;
  for (std::size_t i = 0; i < topology.nodes.size(); ++i) {
    const TopologyNode& node = topology.nodes[i];
    if (node.dl_status_frame == 0) without.insert(node.position);
    if (node.counter_reads > 1) counted.insert(node.position);
    if (node.counter_reads > 1) reads = std::max(reads, node.counter_reads);
    for (std::uint8_t port = 0; port < node.ports.size(); ++port) {
      const PortSummary& summary = node.ports[port];
      std::string text;
      for (const LinkChange& change : summary.changes) {
        text += (text.empty() ? "" : ", ") + std::string(change.link ? "link there again" : "link gone") + " in " +
                At(result, change.frame, style) + " (read before in frame " + std::to_string(change.before.number) +
                ")";
      }
      if (summary.errors.any()) {
        rose = true;
        text += (text.empty() ? "" : "; ") + ErrorsText(summary.errors) + " counted from frame " +
                std::to_string(summary.errors_before.number) + " to " + At(result, summary.errors_frame, style);
      }
      if (!text.empty()) notes.push_back(LinkText(topology, names, i, port) + ": " + text);
    }
    if (node.processing_errors > 0) {
      rose = true;
      notes.push_back(names.Of(node.position) + ": its processing unit counted " +
                      Count(node.processing_errors, "bad frame"));
    }
  }
  if (notes.size() > kNotesShown) {
    const std::size_t more = notes.size() - kNotesShown;
    notes.resize(kNotesShown);
    notes.push_back("and " + Count(more, "more link") + " (--format json has all)");
  }
  if (result.bus.lost_frames > 0 && notes.size() == 1) {
    notes.front() += "; " + Count(result.bus.lost_frames, "frame") + " lost on the bus in all";
  }
  for (const TopologyNode& node : topology.nodes) {
    if (!node.entry_port) continue;
    notes.push_back(names.Of(node.position) + ": frames enter at port " + std::to_string(*node.entry_port) +
                    ", not at port 0 (bus-port-order)");
  }
  if (!counted.empty() && !rose) {
    notes.push_back("error counters of " + names.Of(counted) + " read " + (counted.size() == 1 ? "" : "up to ") +
                    Count(reads, "time") + ": none rose");
  }
  if (!without.empty() && without.size() < topology.nodes.size()) {
    notes.push_back("DL status of " + names.Of(without) + " not read: what hangs there is open");
  }
  return notes;
}

}  // namespace ecaudit::report
