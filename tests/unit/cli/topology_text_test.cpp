#include "cli/report/topology_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analyzers/collect/topology.h"
#include "tests/unit/cli/sample_result.h"

namespace ecaudit::report {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TopologyNode Node(SlavePos position, std::initializer_list<int> open) {
  TopologyNode node;
  node.position = position;
  node.dl_status_frame = 1;
  for (PortSummary& port : node.ports) port.communication = false;
  for (const int port : open) node.ports[static_cast<std::size_t>(port)].communication = true;
  return node;
}

AnalysisResult ResultOf(std::vector<TopologyNode> nodes) {
  AnalysisResult result = test::RefusedSafeop().result;
  result.bus.topology.nodes = std::move(nodes);
  BuildTree(result.bus.topology);
  return result;
}

TEST(TopologyText, Chains) {
  EXPECT_THAT(TopologyChains(ResultOf({Node(0, {0, 1}), Node(1, {0})}).bus.topology, {}),
              ElementsAre("master - 0 - 1"));
  EXPECT_THAT(
      TopologyChains(ResultOf({Node(0, {0, 1, 3}), Node(1, {0, 1}), Node(2, {0}), Node(3, {0})}).bus.topology, {}),
      ElementsAre("master - 0 - 3", "0 port 3 - 1 - 2"));
  EXPECT_THAT(TopologyChains(ResultOf({Node(0, {0}), Node(4, {0})}).bus.topology, {}),
              ElementsAre("master - 0", "? - 4"));
  std::vector<TopologyNode> line;
  for (SlavePos i = 0; i < 40; ++i) line.push_back(i == 39 ? Node(i, {0}) : Node(i, {0, 1}));
  EXPECT_THAT(TopologyChains(ResultOf(std::move(line)).bus.topology, {}), ElementsAre("master - 0 - ... - 39"));
}

TEST(TopologyText, TroubleStandsAtItsLink) {
  std::vector<TopologyNode> nodes{Node(0, {0, 1}), Node(1, {0})};
  nodes[0].counter_reads = nodes[1].counter_reads = 14;
  EXPECT_THAT(TopologyNotes(ResultOf(nodes), {}),
              ElementsAre("error counters of slaves 0-1 read up to 14 times: none rose"));
  nodes[1].ports[0].changes.push_back({test::Frame(20), test::Frame(30), false});
  nodes[1].ports[0].errors.receive_errors = 3;
  nodes[1].ports[0].errors_before = test::Frame(10);
  nodes[1].ports[0].errors_frame = test::Frame(40);
  AnalysisResult result = ResultOf(nodes);
  result.bus.lost_frames = 7;
  EXPECT_THAT(TopologyNotes(result, {}),
              ElementsAre("between slave 0 port 1 and slave 1 port 0: link gone in frame 30 at 0.029 s (read before in "
                          "frame 20); 3 receive errors counted from frame 10 to frame 40 at 0.039 s; 7 frames lost on "
                          "the bus in all"));
  EXPECT_EQ(LinkText(result.bus.topology, {}, 0, 0), "between the master and slave 0 port 0");
  EXPECT_EQ(LinkText(result.bus.topology, {}, 0, 1), "between slave 0 port 1 and slave 1 port 0");
  EXPECT_EQ(LinkText(result.bus.topology, {}, 1, 1), "at slave 1 port 1");
}

TEST(TopologyText, NothingToSay) {
  EXPECT_THAT(TopologyNotes(ResultOf({Node(0, {0})}), {}), IsEmpty());
}

}  // namespace
}  // namespace ecaudit::report
