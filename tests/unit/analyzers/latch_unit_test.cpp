// What the latch unit remembers of each capture, and what it says while it goes on. Words and objects: AKD-2011 4.11,
// MKD 4.12 and 4.7. What is forbidden is tested by the traces of tests/rules/latch-*.
#include "analyzers/model/latch_unit.h"

#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/capture/capture_reader.h"
#include "decoder/device/profile_registry.h"
#include "tests/support/folders.h"
#include "tests/support/trace_builder.h"

namespace ecaudit::model {
namespace {

class Recorder final : public EventBus {
 public:
  Recorder() { ListenTo<LatchStep, LatchMisuse>(Stage::kModel, *this); }
  void On(const LatchStep& e) {
    static constexpr const char* kNames[] = {"armed", "rearmed", "valid", "read", "disarmed"};
    steps.push_back(kNames[static_cast<std::size_t>(e.kind)]);
    last = e.capture;
  }
  void On(const LatchMisuse& e) { steps.emplace_back(RuleOf(e.kind)); }
  std::vector<std::string> steps;
  LatchCapture last;
};

/// One drive whose latch words go by SDO; each transfer is two frames, 1 ms apart.
class LatchUnitTest : public testing::Test {
 protected:
  LatchUnitTest() {
    const device::DeviceDescription& family = *device::BuiltinProfile("kollmorgen-mkd-n");
    process_.SetFamily(family);
    unit_.SetFamily(family);
    probe_.SetFamily(family);
  }
  void Transfer(mailbox::SdoService service, std::uint16_t index, std::vector<std::uint8_t> bytes) {
    mailbox::SdoTransfer sdo;
    sdo.slave = 0;
    sdo.service = service;
    sdo.has_object = true;
    sdo.index = index;
    sdo.data = bytes;
    sdo.size = bytes.size();
    sdo.outcome = mailbox::SdoOutcome::kCompleted;
    sdo.request = Next();
    sdo.response = Next();
    unit_.OnSdo(sdo);
    probe_.OnSdo(sdo);
  }
  FrameRef Next() {
    ++frame_;
    return {frame_, static_cast<TimeNs>(frame_) * 1'000'000, true};
  }
  void Control(std::uint16_t word) {
    Transfer(mailbox::SdoService::kDownload, 0x20A4,
             {static_cast<std::uint8_t>(word), static_cast<std::uint8_t>(word >> 8U)});
  }
  void Status(std::uint16_t word) {
    Transfer(mailbox::SdoService::kUpload, 0x20A5,
             {static_cast<std::uint8_t>(word), static_cast<std::uint8_t>(word >> 8U)});
  }

  Recorder sink_;
  track::SlaveState state_;
  events::ObjectNames names_;
  AlMachine al_{0, sink_};
  ProcessData process_{state_, names_};
  LatchUnit unit_{LatchUnit::Words::kLatch, 0, al_, process_, sink_};
  LatchUnit probe_{LatchUnit::Words::kTouchProbe, 0, al_, process_, sink_};
  FrameNo frame_ = 0;
};

TEST_F(LatchUnitTest, TouchProbeCapturesAreToldAndNotJudged) {
  // CiA 402: bit 0 enables probe 1, bit 4 its positive edge; 60B9h bit 1 tells that 60BAh holds the position.
  const auto write = [&](std::uint16_t word) {
    Transfer(mailbox::SdoService::kDownload, 0x60B8,
             {static_cast<std::uint8_t>(word), static_cast<std::uint8_t>(word >> 8U)});
  };
  const auto read = [&](std::uint16_t word) {
    Transfer(mailbox::SdoService::kUpload, 0x60B9,
             {static_cast<std::uint8_t>(word), static_cast<std::uint8_t>(word >> 8U)});
  };
  write(0x0000);
  write(0x0001);  // enabled, but no edge chosen
  EXPECT_TRUE(sink_.steps.empty());
  write(0x0011);  // frames 5, 6
  read(0x0001);
  read(0x0003);                                                              // 9, 10
  Transfer(mailbox::SdoService::kUpload, 0x60BA, {0x9C, 0xFF, 0xFF, 0xFF});  // 11, 12
  write(0x0000);                                                             // 13, 14
  EXPECT_EQ(sink_.steps, (std::vector<std::string>{"armed", "valid", "read", "disarmed"}));
  ASSERT_EQ(probe_.captures().size(), 1U);
  const LatchCapture& capture = probe_.captures()[0];
  EXPECT_EQ(probe_.edge(capture.edge).name, "touch probe 1 positive edge");
  EXPECT_EQ(capture.armed.number, 5U);
  EXPECT_EQ(capture.valid.number, 10U);
  EXPECT_EQ(capture.read.number, 12U);
  EXPECT_EQ(capture.position, -100);
  read(0x0000);
  write(0x0011);
  read(0x0001);
  read(0x0003);
  write(0x0000);
  read(0x0000);  // never read
  EXPECT_EQ(probe_.history(0).lost, 1U);
  EXPECT_EQ(probe_.misuses(), 0U);
}

TEST_F(LatchUnitTest, OneCaptureIsOneRecordWithItsFrames) {
  Control(0);       // frames 1, 2
  Control(0x0004);  // 3, 4: latch 2 rising
  Status(0);        // 5, 6
  Status(0x0004);   // 7, 8
  Control(0x0304);  // 9, 10
  Status(0x0304);   // 11, 12
  Control(0);       // 13, 14
  Status(0);        // 15, 16
  Control(0x0004);  // 17, 18
  EXPECT_EQ(sink_.steps, (std::vector<std::string>{"armed", "valid", "read", "disarmed", "rearmed"}));
  ASSERT_EQ(unit_.captures().size(), 2U);
  const LatchCapture& first = unit_.captures()[0];
  EXPECT_EQ(first.edge, 2);
  EXPECT_EQ(first.armed.number, 3U);
  EXPECT_EQ(first.valid.number, 8U);
  EXPECT_EQ(first.selected.number, 9U);
  EXPECT_EQ(first.acknowledged.number, 12U);
  EXPECT_EQ(first.read.number, 12U);
  EXPECT_EQ(first.reading, LatchReading::kSelector);
  EXPECT_FALSE(first.position) << "which object the drive supplied it in, the manual does not say";
  EXPECT_EQ(first.disarmed.number, 13U);
  EXPECT_EQ(first.rearmed.number, 17U);
  EXPECT_EQ(unit_.captures()[1].armed.number, 17U);
  EXPECT_EQ(unit_.history(2).armed, 2U);
  EXPECT_EQ(unit_.history(2).read, 1U);
  EXPECT_TRUE(unit_.control_by_sdo());
}

TEST_F(LatchUnitTest, AnUploadedPositionIsSigned) {
  Control(0);
  Status(0);
  Control(0x0002);
  Status(0x0002);
  Transfer(mailbox::SdoService::kUpload, 0x20A0, {1, 0, 0, 0});  // of the rising edge: not the one that is awaited
  EXPECT_FALSE(unit_.captures()[0].read.seen());
  Transfer(mailbox::SdoService::kUpload, 0x20A6, {0xFE, 0xFF, 0xFF, 0xFF});  // latch 1, either edge
  ASSERT_TRUE(unit_.captures()[0].read.seen());
  EXPECT_EQ(unit_.captures()[0].reading, LatchReading::kSdo);
  EXPECT_EQ(unit_.captures()[0].position, -2);
}

TEST_F(LatchUnitTest, InputsStandInReverseOrder) {
  Status(0x0000);
  Status(0x8000);  // bit 15: input 1
  Status(0x9000);  // bit 12: input 4
  Status(0x1000);
  EXPECT_EQ(unit_.input(0, 0x8000), true);
  EXPECT_EQ(unit_.input(3, 0x8000), false);
  EXPECT_EQ(unit_.input_changes(0), 2U);
  EXPECT_EQ(unit_.input_changes(1), 0U);
  EXPECT_EQ(unit_.input_changes(3), 1U);
}

TEST_F(LatchUnitTest, TheValidBitOfTheCaptureBeforeIsNotNews) {
  Control(0);
  Status(0);
  Control(0x0001);
  Status(0x0001);
  Control(0x0101);
  Status(0x0101);
  Control(0);
  Control(0x0001);
  Status(0x0001);  // the drive has not taken the old bit back yet
  EXPECT_EQ(sink_.steps, (std::vector<std::string>{"armed", "valid", "read", "disarmed", "rearmed"}));
  Status(0);
  Status(0x0001);
  EXPECT_EQ(sink_.steps.back(), "valid");
}

TEST_F(LatchUnitTest, WhatTheDriveReportsIsNobodysMistake) {
  Transfer(mailbox::SdoService::kUpload, 0x20A4, {0xF0, 0xFF});
  EXPECT_TRUE(sink_.steps.empty());
  EXPECT_EQ(unit_.control(), 0xFFF0);
}

TEST_F(LatchUnitTest, CapturesAreBounded) {
  Control(0);
  Status(0);
  for (int i = 0; i < 100; ++i) {
    Control(0x0001);
    Control(0);
  }
  EXPECT_EQ(unit_.captures().size(), LatchUnit::kMaxCaptures);
  EXPECT_EQ(unit_.captures_left_out(), 100 - LatchUnit::kMaxCaptures);
  EXPECT_EQ(unit_.history(0).armed, 100U);
}

TEST_F(LatchUnitTest, AFamilyWithoutLatchWordsSaysNothing) {
  unit_.SetFamily(*device::BuiltinProfile("generic"));
  Control(0);
  Control(0xFFFF);
  EXPECT_TRUE(sink_.steps.empty());
  EXPECT_FALSE(unit_.seen());
}

// The way through the whole analysis, with the position among the inputs.
TEST(LatchSummary, AMappedPositionIsReadWithTheValidBit) {
  const auto trace = test::Trace::Load(test::SourceDir() + "/tests/rules/latch-value-lost/complies.trace");
  ASSERT_TRUE(trace) << trace.error().message;
  AnalysisOptions options;
  options.default_profile = "kollmorgen-akd-2011";
  const AnalysisResult result = Analyse(*trace->Source(), options);
  ASSERT_EQ(result.slaves.size(), 1U);
  ASSERT_TRUE(result.slaves[0].latch);
  const LatchSummary& latch = *result.slaves[0].latch;
  ASSERT_EQ(latch.captures.size(), 1U);
  EXPECT_EQ(latch.captures[0].edge, "external latch 1 rising");
  EXPECT_EQ(latch.captures[0].read_by, "mapped object");
  EXPECT_EQ(latch.captures[0].position, 4711);
  EXPECT_EQ(latch.captures[0].read.number, latch.captures[0].valid.number);
  EXPECT_EQ(latch.captures[0].valid.time - latch.captures[0].armed.time, 1'030'000)
      << "one cycle of 1 ms and 30 us back";
  EXPECT_FALSE(latch.control_by_sdo);
  ASSERT_EQ(latch.inputs.size(), 4U);
  EXPECT_EQ(latch.misuses, 0U);
}

// The object of latch 1 rising is among the inputs, but the drive fills it when the selector asks for it.
TEST(LatchSummary, TheAcknowledgeTellsWhichPositionAMappedObjectHolds) {
  std::ifstream file(test::SourceDir() + "/tests/rules/latch-value-lost/complies.trace");
  std::string lines{std::istreambuf_iterator<char>(file), {}};
  lines.resize(lines.find("+1ms   LRW"));
  lines +=
      "+1ms LRW 0x10000 00 00 00 00 00 00 00 00 -> 00 00 00 00 00 00 00 00\n"
      "+1ms LRW 0x10000 01 00 00 00 00 00 00 00 -> 01 00 00 00 00 00 00 00\n"
      "+1ms LRW 0x10000 01 00 00 00 00 00 00 00 -> 01 00 01 00 00 00 00 00\n"
      "+1ms LRW 0x10000 01 01 00 00 00 00 00 00 -> 01 01 01 00 00 00 00 00\n"
      "+1ms LRW 0x10000 01 01 00 00 00 00 00 00 -> 01 01 01 01 67 12 00 00\n";
  const auto trace = test::Trace::Parse(lines);
  ASSERT_TRUE(trace) << trace.error().message;
  AnalysisOptions options;
  options.default_profile = "kollmorgen-akd-2011";
  const AnalysisResult result = Analyse(*trace->Source(), options);
  ASSERT_EQ(result.slaves.size(), 1U);
  ASSERT_TRUE(result.slaves[0].latch);
  ASSERT_EQ(result.slaves[0].latch->captures.size(), 1U);
  EXPECT_EQ(result.slaves[0].latch->captures[0].position, 0x1267);
}

// Its truth file has the positions that the emulated drive supplied. 1B20h holds one latch position there, 20A6h, which
// the manuals of the AKD give to no edge: the drive supplies in it what the selector asks for.
TEST(LatchSummary, ASelectorSuppliesThePositionBesideItsAcknowledge) {
  auto reader = capture::OpenCapture(test::SharedDir() + "/captures/lab/latch.pcapng");
  if (!reader) GTEST_SKIP() << reader.error().message;
  const AnalysisResult result = Analyse(**reader, AnalysisOptions{});
  ASSERT_EQ(result.slaves.size(), 1U);
  ASSERT_TRUE(result.slaves[0].latch);
  std::vector<std::int64_t> positions;
  for (const LatchCaptureSummary& capture : result.slaves[0].latch->captures) {
    if (capture.read_by == "selector") positions.push_back(capture.position.value_or(-1));
  }
  const std::vector<std::int64_t> supplied = {1'029'900, 1'069'900, 1'119'900, 1'169'900,
                                              1'239'900, 1'369'900, 1'374'900};
  EXPECT_EQ(positions, supplied);
}

}  // namespace
}  // namespace ecaudit::model
