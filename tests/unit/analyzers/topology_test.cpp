#include "analyzers/collect/topology.h"

#include <string>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "tests/support/trace_builder.h"

namespace ecaudit {
namespace {

using Above = TopologyNode::Above;

/// A slave whose ports let frames pass as `open` says; unknown where it is empty.
TopologyNode Node(SlavePos position, std::initializer_list<int> open) {
  TopologyNode node;
  node.position = position;
  if (open.size() == 0) return node;
  node.dl_status_frame = 1;
  for (PortSummary& port : node.ports) port.communication = false;
  for (const int port : open) node.ports[static_cast<std::size_t>(port)].communication = true;
  return node;
}

/// "master", "0.1" for port 1 of slave 0, "0.?", "?" for each node.
std::string Tree(std::vector<TopologyNode> nodes) {
  TopologySummary topology{std::move(nodes)};
  BuildTree(topology);
  std::string text;
  for (const TopologyNode& node : topology.nodes) {
    if (!text.empty()) text += " ";
    if (node.above == Above::kMaster) text += "master";
    if (node.above == Above::kUnknown) text += "?";
    if (node.above == Above::kSlave) {
      text += std::to_string(topology.nodes[node.parent].position) + "." +
              (node.parent_port ? std::to_string(*node.parent_port) : "?");
    }
  }
  return text;
}

TEST(Topology, ALine) {
  EXPECT_EQ(Tree({Node(0, {0, 1}), Node(1, {0, 1}), Node(2, {0})}), "master 0.1 1.1");
}

TEST(Topology, BranchesInTheOrderOfFrames) {
  // At slave 0 a frame goes to port 3 first, with slaves 1 and 2, then to port 1.
  EXPECT_EQ(Tree({Node(0, {0, 1, 3}), Node(1, {0, 1}), Node(2, {0}), Node(3, {0})}), "master 0.3 1.1 0.1");
  EXPECT_EQ(Tree({Node(0, {0, 1, 2, 3}), Node(1, {0}), Node(2, {0}), Node(3, {0})}), "master 0.3 0.1 0.2");
}

TEST(Topology, WhatWasNotReadIsOpen) {
  // Nobody else has a port left: slave 2 can only hang on slave 1.
  EXPECT_EQ(Tree({Node(0, {0, 1}), Node(1, {}), Node(2, {0})}), "master 0.1 1.?");
  // It may hang on slave 0 as well.
  EXPECT_EQ(Tree({Node(0, {0, 1, 3}), Node(1, {}), Node(2, {0})}), "master 0.3 ?");
  // A position that no slave was met at.
  EXPECT_EQ(Tree({Node(0, {0, 1}), Node(2, {0, 1}), Node(3, {0})}), "master ? 2.1");
  EXPECT_EQ(Tree({Node(1, {0})}), "?");
  // More slaves than ports.
  EXPECT_EQ(Tree({Node(0, {0}), Node(1, {0})}), "master ?");
}

AnalysisResult ResultOf(const std::string& lines) {
  const auto trace = test::Trace::Parse("@slaves 2\n+0us APWR 0:0x0010 01 10\n+1ms APWR 1:0x0010 02 10\n" + lines);
  if (!trace) {
    ADD_FAILURE() << trace.error().message;
    return {};
  }
  return Analyse(*trace->Source(), AnalysisOptions{});
}

TEST(Topology, LinksCountersAndDelays) {
  const AnalysisResult result = ResultOf(
      "+1ms FPRD 0x1001:0x0110 31 5A\n"  // link at ports 0 and 1; frames pass there
      "+1ms FPRD 0x1002:0x0110 11 56\n"
      "+1ms FPRD 0x1001:0x0900 00 00 00 00 00 04 00 00\n"  // behind port 1 for 1024 ns
      "+1ms FPRD 0x1002:0x0900 00 00 00 00\n"
      "+1ms FPWR 0x1001:0x0928 00 00 00 00\n"
      "+1ms FPWR 0x1002:0x0928 00 02 00 00\n"
      "+1ms FPRD 0x1001:0x0300 00 00 00 02\n"
      "+1ms FPRD 0x1001:0x0300 00 00 00 05\n"
      "+1ms FPRD 0x1001:0x0110 11 56\n"  // the link at port 1 is gone
      "+1ms FPRD 0x1001:0x0110 31 5A\n");
  const TopologySummary& topology = result.bus.topology;
  ASSERT_EQ(topology.nodes.size(), 2U);
  const TopologyNode& first = topology.nodes[0];
  const TopologyNode& second = topology.nodes[1];
  EXPECT_EQ(first.above, Above::kMaster);
  EXPECT_EQ(second.above, Above::kSlave);
  EXPECT_EQ(second.parent_port, 1);
  EXPECT_EQ(second.delay_ns, 512);
  EXPECT_EQ(second.measured_ns, 512);
  EXPECT_EQ(first.dl_status_reads, 3U);
  EXPECT_EQ(first.counter_reads, 2U);
  EXPECT_EQ(first.ports[1].errors.receive_errors, 3U);
  EXPECT_FALSE(first.ports[0].errors.any());
  ASSERT_EQ(first.ports[1].changes.size(), 2U);
  EXPECT_FALSE(first.ports[1].changes[0].link);
  EXPECT_TRUE(first.ports[1].changes[1].link);
  EXPECT_EQ(first.ports[1].communication, true) << "the fullest picture is the one that is drawn";
}

TEST(Topology, NothingReadNothingKnown) {
  EXPECT_FALSE(ResultOf("+1ms FPRD 0x1001:0x0130 01 00\n").bus.topology.known());
}

}  // namespace
}  // namespace ecaudit
