#include "analyzers/model/process_image.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analyzers/model/bus_model.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/pipeline.h"
#include "tests/support/trace_builder.h"

namespace ecaudit::model {
namespace {

using device::PdoDirection;
using test::Bytes;
using test::Trace;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Written by hand after ETG.2000: outputs 6040h (16 bits) and 607Ah (32 bits), inputs 6041h and a gap of 8 bits
/// before 6061h.
constexpr std::string_view kDrive = R"(<EtherCATInfo><Vendor><Id>#x999</Id></Vendor><Descriptions><Devices>
  <Device><Type ProductCode="1" RevisionNo="1">Drive</Type>
    <RxPdo Sm="2"><Index>#x1600</Index>
      <Entry><Index>#x6040</Index><SubIndex>0</SubIndex><BitLen>16</BitLen><Name>Controlword</Name><DataType>UINT</DataType></Entry>
      <Entry><Index>#x607A</Index><SubIndex>0</SubIndex><BitLen>32</BitLen><Name>Target</Name><DataType>DINT</DataType></Entry>
    </RxPdo>
    <TxPdo Sm="3"><Index>#x1A00</Index>
      <Entry><Index>#x6041</Index><SubIndex>0</SubIndex><BitLen>16</BitLen><Name>Statusword</Name><DataType>UINT</DataType></Entry>
      <Entry><Index>0</Index><BitLen>8</BitLen></Entry>
      <Entry><Index>#x6061</Index><SubIndex>0</SubIndex><BitLen>8</BitLen><Name>Mode</Name><DataType>SINT</DataType></Entry>
    </TxPdo></Device></Devices></Descriptions></EtherCATInfo>)";

/// A terminal with four inputs of one bit each.
constexpr std::string_view kInputs = R"(<EtherCATInfo><Vendor><Id>#x999</Id></Vendor><Descriptions><Devices>
  <Device><Type ProductCode="2" RevisionNo="1">Inputs</Type>
    <TxPdo Sm="0"><Index>#x1A00</Index>
      <Entry><Index>#x6000</Index><SubIndex>1</SubIndex><BitLen>1</BitLen><Name>One</Name><DataType>BOOL</DataType></Entry>
      <Entry><Index>#x6000</Index><SubIndex>2</SubIndex><BitLen>1</BitLen><Name>Two</Name><DataType>BOOL</DataType></Entry>
      <Entry><Index>#x6000</Index><SubIndex>3</SubIndex><BitLen>1</BitLen><Name>Three</Name><DataType>BOOL</DataType></Entry>
      <Entry><Index>#x6000</Index><SubIndex>4</SubIndex><BitLen>1</BitLen><Name>Four</Name><DataType>BOOL</DataType></Entry>
    </TxPdo></Device></Devices></Descriptions></EtherCATInfo>)";

struct Seen {
  SlaveId slave = kNoSlave;
  std::string name;
  PdoDirection direction = PdoDirection::kRx;
  Exchange exchange = Exchange::kUnknown;
  FrameNo frame = 0;
  std::vector<std::uint64_t> values;  ///< of all places, when there are data
  std::vector<std::uint8_t> raw;
  std::string reason;
  bool known = false;
  std::uint64_t serial = 0;  ///< of the part
};

class CycleRecorder final : public EventBus {
 public:
  CycleRecorder() { ListenTo<track::LogicalAccess, ProcessDataUnplaced, ProcessCycle>(Stage::kBeforeModel, *this); }
  void On(const track::LogicalAccess&) { placed.push_back(true); }
  void On(const ProcessDataUnplaced&) { placed.back() = false; }
  void On(const ProcessCycle& cycle) {
    Seen s{cycle.part.slave,
           cycle.part.model->name,
           cycle.part.direction,
           cycle.exchange,
           cycle.frame().number,
           {},
           {},
           cycle.part.reason,
           cycle.part.layout->known(),
           cycle.part.serial};
    for (const ImagePart::Place& place : cycle.part.places) {
      if (const auto value = cycle.Value(place)) s.values.push_back(*value);
    }
    cycle.AppendRaw(s.raw);
    seen.push_back(std::move(s));
  }

  std::vector<Seen> seen;
  std::vector<bool> placed;  ///< of each logical access
};

class ProcessImageTest : public ::testing::Test {
 protected:
  void Esi(std::string_view xml) {
    Result<device::EsiFile> file = device::ReadEsi(xml);
    ASSERT_TRUE(file) << file.error().message;
    files->esi.push_back({"esi.xml", std::move(*file), {}});
  }
  void Eni(std::string_view xml) {
    Result<device::EniConfig> config = device::ReadEni(xml);
    ASSERT_TRUE(config) << config.error().message;
    files->eni = {"eni.xml", std::move(*config)};
  }
  /// The slaves of the trace show up in PREOP, each without sync managers and FMMUs.
  void Scan(std::uint16_t slaves) {
    trace.Slaves(slaves);
    trace.After(1000).Brd(0x0130, {2, 0});
    for (std::uint16_t i = 0; i < slaves; ++i) {
      trace.After(1000).Apwr(i, 0x0010, {static_cast<std::uint8_t>(1 + i), 0x10});
      trace.After(1000).Fpwr(static_cast<std::uint16_t>(0x1001 + i), 0x0600, Bytes(256));
    }
  }
  /// Sync manager: start, length, 0x64 outputs, 0x20 inputs.
  void SyncManager(std::uint16_t station, std::size_t n, std::uint16_t start, std::uint8_t length,
                   std::uint8_t control) {
    trace.After(1000).Fpwr(
        station, static_cast<std::uint16_t>(0x0800 + 8 * n),
        {static_cast<std::uint8_t>(start), static_cast<std::uint8_t>(start >> 8U), length, 0, control, 0, 1, 0});
  }
  /// Whole bytes unless bits are given. Type 1 inputs, 2 outputs.
  void Fmmu(std::uint16_t station, std::size_t n, std::uint32_t logical, std::uint8_t length, std::uint16_t physical,
            std::uint8_t type, std::uint8_t start_bit = 0, std::uint8_t stop_bit = 7) {
    trace.After(1000).Fpwr(
        station, static_cast<std::uint16_t>(0x0600 + 16 * n),
        {static_cast<std::uint8_t>(logical), static_cast<std::uint8_t>(logical >> 8U),
         static_cast<std::uint8_t>(logical >> 16U), 0, length, 0, start_bit, stop_bit,
         static_cast<std::uint8_t>(physical), static_cast<std::uint8_t>(physical >> 8U), 0, type, 1, 0, 0, 0});
  }
  /// Outputs 6 bytes at 0x1100, inputs 4 bytes at 0x1140.
  void Drive(std::uint16_t station, std::uint32_t outputs_at, std::uint32_t inputs_at) {
    SyncManager(station, 2, 0x1100, 6, 0x64);
    SyncManager(station, 3, 0x1140, 4, 0x20);
    Fmmu(station, 0, outputs_at, 6, 0x1100, 2);
    Fmmu(station, 1, inputs_at, 4, 0x1140, 1);
  }
  void Run() {
    options.files = files;
    Pipeline pipeline(recorder);
    const BusModel model(pipeline.network(), options, recorder);
    const auto source = trace.Source();
    pipeline.Run(*source, {});
  }
  /// What was seen of one slave and direction.
  std::vector<Seen> Of(SlaveId slave, PdoDirection direction) {
    std::vector<Seen> found;
    for (const Seen& s : recorder.seen) {
      if (s.slave == slave && s.direction == direction) found.push_back(s);
    }
    return found;
  }

  std::shared_ptr<DeviceFiles> files = std::make_shared<DeviceFiles>();
  AnalysisOptions options;
  CycleRecorder recorder;
  Trace trace;
};

TEST(ExtractBitsTest, TakesLittleEndianBitsFromAnywhere) {
  const std::vector<std::uint8_t> data{0x34, 0x12, 0xF0, 0xFF, 1, 2, 3, 4, 5, 6};
  EXPECT_EQ(ExtractBits(data, 0, 16), 0x1234U);
  EXPECT_EQ(ExtractBits(data, 4, 8), 0x23U);
  EXPECT_EQ(ExtractBits(data, 20, 12), 0xFFFU);
  EXPECT_EQ(ExtractBits(data, 8, 64), 0x050403020'1FFF012ULL);
  EXPECT_EQ(ExtractBits(data, 12, 64), 0x6050403020'1FFF01ULL);
  EXPECT_EQ(ExtractBits(data, 17, 64), 0U);  // one bit too far
  EXPECT_EQ(ExtractBits(data, 0, 0), 0U);
}

TEST_F(ProcessImageTest, OutputsComeFromTheCopySentAndInputsFromTheCopyReturned) {
  Esi(kDrive);
  Scan(1);
  Drive(0x1001, 0x10000, 0x10006);
  trace.After(1000)
      .Lrw(0x10000, {0x0F, 0, 0x78, 0x56, 0x34, 0x12, 0, 0, 0, 0}, {0x0F, 0, 0x78, 0x56, 0x34, 0x12, 0x37, 0x12, 9, 8})
      .Wkc(3)
      .Mark("x");
  Run();
  const auto outputs = Of(0, PdoDirection::kRx);
  ASSERT_EQ(outputs.size(), 1U);
  EXPECT_THAT(outputs[0].values, ElementsAre(0x000FU, 0x12345678U));
  EXPECT_EQ(outputs[0].exchange, Exchange::kYes);
  EXPECT_EQ(outputs[0].frame, trace.Returned("x"));
  const auto inputs = Of(0, PdoDirection::kTx);
  ASSERT_EQ(inputs.size(), 1U);
  EXPECT_THAT(inputs[0].values, ElementsAre(0x1237U, 8U));  // the gap holds 9
  EXPECT_THAT(inputs[0].raw, ElementsAre(0x37, 0x12, 9, 8));
}

TEST_F(ProcessImageTest, WhatChangesAtOneSlaveLeavesTheOthersAlone) {
  Esi(kDrive);
  Scan(3);
  Drive(0x1001, 0x10000, 0x10006);
  Drive(0x1002, 0x1000A, 0x10010);
  Drive(0x1003, 0x10014, 0x1001A);
  std::vector<std::uint8_t> sent(40);
  for (std::size_t i = 0; i < sent.size(); ++i) sent[i] = static_cast<std::uint8_t>(i);
  const auto cycle = [&](std::uint8_t wkc) { trace.After(1000).Lrw(0x10000, sent, sent).Wkc(wkc); };
  cycle(9);
  Fmmu(0x1002, 0, 0x1001E, 6, 0x1100, 2);  // its outputs move behind the others'
  cycle(9);
  Fmmu(0x1002, 1, 0x20000, 4, 0x1140, 1);  // its inputs leave the datagram
  cycle(8);
  Fmmu(0x1002, 1, 0x10010, 4, 0x1140, 1);  // and come back
  cycle(9);
  Run();
  const auto outputs = Of(1, PdoDirection::kRx);
  ASSERT_EQ(outputs.size(), 4U);
  EXPECT_THAT(outputs[0].values, ElementsAre(0x0B0AU, 0x0F0E0D0CU));
  EXPECT_THAT(outputs[1].values, ElementsAre(0x1F1EU, 0x23222120U));
  const auto inputs = Of(1, PdoDirection::kTx);
  ASSERT_EQ(inputs.size(), 3U);
  EXPECT_THAT(inputs[2].values, ElementsAre(0x1110U, 0x13U));
  for (const SlaveId other : {SlaveId{0}, SlaveId{2}}) {
    for (const auto direction : {PdoDirection::kRx, PdoDirection::kTx}) {
      const auto seen = Of(other, direction);
      ASSERT_EQ(seen.size(), 4U) << other;
      for (const Seen& s : seen) {
        EXPECT_EQ(s.serial, seen[0].serial) << other;
        EXPECT_EQ(s.values, seen[0].values) << other;
      }
    }
  }
  // One slave after the other, outputs first, as before.
  std::vector<SlaveId> order;
  for (std::size_t i = recorder.seen.size() - 6; i < recorder.seen.size(); ++i) order.push_back(recorder.seen[i].slave);
  EXPECT_THAT(order, ElementsAre(0, 0, 1, 1, 2, 2));
}

TEST_F(ProcessImageTest, OverlappingImageIsReadFromBothCopies) {
  Esi(kDrive);
  Scan(1);
  Drive(0x1001, 0x10000, 0x10000);  // inputs over outputs, as SOEM's overlapping map
  trace.After(1000).Lrw(0x10000, {0x0F, 0, 1, 0, 0, 0}, {0x37, 0x12, 9, 8, 0, 0}).Wkc(3);
  Run();
  EXPECT_THAT(Of(0, PdoDirection::kRx).at(0).values, ElementsAre(0x000FU, 1U));
  EXPECT_THAT(Of(0, PdoDirection::kTx).at(0).values, ElementsAre(0x1237U, 8U));
}

TEST_F(ProcessImageTest, ReturnedCopyAloneShowsOutputsUnlessInputsLieOverThem) {
  Esi(kDrive);
  Scan(2);
  Drive(0x1001, 0x10000, 0x10006);
  Drive(0x1002, 0x20000, 0x20000);
  trace.Direction(test::Copies::kReturned);
  trace.After(1000).Lrw(0x10000, Bytes(10), {0x0F, 0, 1, 0, 0, 0, 0x37, 0x12, 9, 8}).Wkc(3);
  trace.After(1000).Lrw(0x20000, Bytes(6), {0x37, 0x12, 9, 8, 0, 0}).Wkc(3);
  Run();
  EXPECT_THAT(Of(0, PdoDirection::kRx).at(0).values, ElementsAre(0x000FU, 1U));
  EXPECT_THAT(Of(1, PdoDirection::kRx).at(0).values, IsEmpty());
  EXPECT_THAT(Of(1, PdoDirection::kTx).at(0).values, ElementsAre(0x1237U, 8U));
}

TEST_F(ProcessImageTest, WorkingCounterTellsWhoTookPart) {
  Esi(kDrive);
  Scan(1);
  Drive(0x1001, 0x10000, 0x10006);
  for (const std::uint8_t wkc : std::initializer_list<std::uint8_t>{0, 1, 2, 3, 7})
    trace.After(1000).Lrw(0x10000, Bytes(10), Bytes(10)).Wkc(wkc);
  trace.After(1000).Lrw(0x10000, Bytes(10), Bytes(10)).Wkc(3).Circulating();
  trace.After(1000).Lrw(0x10000, Bytes(10), Bytes(10)).Lost();
  Run();
  const auto outputs = Of(0, PdoDirection::kRx);
  const auto inputs = Of(0, PdoDirection::kTx);
  ASSERT_GE(outputs.size(), 6U);
  ASSERT_EQ(inputs.size(), outputs.size());
  const std::array<Exchange, 6> out{Exchange::kNo,  Exchange::kNo,      Exchange::kYes,
                                    Exchange::kYes, Exchange::kUnknown, Exchange::kUnknown};
  const std::array<Exchange, 6> in{Exchange::kNo,  Exchange::kYes,     Exchange::kNo,
                                   Exchange::kYes, Exchange::kUnknown, Exchange::kUnknown};
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(outputs[i].exchange, out[i]) << i;
    EXPECT_EQ(inputs[i].exchange, in[i]) << i;
    EXPECT_EQ(outputs[i].values.size(), 2U) << i;  // what the master wants is known all the same
    EXPECT_EQ(inputs[i].values.empty(), in[i] != Exchange::kYes) << i;
  }
}

TEST_F(ProcessImageTest, AmbiguousCounterIsReadWithTheStatesOfTheSlaves) {
  Esi(kDrive);
  Scan(2);
  Drive(0x1001, 0x10000, 0x1000C);
  Drive(0x1002, 0x10006, 0x10010);
  trace.After(1000).Lrw(0x10000, Bytes(20), Bytes(20)).Wkc(2);  // inputs of both, or outputs of one?
  trace.After(1000).Fprd(0x1001, 0x0130, {4, 0});
  trace.After(1000).Fprd(0x1002, 0x0130, {4, 0});
  trace.After(1000).Lrw(0x10000, Bytes(20), Bytes(20)).Wkc(2);
  trace.After(1000).Lrw(0x10000, Bytes(20), Bytes(20)).Wkc(6);
  Run();
  for (const SlaveId slave : {SlaveId{0}, SlaveId{1}}) {
    const auto inputs = Of(slave, PdoDirection::kTx);
    ASSERT_EQ(inputs.size(), 3U);
    EXPECT_EQ(inputs[0].exchange, Exchange::kUnknown);
    EXPECT_EQ(inputs[1].exchange, Exchange::kInferred);
    EXPECT_EQ(inputs[2].exchange, Exchange::kYes);
    EXPECT_EQ(Of(slave, PdoDirection::kRx)[1].exchange, Exchange::kNo);
  }
}

TEST_F(ProcessImageTest, WhoIsAskedToLeaveNeedNotGiveInputs) {
  Esi(kDrive);
  Scan(3);
  for (std::uint16_t i = 0; i < 3; ++i) {
    Drive(static_cast<std::uint16_t>(0x1001 + i), 0x10000U + 10U * i, 0x10006U + 10U * i);
    trace.After(1000).Fprd(static_cast<std::uint16_t>(0x1001 + i), 0x0130, {4, 0});
  }
  trace.After(1000).Lrw(0x10000, Bytes(30), Bytes(30)).Wkc(3);  // inputs of all: they are in SAFEOP
  for (std::uint16_t i = 0; i < 3; ++i) trace.After(1000).Fprd(static_cast<std::uint16_t>(0x1001 + i), 0x0130, {8, 0});
  trace.After(1000).Lrw(0x10000, Bytes(30), Bytes(30)).Wkc(9);
  trace.After(1000).Lrw(0x10000, Bytes(30), Bytes(30)).Wkc(3);  // one of them, or their watchdogs have ended
  trace.After(1000).Lrw(0x10000, Bytes(30), Bytes(30)).Wkc(7);  // one watchdog has
  trace.After(1000).Bwr(0x0120, {1, 0});
  trace.After(1000).Lrw(0x10000, Bytes(30), Bytes(30)).Wkc(3);
  Run();
  const std::array<Exchange, 5> in{Exchange::kInferred, Exchange::kYes, Exchange::kUnknown, Exchange::kInferred,
                                   Exchange::kUnknown};
  for (const SlaveId slave : {SlaveId{0}, SlaveId{1}, SlaveId{2}}) {
    const auto inputs = Of(slave, PdoDirection::kTx);
    ASSERT_EQ(inputs.size(), 5U);
    for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(inputs[i].exchange, in[i]) << i;
  }
}

TEST_F(ProcessImageTest, BitsOfTwoTerminalsShareAByte) {
  Esi(kInputs);
  Scan(2);
  for (const std::uint16_t station : std::initializer_list<std::uint16_t>{0x1001, 0x1002}) {
    SyncManager(station, 0, 0x1000, 1, 0x00);
    const std::uint8_t first = station == 0x1001 ? 1 : 5;  // the second one crosses into the next byte
    Fmmu(station, 0, 0x10000, static_cast<std::uint8_t>(first == 5 ? 2 : 1), 0x1000, 1, first,
         static_cast<std::uint8_t>(first == 5 ? 0 : 4));
  }
  trace.After(1000).Lrd(0x10000, {0b1010'0110, 0b0000'0001}).Wkc(2);
  Run();
  EXPECT_THAT(Of(0, PdoDirection::kTx).at(0).values, ElementsAre(1U, 1U, 0U, 0U));
  EXPECT_THAT(Of(0, PdoDirection::kTx).at(0).raw, ElementsAre(0b0011));
  EXPECT_THAT(Of(1, PdoDirection::kTx).at(0).values, ElementsAre(1U, 0U, 1U, 1U));
  EXPECT_THAT(Of(1, PdoDirection::kTx).at(0).raw, ElementsAre(0b1101));
}

TEST_F(ProcessImageTest, SeparateReadAndWriteDatagrams) {
  Esi(kDrive);
  Scan(1);
  Drive(0x1001, 0x10000, 0x20000);
  trace.After(1000).Lwr(0x10000, {0x06, 0, 5, 0, 0, 0}).Wkc(1).Lrd(0x20000, {0x31, 2, 0, 8}).Wkc(1);
  Run();
  EXPECT_THAT(Of(0, PdoDirection::kRx).at(0).values, ElementsAre(6U, 5U));
  EXPECT_THAT(Of(0, PdoDirection::kTx).at(0).values, ElementsAre(0x0231U, 8U));
  EXPECT_THAT(recorder.placed, ElementsAre(true, true));
}

TEST_F(ProcessImageTest, MailboxStateAndMailboxesAreNoProcessData) {
  Esi(kDrive);
  Scan(1);
  SyncManager(0x1001, 1, 0x1C00, 128, 0x22);
  Fmmu(0x1001, 2, 0x10000, 1, 0x080D, 1);
  Fmmu(0x1001, 3, 0x10001, 16, 0x1C00, 1);
  trace.After(1000).Lrd(0x10000, Bytes(17)).Wkc(1);
  Run();
  EXPECT_THAT(recorder.seen, IsEmpty());
  EXPECT_THAT(recorder.placed, ElementsAre(false));
}

TEST_F(ProcessImageTest, NewMappingCountsFromTheNextFrameOn) {
  Esi(kDrive);
  Scan(1);
  Drive(0x1001, 0x10000, 0x10006);
  trace.After(1000).Lrd(0x10006, {1, 0, 0, 0, 2, 0, 0, 0}).Wkc(1);
  Fmmu(0x1001, 1, 0x1000A, 4, 0x1140, 1);
  trace.After(1000).Lrd(0x10006, {1, 0, 0, 0, 2, 0, 0, 0}).Wkc(1);
  Run();
  const auto inputs = Of(0, PdoDirection::kTx);
  ASSERT_EQ(inputs.size(), 2U);
  EXPECT_THAT(inputs[0].values, ElementsAre(1U, 0U));
  EXPECT_THAT(inputs[1].values, ElementsAre(2U, 0U));
}

TEST_F(ProcessImageTest, SignalBehindTheDatagramsEndHasNoPlace) {
  Esi(kDrive);
  Scan(1);
  Drive(0x1001, 0x10000, 0x10006);
  trace.After(1000).Lrd(0x10006, {0x37, 0x12, 9}).Wkc(1);  // the last byte travels elsewhere
  Run();
  EXPECT_THAT(Of(0, PdoDirection::kTx).at(0).values, ElementsAre(0x1237U));
  EXPECT_THAT(Of(0, PdoDirection::kTx).at(0).raw, ElementsAre(0x37, 0x12, 9));
}

TEST_F(ProcessImageTest, TwoFmmusCarryOneSignal) {
  Esi(kDrive);
  Scan(1);
  SyncManager(0x1001, 2, 0x1100, 6, 0x64);
  SyncManager(0x1001, 3, 0x1140, 4, 0x20);
  Fmmu(0x1001, 0, 0x10000, 4, 0x1100, 2);
  Fmmu(0x1001, 1, 0x10008, 2, 0x1104, 2);  // the upper half of 607Ah lies elsewhere
  Fmmu(0x1001, 2, 0x20000, 1, 0x1141, 1);  // 6041h with its high byte first
  Fmmu(0x1001, 3, 0x20001, 1, 0x1140, 1);
  trace.After(1000).Lwr(0x10000, {0x0F, 0, 0x78, 0x56, 0xAA, 0xAA, 0xAA, 0xAA, 0x34, 0x12}).Wkc(1);
  trace.After(1000).Lrd(0x20000, {0x12, 0x37}).Wkc(1);
  trace.After(1000).Lrd(0x1FFFF, {0xAA, 0x12, 0x37}).Wkc(1);
  Run();
  EXPECT_THAT(Of(0, PdoDirection::kRx).at(0).values, ElementsAre(0x000FU, 0x12345678U));
  EXPECT_THAT(Of(0, PdoDirection::kRx).at(0).raw, ElementsAre(0x0F, 0, 0x78, 0x56, 0x34, 0x12));
  EXPECT_THAT(Of(0, PdoDirection::kTx).at(0).values, ElementsAre(0x1237U));
  EXPECT_THAT(Of(0, PdoDirection::kTx).at(1).values, ElementsAre(0x1237U));
}

TEST_F(ProcessImageTest, TwoFmmusSideBySideAreOne) {
  Esi(kDrive);
  Scan(1);
  SyncManager(0x1001, 2, 0x1100, 6, 0x64);
  Fmmu(0x1001, 0, 0x10000, 3, 0x1100, 2);
  Fmmu(0x1001, 1, 0x10003, 3, 0x1103, 2);
  trace.After(1000).Lwr(0x10000, {0x0F, 0, 0x78, 0x56, 0x34, 0x12}).Wkc(1);
  Run();
  EXPECT_THAT(Of(0, PdoDirection::kRx).at(0).values, ElementsAre(0x000FU, 0x12345678U));
}

TEST_F(ProcessImageTest, TwoFmmusWithBitsApartCarryOneSignal) {
  Esi(kDrive);
  Scan(1);
  SyncManager(0x1001, 2, 0x1100, 6, 0x64);
  // 28 bits from 0x1100 on, then 20 bits, with 6 bits between them.
  trace.After(1000).Fpwr(0x1001, 0x0600, {0, 0, 1, 0, 4, 0, 0, 3, 0x00, 0x11, 0, 2, 1, 0, 0, 0});
  trace.After(1000).Fpwr(0x1001, 0x0610, {4, 0, 1, 0, 3, 0, 2, 5, 0x03, 0x11, 4, 2, 1, 0, 0, 0});
  // 6040h = 0x000F, 607Ah = 0x12345678: its lower 12 bits 0x678, then its upper 20 bits 0x12345 from bit 34 on.
  trace.After(1000).Lwr(0x10000, {0x0F, 0, 0x78, 0xF6, 0x17, 0x8D, 0x04}).Wkc(1);
  Run();
  EXPECT_THAT(Of(0, PdoDirection::kRx).at(0).values, ElementsAre(0x000FU, 0x12345678U));
}

TEST_F(ProcessImageTest, SignalOfWhichOneFmmuIsMissingHasNoValue) {
  Esi(kDrive);
  Scan(1);
  SyncManager(0x1001, 2, 0x1100, 6, 0x64);
  Fmmu(0x1001, 0, 0x10000, 4, 0x1100, 2);
  trace.After(1000).Lwr(0x10000, {0x0F, 0, 0x78, 0x56, 0, 0, 0, 0}).Wkc(1);
  Run();
  EXPECT_THAT(Of(0, PdoDirection::kRx).at(0).values, ElementsAre(0x000FU));
}

TEST_F(ProcessImageTest, TwoDatagramsOfAFrameCarryOneSignal) {
  Esi(kDrive);
  Scan(1);
  Drive(0x1001, 0x10000, 0x20000);
  trace.After(1000).Lwr(0x10000, {0x0F, 0, 0x78, 0x56}).Wkc(1).Lwr(0x10004, {0x34, 0x12}).Wkc(1);
  trace.After(1000).Lrd(0x20000, {0x37}).Wkc(1).Lrd(0x20001, {0x12, 9, 8}).Wkc(1);
  Run();
  const auto outputs = Of(0, PdoDirection::kRx);
  ASSERT_EQ(outputs.size(), 2U);
  EXPECT_THAT(outputs[0].values, ElementsAre(0x000FU));
  EXPECT_THAT(outputs[1].values, ElementsAre(0x12345678U));
  EXPECT_THAT(outputs[1].raw, ElementsAre(0x34, 0x12));
  const auto inputs = Of(0, PdoDirection::kTx);
  ASSERT_EQ(inputs.size(), 2U);
  EXPECT_THAT(inputs[0].values, IsEmpty());
  EXPECT_EQ(inputs[0].reason, "no entry lies in this datagram as a whole");
  EXPECT_THAT(inputs[1].values, ElementsAre(0x1237U, 8U));
}

TEST_F(ProcessImageTest, HalfASignalIsNoValue) {
  Esi(kDrive);
  Scan(1);
  Drive(0x1001, 0x10000, 0x20000);
  // The slave did not give the first half; the first half is missing; its second half is.
  trace.After(1000).Lrd(0x20000, {0x37}).Wkc(0).Lrd(0x20001, {0x12, 9, 8}).Wkc(1);
  trace.After(1000).Lrd(0x20001, {0x12, 9, 8}).Wkc(1);
  trace.After(1000).Lrd(0x20000, {0x37}).Wkc(1);
  // Half of it was taken.
  trace.After(1000).Lwr(0x10000, {0x0F, 0, 0x78, 0x56}).Wkc(1).Lwr(0x10004, {0x34, 0x12}).Wkc(0);
  Run();
  const auto inputs = Of(0, PdoDirection::kTx);
  ASSERT_EQ(inputs.size(), 4U);
  EXPECT_THAT(inputs[1].values, ElementsAre(8U));
  EXPECT_THAT(inputs[2].values, ElementsAre(8U));
  EXPECT_THAT(inputs[3].values, IsEmpty());
  EXPECT_THAT(Of(0, PdoDirection::kRx).at(1).values, IsEmpty());
}

TEST_F(ProcessImageTest, TwoFramesOfACycleCarryOneSignal) {
  Esi(kDrive);
  Scan(1);
  Drive(0x1001, 0x10000, 0x20000);
  const auto first = [&](std::int64_t us, std::uint8_t low) { trace.After(us).Lrd(0x20000, {low}).Wkc(1).Rtt(5000); };
  const auto second = [&](std::int64_t us, std::uint8_t high) {
    trace.After(us).Lrd(0x20001, {high, 0, 8}).Wkc(1).Rtt(5000);
  };
  first(1000, 0x01);
  second(20, 0x10);  // how long a cycle is does not show yet
  first(980, 0x02);
  second(20, 0x20);
  second(1000, 0x30);  // its first half is lost
  first(980, 0x04);    // its second half is lost
  first(1000, 0x05);
  second(20, 0x50);
  Run();
  std::vector<std::vector<std::uint64_t>> values;
  for (const Seen& s : Of(0, PdoDirection::kTx)) {
    if (!s.values.empty()) values.push_back(s.values);
  }
  EXPECT_THAT(values,
              ElementsAre(ElementsAre(8U), ElementsAre(0x2002U, 8U), ElementsAre(8U), ElementsAre(0x5005U, 8U)));
}

TEST_F(ProcessImageTest, FirstHalfThatFollowsIsOfAnotherCycle) {
  Esi(kDrive);
  Scan(1);
  Drive(0x1001, 0x10000, 0x20000);
  for (int i = 0; i < 3; ++i) {
    trace.After(980).Lrd(0x20001, {0x12, 9, 8}).Wkc(1).Rtt(5000);
    trace.After(20).Lrd(0x20000, {0x37}).Wkc(1).Rtt(5000);
  }
  Run();
  for (const Seen& s : Of(0, PdoDirection::kTx)) {
    EXPECT_LE(s.values.size(), 1U);
  }
}

TEST_F(ProcessImageTest, UnknownMappingStillHasItsBytes) {
  Scan(1);
  Drive(0x1001, 0x10000, 0x10006);
  trace.After(1000).Lrw(0x10000, {1, 2, 3, 4, 5, 6, 0, 0, 0, 0}, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10}).Wkc(3);
  Run();
  const auto outputs = Of(0, PdoDirection::kRx);
  ASSERT_EQ(outputs.size(), 1U);
  EXPECT_FALSE(outputs[0].known);
  EXPECT_THAT(outputs[0].raw, ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(Of(0, PdoDirection::kTx).at(0).raw, ElementsAre(7, 8, 9, 10));
}

TEST_F(ProcessImageTest, WithoutSyncManagersTheFmmusTellWhereTheBufferBegins) {
  Esi(kDrive);
  Scan(1);
  Fmmu(0x1001, 1, 0x10000, 4, 0x1140, 1);
  trace.After(1000).Lrd(0x10000, {0x37, 0x12, 9, 8}).Wkc(1);
  Run();
  EXPECT_THAT(Of(0, PdoDirection::kTx).at(0).values, ElementsAre(0x1237U, 8U));
}

TEST_F(ProcessImageTest, BufferReadAndWrittenByItsAddress) {
  Esi(kDrive);
  Scan(1);
  SyncManager(0x1001, 2, 0x1100, 6, 0x64);
  SyncManager(0x1001, 3, 0x1140, 4, 0x20);
  trace.After(1000).Fpwr(0x1001, 0x1100, {0x0F, 0, 1, 0, 0, 0});
  trace.After(1000).Fprd(0x1001, 0x1140, {0x37, 0x12, 9, 8});
  trace.After(1000).Fprd(0x1001, 0x1140, {0, 0, 0, 0}).Wkc(0);
  Run();
  const auto outputs = Of(0, PdoDirection::kRx);
  ASSERT_EQ(outputs.size(), 1U);
  EXPECT_THAT(outputs[0].values, ElementsAre(0x000FU, 1U));
  EXPECT_EQ(outputs[0].exchange, Exchange::kYes);
  const auto inputs = Of(0, PdoDirection::kTx);
  ASSERT_FALSE(inputs.empty());
  EXPECT_THAT(inputs[0].values, ElementsAre(0x1237U, 8U));
  if (inputs.size() > 1) {
    EXPECT_EQ(inputs[1].exchange, Exchange::kNo);
    EXPECT_THAT(inputs[1].values, IsEmpty());
  }
}

/// After ETG.2100: two drives, the master's image 4 bytes into the datagram's offsets.
constexpr std::string_view kNetwork = R"(<EtherCATConfig><Config>
  <Slave><Info><Name>Axis X</Name><PhysAddr>4097</PhysAddr><AutoIncAddr>0</AutoIncAddr></Info>
    <ProcessData><Send><BitStart>32</BitStart><BitLength>48</BitLength></Send>
      <Recv><BitStart>128</BitStart><BitLength>32</BitLength></Recv>
      <RxPdo Sm="2"><Index>#x1600</Index>
        <Entry><Index>#x6040</Index><SubIndex>0</SubIndex><BitLen>16</BitLen><Name>Controlword</Name></Entry>
        <Entry><Index>#x607A</Index><SubIndex>0</SubIndex><BitLen>32</BitLen><Name>Target</Name></Entry></RxPdo>
      <TxPdo Sm="3"><Index>#x1A00</Index>
        <Entry><Index>#x6041</Index><SubIndex>0</SubIndex><BitLen>16</BitLen><Name>Statusword</Name></Entry></TxPdo>
    </ProcessData></Slave>
  <Slave><Info><Name>Axis Y</Name><PhysAddr>4098</PhysAddr><AutoIncAddr>65535</AutoIncAddr></Info>
    <ProcessData><Send><BitStart>80</BitStart><BitLength>48</BitLength></Send>
      <Recv><BitStart>160</BitStart><BitLength>8</BitLength></Recv>
      <TxPdo Sm="3"><Index>#x1A00</Index>
        <Entry><Index>#x6041</Index><SubIndex>0</SubIndex><BitLen>16</BitLen><Name>Statusword</Name></Entry></TxPdo>
    </ProcessData></Slave>
  <Cyclic><Frame><Cmd><State>OP</State><Cmd>12</Cmd><Addr>65536</Addr><DataLength>17</DataLength><Cnt>6</Cnt>
    <InputOffs>4</InputOffs><OutputOffs>4</OutputOffs></Cmd></Frame></Cyclic>
</Config></EtherCATConfig>)";

TEST_F(ProcessImageTest, EniTellsThePlacesOfSlavesThatWereNeverAddressed) {
  Eni(kNetwork);
  Bytes sent(17);
  sent[0] = 0x0F;
  sent[2] = 7;
  Bytes returned = sent;
  returned[12] = 0x37;
  returned[13] = 0x12;
  trace.Slaves(2);
  trace.After(1000).Lrw(0x10000, sent, returned).Wkc(6);
  trace.After(1000).Lrw(0x10000, sent, returned).Wkc(3);
  trace.After(1000).Lrw(0x20000, sent, returned).Wkc(6);  // no such command in the ENI
  Run();
  EXPECT_THAT(recorder.placed, ElementsAre(true, true, false));
  ASSERT_EQ(recorder.seen.size(), 8U);
  EXPECT_EQ(recorder.seen[0].slave, kNoSlave);
  EXPECT_EQ(recorder.seen[0].name, "Axis X");
  EXPECT_THAT(recorder.seen[0].values, ElementsAre(0x000FU, 7U));
  EXPECT_EQ(recorder.seen[1].direction, PdoDirection::kTx);
  EXPECT_EQ(recorder.seen[1].exchange, Exchange::kInferred);
  EXPECT_THAT(recorder.seen[1].values, ElementsAre(0x1237U));
  // Axis Y: outputs without PDOs, inputs too small for theirs.
  EXPECT_EQ(recorder.seen[2].name, "Axis Y");
  EXPECT_THAT(recorder.seen[2].values, IsEmpty());
  EXPECT_THAT(recorder.seen[3].reason, HasSubstr("the PDOs fill 16 bits, but the ENI's process image has 8"));
  // Half of the slaves counted: which half is not known.
  EXPECT_EQ(recorder.seen[5].exchange, Exchange::kUnknown);
  EXPECT_THAT(recorder.seen[5].values, IsEmpty());
}

TEST_F(ProcessImageTest, FmmusBeatTheEni) {
  Eni(kNetwork);
  Scan(2);
  Drive(0x1001, 0x10000, 0x1000D);  // inputs one byte behind where the ENI says
  Bytes returned(17);
  returned[13] = 0x31;
  trace.After(1000).Lrw(0x10000, Bytes(17), returned).Wkc(3);
  Run();
  const auto inputs = Of(0, PdoDirection::kTx);
  ASSERT_EQ(inputs.size(), 1U);
  EXPECT_THAT(inputs[0].raw, ElementsAre(0x31, 0, 0, 0));
}

}  // namespace
}  // namespace ecaudit::model
