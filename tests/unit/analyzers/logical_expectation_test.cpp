#include "analyzers/model/logical_expectation.h"

#include <random>
#include <string>

#include <gtest/gtest.h>

#include "analyzers/model/bus_model.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/pipeline.h"
#include "tests/support/trace_builder.h"

namespace ecaudit::model {
namespace {

using test::Bytes;
using test::Trace;

std::string Text(const LogicalExpectation& e) {
  std::string text = std::to_string(e.mapping_known) + std::to_string(e.complete) + " " + std::to_string(e.full) + " " +
                     std::to_string(e.inputs) + " " + std::to_string(e.outputs) + " " + std::to_string(e.fills_bytes);
  for (const LogicalShare& s : e.shares) {
    text += " | " + std::to_string(s.slave) + (s.inputs ? "i" : "") + (s.outputs ? "o" : "") +
            (s.mailbox_only ? "m" : "") + std::to_string(s.input_manager.value_or(99)) + "," +
            std::to_string(s.output_manager.value_or(99)) + "," + std::to_string(s.input_offset) + "+" +
            std::to_string(s.input_bytes);
  }
  return text;
}

/// Compares what the model expects with what follows from all FMMUs and sync managers anew.
class Comparison final : public EventBus {
 public:
  Comparison() { ListenTo<track::LogicalAccess>(Stage::kAfterModel, *this); }
  void On(const track::LogicalAccess& access) {
    const auto anew = std::make_unique<LogicalExpectations>();
    const track::Network& network = model->network();
    EXPECT_EQ(Text(model->Expect(access)), Text(anew->Find(network, access.command, access.address, access.length)));
    some_shares = some_shares || !model->Expect(access).shares.empty();
    ++compared;
  }

  const BusModel* model = nullptr;
  std::size_t compared = 0;
  bool some_shares = false;
};

TEST(LogicalExpectations, FollowEachChangeAsIfTheyWereMadeAnew) {
  constexpr std::uint16_t kSlaves = 6;
  std::mt19937 chance(20261124);
  const auto below = [&](std::uint32_t end) { return static_cast<std::uint8_t>(chance() % end); };
  Trace trace;
  trace.Slaves(kSlaves);
  trace.After(1000).Brd(0x0130, {2, 0});
  for (std::uint16_t i = 0; i < kSlaves; ++i) {
    trace.After(1000).Apwr(i, 0x0010, {static_cast<std::uint8_t>(1 + i), 0x10});
    trace.After(1000).Fpwr(static_cast<std::uint16_t>(0x1001 + i), 0x0600, Bytes(256));
  }
  constexpr std::size_t kSteps = 2000;
  for (std::size_t step = 0; step < kSteps; ++step) {
    const auto station = static_cast<std::uint16_t>(0x1001 + below(kSlaves));
    switch (below(4)) {
      case 0:
        trace.After(1000).Fpwr(station, static_cast<std::uint16_t>(0x0600 + 16 * below(3)),
                               {below(200), 0, 0, 0, static_cast<std::uint8_t>(1 + below(8)), 0, 0, 7,
                                static_cast<std::uint8_t>(16 * below(4)), 0x11, 0,
                                static_cast<std::uint8_t>(1 + below(3)), below(2), 0, 0, 0});
        break;
      case 1:
        trace.After(1000).Fpwr(station, static_cast<std::uint16_t>(0x0800 + 8 * below(4)),
                               {static_cast<std::uint8_t>(16 * below(4)), 0x11, 16, 0,
                                below(2) != 0 ? Bytes{0x64}[0] : Bytes{0x22}[0], 0, 1, 0});
        break;
      default:
        // More kinds of datagrams than are kept, some of them often.
        const std::uint32_t at = below(2) != 0 ? 0 : below(200);
        trace.After(1000).Lrw(at, Bytes(1 + below(3)), Bytes(1)).Wkc(0);
        break;
    }
  }
  Comparison comparison;
  Pipeline pipeline(comparison);
  const AnalysisOptions options;
  const BusModel model(pipeline.network(), options, comparison);
  comparison.model = &model;
  const auto source = trace.Source();
  pipeline.Run(*source, {});
  EXPECT_GT(comparison.compared, kSteps / 3);
  EXPECT_TRUE(comparison.some_shares);
}

TEST(LogicalKinds, KeepWhatIsAskedForWhereManyOthersCome) {
  const auto kinds = std::make_unique<LogicalKinds<int>>();
  const auto value = [&](std::uint32_t address) -> int& {
    const LogicalKind kind{wire::Command::LRW, address, 8};
    if (int* found = kinds->Find(kind)) return *found;
    int& taken = kinds->Take(kind);
    taken = 0;
    return taken;
  };
  // A master with 32 datagrams a cycle, and one that is another each time.
  constexpr std::uint32_t kCyclic = 32;
  for (std::uint32_t cycle = 0; cycle < 100; ++cycle) {
    for (std::uint32_t i = 0; i < kCyclic; ++i) ++value(0x10000 + 0x200 * i);
    ++value(0x900000 + cycle * 4);
  }
  for (std::uint32_t i = 0; i < kCyclic; ++i) EXPECT_EQ(value(0x10000 + 0x200 * i), 100) << i;
}

}  // namespace
}  // namespace ecaudit::model
