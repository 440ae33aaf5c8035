/// Trackers of EoE, FoE, SoE and SDO information, fed with messages.
#include <gtest/gtest.h>

#include "decoder/mailbox/eoe.h"
#include "decoder/mailbox/foe.h"
#include "decoder/mailbox/sdo_info.h"
#include "decoder/mailbox/soe_reassembler.h"
#include "tests/unit/mailbox/mailbox_test_support.h"

namespace ecaudit::mailbox {
namespace {

class Feed {
 public:
  MailboxMessage Next(Direction direction, Protocol protocol, Bytes payload) {
    payload_ = std::move(payload);
    MailboxMessage message = CoeMessage(direction, ++frame_, payload_);
    message.header.protocol = protocol;
    return message;
  }
  FrameNo frame_ = 0;

 private:
  Bytes payload_;
};

// --- EoE -------------------------------------------------------------------------------------------------------------

class EoeTest : public ::testing::Test {
 protected:
  void Fragment(int number, int blocks, int frame, bool last, std::size_t bytes, unsigned flags = 0) {
    Bytes payload{0, static_cast<std::uint8_t>((last ? 1U : 0U) | flags)};
    const unsigned word =
        static_cast<unsigned>(number) | static_cast<unsigned>(blocks) << 6U | static_cast<unsigned>(frame) << 12U;
    payload.push_back(static_cast<std::uint8_t>(word));
    payload.push_back(static_cast<std::uint8_t>(word >> 8U));
    for (std::size_t i = 0; i < bytes; ++i) payload.push_back(next_byte_++);
    reassembler_.OnMessage(feed_.Next(Direction::kOut, Protocol::kEoE, payload), {}, sink_);
  }

  Feed feed_;
  Recorder sink_;
  EoeReassembler reassembler_;
  std::uint8_t next_byte_ = 0;
};

TEST_F(EoeTest, ThreeFragmentsMakeAFrame) {
  Fragment(0, 3, 5, false, 32);  // 3 blocks of 32: 65 to 96 bytes
  Fragment(1, 1, 5, false, 32);
  Fragment(2, 2, 5, true, 10);
  ASSERT_EQ(sink_.eoe.size(), 1U);
  const KeptEoeFrame& frame = sink_.eoe[0];
  EXPECT_EQ(frame.problem, EoeFrame::Problem::kNone);
  EXPECT_EQ(frame.size, 74U);
  EXPECT_EQ(frame.fragments, 3U);
  EXPECT_EQ(frame.frame_number, 5);
  EXPECT_EQ(frame.first.number, 1U);
  EXPECT_EQ(frame.last.number, 3U);
  ASSERT_EQ(frame.bytes.size(), 74U);
  for (std::size_t i = 0; i < frame.bytes.size(); ++i) EXPECT_EQ(frame.bytes[i], i);
  EXPECT_TRUE(frame.summary.valid);
}

TEST_F(EoeTest, OneFragmentWithTimeStamp) {
  Fragment(0, 2, 1, true, 64, 0x02);
  ASSERT_EQ(sink_.eoe.size(), 1U);
  EXPECT_EQ(sink_.eoe[0].problem, EoeFrame::Problem::kNone);
  EXPECT_EQ(sink_.eoe[0].size, 60U);
  EXPECT_EQ(sink_.eoe[0].timestamp, 0x3F3E3D3CU);
}

TEST_F(EoeTest, MissingFragmentIsReportedOnce) {
  Fragment(0, 4, 5, false, 32);
  Fragment(2, 2, 5, false, 32);
  Fragment(3, 3, 5, true, 10);
  Fragment(0, 1, 6, true, 20);
  ASSERT_EQ(sink_.eoe.size(), 2U);
  EXPECT_EQ(sink_.eoe[0].problem, EoeFrame::Problem::kFragmentMissing);
  EXPECT_EQ(sink_.eoe[1].problem, EoeFrame::Problem::kNone);
}

TEST_F(EoeTest, OtherProblems) {
  Fragment(1, 1, 5, false, 32);  // its start is not in the capture
  Fragment(2, 2, 5, true, 10);
  Fragment(0, 2, 6, false, 32);
  Fragment(1, 2, 6, true, 10);  // offset should be 1
  Fragment(0, 9, 7, true, 32);  // announced 9 blocks
  Fragment(0, 2, 8, false, 32);
  Fragment(0, 1, 9, true, 20);  // the one before was never finished
  Fragment(0, 2, 10, false, 32);
  reassembler_.End(sink_);
  ASSERT_EQ(sink_.eoe.size(), 6U);
  EXPECT_EQ(sink_.eoe[0].problem, EoeFrame::Problem::kNoStart);
  EXPECT_EQ(sink_.eoe[1].problem, EoeFrame::Problem::kWrongOffset);
  EXPECT_EQ(sink_.eoe[2].problem, EoeFrame::Problem::kWrongSize);
  EXPECT_EQ(sink_.eoe[3].problem, EoeFrame::Problem::kUnfinished);
  EXPECT_EQ(sink_.eoe[4].problem, EoeFrame::Problem::kNone);
  EXPECT_EQ(sink_.eoe[5].problem, EoeFrame::Problem::kUnfinished);
  for (const KeptEoeFrame& frame : sink_.eoe) {
    EXPECT_EQ(Describe(frame.problem).empty(), frame.problem == EoeFrame::Problem::kNone);
  }
}

TEST_F(EoeTest, FramesAreBounded) {
  Fragment(0, 63, 5, false, 1024);
  for (int i = 1; i < 7; ++i) Fragment(i, (i * 32) & 63, 5, false, 1024);
  reassembler_.End(sink_);
  ASSERT_FALSE(sink_.eoe.empty());
  for (const KeptEoeFrame& frame : sink_.eoe) EXPECT_LE(frame.bytes.size(), EoeReassembler::kMaxFrameBytes);
}

TEST_F(EoeTest, SetIpAndItsAnswer) {
  Bytes request = FromHex("02000000 02000000 000000000000 8b00a8c0");
  reassembler_.OnMessage(feed_.Next(Direction::kOut, Protocol::kEoE, request), {}, sink_);
  reassembler_.OnMessage(feed_.Next(Direction::kIn, Protocol::kEoE, FromHex("03000102")), Frame(1), sink_);
  ASSERT_EQ(sink_.eoe_controls.size(), 2U);
  EXPECT_EQ(sink_.eoe_controls[0].type, EoeType::kSetIpRequest);
  EXPECT_EQ(sink_.eoe_controls[0].ip.ip, 0xC0A8008BU);
  EXPECT_EQ(sink_.eoe_controls[1].type, EoeType::kSetIpResponse);
  EXPECT_EQ(sink_.eoe_controls[1].result, 0x0201);
  EXPECT_EQ(sink_.eoe_controls[1].request.number, 1U);
}

// --- FoE -------------------------------------------------------------------------------------------------------------

class FoeTest : public ::testing::Test {
 protected:
  FoeTest() { tracker_.SetMailboxLengths(128, 128); }
  static constexpr std::size_t kFull = 128 - 12;

  void Send(Direction direction, FoeOperation operation, std::uint32_t parameter, const Bytes& data = {}) {
    Bytes payload{static_cast<std::uint8_t>(operation), 0};
    for (int i = 0; i < 4; ++i) payload.push_back(static_cast<std::uint8_t>(parameter >> (8 * i)));
    payload.insert(payload.end(), data.begin(), data.end());
    tracker_.OnMessage(feed_.Next(direction, Protocol::kFoE, payload), sink_);
  }
  void Out(FoeOperation operation, std::uint32_t parameter, const Bytes& data = {}) {
    Send(Direction::kOut, operation, parameter, data);
  }
  void In(FoeOperation operation, std::uint32_t parameter, const Bytes& data = {}) {
    Send(Direction::kIn, operation, parameter, data);
  }

  Feed feed_;
  Recorder sink_;
  FoeTracker tracker_{3};
};

TEST_F(FoeTest, Write) {
  Out(FoeOperation::kWriteRequest, 0xCAFE, FromHex("66772e62696e"));
  In(FoeOperation::kAcknowledge, 0);
  Out(FoeOperation::kData, 1, Bytes(kFull));
  In(FoeOperation::kBusy, 0);
  Out(FoeOperation::kData, 1, Bytes(kFull));
  In(FoeOperation::kAcknowledge, 1);
  Out(FoeOperation::kData, 2, Bytes(10));
  EXPECT_TRUE(sink_.files.empty());
  In(FoeOperation::kAcknowledge, 2);
  ASSERT_EQ(sink_.files.size(), 1U);
  const KeptFile& f = sink_.files[0];
  EXPECT_TRUE(f.write);
  EXPECT_EQ(f.outcome, FoeTransfer::Outcome::kCompleted);
  EXPECT_EQ(f.name, "fw.bin");
  EXPECT_EQ(f.password, 0xCAFEU);
  EXPECT_EQ(f.packets, 2U);
  EXPECT_EQ(f.repeated_packets, 1U);
  EXPECT_EQ(f.busy, 1U);
  EXPECT_EQ(f.bytes, kFull + 10);
  EXPECT_EQ(f.packet_errors, 0U);
  EXPECT_EQ(f.slave, 3);
  EXPECT_EQ(f.request.number, 1U);
  EXPECT_EQ(f.last.number, 8U);
  EXPECT_EQ(f.duration, 7000);
  EXPECT_EQ(f.certainty, Certainty::kObserved);
}

TEST_F(FoeTest, ReadThatEndsWithAnEmptyPacket) {
  Out(FoeOperation::kReadRequest, 0, FromHex("610000"));  // name padded with zeros
  In(FoeOperation::kData, 1, Bytes(kFull));
  Out(FoeOperation::kAcknowledge, 1);
  In(FoeOperation::kData, 2);
  Out(FoeOperation::kAcknowledge, 2);
  ASSERT_EQ(sink_.files.size(), 1U);
  EXPECT_FALSE(sink_.files[0].write);
  EXPECT_EQ(sink_.files[0].name, "a");
  EXPECT_EQ(sink_.files[0].packets, 2U);
  EXPECT_EQ(sink_.files[0].bytes, kFull);
  EXPECT_EQ(sink_.files[0].outcome, FoeTransfer::Outcome::kCompleted);
}

TEST_F(FoeTest, ErrorsOfEitherSide) {
  Out(FoeOperation::kReadRequest, 0, FromHex("61"));
  In(FoeOperation::kError, 0x8001, FromHex("6e6f6e65"));
  Out(FoeOperation::kWriteRequest, 0, FromHex("61"));
  In(FoeOperation::kAcknowledge, 0);
  Out(FoeOperation::kError, 0x8003);
  ASSERT_EQ(sink_.files.size(), 2U);
  EXPECT_EQ(sink_.files[0].outcome, FoeTransfer::Outcome::kError);
  EXPECT_EQ(sink_.files[0].error_code, 0x8001U);
  EXPECT_EQ(sink_.files[0].error, "none");
  EXPECT_EQ(sink_.files[0].error_by, Direction::kIn);
  EXPECT_EQ(sink_.files[1].error_by, Direction::kOut);
}

TEST_F(FoeTest, PacketNumbersOutOfOrder) {
  Out(FoeOperation::kWriteRequest, 0, FromHex("61"));
  In(FoeOperation::kAcknowledge, 0);
  Out(FoeOperation::kData, 1, Bytes(kFull));
  In(FoeOperation::kAcknowledge, 1);
  Out(FoeOperation::kData, 3, Bytes(5));
  EXPECT_TRUE(sink_.files.empty());
  In(FoeOperation::kAcknowledge, 3);
  ASSERT_EQ(sink_.files.size(), 1U);
  EXPECT_EQ(sink_.files[0].packet_errors, 1U);
  EXPECT_EQ(sink_.files[0].packet_error.number, 5U);
}

TEST_F(FoeTest, UnfinishedOnes) {
  Out(FoeOperation::kWriteRequest, 0, FromHex("61"));
  Out(FoeOperation::kReadRequest, 0, FromHex("62"));
  tracker_.OnMailboxError(2, Frame(9), sink_);
  Out(FoeOperation::kReadRequest, 0, FromHex("63"));
  tracker_.End(TransferEnd::kCaptureEnd, sink_);
  ASSERT_EQ(sink_.files.size(), 3U);
  EXPECT_EQ(sink_.files[0].outcome, FoeTransfer::Outcome::kSuperseded);
  EXPECT_FALSE(sink_.files[0].answered);
  EXPECT_EQ(sink_.files[1].outcome, FoeTransfer::Outcome::kMailboxError);
  EXPECT_EQ(sink_.files[1].mailbox_error, 2);
  EXPECT_EQ(sink_.files[2].outcome, FoeTransfer::Outcome::kCaptureEnd);
}

TEST_F(FoeTest, CaptureBeginsInsideATransfer) {
  tracker_.SetMailboxLengths(0, 0);
  Out(FoeOperation::kData, 7, Bytes(50));
  In(FoeOperation::kAcknowledge, 7);
  Out(FoeOperation::kData, 8, Bytes(20));
  In(FoeOperation::kAcknowledge, 8);
  ASSERT_EQ(sink_.files.size(), 1U);
  EXPECT_TRUE(sink_.files[0].write);
  EXPECT_EQ(sink_.files[0].certainty, Certainty::kUnknown);
  EXPECT_EQ(sink_.files[0].packets, 2U);
  EXPECT_EQ(sink_.files[0].packet_errors, 0U);
  EXPECT_EQ(sink_.files[0].name, "");
  EXPECT_FALSE(sink_.files[0].request.seen());
}

// --- SoE -------------------------------------------------------------------------------------------------------------

class SoeTest : public ::testing::Test {
 protected:
  void Send(const char* hex) {
    reassembler_.OnMessage(feed_.Next(Direction::kIn, Protocol::kSoE, FromHex(hex)), Frame(77), sink_);
  }
  Feed feed_;
  Recorder sink_;
  SoeReassembler reassembler_;
};

TEST_F(SoeTest, WholeMessageAndError) {
  Send("02 40 1100 01000000");
  Send("12 40 1100 0110");
  ASSERT_EQ(sink_.soe.size(), 2U);
  EXPECT_EQ(sink_.soe[0].operation, SoeOperation::kReadResponse);
  EXPECT_EQ(sink_.soe[0].idn, 17);
  EXPECT_EQ(sink_.soe[0].bytes, FromHex("01000000"));
  EXPECT_FALSE(sink_.soe[0].error_code.has_value());
  EXPECT_EQ(sink_.soe[0].request.number, 77U);
  EXPECT_EQ(sink_.soe[1].error_code, 0x1001);
  EXPECT_TRUE(sink_.soe[1].bytes.empty());
}

TEST_F(SoeTest, FragmentsCountDown) {
  Send("0a 40 0200 4142");
  Send("0a 40 0100 4344");
  Send("02 40 1100 45");
  ASSERT_EQ(sink_.soe.size(), 1U);
  EXPECT_EQ(Text(sink_.soe[0].bytes), "ABCDE");
  EXPECT_EQ(sink_.soe[0].fragments, 3U);
  EXPECT_FALSE(sink_.soe[0].fragment_error);
  EXPECT_EQ(sink_.soe[0].idn, 17);
  EXPECT_EQ(sink_.soe[0].frame.number, 3U);
}

TEST_F(SoeTest, MissingFragmentAndUnfinishedMessage) {
  Send("0a 40 0300 4142");
  Send("02 40 1100 45");
  Send("0a 40 0300 4142");
  Send("03 40 1100 45");  // another operation
  Send("0a 40 0100 4142");
  reassembler_.End(sink_);
  ASSERT_EQ(sink_.soe.size(), 4U);
  EXPECT_TRUE(sink_.soe[0].fragment_error);
  EXPECT_TRUE(sink_.soe[0].idn_known);
  EXPECT_TRUE(sink_.soe[1].fragment_error);
  EXPECT_FALSE(sink_.soe[1].idn_known);
  EXPECT_FALSE(sink_.soe[2].fragment_error);
  EXPECT_TRUE(sink_.soe[3].fragment_error);
}

// --- SDO information -------------------------------------------------------------------------------------------------

class SdoInfoTest : public ::testing::Test {
 protected:
  void Out(const char* hex) { tracker_.OnMessage(feed_.Next(Direction::kOut, Protocol::kCoE, FromHex(hex)), sink_); }
  void In(const char* hex) { tracker_.OnMessage(feed_.Next(Direction::kIn, Protocol::kCoE, FromHex(hex)), sink_); }
  Feed feed_;
  Recorder sink_;
  SdoInfoTracker tracker_{5};
};

TEST_F(SdoInfoTest, ListInFragments) {
  Out("0080 01000000 0100");
  In("0080 82000200 0100 0010 1810");  // the list type stands in the first fragment only
  In("0080 82000100 0016");
  In("0080 02000000 001a");
  ASSERT_EQ(sink_.infos.size(), 1U);
  EXPECT_EQ(sink_.infos[0].objects, (std::vector<std::uint16_t>{0x1000, 0x1018, 0x1600, 0x1A00}));
  EXPECT_EQ(sink_.infos[0].list_type, 1);
  EXPECT_EQ(sink_.infos[0].fragments, 3U);
  EXPECT_FALSE(sink_.infos[0].fragment_error);
  EXPECT_EQ(sink_.infos[0].slave, 5);
  EXPECT_EQ(sink_.infos[0].duration, 3000);
}

TEST_F(SdoInfoTest, FragmentMissing) {
  Out("0080 01000000 0100");
  In("0080 82000200 0100 0010");
  In("0080 02000000 001a");
  ASSERT_EQ(sink_.infos.size(), 1U);
  EXPECT_TRUE(sink_.infos[0].fragment_error);
}

TEST_F(SdoInfoTest, ListLengths) {
  Out("0080 01000000 0000");
  In("0080 02000000 0000 3100 0500 0400 0000 0000");
  ASSERT_EQ(sink_.infos.size(), 1U);
  EXPECT_EQ(sink_.infos[0].list_type, 0);
  EXPECT_EQ(sink_.infos[0].objects, (std::vector<std::uint16_t>{49, 5, 4, 0, 0}));
  EXPECT_EQ(ListTypeName(0), "lengths of the lists");
  EXPECT_EQ(ListTypeName(9), "list 9");
}

TEST_F(SdoInfoTest, ObjectDescription) {
  Out("0080 03000000 1810");
  In("0080 04000000 1810 0500 04 09 4964656e74697479");  // sdo-mix packet 700
  ASSERT_EQ(sink_.infos.size(), 1U);
  const KeptInfo& i = sink_.infos[0];
  EXPECT_EQ(i.kind, SdoInfo::Kind::kObject);
  EXPECT_EQ(i.index, 0x1018);
  EXPECT_EQ(i.data_type, 5);
  EXPECT_EQ(i.max_subindex, 4);
  EXPECT_EQ(i.object_code, 9);
  EXPECT_EQ(i.text, "Identity");
}

TEST_F(SdoInfoTest, EntryDescriptionWithAllParts) {
  Out("0080 05000000 0760 00 78");
  In("0080 06000000 0760 00 78 0400 2000 bf02 0500 01000000 00000080 ffffff7f 506f73");
  ASSERT_EQ(sink_.infos.size(), 1U);
  const KeptInfo& i = sink_.infos[0];
  EXPECT_EQ(i.kind, SdoInfo::Kind::kEntry);
  EXPECT_EQ(i.index, 0x6007);
  EXPECT_EQ(i.value_info, 0x78);
  EXPECT_EQ(i.data_type, 4);
  EXPECT_EQ(i.bit_length, 32);
  EXPECT_EQ(i.unit, 5);
  EXPECT_EQ(i.initial, FromHex("01000000"));
  EXPECT_EQ(i.low, FromHex("00000080"));
  EXPECT_EQ(i.high, FromHex("ffffff7f"));
  EXPECT_EQ(i.text, "Pos");
  EXPECT_EQ(AccessText(i.access), "rw txpdo settings");
  EXPECT_FALSE(i.malformed);
}

TEST_F(SdoInfoTest, AccessWords) {
  EXPECT_EQ(AccessText(0x0007), "ro");
  EXPECT_EQ(AccessText(0x003F), "rw");
  EXPECT_EQ(AccessText(0x0038), "wo");
  EXPECT_EQ(AccessText(0x000F), "rw (write PREOP)");
  EXPECT_EQ(AccessText(0x0101), "ro (read PREOP) backup");
  EXPECT_EQ(AccessText(0x007F), "rw rxpdo");
  EXPECT_EQ(AccessText(0), "none");
}

TEST_F(SdoInfoTest, ErrorAndUnfinished) {
  Out("0080 03000000 ff5f");
  In("0080 07000000 00000206");
  Out("0080 03000000 0010");
  Out("0080 03000000 0110");
  tracker_.OnMailboxError(4, Frame(9), sink_);
  Out("0080 03000000 0210");
  tracker_.End(TransferEnd::kReset, sink_);
  ASSERT_EQ(sink_.infos.size(), 4U);
  EXPECT_EQ(sink_.infos[0].outcome, SdoInfo::Outcome::kError);
  EXPECT_EQ(sink_.infos[0].abort_code, 0x06020000U);
  EXPECT_EQ(sink_.infos[0].index, 0x5FFF);
  EXPECT_FALSE(sink_.infos[0].malformed);
  EXPECT_EQ(sink_.infos[1].outcome, SdoInfo::Outcome::kSuperseded);
  EXPECT_EQ(sink_.infos[2].outcome, SdoInfo::Outcome::kMailboxError);
  EXPECT_EQ(sink_.infos[2].mailbox_error, 4);
  EXPECT_EQ(sink_.infos[3].outcome, SdoInfo::Outcome::kReset);
}

TEST_F(SdoInfoTest, CutDescriptionsAreMarked) {
  Out("0080 03000000 1810");
  In("0080 04000000 1810 05");
  Out("0080 05000000 1810 00 10");
  In("0080 06000000 1810 00 10 0500 2000 0700 0102");
  ASSERT_EQ(sink_.infos.size(), 2U);
  EXPECT_TRUE(sink_.infos[0].malformed);
  EXPECT_TRUE(sink_.infos[1].malformed);
  EXPECT_EQ(sink_.infos[1].initial, FromHex("0102"));
  EXPECT_EQ(sink_.infos[1].text, "");
}

TEST_F(SdoInfoTest, AnswerWithoutCapturedRequest) {
  In("0080 04000000 1810 0500 04 09 4964");
  ASSERT_EQ(sink_.infos.size(), 1U);
  EXPECT_EQ(sink_.infos[0].text, "Id");
  EXPECT_FALSE(sink_.infos[0].request.seen());
}

}  // namespace
}  // namespace ecaudit::mailbox
