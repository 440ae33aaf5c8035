// Bus semantics of the simulated slaves, from esc-reference chapters 2, 4, 5 and 6.
#include "samples/builder/esc.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "samples/builder/devices.h"
#include "samples/builder/simulated_bus.h"

namespace ecaudit::samples {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;

/// Three drives with the addresses 0x1001 to 0x1003.
class EscTest : public ::testing::Test {
 protected:
  EscTest() : bus_(0) {
    for (int i = 0; i < 3; ++i) bus_.Add(AkdDrive());
    for (std::uint16_t i = 0; i < 3; ++i) {
      bus_.slave(i).esc().SetWord(reg::kStationAddress, static_cast<std::uint16_t>(0x1001 + i));
    }
  }

  Datagram Send(Cmd command, std::uint16_t adp, std::uint16_t ado, Bytes data, std::uint16_t wkc = 0) {
    Datagram d;
    d.command = command;
    d.adp = adp;
    d.ado = ado;
    d.data = std::move(data);
    d.wkc = wkc;
    return SendOne(d);
  }
  Datagram SendLogical(Cmd command, std::uint32_t logical, Bytes data) {
    Datagram d;
    d.command = command;
    d.set_logical(logical);
    d.data = std::move(data);
    return SendOne(d);
  }
  Datagram SendOne(const Datagram& d) {
    EtherCatFrame frame;
    frame.datagrams = {d};
    now_ += kMs;
    return bus_.Pass(frame, now_).frame.datagrams.front();
  }
  Esc& esc(std::size_t i) { return bus_.slave(i).esc(); }
  void SetSyncManager(std::size_t slave, int number, std::uint16_t start, std::uint16_t length, std::uint8_t control) {
    Bytes settings = LeBytes(start);
    AppendLe(settings, length);
    settings.insert(settings.end(), {control, 0, 1, 0});
    Send(Cmd::FPWR, static_cast<std::uint16_t>(0x1001 + slave), static_cast<std::uint16_t>(0x0800 + 8 * number),
         settings);
  }
  void SetFmmu(std::size_t slave, int number, std::uint32_t logical, std::uint16_t length, std::uint8_t start_bit,
               std::uint8_t stop_bit, std::uint16_t physical, std::uint8_t physical_bit, std::uint8_t type) {
    Bytes settings = LeBytes(logical);
    AppendLe(settings, length);
    settings.insert(settings.end(), {start_bit, stop_bit});
    AppendLe(settings, physical);
    settings.insert(settings.end(), {physical_bit, type, 1, 0, 0, 0});
    Send(Cmd::FPWR, static_cast<std::uint16_t>(0x1001 + slave), static_cast<std::uint16_t>(0x0600 + 16 * number),
         settings);
  }

  SimulatedBus bus_;
  TimeNs now_ = 0;
};

// --- 2.1: working counter and address counter of each command

TEST_F(EscTest, ReadAndWriteByStationAddress) {
  EXPECT_EQ(Send(Cmd::FPWR, 0x1002, 0x0F80, {0xAA, 0xBB}).wkc, 1);
  const Datagram read = Send(Cmd::FPRD, 0x1002, 0x0F80, {0, 0});
  EXPECT_EQ(read.wkc, 1);
  EXPECT_EQ(read.adp, 0x1002) << "station addresses are not counted up";
  EXPECT_THAT(read.data, ElementsAre(0xAA, 0xBB));
  EXPECT_EQ(Send(Cmd::FPRD, 0x1009, 0x0F80, {0, 0}).wkc, 0) << "nobody has this address";
}

TEST_F(EscTest, ReadWriteExchangesAndCountsThree) {
  Send(Cmd::FPWR, 0x1002, 0x0F80, {0x11});
  const Datagram exchanged = Send(Cmd::FPRW, 0x1002, 0x0F80, {0x22});
  EXPECT_EQ(exchanged.wkc, 3) << "read +1, write +2";
  EXPECT_THAT(exchanged.data, ElementsAre(0x11));
  EXPECT_EQ(esc(1).Byte(0x0F80), 0x22);
  EXPECT_EQ(Send(Cmd::APRW, 0xFFFF, 0x0F80, {0x33}).wkc, 3);
  EXPECT_EQ(esc(1).Byte(0x0F80), 0x33);
}

TEST_F(EscTest, PositionsCountTowardsZero) {
  const Datagram first = Send(Cmd::APRD, 0x0000, 0x0010, {0, 0});
  EXPECT_THAT(first.data, ElementsAre(0x01, 0x10));
  EXPECT_EQ(first.adp, 3);
  const Datagram third = Send(Cmd::APRD, 0xFFFE, 0x0010, {0, 0});
  EXPECT_THAT(third.data, ElementsAre(0x03, 0x10));
  EXPECT_EQ(third.wkc, 1);
  EXPECT_EQ(third.adp, 1);
  const Datagram beyond = Send(Cmd::APRD, 0xFFFD, 0x0010, {0, 0});
  EXPECT_EQ(beyond.wkc, 0);
  EXPECT_EQ(beyond.adp, 0) << "counted although nobody was meant";
}

TEST_F(EscTest, BroadcastReadIsTheOrOfAllAndOfWhatWasSent) {
  for (std::size_t i = 0; i < 3; ++i) esc(i).SetByte(0x0F80, static_cast<std::uint8_t>(1U << i));
  const Datagram read = Send(Cmd::BRD, 0, 0x0F80, {0x80});
  EXPECT_EQ(read.wkc, 3);
  EXPECT_EQ(read.adp, 3);
  EXPECT_THAT(read.data, ElementsAre(0x87));
}

TEST_F(EscTest, BroadcastWriteReachesAll) {
  const Datagram write = Send(Cmd::BWR, 0, 0x0F80, {0x5A});
  EXPECT_EQ(write.wkc, 3);
  EXPECT_EQ(write.adp, 3);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(esc(i).Byte(0x0F80), 0x5A);
  EXPECT_EQ(Send(Cmd::BRW, 0, 0x0F80, {0x00}).wkc, 9);
}

TEST_F(EscTest, ReadMultipleWriteCountsOneForEach) {
  esc(0).SetByte(0x0F80, 0x77);
  const Datagram frmw = Send(Cmd::FRMW, 0x1001, 0x0F80, {0});
  EXPECT_EQ(frmw.wkc, 3);
  EXPECT_EQ(frmw.adp, 0x1001);
  EXPECT_EQ(esc(2).Byte(0x0F80), 0x77) << "the others store what the first one read";
  const Datagram armw = Send(Cmd::ARMW, 0x0000, 0x0F80, {0});
  EXPECT_EQ(armw.wkc, 3);
  EXPECT_EQ(armw.adp, 3);
}

TEST_F(EscTest, NopDoesNothing) {
  const Datagram nop = Send(Cmd::NOP, 0x1001, 0x0F80, {0x12}, 5);
  EXPECT_EQ(nop.wkc, 5);
  EXPECT_EQ(nop.adp, 0x1001);
  EXPECT_THAT(nop.data, ElementsAre(0x12));
}

TEST_F(EscTest, TheWorkingCounterSentIsAddedTo) {
  EXPECT_EQ(Send(Cmd::BRD, 0, 0x0130, {0, 0}, 10).wkc, 13);
}

TEST_F(EscTest, AliasAnswersOnlyWhenEnabled) {
  esc(1).SetWord(reg::kAlias, 0x2222);
  EXPECT_EQ(Send(Cmd::FPRD, 0x2222, 0x0130, {0, 0}).wkc, 0);
  Send(Cmd::FPWR, 0x1002, 0x0103, {1});
  EXPECT_EQ(Send(Cmd::FPRD, 0x2222, 0x0130, {0, 0}).wkc, 1);
}

TEST_F(EscTest, SlavesMarkTheSourceAddress) {
  EtherCatFrame frame;
  frame.datagrams = {Datagram{.command = Cmd::NOP}};
  EXPECT_EQ(bus_.Pass(frame, kMs).frame.source[0], 0x03);
}

// --- 2.2: when a slave does not count

TEST_F(EscTest, ReadOnlyAndMissingRegistersDoNotCount) {
  EXPECT_EQ(Send(Cmd::FPWR, 0x1001, 0x0130, {4, 0}).wkc, 0) << "AL Status is read-only";
  EXPECT_EQ(Send(Cmd::BWR, 0, 0x092C, {0, 0, 0, 0}).wkc, 0) << "system time difference is read-only";
  EXPECT_EQ(Send(Cmd::FPRD, 0x1001, 0x0014, {0, 0}).wkc, 0) << "reserved";
  EXPECT_EQ(Send(Cmd::FPRD, 0x1001, 0x0630, Bytes(16, 0)).wkc, 0) << "a fourth FMMU; an AKD has three";
  EXPECT_EQ(Send(Cmd::FPRD, 0x1001, 0x0820, Bytes(8, 0)).wkc, 0) << "a fifth sync manager; an AKD has four";
  EXPECT_EQ(Send(Cmd::FPRD, 0x1001, 0x2000, {0}).wkc, 0) << "behind the process RAM of 4 KiB";
}

TEST_F(EscTest, OneByteThatSucceedsIsEnough) {
  EXPECT_EQ(Send(Cmd::BWR, 0, 0x0600, Bytes(256, 0)).wkc, 3) << "three of sixteen FMMUs exist";
  const Datagram wide = Send(Cmd::FPRD, 0x1001, 0x000E, Bytes(4, 0xEE));
  EXPECT_EQ(wide.wkc, 1);
  EXPECT_THAT(wide.data, ElementsAre(0xEE, 0xEE, 0x01, 0x10)) << "reserved bytes keep what was in the frame";
}

TEST_F(EscTest, AlControlRefusesASecondWriteUntilItWasRead) {
  EtherCatFrame frame;
  Datagram write{.command = Cmd::BWR, .ado = 0x0120, .data = {0x11, 0x00}};
  frame.datagrams = {write, write};
  const std::vector<Datagram> back = bus_.Pass(frame, kMs).frame.datagrams;
  EXPECT_EQ(back[0].wkc, 3);
  EXPECT_EQ(back[1].wkc, 0);
}

// --- 4.9, 6.2, 6.3: sync managers

TEST_F(EscTest, SettingsOfAnEnabledSyncManagerAreKept) {
  SetSyncManager(0, 0, 0x1800, 128, 0x26);
  Bytes other = LeBytes(std::uint16_t{0x1900});
  AppendLe(other, std::uint16_t{64});
  other.insert(other.end(), {0x26, 0, 0, 0});
  EXPECT_EQ(Send(Cmd::FPWR, 0x1001, 0x0800, other).wkc, 1);
  EXPECT_EQ(esc(0).sync_manager(0).start, 0x1800) << "only the activate byte took effect";
  EXPECT_FALSE(esc(0).sync_manager(0).enabled);
  EXPECT_EQ(Send(Cmd::FPWR, 0x1001, 0x0800, other).wkc, 1);
  EXPECT_EQ(esc(0).sync_manager(0).start, 0x1900);
}

TEST_F(EscTest, AMailboxWritesOnceUntilRead) {
  SetSyncManager(0, 0, 0x1800, 128, 0x26);
  EXPECT_EQ(Send(Cmd::FPWR, 0x1001, 0x1800, Bytes(128, 1)).wkc, 1);
  EXPECT_TRUE(esc(0).mailbox_full(0));
  EXPECT_EQ(Send(Cmd::FPRD, 0x1001, 0x0805, {0}).data[0] & 0x08, 0x08);
  EXPECT_EQ(Send(Cmd::FPWR, 0x1001, 0x1800, Bytes(128, 2)).wkc, 0) << "full";
  EXPECT_THAT(esc(0).TakeMailbox(0), Each(1));
  EXPECT_EQ(Send(Cmd::FPWR, 0x1001, 0x1800, Bytes(128, 3)).wkc, 1);
  EXPECT_EQ(Send(Cmd::FPRD, 0x1001, 0x1800, Bytes(128, 0)).wkc, 0) << "the wrong direction";
}

TEST_F(EscTest, AMailboxIsReadOnce) {
  SetSyncManager(0, 1, 0x1C00, 128, 0x22);
  EXPECT_EQ(Send(Cmd::FPRD, 0x1001, 0x1C00, Bytes(128, 0)).wkc, 0) << "empty";
  EXPECT_TRUE(esc(0).PutMailbox(1, Bytes(20, 7)));
  EXPECT_FALSE(esc(0).PutMailbox(1, Bytes(20, 8))) << "full";
  EXPECT_EQ(Send(Cmd::FPRD, 0x1001, 0x1C00, Bytes(2, 0)).wkc, 1) << "a look at the first bytes";
  EXPECT_TRUE(esc(0).mailbox_full(1)) << "only the last byte empties it";
  EXPECT_EQ(Send(Cmd::FPRD, 0x1001, 0x1C00, Bytes(128, 0)).wkc, 1);
  EXPECT_FALSE(esc(0).mailbox_full(1));
  EXPECT_EQ(Send(Cmd::FPRD, 0x1001, 0x1C00, Bytes(128, 0)).wkc, 0);
}

// As TwinCAT writes: the used part, then one byte at the last address.
TEST_F(EscTest, AMailboxInTwoPieces) {
  SetSyncManager(0, 0, 0x1800, 128, 0x26);
  EXPECT_EQ(Send(Cmd::FPWR, 0x1001, 0x187F, {9}).wkc, 0) << "not opened by its first byte";
  EXPECT_EQ(Send(Cmd::FPWR, 0x1001, 0x1800, Bytes(16, 5)).wkc, 1);
  EXPECT_FALSE(esc(0).mailbox_full(0));
  EXPECT_EQ(Send(Cmd::FPWR, 0x1001, 0x187F, {9}).wkc, 1);
  EXPECT_TRUE(esc(0).mailbox_full(0));
}

TEST_F(EscTest, BufferedInputsCountOnceTheSlaveWroteThem) {
  SetSyncManager(0, 3, 0x1140, 4, 0x20);
  EXPECT_EQ(Send(Cmd::FPRD, 0x1001, 0x1140, Bytes(4, 0)).wkc, 0);
  esc(0).PutInputs(3, Bytes{1, 2, 3, 4});
  EXPECT_THAT(Send(Cmd::FPRD, 0x1001, 0x1140, Bytes(4, 0)).data, ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(Send(Cmd::FPRD, 0x1001, 0x1140, Bytes(4, 0)).wkc, 1) << "may be read again and again";
}

TEST_F(EscTest, ALockedSyncManagerDoesNotCount) {
  SetSyncManager(0, 2, 0x1100, 4, 0x64);
  EXPECT_EQ(Send(Cmd::FPWR, 0x1001, 0x1100, Bytes(4, 1)).wkc, 1);
  esc(0).LockSyncManager(2, true);
  EXPECT_EQ(Send(Cmd::FPWR, 0x1001, 0x1100, Bytes(4, 2)).wkc, 0);
}

// --- 7: FMMUs

TEST_F(EscTest, LogicalReadWriteCountsPerSlaveAndDirection) {
  for (std::size_t i = 0; i < 3; ++i) {
    SetSyncManager(i, 2, 0x1100, 2, 0x64);
    SetSyncManager(i, 3, 0x1140, 2, 0x20);
    const auto offset = static_cast<std::uint32_t>(0x10000 + 4 * i);
    SetFmmu(i, 0, offset, 2, 0, 7, 0x1100, 0, 2);
    SetFmmu(i, 1, offset + 2, 2, 0, 7, 0x1140, 0, 1);
    esc(i).PutInputs(3, Bytes{static_cast<std::uint8_t>(0xA0 + i), 0});
  }
  Bytes sent(12, 0);
  for (std::size_t i = 0; i < 12; ++i) sent[i] = static_cast<std::uint8_t>(i);
  const Datagram all = SendLogical(Cmd::LRW, 0x10000, sent);
  EXPECT_EQ(all.wkc, 9);
  EXPECT_THAT(all.data, ElementsAre(0, 1, 0xA0, 0, 4, 5, 0xA1, 0, 8, 9, 0xA2, 0)) << "outputs come back unchanged";
  EXPECT_THAT(esc(2).outputs(2), ElementsAre(8, 9));
  EXPECT_EQ(SendLogical(Cmd::LRD, 0x10000, Bytes(12, 0)).wkc, 3);
  EXPECT_EQ(SendLogical(Cmd::LWR, 0x10000, Bytes(12, 0)).wkc, 3);
  EXPECT_EQ(SendLogical(Cmd::LRW, 0x10004, Bytes(4, 0)).wkc, 3) << "one slave only";
  EXPECT_EQ(SendLogical(Cmd::LRW, 0x20000, Bytes(4, 0)).wkc, 0);
}

TEST_F(EscTest, TwoFmmusOfOneSlaveCountOnce) {
  SetFmmu(0, 0, 0x0, 1, 0, 7, 0x0F80, 0, 2);
  SetFmmu(0, 1, 0x1, 1, 0, 7, 0x0F90, 0, 2);
  EXPECT_EQ(SendLogical(Cmd::LRW, 0, {1, 2}).wkc, 2);
  EXPECT_EQ(esc(0).Byte(0x0F80), 1);
  EXPECT_EQ(esc(0).Byte(0x0F90), 2);
}

TEST_F(EscTest, BitsOfTwoSlavesShareAByte) {
  SetFmmu(0, 0, 0x100, 1, 0, 2, 0x0F80, 0, 1);
  SetFmmu(1, 0, 0x100, 1, 4, 6, 0x0F80, 1, 1);
  esc(0).SetByte(0x0F80, 0x05);
  esc(1).SetByte(0x0F80, 0x0E);
  const Datagram read = SendLogical(Cmd::LRD, 0x100, {0x88});
  EXPECT_EQ(read.wkc, 2);
  EXPECT_THAT(read.data, ElementsAre(0x88 | 0x05 | 0x70)) << "bits nobody mapped stay";
}

// --- 4.2, 4.5, 4.6

TEST_F(EscTest, DlStatusAndLostLinksOfABrokenLine) {
  EXPECT_EQ(esc(2).Word(reg::kDlStatus), 0x5613) << "end of the line, as captured from real slaves";
  EXPECT_EQ(esc(0).Word(reg::kDlStatus), 0x5A33) << "a slave in the middle";
  bus_.BreakBehind(2);
  EXPECT_EQ(esc(1).Word(reg::kDlStatus), 0x5613);
  EXPECT_EQ(Send(Cmd::BRD, 0, 0x0000, {0}).adp, 2);
  EXPECT_THAT(Send(Cmd::FPRD, 0x1002, 0x0310, Bytes(4, 0)).data, ElementsAre(0, 1, 0, 0));
  bus_.Heal();
  EXPECT_EQ(Send(Cmd::BRD, 0, 0x0000, {0}).wkc, 3);
}

TEST_F(EscTest, AnyWriteClearsAGroupOfErrorCounters) {
  esc(0).CountErrors(0x0302, 3);
  esc(0).CountErrors(0x030C, 4);
  Send(Cmd::FPWR, 0x1001, 0x0300, {0});
  EXPECT_EQ(esc(0).Byte(0x0302), 0);
  EXPECT_EQ(esc(0).Byte(0x030C), 4) << "another group";
}

TEST_F(EscTest, EventFieldShowsMaskedEvents) {
  EXPECT_EQ(Send(Cmd::BRD, 0, 0x0000, {0}).irq, 0) << "nothing is enabled";
  Send(Cmd::BWR, 0, 0x0200, {0x04, 0x00});
  EXPECT_EQ(Send(Cmd::BRD, 0, 0x0000, {0}).irq, 0x0004) << "links came up at power on";
  Send(Cmd::BRD, 0, 0x0110, {0, 0});
  EXPECT_EQ(Send(Cmd::BRD, 0, 0x0000, {0}).irq, 0) << "cleared by reading DL status";
}

TEST_F(EscTest, EepromIsBusyBeforeItAnswers) {
  Bytes command = LeBytes(std::uint16_t{0x0100});
  AppendLe(command, std::uint32_t{0x0A});
  EtherCatFrame frame;
  frame.datagrams = {Datagram{.command = Cmd::FPWR, .adp = 0x1001, .ado = 0x0502, .data = command},
                     Datagram{.command = Cmd::FPRD, .adp = 0x1001, .ado = 0x0502, .data = Bytes(2, 0)}};
  const std::vector<Datagram> back = bus_.Pass(frame, kMs).frame.datagrams;
  EXPECT_EQ(LoadLe<std::uint16_t>(back[1].data, 0) & 0x8000, 0x8000);
  now_ = 5 * kMs;
  EXPECT_EQ(LoadLe<std::uint16_t>(Send(Cmd::FPRD, 0x1001, 0x0502, Bytes(2, 0)).data, 0), 0x0020) << "emulated, ready";
  EXPECT_EQ(LoadLe<std::uint32_t>(Send(Cmd::FPRD, 0x1001, 0x0508, Bytes(4, 0)).data, 0), 0x00414B44U);
}

// --- 5: AL

TEST_F(EscTest, DeviceEmulationEchoesTheAcknowledgeBit) {
  SimulatedBus bus(0);
  bus.Add(InputTerminal());
  EtherCatFrame frame;
  frame.datagrams = {Datagram{.command = Cmd::BWR, .ado = 0x0120, .data = {0x11, 0x00}},
                     Datagram{.command = Cmd::BRD, .ado = 0x0130, .data = {0, 0}}};
  EXPECT_THAT(bus.Pass(frame, kMs).frame.datagrams[1].data, ElementsAre(0x11, 0x00));
}

TEST_F(EscTest, ErrorsAreAcknowledgedOrIgnored) {
  const auto request = [&](std::uint8_t control) {
    Send(Cmd::FPWR, 0x1001, 0x0120, {control, 0});
    now_ += 20 * kMs;
    const Datagram status = Send(Cmd::FPRD, 0x1001, 0x0130, Bytes(6, 0));
    return LoadLe<std::uint16_t>(status.data, 0) | LoadLe<std::uint16_t>(status.data, 4) << 16U;
  };
  EXPECT_EQ(request(0x08), 0x00110011) << "INIT to OP: refused with 0x0011";
  EXPECT_EQ(request(0x02), 0x00110011) << "a request without acknowledge is ignored";
  EXPECT_EQ(request(0x11), 0x00000001) << "acknowledged";
  EXPECT_EQ(request(0x12), 0x00170011) << "no mailbox configured";
  EXPECT_EQ(request(0x01), 0x00000001) << "INIT acknowledges by itself";
}

}  // namespace
}  // namespace ecaudit::samples
