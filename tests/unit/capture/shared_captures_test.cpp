// The captures beside the project: packet counts of their README and truth files, time stamps of tshark, and the same
// run in every container.
#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/unit/capture/capture_test_support.h"

namespace ecaudit::capture {
namespace {

#define SKIP_WITHOUT_CAPTURES() \
  if (SharedCapture("lab/startup-ok-1slave.pcapng").empty()) GTEST_SKIP() << "no captures beside the project"

struct Expected {
  std::string file;
  std::size_t packets;
};

/// Packets as the READMEs give them.
const std::vector<Expected> kWholeFiles{
    {"real/soem-sdinfo-akd.pcapng", 6762},
    {"real/replay-dc.pcapng", 3604},
    {"real/replay-ek1914-segmented-upload.pcapng", 964},
    {"real/replay-ek1914-no-complete-access.pcapng", 2208},
    {"real/soem-single-lan9252.pcapng", 999},
    {"real/twincat-run-ek1100-el1004.pcapng", 554},
    {"lab/startup-ok-1slave.pcapng", 10870},
    {"lab/startup-ok-3slaves.pcapng", 11614},
    {"lab/startup-ok-1slave-pdo1701.pcapng", 2772},
    {"lab/startup-40slaves-2frames.pcapng", 18650},
    {"lab/legal-shortcuts.pcapng", 1296},
    {"lab/soem-slaveinfo-akd.pcapng", 940},
    {"lab/soem-slaveinfo-akdca.pcapng", 580},
    {"lab/soem-ec-sample.pcapng", 17830},
    {"lab/soem-eepromtool-info.pcapng", 264},
    {"lab/soem-eepromtool-read.pcapng", 4110},
    {"lab/kickcat-ingenia-info.pcapng", 1326},
    {"lab/mid-run.pcapng", 20969},
    {"lab/dc.pcapng", 12928},
    {"lab/illegal-init-to-op.pcapng", 1634},
    {"lab/no-ack-after-error.pcapng", 296},
    {"lab/bad-sm-config.pcapng", 680},
    {"lab/one-slave-refuses.pcapng", 1332},
    {"lab/watchdog-sm.pcapng", 8886},
    {"lab/drive-fault.pcapng", 8870},
    {"lab/sdo-mix.pcapng", 960},
    {"lab/mailbox-emergency.pcapng", 358},
    {"lab/mailbox-error-reply.pcapng", 8970},
    {"lab/foe-unsupported.pcapng", 9242},
    {"lab/mailbox-timeout.pcapng", 5016},
    {"lab/mailbox-read-reply-lost.pcapng", 5241},
    {"lab/jitter.pcapng", 14852},
    {"lab/lost-frames.pcapng", 20759},
    {"lab/wkc-error-link-break.pcapng", 11614},
    {"lab/disturbed-returns.pcapng", 11245},
    {"lab/latch.pcapng", 10870},
    {"lab/mixed-traffic.pcapng", 6970},
    {"lab/startup-ok-1slave-cooked.pcapng", 2870},
    {"lab/empty-no-packets.pcap", 0},
    {"lab/empty-no-packets.pcapng", 0},
    {"lab/empty-shb-only.pcapng", 0},
};

TEST(SharedCaptures, PacketCountsOfTheReadme) {
  SKIP_WITHOUT_CAPTURES();
  for (const auto& [file, packets] : kWholeFiles) {
    const WholeCapture capture = ReadFile(SharedCapture(file));
    EXPECT_EQ(capture.frames.size(), packets) << file;
    EXPECT_EQ(capture.end, ReadStatus::kEnd) << file << ": " << capture.error << capture.damage();
  }
}

TEST(SharedCaptures, PacketCountsOfTheTruthFiles) {
  SKIP_WITHOUT_CAPTURES();
  int checked = 0;
  for (const auto& entry : std::filesystem::directory_iterator(SharedCapture("lab"))) {
    if (!entry.path().string().ends_with(".truth.json")) continue;
    std::ifstream file(entry.path());
    const auto truth = nlohmann::json::parse(file, nullptr, false);
    ASSERT_TRUE(truth.is_object()) << entry.path();
    const auto whole = truth.contains("packets") ? truth["packets"] : truth.value("whole_packets", nlohmann::json());
    if (!whole.is_number()) continue;
    const std::string name = truth.value("file", "");
    EXPECT_EQ(ReadFile(SharedCapture("lab/" + name)).frames.size(), whole.get<std::size_t>()) << name;
    ++checked;
  }
  EXPECT_GE(checked, 25);
}

TEST(SharedCaptures, EqualToTshark) {
  SKIP_WITHOUT_CAPTURES();
  if (!HaveTshark()) GTEST_SKIP() << "no tshark";
  // One of each kind: tshark takes its time to start, and Container compares the others with these.
  for (const char* file : {"real/soem-sdinfo-akd.pcapng", "real/twincat-run-ek1100-el1004.pcapng",
                           "lab/startup-ok-1slave.pcapng", "lab/startup-ok-1slave-tsresol2e30.pcapng",
                           "lab/startup-ok-1slave-spb.pcapng", "lab/startup-ok-1slave-be-usec.pcap",
                           "lab/startup-ok-1slave-cooked.pcapng", "lab/truncated-mid-packet.pcapng"}) {
    const std::string path = SharedCapture(file);
    const std::vector<TsharkFrame> expected = TsharkFrames(path);
    const WholeCapture capture = ReadFile(path);
    ASSERT_FALSE(expected.empty()) << file;
    ASSERT_EQ(capture.frames.size(), expected.size()) << file;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const OwnedFrame& frame = capture.frames[i];
      ASSERT_EQ(frame.number, expected[i].number) << file;
      ASSERT_EQ(frame.has_time, expected[i].has_time) << file << ':' << frame.number;
      ASSERT_EQ(frame.time, expected[i].time) << file << ':' << frame.number;
      ASSERT_EQ(frame.original_length, expected[i].length) << file << ':' << frame.number;
      ASSERT_EQ(frame.bytes.size(), expected[i].captured) << file << ':' << frame.number;
    }
  }
}

/// The run of startup-ok-1slave.pcapng, in nanoseconds, in another container.
struct Variant {
  std::string file;
  std::string format;
  TimeNs step;  // stamps are the source's rounded down to this; 0: none, -1: 2^-30 s
};

class Container : public testing::TestWithParam<Variant> {};

TEST_P(Container, SameFramesAsTheSource) {
  SKIP_WITHOUT_CAPTURES();
  const Variant& variant = GetParam();
  const WholeCapture source = ReadFile(SharedCapture("lab/startup-ok-1slave.pcapng"));
  const WholeCapture copy = ReadFile(SharedCapture("lab/" + variant.file));
  EXPECT_EQ(copy.info.format, variant.format);
  ASSERT_FALSE(copy.info.interfaces.empty());
  EXPECT_EQ(copy.info.interfaces[0].link_type, 1);
  if (variant.step > 0) {
    EXPECT_EQ(copy.info.interfaces[0].resolution_ns, variant.step);
  }
  ASSERT_EQ(copy.frames.size(), source.frames.size());
  for (std::size_t i = 0; i < source.frames.size(); ++i) {
    const OwnedFrame& frame = copy.frames[i];
    ASSERT_EQ(frame.number, i + 1);
    ASSERT_EQ(frame.bytes, source.frames[i].bytes) << "frame " << i + 1;
    ASSERT_EQ(frame.original_length, source.frames[i].original_length);
    const TimeNs time = source.frames[i].time;
    ASSERT_EQ(frame.has_time, variant.step != 0);
    if (variant.step > 0) {
      ASSERT_EQ(frame.time, time - time % variant.step) << "frame " << i + 1;
    } else if (variant.step < 0) {
      ASSERT_LE(std::abs(frame.time - time), 1) << "frame " << i + 1;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(StartupOk1Slave, Container,
                         testing::Values(Variant{"startup-ok-1slave-be.pcapng", "pcapng", 1},
                                         Variant{"startup-ok-1slave-spb.pcapng", "pcapng", 0},
                                         Variant{"startup-ok-1slave-tap2if.pcapng", "pcapng", 1},
                                         Variant{"startup-ok-1slave-tsresol6.pcapng", "pcapng", 1000},
                                         Variant{"startup-ok-1slave-tsresol2e30.pcapng", "pcapng", -1},
                                         Variant{"startup-ok-1slave-nsec.pcap", "pcap", 1},
                                         Variant{"startup-ok-1slave-usec.pcap", "pcap", 1000},
                                         Variant{"startup-ok-1slave-be-nsec.pcap", "pcap", 1},
                                         Variant{"startup-ok-1slave-be-usec.pcap", "pcap", 1000}));

TEST(SharedCaptures, TapOfTwoInterfacesWithDirections) {
  SKIP_WITHOUT_CAPTURES();
  const WholeCapture capture = ReadFile(SharedCapture("lab/startup-ok-1slave-tap2if.pcapng"));
  ASSERT_EQ(capture.info.interfaces.size(), 2U);
  EXPECT_EQ(capture.info.interfaces[0].name, "tapA");
  EXPECT_EQ(capture.info.interfaces[1].name, "tapB");
  std::size_t outbound = 0;
  for (const OwnedFrame& frame : capture.frames) {
    ASSERT_EQ(frame.flag, frame.interface_index == 0 ? PacketFlag::kOutbound : PacketFlag::kInbound);
    if (frame.interface_index == 0) ++outbound;
  }
  EXPECT_EQ(outbound, 5435U);
}

TEST(SharedCaptures, CookedLinkTypeIsPassedThrough) {
  SKIP_WITHOUT_CAPTURES();
  const WholeCapture capture = ReadFile(SharedCapture("lab/startup-ok-1slave-cooked.pcapng"));
  ASSERT_FALSE(capture.frames.empty());
  EXPECT_EQ(capture.frames[0].link_type, 113);
}

TEST(SharedCaptures, DamagedFilesAreReadUpToTheDamage) {
  SKIP_WITHOUT_CAPTURES();
  const std::map<std::string, std::pair<std::size_t, std::string>> files{
      {"truncated-mid-packet.pcapng", {5000, "file ends inside packet 5001"}},
      {"truncated-mid-packet.pcap", {5000, "file ends inside packet 5001"}},
      {"truncated-record-header.pcap", {5000, "file ends inside packet 5001"}},
      {"truncated-block-header.pcapng", {5000, "file ends inside a block header before packet 5001"}},
      {"garbage-blocklen-zero.pcapng", {3000, "packet 3001 has an impossible block length, 0 bytes"}},
      {"garbage-blocklen-huge.pcapng", {3000, "packet 3001 has an impossible block length, 4,294,967,280 bytes"}},
  };
  for (const auto& [file, expected] : files) {
    const WholeCapture capture = ReadFile(SharedCapture("lab/" + file));
    EXPECT_EQ(capture.frames.size(), expected.first) << file;
    EXPECT_EQ(capture.end, ReadStatus::kDamaged) << file;
    EXPECT_EQ(capture.damage(), expected.second) << file;
    ASSERT_TRUE(capture.info.damage.has_value());
    EXPECT_EQ(capture.info.damage->after_frame, expected.first) << file;
  }
}

TEST(SharedCaptures, WhatIsNoCaptureReportsIt) {
  SKIP_WITHOUT_CAPTURES();
  const auto error = [](const std::string& name) {
    const std::string path = SharedCapture("lab/" + name);
    std::string message = ReadFile(path).error;
    const std::size_t at = message.find(path);
    return at == std::string::npos ? message : message.replace(at, path.size(), name);
  };
  EXPECT_EQ(error("garbage-random.pcapng"), "garbage-random.pcapng is not a capture: neither pcap nor pcapng");
  EXPECT_EQ(error("empty-zero-length.pcapng"), "empty-zero-length.pcapng is empty, not a capture");
  EXPECT_EQ(error("truncated-file-header.pcap"),
            "truncated-file-header.pcap is not a readable capture: file ends inside its pcap file header");
}

}  // namespace
}  // namespace ecaudit::capture
