#include "cli/report/json_sections.h"
#include "cli/report/json_text.h"
#include "cli/report/times.h"

namespace ecaudit::report {
namespace {

void PutPort(JsonObject& out, const AnalysisResult& result, const PortSummary& port, std::size_t number) {
  out.Put("port", number);
  out.Put("link", port.link);
  out.Put("communication", port.communication);
  out.Object("errors", [&](JsonObject& json) {
    json.Put("invalid_frames", port.errors.invalid_frames);
    json.Put("receive_errors", port.errors.receive_errors);
    json.Put("forwarded_errors", port.errors.forwarded_errors);
    json.Put("lost_links", port.errors.lost_links);
  });
  out.Frame("errors_frame", port.errors_frame);
  out.List("changes", port.changes, [&](JsonObject& json, const LinkChange& change) {
    json.Frame("frame", change.frame);
    json.Put("time_s", SecondsSince(result.capture.origin, change.frame));
    json.Frame("frame_before", change.before);
    json.Put("link", change.link);
  });
}

/// What the slave hangs on: null where it is not known.
void PutAbove(JsonObject& out, const TopologySummary& topology, const TopologyNode& node) {
  if (node.above == TopologyNode::Above::kUnknown) return out.Put("above", nullptr);
  out.Object("above", [&](JsonObject& json) {
    if (node.above == TopologyNode::Above::kMaster) {
      json.Put("slave", nullptr);
      json.Put("port", nullptr);
    } else {
      json.Put("slave", topology.nodes[node.parent].position);
      json.Put("port", node.parent_port);
    }
    json.Put("delay_ns", node.delay_ns);
    json.Put("measured_delay_ns", node.measured_ns);
  });
}

}  // namespace

void PutTopology(JsonObject& out, std::string_view key, const AnalysisResult& result) {
  const TopologySummary& topology = result.bus.topology;
  if (!topology.known()) return out.Put(key, nullptr);
  out.Object(key, [&](JsonObject& json) {
    json.List("slaves", topology.nodes, [&](JsonObject& slave, const TopologyNode& node) {
      slave.Put("slave", node.position);
      PutAbove(slave, topology, node);
      slave.Put("entry_port", node.entry_port);
      slave.Put("dl_status_reads", node.dl_status_reads);
      slave.Frame("dl_status_frame", node.dl_status_frame);
      slave.Put("counter_reads", node.counter_reads);
      slave.Put("processing_errors", node.processing_errors);
      slave.Array("ports", [&](JsonArray& ports) {
        if (node.dl_status_frame == 0 && node.counter_reads == 0) return;
        for (std::size_t port = 0; port < node.ports.size(); ++port) {
          ports.AddObject([&](JsonObject& entry) { PutPort(entry, result, node.ports[port], port); });
        }
      });
    });
  });
}

}  // namespace ecaudit::report
