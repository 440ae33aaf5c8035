// The slave's application and the scripted master playing together: mailbox, AL, clocks, drive, cyclic task.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "samples/builder/devices.h"
#include "samples/builder/scripted_master.h"

namespace ecaudit::samples {
namespace {

using ::testing::ElementsAre;
using ::testing::ElementsAreArray;

constexpr TimeNs kStart = 1'772'442'000'000'000'000;

class MasterTest : public ::testing::Test {
 protected:
  SimulatedSlave& Add(SlaveDescription description = AkdDrive()) { return bus_.Add(std::move(description)); }
  void ToOp(CyclicTask task = {}) {
    master_.Scan();
    master_.BringToPreop();
    master_.BringToSafeop();
    master_.BringToOp(std::move(task));
  }

  SimulatedBus bus_{kStart};
  Recorder recorder_;
  ScriptedMaster master_{bus_, recorder_, kStart + 500 * kMs};
};

// ---------------------------------------------------------------------------------------------- mailbox

class SdoTest : public MasterTest {
 protected:
  SdoTest() {
    SlaveDescription akd = AkdDrive();
    akd.coe.complete_access = true;
    akd.objects.Add(0x2FFF, 0, {.type = 9, .value = Bytes(300, 0x55), .writable = true, .any_size = true});
    akd.objects.Add(0x2FFE, 0, {.type = 5, .value = {1}, .readable = false, .writable = true});
    slave_ = &Add(std::move(akd));
    master_.Scan();
    master_.BringToPreop();
  }

  SimulatedSlave* slave_;
};

TEST_F(SdoTest, ExpeditedUploadOfEverySize) {
  EXPECT_THAT(master_.Upload(0, 0x1018, 1).data, ElementsAre(0x6A, 0, 0, 0));
  EXPECT_THAT(master_.Upload(0, 0x1C12, 1).data, ElementsAre(0x01, 0x17));
  EXPECT_THAT(master_.Upload(0, 0x1018, 0).data, ElementsAre(4));
}

TEST_F(SdoTest, NormalAndSegmentedUpload) {
  const std::string version = "M_01-03-00-012 simulated by ecaudit";
  EXPECT_THAT(master_.Upload(0, 0x100A, 0).data, ElementsAreArray(Bytes(version.begin(), version.end())));
  // 300 bytes: 112 with the first answer, then segments of 119 and 69.
  const std::size_t before = recorder_.written();
  EXPECT_THAT(master_.Upload(0, 0x2FFF, 0).data, ElementsAreArray(Bytes(300, 0x55)));
  EXPECT_GT(recorder_.written(), before);
}

TEST_F(SdoTest, DownloadsOfEveryKind) {
  EXPECT_TRUE(master_.Download(0, 0x60C2, 1, {2}).done);
  EXPECT_EQ(slave_->objects().Number<std::uint8_t>(0x60C2, 1), 2);
  for (const std::size_t size : {5U, 112U, 113U, 112U + 119U, 500U}) {
    Bytes data(size);
    for (std::size_t i = 0; i < size; ++i) data[i] = static_cast<std::uint8_t>(i);
    EXPECT_TRUE(master_.Download(0, 0x2FFF, 0, data).done) << size;
    EXPECT_EQ(slave_->objects().Find(0x2FFF, 0)->value, data) << size;
    EXPECT_EQ(master_.Upload(0, 0x2FFF, 0).data, data) << size;
  }
}

TEST_F(SdoTest, CompleteAccess) {
  const SdoAnswer identity = master_.Upload(0, 0x1018, 0, true);
  ASSERT_EQ(identity.data.size(), 2U + 4 * 4) << "subindex 0 takes 16 bits";
  EXPECT_THAT(Bytes(identity.data.begin(), identity.data.begin() + 6), ElementsAre(4, 0, 0x6A, 0, 0, 0));
  EXPECT_TRUE(master_.Download(0, 0x1C12, 0, {1, 0, 0x20, 0x17}, true).done);
  EXPECT_EQ(slave_->objects().Number<std::uint8_t>(0x1C12, 0), 1);
  EXPECT_EQ(slave_->objects().Number<std::uint16_t>(0x1C12, 1), 0x1720);
}

TEST_F(SdoTest, AbortCodes) {
  EXPECT_EQ(master_.Upload(0, 0x5555, 0).abort_code, 0x06020000U);
  EXPECT_EQ(master_.Upload(0, 0x1018, 9).abort_code, 0x06090011U);
  EXPECT_EQ(master_.Upload(0, 0x2FFE, 0).abort_code, 0x06010001U);
  EXPECT_EQ(master_.Download(0, 0x1018, 1, {0, 0, 0, 0}).abort_code, 0x06010002U);
  EXPECT_EQ(master_.Download(0, 0x60C2, 1, {0, 0}).abort_code, 0x06070012U);
  EXPECT_EQ(master_.Download(0, 0x6040, 0, {0}).abort_code, 0x06070013U);
}

TEST_F(SdoTest, AssignmentsChangeInPreopAndInOrder) {
  EXPECT_EQ(master_.Download(0, 0x1C12, 1, {0x20, 0x17}).abort_code, 0x06010003U) << "subindex 0 is not 0";
  EXPECT_TRUE(master_.Download(0, 0x1C12, 0, {0}).done);
  EXPECT_TRUE(master_.Download(0, 0x1C12, 1, {0x20, 0x17}).done);
  EXPECT_TRUE(master_.Download(0, 0x1C12, 0, {1}).done);
  EXPECT_EQ(slave_->ProcessDataBytes(0x1C12), 12) << "1720h: 2 + 4 + 2 + 2 + 2 bytes";
  EXPECT_EQ(slave_->ProcessDataBytes(0x1C13), 6) << "1B01h: 4 + 2 bytes";
  master_.BringToSafeop();
  EXPECT_EQ(master_.Download(0, 0x1C12, 0, {0}).abort_code, 0x08000022U);
}

TEST_F(SdoTest, EmergenciesComeBetweenRequestAndResponse) {
  slave_->coe().QueueEmergency(master_.now(), 0x7305, 0x81, {1, 2, 3});
  FrameIds frame;
  EXPECT_TRUE(master_.Upload(0, 0x1018, 1).done);
  slave_->coe().QueueEmergency(master_.now(), 0x7305, 0x81, {1, 2, 3});
  const std::optional<Bytes> mail = master_.ReadMailbox(0, 100 * kMs, &frame);
  ASSERT_TRUE(mail);
  EXPECT_EQ((*mail)[0], 10);
  EXPECT_THAT(Bytes(mail->begin() + 6, mail->begin() + 16), ElementsAre(0x00, 0x10, 0x05, 0x73, 0x81, 1, 2, 3, 0, 0));
}

TEST_F(SdoTest, OtherProtocolsGetAnErrorReply) {
  EXPECT_EQ(master_.WriteMailbox(0, 4, {1, 0, 0, 0, 0, 0}).wkc, 1);
  const std::optional<Bytes> mail = master_.ReadMailbox(0, 100 * kMs);
  ASSERT_TRUE(mail);
  EXPECT_EQ((*mail)[5] & 0x0F, 0) << "type error";
  EXPECT_THAT(Bytes(mail->begin() + 6, mail->begin() + 10), ElementsAre(1, 0, 2, 0)) << "unsupported protocol";
}

TEST_F(SdoTest, AnswersCountOneToSeven) {
  std::vector<int> counters;
  for (int i = 0; i < 9; ++i) {
    Bytes request{0x00, 0x20, 0x40, 0x18, 0x10, 0x01, 0, 0, 0, 0};
    master_.WriteMailbox(0, 3, request);
    const std::optional<Bytes> mail = master_.ReadMailbox(0, 100 * kMs);
    ASSERT_TRUE(mail);
    counters.push_back((*mail)[5] >> 4);
  }
  EXPECT_THAT(counters, ElementsAre(1, 2, 3, 4, 5, 6, 7, 1, 2));
}

TEST_F(SdoTest, ALostAnswerIsRepeatedOnRequest) {
  master_.WriteMailbox(0, 3, {0x00, 0x20, 0x40, 0x18, 0x10, 0x01, 0, 0, 0, 0});
  const std::optional<Bytes> first = master_.ReadMailbox(0, 100 * kMs);
  ASSERT_TRUE(first);
  master_.Fpwr(0x1001, 0x080E, {0x03});  // toggles the repeat bit of SM1
  master_.Wait(kMs);
  EXPECT_EQ(master_.Fprd(0x1001, 0x080F, 1).data[0] & 0x02, 0x02);
  const std::optional<Bytes> again = master_.ReadMailbox(0, 100 * kMs);
  ASSERT_TRUE(again);
  EXPECT_EQ(*again, *first) << "the same counter too";
}

TEST_F(SdoTest, ASilentServerAndAFullMailbox) {
  slave_->coe().behaviour().reads_requests = false;
  EXPECT_EQ(master_.WriteMailbox(0, 3, {0x00, 0x20, 0x40, 0x18, 0x10, 0x01, 0, 0, 0, 0}).wkc, 1);
  EXPECT_FALSE(master_.ReadMailbox(0, 20 * kMs));
  EXPECT_EQ(master_.WriteMailbox(0, 3, {0x00, 0x20, 0x40, 0x18, 0x10, 0x01, 0, 0, 0, 0}).wkc, 0);
}

// ---------------------------------------------------------------------------------------------- AL and cyclic task

TEST_F(MasterTest, TheWatchdogEndsOpWithoutProcessData) {
  Add();
  ToOp();
  EXPECT_EQ(bus_.slave(0).state(), 8);
  master_.StopCyclic();
  master_.Wait(99 * kMs);
  EXPECT_EQ(master_.Poll(0, 8, 0).status, 0x0008);
  master_.Wait(3 * kMs);
  const AlAnswer fallen = master_.Poll(0, 8, 0);
  EXPECT_EQ(fallen.status, 0x0014);
  EXPECT_EQ(fallen.code, 0x001B);
}

TEST_F(MasterTest, ProcessDataOfThreeDrivesCountNine) {
  for (int i = 0; i < 3; ++i) Add();
  ToOp();
  master_.Cycles(3);
  EXPECT_EQ(master_.last_cyclic_wkc(), 9);
  bus_.BreakBehind(2);
  master_.Cycles(1);
  EXPECT_EQ(master_.last_cyclic_wkc(), 6);
}

TEST_F(MasterTest, ChangedCyclesMoveStayAwayOrGetLost) {
  Add();
  ToOp({.cycle = 2 * kMs});
  master_.Cycles(1);
  const int base = master_.next_cycle();
  const TimeNs before = master_.now();
  master_.ChangeCycle(base, {.shift = 500'000});
  master_.ChangeCycle(base + 1, {.skip = true});
  master_.ChangeCycle(base + 2, {.lose = true});
  std::size_t packets = recorder_.written();
  master_.Cycles(1);
  EXPECT_NEAR(static_cast<double>(master_.now() - before), 2'500'000, 10'000);
  EXPECT_EQ(recorder_.written(), packets += 2);
  master_.Cycles(1);
  EXPECT_EQ(recorder_.written(), packets) << "skipped";
  master_.Cycles(1);
  EXPECT_EQ(recorder_.written(), packets + 1) << "the returned copy is lost";
}

// ---------------------------------------------------------------------------------------------- drive

TEST_F(MasterTest, TheDriveFollowsTheControlWord) {
  SimulatedSlave& drive = Add();
  ToOp();
  const auto status = [&](std::uint16_t control, int cycles = 6) {
    Bytes outputs = LeBytes(std::int32_t{0});
    AppendLe(outputs, control);
    master_.SetOutputs(0, outputs);
    master_.Cycles(cycles);
    return LoadLe<std::uint16_t>(master_.inputs(0), 4) & 0x6F;
  };
  EXPECT_EQ(status(0x00), 0x40) << "switch on disabled";
  EXPECT_EQ(status(0x0F), 0x40) << "shutdown must come first";
  EXPECT_EQ(status(0x06), 0x21);
  EXPECT_EQ(status(0x07), 0x23);
  EXPECT_EQ(status(0x0F), 0x27);
  EXPECT_EQ(status(0x02), 0x07) << "quick stop";
  EXPECT_EQ(status(0x0F), 0x27) << "transition 16";
  drive.drive().FaultAt(master_.now());
  EXPECT_EQ(status(0x0F, 3) & 0x4F, 0x0F) << "fault reaction";
  EXPECT_EQ(status(0x0F) & 0x4F, 0x08) << "fault";
  EXPECT_EQ(status(0x80), 0x40) << "reset";
}

TEST_F(MasterTest, LatchesCaptureTheFirstEdgeAfterArming) {
  SlaveDescription akd = AkdDrive();
  akd.objects.Set(0x1C12, 1, std::uint16_t{0x1720});
  akd.objects.Set(0x1C13, 1, std::uint16_t{0x1B20});
  SimulatedSlave& drive = Add(std::move(akd));
  ToOp();
  // 1720h: control word, position, latch control word, ...; 1B20h: the latch status word is at byte 28.
  const auto latch = [&](std::uint16_t control) {
    Bytes outputs(12, 0);
    StoreLe(outputs, 6, control);
    master_.SetOutputs(0, outputs);
    master_.Cycles(3);
    return LoadLe<std::uint16_t>(master_.inputs(0), 28) & 0x0FFF;
  };
  EXPECT_EQ(latch(0x0001), 0x0000);
  drive.drive().LatchEdgeAt(master_.now(), 0, 1234);
  EXPECT_EQ(latch(0x0001), 0x0001);
  EXPECT_EQ(LoadLe<std::int32_t>(master_.inputs(0), 20), 1234);
  drive.drive().LatchEdgeAt(master_.now(), 0, 9999);
  EXPECT_EQ(latch(0x0101), 0x0101) << "the value is supplied";
  EXPECT_EQ(LoadLe<std::int32_t>(master_.inputs(0), 20), 1234) << "a second edge does not count";
  EXPECT_EQ(latch(0x0201), 0x0001) << "nothing was captured at the falling edge";
  EXPECT_EQ(latch(0x0000), 0x0000);
}

// ---------------------------------------------------------------------------------------------- clocks

TEST_F(MasterTest, ClocksAgreeAfterSetUpAndWhileTimeIsDistributed) {
  const std::int64_t deviations[] = {0, 20'000, -35'000};  // parts in 10^9
  for (const std::int64_t ppb : deviations) {
    SlaveDescription akd = AkdDrive();
    akd.esc.clock_ppb = ppb;
    akd.esc.clock_at_power_on = static_cast<std::uint64_t>(1'000'000'000 + ppb);
    Add(std::move(akd));
  }
  master_.Scan();
  master_.BringToPreop();
  master_.SetUpClocks();
  const auto spread = [&] {
    std::uint32_t worst = 0;
    for (std::uint16_t i = 0; i < 3; ++i) {
      worst = std::max(
          worst,
          LoadLe<std::uint32_t>(master_.Fprd(static_cast<std::uint16_t>(0x1001 + i), 0x092C, 4).data, 0) & 0x7FFFFFFFU);
    }
    return worst;
  };
  EXPECT_LT(spread(), 100U);
  master_.BringToSafeop();
  master_.BringToOp({.distributes_time = true});
  master_.Cycles(200);
  EXPECT_LT(spread(), 1'000U) << "20 and 35 ppm are 20 and 35 ns in each cycle";
  EXPECT_GT(spread(), 0U);
}

TEST_F(MasterTest, Sync0StartsInTheFutureAtWholeCycles) {
  Add();
  master_.Scan();
  master_.BringToPreop();
  master_.SetUpClocks();
  master_.StartSync0(0, 1'000'000);
  Esc& esc = bus_.slave(0).esc();
  EXPECT_EQ(esc.Byte(0x0981), 3);
  Bytes cycle;
  for (std::uint16_t i = 0; i < 4; ++i) cycle.push_back(esc.Byte(static_cast<std::uint16_t>(0x09A0 + i)));
  EXPECT_EQ(LoadLe<std::uint32_t>(cycle, 0), 1'000'000U);
}

TEST_F(MasterTest, TerminalsWithoutMailboxGoToOpToo) {
  Add();
  Add(InputTerminal());
  ToOp();
  master_.Cycles(2);
  EXPECT_EQ(bus_.slave(1).state(), 8);
  EXPECT_EQ(master_.last_cyclic_wkc(), 4);
}

TEST_F(MasterTest, ALostFrameIsSentAgainWithTheSameIndex) {
  Add();
  const std::size_t before = recorder_.written();
  master_.LoseNext(1);
  EXPECT_EQ(master_.Brd(0x0130, 2).wkc, 1);
  ASSERT_EQ(recorder_.written(), before + 3);
  EXPECT_EQ(recorder_.bytes(before), recorder_.bytes(before + 1));
}

}  // namespace
}  // namespace ecaudit::samples
