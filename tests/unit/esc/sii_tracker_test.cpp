#include "decoder/track/sii_tracker.h"

#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analyzers/wiring/event_bus.h"
#include "decoder/base/text.h"
#include "decoder/capture/capture_reader.h"
#include "decoder/pipeline.h"
#include "tests/support/folders.h"

namespace ecaudit::track {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using Bytes = std::vector<std::uint8_t>;

/// Events as text: "read 0x0008 0x006a 0x0000 (3 for 1)" names the frames of the data and of the command.
class Log final : public SiiListener {
 public:
  void OnEepromRead(const EepromRead& event) override {
    std::string text = "read " + Hex(event.address);
    for (const std::uint16_t word : event.words) text += " " + Hex(word);
    lines.push_back(text + Frames(event.frame, event.command));
  }
  void OnEepromWrite(const EepromWrite& event) override {
    lines.push_back("write " + Hex(event.address) + " " + (event.word ? Hex(*event.word) : "?") +
                    (event.confirmed ? "" : " unconfirmed") + Frames(event.frame, event.command));
  }
  void OnEepromError(const EepromError& event) override {
    lines.push_back("error " + Hex(event.bits) + (event.address ? " at " + Hex(*event.address) : "") +
                    Frames(event.frame, event.command));
  }
  void OnEepromReload(SlaveId /*slave*/, const FrameRef& command) override {
    lines.push_back("reload (" + std::to_string(command.number) + ")");
  }
  void OnEepromOwner(SlaveId /*slave*/, const FrameRef& frame, bool to_pdi) override {
    lines.push_back(std::string(to_pdi ? "to PDI" : "to ECAT") + " (" + std::to_string(frame.number) + ")");
  }

  std::vector<std::string> lines;

 private:
  static std::string Frames(const FrameRef& frame, const FrameRef& command) {
    return " (" + std::to_string(frame.number) + " for " + std::to_string(command.number) + ")";
  }
};

/// Feeds accesses, each in a frame of its own unless Same() says otherwise.
class SiiAssemblerTest : public testing::Test {
 protected:
  void Write(EscAddress address, const Bytes& bytes, Acceptance acceptance = Acceptance::kAccepted,
             bool broadcast = false) {
    SlaveAccess access = Next(address, acceptance, broadcast);
    access.written = bytes;
    assembler_.OnAccess(access, &log_);
  }
  void Read(EscAddress address, const Bytes& bytes, bool broadcast = false) {
    SlaveAccess access = Next(address, Acceptance::kAccepted, broadcast);
    access.read = bytes;
    assembler_.OnAccess(access, &log_);
  }
  void Same() { same_ = true; }

  SiiAssembler assembler_{3};
  Log log_;

 private:
  SlaveAccess Next(EscAddress address, Acceptance acceptance, bool broadcast) {
    if (!same_) ++frame_;
    same_ = false;
    SlaveAccess access;
    access.slave = 3;
    access.returned.number = frame_;
    access.address = address;
    access.acceptance = acceptance;
    access.broadcast = broadcast;
    return access;
  }
  FrameNo frame_ = 0;
  bool same_ = false;
};

TEST_F(SiiAssemblerTest, CommandPollData) {
  Write(0x0502, {0x00, 0x01, 0x08, 0x00, 0x00, 0x00});
  EXPECT_TRUE(assembler_.busy());
  Read(0x0502, {0x00, 0x81});
  EXPECT_TRUE(assembler_.busy());
  Read(0x0502, {0x00, 0x00});
  EXPECT_FALSE(assembler_.busy());
  Read(0x0508, {0x6A, 0x00, 0x00, 0x00});
  Read(0x0508, {0x6A, 0x00, 0x00, 0x00});  // asked again: the same words
  EXPECT_THAT(log_.lines, ElementsAre("read 0x0008 0x006a 0x0000 (4 for 1)"));
  EXPECT_EQ(assembler_.image().DoubleWord(8), 0x6AU);
}

TEST_F(SiiAssemblerTest, EightBytesOnlyWhenTheStatusReportsIt) {
  Write(0x0502, {0x00, 0x01, 0x10, 0x00, 0x00, 0x00});
  Read(0x0502, {0x40, 0x00});
  Read(0x0508, {1, 0, 2, 0, 3, 0, 4, 0});
  Write(0x0502, {0x00, 0x01, 0x20, 0x00, 0x00, 0x00});
  Read(0x0502, {0x00, 0x00});
  Read(0x0508, {5, 0, 6, 0, 0xEE, 0xEE, 0xEE, 0xEE});  // bytes 4-7 mean nothing
  EXPECT_THAT(log_.lines,
              ElementsAre("read 0x0010 0x0001 0x0002 0x0003 0x0004 (3 for 1)", "read 0x0020 0x0005 0x0006 (6 for 4)"));
  EXPECT_FALSE(assembler_.image().Word(0x22));
}

TEST_F(SiiAssemblerTest, DataFetchedInParts) {
  Write(0x0502, {0x00, 0x01, 0x10, 0x00, 0x00, 0x00});
  Read(0x0502, {0x40, 0x00});
  Read(0x0508, {1, 0, 2, 0});
  Read(0x050C, {3, 0, 4, 0});
  EXPECT_THAT(log_.lines, ElementsAre("read 0x0010 0x0001 0x0002 (3 for 1)", "read 0x0012 0x0003 0x0004 (4 for 1)"));
}

// TwinCAT fetches status, address and data at once (esc-reference 11.2).
TEST_F(SiiAssemblerTest, StatusAddressAndDataInOneRead) {
  Write(0x0502, {0x00, 0x01, 0x0A, 0x00, 0x00, 0x00});
  Read(0x0502, {0x40, 0x81, 0x0A, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF});  // busy
  EXPECT_THAT(log_.lines, IsEmpty());
  Read(0x0502, {0x40, 0x00, 0x0A, 0, 0, 0, 0x44, 0x4B, 0x41, 0x00, 2, 0, 0, 0});
  EXPECT_THAT(log_.lines, ElementsAre("read 0x000a 0x4b44 0x0041 0x0002 0x0000 (3 for 1)"));
}

TEST_F(SiiAssemblerTest, AnAnswerThatNamesItsAddressNeedsNoCommand) {
  Read(0x0502, {0x00, 0x00, 0x0A, 0, 0, 0, 0x44, 0x4B, 0x41, 0x00});
  Read(0x0502, {0x00, 0x00, 0x0A, 0, 0, 0, 0x44, 0x4B, 0x41, 0x00});
  EXPECT_THAT(log_.lines, ElementsAre("read 0x000a 0x4b44 0x0041 (1 for 0)"));
  Read(0x0508, {1, 1, 1, 1});  // this one does not
  EXPECT_EQ(log_.lines.size(), 1U);
}

TEST_F(SiiAssemblerTest, AnotherAddressInTheAnswerIsNotTrusted) {
  Write(0x0502, {0x00, 0x01, 0x0A, 0x00, 0x00, 0x00});
  Read(0x0502, {0x00, 0x00, 0x0C, 0, 0, 0, 0x44, 0x4B, 0x41, 0x00});
  EXPECT_THAT(log_.lines, IsEmpty());
  EXPECT_EQ(assembler_.image().KnownWords(), 0U);
}

TEST_F(SiiAssemblerTest, CommandAndAddressApart) {
  Write(0x0504, {0x18, 0x00, 0x00, 0x00});
  Write(0x0502, {0x00, 0x01});
  Read(0x0502, {0x00, 0x00});
  Read(0x0508, {0x00, 0x18, 0x00, 0x04});
  // IgH writes four bytes: the upper half of the address keeps its value.
  Write(0x0502, {0x00, 0x01, 0x1A, 0x00});
  Read(0x0502, {0x00, 0x00, 0x1A, 0x00, 0x00, 0x00, 0x00, 0x1C, 0x00, 0x04});
  EXPECT_THAT(log_.lines, ElementsAre("read 0x0018 0x1800 0x0400 (4 for 2)", "read 0x001a 0x1c00 0x0400 (6 for 5)"));
}

TEST_F(SiiAssemblerTest, AddressInALaterDatagramOfTheSameFrame) {
  Write(0x0502, {0x00, 0x01});
  Same();
  Write(0x0504, {0x18, 0x00, 0x00, 0x00});
  Read(0x0502, {0x00, 0x00});
  Write(0x0504, {0x55, 0x00, 0x00, 0x00});  // without a command: the data are still those of word 0x18
  Read(0x0508, {0x00, 0x18, 0x00, 0x04});
  EXPECT_THAT(log_.lines, ElementsAre("read 0x0018 0x1800 0x0400 (4 for 1)"));
}

TEST_F(SiiAssemblerTest, DataWithoutAFreshStatusAreDropped) {
  Write(0x0502, {0x00, 0x01, 0x08, 0x00, 0x00, 0x00});
  Read(0x0508, {0x6A, 0x00, 0x00, 0x00});
  Read(0x0502, {0x00, 0x81});
  Read(0x0508, {0x6A, 0x00, 0x00, 0x00});
  EXPECT_THAT(log_.lines, IsEmpty());
}

TEST_F(SiiAssemblerTest, ARefusedCommandChangesNothing) {
  Write(0x0502, {0x00, 0x01, 0x08, 0x00, 0x00, 0x00});
  Write(0x0502, {0x00, 0x01, 0x0A, 0x00, 0x00, 0x00}, Acceptance::kRefused);
  Read(0x0502, {0x00, 0x00});
  Read(0x0508, {0x6A, 0x00, 0x00, 0x00});
  EXPECT_THAT(log_.lines, ElementsAre("read 0x0008 0x006a 0x0000 (4 for 1)"));
}

TEST_F(SiiAssemblerTest, AfterACommandOfUnknownFateDataAreNobodys) {
  Write(0x0502, {0x00, 0x01, 0x08, 0x00, 0x00, 0x00});
  Write(0x0502, {0x00, 0x01, 0x0A, 0x00, 0x00, 0x00}, Acceptance::kUnknown);
  Read(0x0502, {0x00, 0x00});
  Read(0x0508, {0x6A, 0x00, 0x00, 0x00});
  EXPECT_THAT(log_.lines, IsEmpty());
  Write(0x0502, {0x00, 0x01});  // accepted again, but the address is the unknown one
  Read(0x0502, {0x00, 0x00});
  Read(0x0508, {0x6A, 0x00, 0x00, 0x00});
  EXPECT_THAT(log_.lines, IsEmpty());
}

TEST_F(SiiAssemblerTest, BroadcastCommandAndStatus) {
  Write(0x0502, {0x00, 0x01, 0x0A, 0x00, 0x00, 0x00}, Acceptance::kAccepted, true);
  Read(0x0502, {0x40, 0x28}, true);  // bits of any slave: only "no slave is busy" counts
  Read(0x0508, {1, 1, 1, 1}, true);
  EXPECT_THAT(log_.lines, IsEmpty());
  Read(0x0508, {0x44, 0x4B, 0x41, 0x00, 9, 9, 9, 9});
  EXPECT_THAT(log_.lines, ElementsAre("read 0x000a 0x4b44 0x0041 (4 for 1)"));
}

TEST_F(SiiAssemblerTest, WriteIsConfirmedByTheStatus) {
  // Status, address and data in one datagram: 0x0502-0x0509.
  Write(0x0502, {0x01, 0x02, 0x04, 0x00, 0x00, 0x00, 0x34, 0x12});
  Read(0x0502, {0x00, 0x82});
  Read(0x0502, {0x00, 0x00});
  EXPECT_THAT(log_.lines, ElementsAre("write 0x0004 0x1234 (3 for 1)"));
  EXPECT_EQ(assembler_.image().Word(4), 0x1234);
  Read(0x0508, {9, 9, 9, 9});  // no read command
  EXPECT_EQ(log_.lines.size(), 1U);
}

TEST_F(SiiAssemblerTest, WriteWithDataInAnotherDatagram) {
  Write(0x0508, {0x34, 0x12});
  Write(0x0502, {0x01, 0x02, 0x04, 0x00, 0x00, 0x00});
  Read(0x0502, {0x00, 0x00});
  Write(0x0502, {0x01, 0x02, 0x05, 0x00, 0x00, 0x00});
  Same();
  Write(0x0508, {0x78, 0x56});
  Read(0x0502, {0x00, 0x00});
  EXPECT_THAT(log_.lines, ElementsAre("write 0x0004 0x1234 (3 for 2)", "write 0x0005 0x5678 (5 for 4)"));
}

TEST_F(SiiAssemblerTest, WriteWithoutKnownDataOrEnd) {
  Read(0x0502, {0x00, 0x00, 0x04, 0, 0, 0, 0x11, 0x11, 0x22, 0x22});
  log_.lines.clear();
  Write(0x0502, {0x01, 0x02, 0x04, 0x00, 0x00, 0x00});
  Read(0x0502, {0x00, 0x00});
  EXPECT_FALSE(assembler_.image().Word(4));
  Write(0x0502, {0x01, 0x02, 0x05, 0x00, 0x00, 0x00, 0x78, 0x56});
  assembler_.Finish(&log_);
  EXPECT_FALSE(assembler_.image().Word(5));
  EXPECT_THAT(log_.lines, ElementsAre("write 0x0004 ? (3 for 2)", "write 0x0005 0x5678 unconfirmed (0 for 4)"));
  assembler_.Finish(&log_);
  EXPECT_EQ(log_.lines.size(), 2U);
}

TEST_F(SiiAssemblerTest, OutboundOnlyWritesAreTakenAsDone) {
  Write(0x0502, {0x01, 0x02, 0x04, 0x00, 0x00, 0x00, 0x34, 0x12}, Acceptance::kAssumed);
  Write(0x0502, {0x01, 0x02, 0x05, 0x00, 0x00, 0x00, 0x78, 0x56}, Acceptance::kAssumed);
  assembler_.Finish(&log_);
  EXPECT_THAT(log_.lines,
              ElementsAre("write 0x0004 0x1234 unconfirmed (0 for 1)", "write 0x0005 0x5678 unconfirmed (0 for 2)"));
  EXPECT_EQ(assembler_.image().Word(4), 0x1234);
  EXPECT_EQ(assembler_.image().Word(5), 0x5678);
}

TEST_F(SiiAssemblerTest, ErrorsEndTheCommand) {
  Write(0x0502, {0x01, 0x02, 0x04, 0x00, 0x00, 0x00, 0x34, 0x12});
  Read(0x0502, {0x00, 0x20});
  Read(0x0502, {0x00, 0x20});  // still there: reported once
  Write(0x0502, {0x00, 0x01, 0x08, 0x00, 0x00, 0x00});
  Read(0x0502, {0x00, 0x20});
  Read(0x0508, {1, 1, 1, 1});
  EXPECT_THAT(log_.lines, ElementsAre("error 0x2000 at 0x0004 (2 for 1)", "error 0x2000 at 0x0008 (5 for 4)"));
  EXPECT_FALSE(assembler_.image().Word(4));
  EXPECT_FALSE(assembler_.image().Word(8));
}

TEST_F(SiiAssemblerTest, AWrongChecksumDoesNotStopReading) {
  Read(0x0502, {0x00, 0x08});
  Write(0x0502, {0x00, 0x01, 0x08, 0x00, 0x00, 0x00});
  Read(0x0502, {0x00, 0x08});
  Read(0x0508, {0x6A, 0x00, 0x00, 0x00});
  EXPECT_THAT(log_.lines, ElementsAre("error 0x0800 (1 for 0)", "read 0x0008 0x006a 0x0000 (4 for 2)"));
}

TEST_F(SiiAssemblerTest, OwnerAndReload) {
  Write(0x0500, {0x02});
  Write(0x0500, {0x00});
  Write(0x0502, {0x00, 0x04});
  Read(0x0502, {0x00, 0x00});
  Write(0x0502, {0x00, 0x01, 0x08, 0x00, 0x00, 0x00});
  Read(0x0502, {0x00, 0x00});
  Write(0x0500, {0x01});
  EXPECT_EQ(assembler_.owned_by_pdi(), true);
  Read(0x0508, {0x6A, 0x00, 0x00, 0x00});  // may be what the slave's processor read
  Write(0x0500, {0x00, 0x00});
  EXPECT_THAT(log_.lines, ElementsAre("to ECAT (1)", "reload (3)", "to PDI (7)", "to ECAT (9)"));
}

TEST_F(SiiAssemblerTest, ForgetKeepsTheImage) {
  Write(0x0502, {0x00, 0x01, 0x08, 0x00, 0x00, 0x00});
  Read(0x0502, {0x00, 0x00});
  Read(0x0508, {0x6A, 0x00, 0x00, 0x00});
  Write(0x0502, {0x00, 0x01, 0x0A, 0x00, 0x00, 0x00});
  Read(0x0502, {0x00, 0x00});
  assembler_.Forget();
  Read(0x0508, {1, 1, 1, 1});
  EXPECT_EQ(log_.lines.size(), 1U);
  EXPECT_EQ(assembler_.image().DoubleWord(8), 0x6AU);
  EXPECT_FALSE(assembler_.status());
}

TEST_F(SiiAssemblerTest, AddressesAfterTheImageAreReportedButNotKept) {
  Write(0x0502, {0x00, 0x01, 0xFF, 0xFF, 0x00, 0x00});
  Read(0x0502, {0x00, 0x00});
  Read(0x0508, {1, 1, 2, 2});
  Write(0x0502, {0x01, 0x02, 0xFF, 0xFF, 0xFF, 0xFF, 3, 3});
  Read(0x0502, {0x00, 0x00});
  EXPECT_THAT(log_.lines, ElementsAre("read 0xffff 0x0101 0x0202 (3 for 1)", "write 0xffffffff 0x0303 (5 for 4)"));
  EXPECT_EQ(assembler_.image().KnownWords(), 1U);
}

TEST_F(SiiAssemblerTest, AccessesElsewhereAndOddOnes) {
  Write(0x0120, {0x01, 0x00});
  Write(0xFFFF, {0x01, 0x00});   // wraps nowhere
  Read(0x04F0, Bytes(0x11, 0));  // ends at 0x0500
  Read(0x0509, {1, 2});          // no whole word
  Write(0x0502, {0x01});         // write enable alone is no command
  EXPECT_THAT(log_.lines, IsEmpty());
  EXPECT_FALSE(assembler_.busy());
}

// ---- captures

/// The EEPROM of the slave at one position, as the whole decoder sees a capture.
struct Captured final : EventBus {
  explicit Captured(SlavePos at) : position(at) { ListenTo<SlaveAccess>(Stage::kModel, *this); }
  void On(const SlaveAccess& access) {
    const SlavePos* here = pipeline.network().slaves()[access.slave].position.if_known();
    if (here != nullptr && *here == position) assembler.OnAccess(access, &log);
  }

  SlavePos position;
  SiiAssembler assembler;
  Log log;
  Pipeline pipeline{*this};
};

/// Nothing when the capture is not there.
std::unique_ptr<Captured> Replay(const std::string& name, SlavePos position) {
  auto source = capture::OpenCapture(test::SharedDir() + "/captures/" + name);
  if (!source) return nullptr;
  auto captured = std::make_unique<Captured>(position);
  captured->pipeline.Run(**source);
  captured->assembler.Finish(&captured->log);
  return captured;
}

// The identity is in the captures' README; the rest was read out of the frames with a separate script.
TEST(SiiCaptures, RealAkd) {
  const auto akd = Replay("real/soem-sdinfo-akd.pcapng", 0);
  if (!akd) GTEST_SKIP() << "capture not found";
  EXPECT_EQ(akd->assembler.image().KnownWords(), 52U);  // 26 reads of 4 bytes
  const esc::SiiContents contents = ParseSii(akd->assembler.image());
  EXPECT_EQ(contents.header.vendor_id, 0x0000006AU);
  EXPECT_EQ(contents.header.product_code, 0x00414B44U);
  EXPECT_EQ(contents.header.revision, 2U);
  EXPECT_FALSE(contents.header.serial);
  EXPECT_EQ(contents.header.standard_receive, (esc::SiiMailbox{0x1800, 0x400}));
  EXPECT_EQ(contents.header.standard_send, (esc::SiiMailbox{0x1C00, 0x400}));
  EXPECT_EQ(contents.header.protocols, esc::kSiiEoe | esc::kSiiCoe | esc::kSiiFoe);
  EXPECT_EQ(contents.Name(), "AKD");
  ASSERT_TRUE(contents.general);
  EXPECT_EQ(contents.general->coe_details, 0x0D);
  EXPECT_FALSE(contents.general->Coe(esc::kSiiCompleteAccess));
  ASSERT_EQ(contents.sync_managers.size(), 4U);
  EXPECT_EQ(contents.sync_managers[2], (esc::SiiSyncManager{0x1100, 0, 0x24, 0, 1, 3}));
  EXPECT_THAT(contents.fmmus, ElementsAre(esc::SiiFmmuUse::OUTPUTS, esc::SiiFmmuUse::INPUTS,
                                          esc::SiiFmmuUse::MAILBOX_STATE, static_cast<esc::SiiFmmuUse>(0xFF)));
  // First in the chain: the vendor categories that the MKD manual names, contents not read by this master.
  ASSERT_GE(contents.categories.size(), 2U);
  EXPECT_EQ(contents.categories[0].type, 0x0800);
  EXPECT_EQ(contents.categories[1].type, 0x0801);
  EXPECT_EQ(contents.categories[0].coverage, esc::SiiCategory::Coverage::kUnknown);
  EXPECT_THAT(akd->log.lines, testing::Contains(testing::StartsWith("to PDI")));
  EXPECT_THAT(akd->log.lines, testing::Not(testing::Contains(testing::StartsWith("error"))));
}

TEST(SiiCaptures, WholeEepromReadByAutoIncrement) {
  const auto lab = Replay("lab/soem-eepromtool-read.pcapng", 0);
  if (!lab) GTEST_SKIP() << "capture not found";
  EXPECT_EQ(lab->assembler.image().KnownWords(), 1024U);  // 512 reads of 4 bytes, all of 2 KiB
  const esc::SiiContents contents = ParseSii(lab->assembler.image());
  EXPECT_EQ(contents.header.size_bytes, 2048U);
  EXPECT_EQ(contents.header.checksum_state, esc::SiiChecksumState::kRight);
  EXPECT_EQ(contents.header.vendor_id, 0x6AU);
  EXPECT_EQ(contents.header.product_code, 0x00414B44U);
  EXPECT_EQ(contents.header.sync_pulse_10ns, 40000);
  EXPECT_EQ(contents.chain_end, esc::SiiChainEnd::kEndMark);
  EXPECT_EQ(contents.strings.size(), 22U);
  EXPECT_EQ(contents.Name(), "AKD-EMUL");
  ASSERT_EQ(contents.tx_pdos.size(), 2U);
  EXPECT_EQ(contents.tx_pdos[0].index, 0x1B01);
  EXPECT_EQ(contents.tx_pdos[0].sync_manager, 3);
  EXPECT_EQ(contents.tx_pdos[0].Bits(), 48U);
  EXPECT_EQ(contents.tx_pdos[1].index, 0x1B20);
  EXPECT_EQ(contents.tx_pdos[1].sync_manager, 0xFF);
  EXPECT_EQ(contents.tx_pdos[1].entries.size(), 10U);
  ASSERT_EQ(contents.rx_pdos.size(), 2U);
  EXPECT_EQ(contents.rx_pdos[0].index, 0x1701);
  EXPECT_EQ(contents.rx_pdos[1].index, 0x1720);
  ASSERT_EQ(contents.dc_modes.size(), 1U);
  EXPECT_EQ(contents.dc_modes[0].assign_activate, 0x0300);
  EXPECT_TRUE(contents.Complete(esc::SiiCategoryType::RX_PDO));
}

// ethercrab reads 8 bytes at a time where the slave offers them.
TEST(SiiCaptures, TerminalsReadEightBytesAtATime) {
  const auto el2828 = Replay("real/replay-dc.pcapng", 1);
  if (!el2828) GTEST_SKIP() << "capture not found";
  const esc::SiiContents contents = ParseSii(el2828->assembler.image());
  EXPECT_EQ(contents.header.vendor_id, 2U);
  EXPECT_EQ(contents.header.product_code, 0x0B0C3052U);
  EXPECT_EQ(contents.header.protocols, 0);
  ASSERT_EQ(contents.sync_managers.size(), 1U);
  EXPECT_EQ(contents.sync_managers[0], (esc::SiiSyncManager{0x0F00, 1, 0x44, 0, 9, 3}));
  ASSERT_EQ(contents.rx_pdos.size(), 8U);
  EXPECT_EQ(contents.rx_pdos[7].index, 0x1607);
  EXPECT_EQ(contents.rx_pdos[7].Bits(), 1U);
  EXPECT_EQ(contents.general->ebus_current_ma, 110);
}

// KickCAT gives the command to all slaves at once with BWR 0x0502.
TEST(SiiCaptures, BroadcastCommands) {
  const auto drive = Replay("lab/kickcat-ingenia-info.pcapng", 0);
  if (!drive) GTEST_SKIP() << "capture not found";
  EXPECT_GE(drive->assembler.image().KnownWords(), 199U);
  EXPECT_TRUE(ParseSii(drive->assembler.image()).header.vendor_id);
}

}  // namespace
}  // namespace ecaudit::track
