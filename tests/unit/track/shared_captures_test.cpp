// The decoder line over whole captures. Expectations: the truth files beside the lab's captures (what masters and
// slaves did, counted by another decoder), and for the real ones what tshark counts by source address and index.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "analyzers/wiring/event_bus.h"
#include "decoder/base/text.h"
#include "decoder/capture/capture_reader.h"
#include "decoder/pipeline.h"
#include "tests/support/folders.h"

namespace ecaudit::track {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::ElementsAreArray;
using ::testing::IsEmpty;
using Json = nlohmann::json;

const fs::path kCaptures = fs::path(test::SharedDir()) / "captures";

/// What a whole capture told.
class Story final : public EventBus {
 public:
  explicit Story(const Pipeline* const& pipeline) : pipeline_(pipeline) {
    ListenTo<FrameSeen, FrameLost, FrameDuplicated, FrameUnusable, SlaveCount, Answered, SlaveAccess>(Stage::kModel,
                                                                                                      *this);
  }

  void On(const FrameSeen& e) {
    if (e.direction == bus::Direction::kOutbound) outbound.push_back(e.frame.ref().number);
    ++by_direction[e.direction];
  }
  void On(const FrameLost& e) { lost.push_back(e.sent.ref().number); }
  void On(const FrameDuplicated& e) { duplicated.push_back(e.returned.ref().number); }
  void On(const FrameUnusable& e) {
    if (!e.own_master) return;
    (e.reason == bus::Unusable::kAltered ? altered : malformed).push_back(e.frame.ref().number);
  }
  void On(const SlaveCount& e) { counts.push_back(e.count); }
  void On(const Answered& e) {
    if (e.address != 0x0120 || !wire::Writes(e.command)) return;
    const std::string value = Hex(e.sent_data.empty() ? 0U : e.sent_data[0], 2);
    controls.push_back(std::to_string(e.returned.number) + " " + std::string(wire::Name(e.command)) + " " + Hex(e.adp) +
                       " " + value + " " + std::to_string(e.wkc));
  }
  void On(const SlaveAccess& e) {
    if (e.broadcast) return;
    const ByteSpan status = e.Covered(e.read, 0x0130, 1);
    if (status.empty()) return;
    const ByteSpan code = e.Covered(e.read, 0x0134, 2);
    const StationAddress* station = pipeline_->network().slaves()[e.slave].station.if_known();
    const std::string slave = station != nullptr ? Hex(*station) : "?";
    if (last_status_.count(slave) != 0 && last_status_[slave] == status[0]) return;
    last_status_[slave] = status[0];
    states.push_back(std::to_string(e.returned.number) + " " + slave + " " + Hex(status[0], 2) + " " +
                     (code.empty() ? "-" : Hex(LittleEndian<std::uint16_t>(code, 0))));
  }

  std::vector<FrameNo> outbound, lost, duplicated, altered, malformed;
  std::map<bus::Direction, std::size_t> by_direction;
  std::vector<std::uint16_t> counts;
  std::vector<std::string> controls;  ///< "packet command address value wkc" of every returned write of AL Control
  std::vector<std::string> states;    ///< "packet slave status code" where it changed, by reads of one slave

 private:
  const Pipeline* const& pipeline_;
  std::map<std::string, std::uint8_t> last_status_;
};

struct Told {
  const Pipeline* pointer = nullptr;
  Story story{pointer};
  std::unique_ptr<Pipeline> pipeline;
};

std::unique_ptr<Told> Tell(const fs::path& path) {
  auto told = std::make_unique<Told>();
  told->pipeline = std::make_unique<Pipeline>(told->story);
  told->pointer = told->pipeline.get();
  auto source = capture::OpenCapture(path.string());
  EXPECT_TRUE(source) << path;
  if (source) told->pipeline->Run(**source);
  return told;
}

/// Packets the truth knows by number only up to the first sixty.
std::vector<FrameNo> Numbers(const Json& list) {
  return list.get<std::vector<FrameNo>>();
}

std::string ControlLine(const Json& write) {
  return std::to_string(write["packet"].get<FrameNo>()) + " " + write["cmd"].get<std::string>() + " " +
         write["adp"].get<std::string>() + " " + write["value"].get<std::string>() + " " +
         std::to_string(write["wkc"].get<int>());
}

std::string StateLine(const Json& change) {
  const Json& code = change.contains("al_status_code") ? change["al_status_code"] : Json();
  return std::to_string(change["packet"].get<FrameNo>()) + " " + change["slave"].get<std::string>() + " " +
         change["al_status"].get<std::string>() + " " + (code.is_string() ? code.get<std::string>() : "-");
}

class NetworkOnLabCapture : public ::testing::TestWithParam<std::string> {};

TEST_P(NetworkOnLabCapture, AgreesWithTheTruthFile) {
  const fs::path folder = kCaptures / "lab";
  if (!fs::exists(folder)) GTEST_SKIP() << "the lab captures are not beside the project";
  std::ifstream stream(folder / (GetParam() + ".truth.json"));
  const Json truth = Json::parse(stream, nullptr, false);
  ASSERT_TRUE(truth.is_object()) << GetParam();
  const Json& check = truth["capture_check"];

  const std::unique_ptr<Told> told = Tell(folder / (GetParam() + ".pcapng"));
  const Story& story = told->story;
  const PipelineStatistics& read = told->pipeline->statistics();
  const bus::PairingStatistics& pairing = told->pipeline->pairing();
  EXPECT_EQ(read.packets, check["packets"].get<std::uint64_t>());
  EXPECT_EQ(pairing.outbound, check["outbound_frames"].get<std::uint64_t>());
  EXPECT_EQ(story.outbound.size(), pairing.outbound);
  // The truth takes every frame with the MAC bit for a returned one, also those of other senders.
  EXPECT_EQ(pairing.returned + pairing.foreign, check["returned_frames"].get<std::uint64_t>());
  EXPECT_EQ(read.other_packets, check["packets_not_decodable_as_ethercat"].get<std::uint64_t>());
  EXPECT_EQ(read.backwards, check["timestamps_going_back"].get<std::uint64_t>());
  if (GetParam() !=
      "startup-ok-1slave-cooked") {  // there the truth misses the Ethernet header, not a part of the frame
    EXPECT_EQ(read.cut_frames, check["truncated_packets"].get<std::uint64_t>());
  }

  const std::vector<FrameNo> unanswered = Numbers(check["outbound_without_return_packet_numbers_first60"]);
  EXPECT_EQ(story.lost.size(), check["outbound_without_return"].get<std::size_t>());
  EXPECT_THAT(std::vector<FrameNo>(story.lost.begin(), story.lost.begin() + static_cast<std::ptrdiff_t>(std::min(
                                                                                story.lost.size(), unanswered.size()))),
              ElementsAreArray(unanswered));
  EXPECT_EQ(pairing.frames().undecided_total(), 0U);
  const std::vector<FrameNo> extra = Numbers(check["returned_without_outbound_packet_numbers_first60"]);
  if (GetParam() == "disturbed-returns") {
    EXPECT_THAT(story.duplicated, ElementsAreArray(extra));
  } else {
    EXPECT_THAT(story.duplicated, IsEmpty());
    EXPECT_EQ(pairing.unmatched_returned + pairing.foreign, extra.size());
  }

  std::vector<std::string> controls;
  for (const Json& write : check["al_control_writes"]) controls.push_back(ControlLine(write));
  EXPECT_THAT(story.controls, ElementsAreArray(controls));
  std::vector<std::string> states;
  for (const Json& change : check["al_status_changes_seen"]) states.push_back(StateLine(change));
  EXPECT_THAT(story.states, ElementsAreArray(states));

  const bus::SlaveSet& slaves = told->pipeline->network().slaves();
  const bool scanned = !controls.empty();
  for (const Json& slave : truth["slaves"]) {
    if (!scanned) break;
    const auto address = static_cast<StationAddress>(std::stoul(slave["adr"].get<std::string>(), nullptr, 16));
    const SlaveId id = slaves.AtStation(address);
    ASSERT_NE(id, kNoSlave) << address;
    ASSERT_NE(slaves[id].position.if_observed(), nullptr);
    EXPECT_EQ(*slaves[id].position.if_observed(), slave["n"].get<int>() - 1);
  }
  if (scanned && !truth["slaves"].empty()) {
    EXPECT_EQ(slaves.size(), truth["slaves"].size());
    EXPECT_THAT(story.counts, ElementsAre(truth["slaves"].size()));
  }
}

INSTANTIATE_TEST_SUITE_P(All, NetworkOnLabCapture,
                         ::testing::Values("bad-sm-config", "dc", "disturbed-returns", "drive-fault", "foe-unsupported",
                                           "illegal-init-to-op", "jitter", "kickcat-ingenia-info", "latch",
                                           "legal-shortcuts", "lost-frames", "mailbox-emergency", "mailbox-error-reply",
                                           "mailbox-read-reply-lost", "mailbox-timeout", "mid-run", "mixed-traffic",
                                           "no-ack-after-error", "one-slave-refuses", "sdo-mix", "soem-ec-sample",
                                           "soem-eepromtool-info", "soem-eepromtool-read", "soem-slaveinfo-akd",
                                           "soem-slaveinfo-akdca", "startup-40slaves-2frames", "startup-ok-1slave",
                                           "startup-ok-1slave-cooked", "startup-ok-1slave-pdo1701",
                                           "startup-ok-3slaves", "watchdog-sm", "wkc-error-link-break"),
                         [](const auto& name) {
                           std::string text = name.param;
                           std::replace(text.begin(), text.end(), '-', '_');
                           return text;
                         });

TEST(LabLosses, AreExactlyTheInjectedOnes) {
  const fs::path folder = kCaptures / "lab";
  if (!fs::exists(folder)) GTEST_SKIP() << "the lab captures are not beside the project";
  std::ifstream stream(folder / "lost-frames.truth.json");
  const Json truth = Json::parse(stream, nullptr, false);
  ASSERT_TRUE(truth.is_object());
  const std::unique_ptr<Told> told = Tell(folder / "lost-frames.pcapng");
  std::vector<FrameNo> dropped;
  for (const Json& one : truth["injected"]) {
    if (one["ev"] != "dropped") continue;
    const auto ordinal = one["frame"].get<std::size_t>();  // of the outbound frame, from 1
    ASSERT_LE(ordinal, told->story.outbound.size());
    dropped.push_back(told->story.outbound[ordinal - 1]);
  }
  EXPECT_EQ(dropped.size(), 113U);
  EXPECT_THAT(told->story.lost, ElementsAreArray(dropped));
}

TEST(LabDisturbances, AreReportedApart) {
  const fs::path folder = kCaptures / "lab";
  if (!fs::exists(folder)) GTEST_SKIP() << "the lab captures are not beside the project";
  const std::unique_ptr<Told> told = Tell(folder / "disturbed-returns.pcapng");
  // Three flips in the logical address, one in the length of the datagram (notes of the truth file), which turns its
  // last bytes into padding.
  EXPECT_EQ(told->story.altered.size(), 4U);
  EXPECT_EQ(told->story.malformed.size(), 0U);
  EXPECT_EQ(told->story.duplicated.size(), 3U);
  EXPECT_THAT(told->story.lost, IsEmpty());
}

struct NetworkOnRealCapture {
  const char* name;
  std::uint64_t packets, outbound, returned;
  std::vector<FrameNo> lost;
  std::uint64_t in_flight;
  std::uint64_t other;
  std::size_t slaves;
};

TEST(RealCaptures, FramesAsTsharkCountsThem) {
  const fs::path folder = kCaptures / "real";
  if (!fs::exists(folder)) GTEST_SKIP() << "the real captures are not beside the project";
  // The three frames that an AKD never returned each have an ARP packet right behind them.
  const NetworkOnRealCapture captures[] = {
      {"replay-dc", 3604, 1802, 1802, {}, 0, 0, 3},
      {"replay-ek1914-no-complete-access", 2208, 1104, 1104, {}, 0, 0, 2},
      {"replay-ek1914-segmented-upload", 964, 482, 482, {}, 0, 0, 2},
      {"soem-sdinfo-akd", 6762, 3381, 3378, {4607, 5457, 6455}, 0, 3, 1},
      {"soem-single-lan9252", 999, 499, 499, {}, 0, 1, 1},
      {"twincat-run-ek1100-el1004", 554, 277, 276, {}, 1, 1, 2},
  };
  for (const NetworkOnRealCapture& want : captures) {
    const std::unique_ptr<Told> told = Tell(folder / (std::string(want.name) + ".pcapng"));
    const bus::PairingStatistics& pairing = told->pipeline->pairing();
    EXPECT_EQ(told->pipeline->statistics().packets, want.packets) << want.name;
    EXPECT_EQ(told->pipeline->statistics().other_packets, want.other) << want.name;
    EXPECT_EQ(pairing.outbound, want.outbound) << want.name;
    EXPECT_EQ(pairing.returned, want.returned) << want.name;
    EXPECT_EQ(pairing.in_flight, want.in_flight) << want.name;
    EXPECT_EQ(pairing.unmatched_returned + pairing.foreign + pairing.duplicated + pairing.altered, 0U) << want.name;
    EXPECT_THAT(told->story.lost, ElementsAreArray(want.lost)) << want.name;
    EXPECT_EQ(told->pipeline->network().slaves().size(), want.slaves) << want.name;
    EXPECT_THAT(told->story.counts, ElementsAre(want.slaves)) << want.name;
  }
}

}  // namespace
}  // namespace ecaudit::track
