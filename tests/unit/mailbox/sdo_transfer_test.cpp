#include "decoder/mailbox/sdo_transfer.h"

#include <gtest/gtest.h>

#include "tests/unit/mailbox/mailbox_test_support.h"

namespace ecaudit::mailbox {
namespace {

class SdoTransferTest : public ::testing::Test {
 protected:
  /// CoE payload without the mailbox header; frames count up by one.
  void Out(const char* hex) { Send(Direction::kOut, FromHex(hex)); }
  void In(const char* hex) { Send(Direction::kIn, FromHex(hex)); }
  void Send(Direction direction, const Bytes& payload, bool assumed = false) {
    MailboxMessage message = CoeMessage(direction, ++frame_, payload);
    message.assumed = assumed;
    if (assumed) message.certainty = Certainty::kInferred;
    tracker_.OnMessage(message, sink_);
  }
  const KeptTransfer& Only() {
    EXPECT_EQ(sink_.transfers.size(), 1U);
    static const KeptTransfer kNone{SdoTransfer()};
    return sink_.transfers.empty() ? kNone : sink_.transfers.back();
  }

  Recorder sink_;
  SdoTransferTracker tracker_{7};
  FrameNo frame_ = 0;
};

TEST_F(SdoTransferTest, ExpeditedDownload) {
  Out("0020 2b121c0104170000");
  EXPECT_TRUE(tracker_.open());
  In("0030 60121c0100000000");
  const KeptTransfer& t = Only();
  EXPECT_EQ(t.slave, 7);
  EXPECT_EQ(t.service, SdoService::kDownload);
  EXPECT_EQ(t.kind, SdoTransferKind::kExpedited);
  EXPECT_EQ(t.outcome, SdoOutcome::kCompleted);
  EXPECT_EQ(t.index, 0x1C12);
  EXPECT_EQ(t.subindex, 1);
  EXPECT_EQ(t.bytes, FromHex("0417"));
  EXPECT_EQ(t.request.number, 1U);
  EXPECT_EQ(t.response.number, 2U);
  EXPECT_EQ(t.duration, 1000);
  EXPECT_EQ(t.certainty, Certainty::kObserved);
  EXPECT_FALSE(t.response_service_mismatch);
  EXPECT_FALSE(t.size_mismatch);
  EXPECT_FALSE(tracker_.open());
}

TEST_F(SdoTransferTest, ExpeditedUpload) {
  Out("0020 4041600000000000");
  In("0030 4b41600050020000");
  EXPECT_EQ(Only().service, SdoService::kUpload);
  EXPECT_EQ(Only().kind, SdoTransferKind::kExpedited);
  EXPECT_EQ(Only().bytes, FromHex("5002"));
  EXPECT_EQ(Only().declared_size, 2U);
}

TEST_F(SdoTransferTest, NormalUploadAndDownload) {
  Out("0020 4008100000000000");
  In("0030 4108100006000000 454b31393134");  // real EK1914
  EXPECT_EQ(Only().kind, SdoTransferKind::kNormal);
  EXPECT_EQ(Text(Only().bytes), "EK1914");
  sink_.transfers.clear();
  Out("0020 21f22f0005000000 4142434445");
  In("0030 61f22f0000000000");
  EXPECT_EQ(Only().service, SdoService::kDownload);
  EXPECT_EQ(Only().kind, SdoTransferKind::kNormal);
  EXPECT_EQ(Text(Only().bytes), "ABCDE");
}

TEST_F(SdoTransferTest, SegmentedUpload) {
  Out("0020 40f02f0000000000");
  In("0030 41f02f000c000000 41");  // 12 bytes announced, the first of them here
  Out("0020 6000000000000000");
  In("0030 0042434445464748");
  Out("0020 7000000000000000");
  In("0030 1749 4a4b4c000000");  // last, 3 unused
  const KeptTransfer& t = Only();
  EXPECT_EQ(t.kind, SdoTransferKind::kSegmented);
  EXPECT_EQ(t.outcome, SdoOutcome::kCompleted);
  EXPECT_EQ(Text(t.bytes), "ABCDEFGHIJKL");
  EXPECT_EQ(t.declared_size, 12U);
  EXPECT_FALSE(t.size_mismatch);
  EXPECT_EQ(t.segments, 2U);
  EXPECT_EQ(t.toggle_errors, 0U);
  EXPECT_EQ(t.request.number, 1U);
  EXPECT_EQ(t.response.number, 6U);
  EXPECT_TRUE(sink_.unexpected.empty());
}

TEST_F(SdoTransferTest, SegmentedDownload) {
  Out("0020 21f12f000b000000 4142");
  In("0030 60f12f0000000000");
  Out("0020 0043444546474849");
  In("0030 20");
  Out("0020 1b4a4b0000000000");  // toggle, last, 5 unused
  In("0030 30");
  const KeptTransfer& t = Only();
  EXPECT_EQ(t.kind, SdoTransferKind::kSegmented);
  EXPECT_EQ(Text(t.bytes), "ABCDEFGHIJK");
  EXPECT_EQ(t.outcome, SdoOutcome::kCompleted);
  EXPECT_FALSE(t.size_mismatch);
  EXPECT_EQ(t.toggle_errors, 0U);
}

TEST_F(SdoTransferTest, SizeMismatch) {
  Out("0020 40f02f0000000000");
  In("0030 41f02f000c000000");
  Out("0020 6000000000000000");
  In("0030 0141424344454647");  // last, although 7 of 12
  EXPECT_TRUE(Only().size_mismatch);
  EXPECT_EQ(Only().size, 7U);
}

TEST_F(SdoTransferTest, CompleteAccess) {
  Out("0020 50121c0000000000");
  In("0030 53121c0001000116");
  EXPECT_TRUE(Only().complete_access);
  EXPECT_EQ(Only().bytes, FromHex("01000116"));
}

TEST_F(SdoTransferTest, AbortBySlaveUnderEitherService) {
  Out("0020 2300100001000000");
  In("0030 8300100002000106");
  Out("0020 2300100001000000");
  In("0020 8000100002000106");
  ASSERT_EQ(sink_.transfers.size(), 2U);
  for (const KeptTransfer& t : sink_.transfers) {
    EXPECT_EQ(t.outcome, SdoOutcome::kAborted);
    EXPECT_EQ(t.abort_code, 0x06010002U);
    EXPECT_EQ(t.aborted_by, Direction::kIn);
    EXPECT_FALSE(t.response_service_mismatch);
    EXPECT_EQ(t.bytes, FromHex("01000000"));  // what was to be written
  }
}

TEST_F(SdoTransferTest, AbortByMaster) {
  Out("0020 40f02f0000000000");
  In("0030 41f02f00ff000000");
  Out("0020 80f02f0000000405");
  EXPECT_EQ(Only().outcome, SdoOutcome::kAborted);
  EXPECT_EQ(Only().aborted_by, Direction::kOut);
  EXPECT_EQ(Only().abort_code, 0x05040000U);
  EXPECT_EQ(Only().index, 0x2FF0);
  EXPECT_EQ(Only().last.number, 3U);
}

TEST_F(SdoTransferTest, AbortInsideASegmentedTransfer) {
  Out("0020 40f02f0000000000");
  In("0030 41f02f00ff000000");
  Out("0020 7000000000000000");  // toggle must start with 0
  In("0030 80f02f0000000305");
  EXPECT_EQ(Only().outcome, SdoOutcome::kAborted);
  EXPECT_EQ(Only().abort_code, 0x05030000U);
  EXPECT_EQ(Only().toggle_errors, 1U);
  EXPECT_EQ(Only().toggle_error.number, 3U);
  EXPECT_EQ(Only().toggle_error_by, Direction::kOut);
}

TEST_F(SdoTransferTest, ToggleErrorOfTheSlave) {
  Out("0020 40f02f0000000000");
  In("0030 41f02f0007000000");
  Out("0020 6000000000000000");
  In("0030 1141424344454647");
  EXPECT_EQ(Only().toggle_errors, 1U);
  EXPECT_EQ(Only().toggle_error.number, 4U);
  EXPECT_EQ(Only().toggle_error_by, Direction::kIn);
}

TEST_F(SdoTransferTest, ServiceNibbleOfThePrintedExample) {
  Out("0020 2b121c0104170000");
  In("0020 60121c0100000000 00000000");  // length 0x0E, service 2
  EXPECT_EQ(Only().outcome, SdoOutcome::kCompleted);
  EXPECT_TRUE(Only().response_service_mismatch);
  EXPECT_FALSE(Only().request_service_mismatch);
  EXPECT_EQ(Only().service_mismatch.number, 2U);
  sink_.transfers.clear();
  Out("0030 4000100000000000");
  In("0030 4300100092010200");
  EXPECT_TRUE(Only().request_service_mismatch);
  EXPECT_EQ(Only().service_mismatch.number, 3U);
}

TEST_F(SdoTransferTest, LateAndForeignAnswersDoNotEndTheTransfer) {
  Out("0020 4000100000000000");
  In("0030 4318100100000000");  // answer to something else
  ASSERT_EQ(sink_.unexpected.size(), 1U);
  EXPECT_EQ(sink_.unexpected[0].reason, SdoUnexpected::Reason::kWrongObject);
  EXPECT_EQ(sink_.unexpected[0].index, 0x1018);
  EXPECT_EQ(sink_.unexpected[0].expected_index, 0x1000);
  EXPECT_EQ(sink_.unexpected[0].request.number, 1U);
  EXPECT_EQ(sink_.unexpected[0].response.number, 2U);
  In("0030 6000100000000000");  // download answer to an upload
  ASSERT_EQ(sink_.unexpected.size(), 2U);
  EXPECT_EQ(sink_.unexpected[1].reason, SdoUnexpected::Reason::kWrongCommand);
  In("0030 4300100092010200");
  EXPECT_EQ(Only().outcome, SdoOutcome::kCompleted);
  EXPECT_EQ(Only().unexpected_responses, 2U);
  In("0030 4300100092010200");
  ASSERT_EQ(sink_.unexpected.size(), 3U);
  EXPECT_EQ(sink_.unexpected[2].reason, SdoUnexpected::Reason::kNoRequest);
  In("0030 8000100000000405");
  ASSERT_EQ(sink_.unexpected.size(), 4U);
  EXPECT_TRUE(sink_.unexpected[3].abort);
  EXPECT_EQ(sink_.unexpected[3].abort_code, 0x05040000U);
}

TEST_F(SdoTransferTest, SupersededWithoutAnswer) {
  Out("0020 4018100100000000");
  Out("0020 4018100200000000");
  EXPECT_EQ(Only().outcome, SdoOutcome::kSuperseded);
  EXPECT_TRUE(Only().incomplete());
  EXPECT_FALSE(Only().answered);
  EXPECT_EQ(Only().subindex, 1);
  EXPECT_FALSE(Only().duration.has_value());
  tracker_.End(TransferEnd::kCaptureEnd, sink_);
  ASSERT_EQ(sink_.transfers.size(), 2U);
  EXPECT_EQ(sink_.transfers[1].outcome, SdoOutcome::kCaptureEnd);
}

TEST_F(SdoTransferTest, SegmentedTransferThatNeverFinishes) {
  Out("0020 40f02f0000000000");
  In("0030 41f02f00ff000000 414243");
  Out("0020 4000100000000000");
  EXPECT_EQ(Only().outcome, SdoOutcome::kSuperseded);
  EXPECT_TRUE(Only().answered);
  EXPECT_EQ(Only().kind, SdoTransferKind::kSegmented);
  EXPECT_EQ(Text(Only().bytes), "ABC");
}

TEST_F(SdoTransferTest, UploadWithoutAnnouncedSizeEndsWithTheNextRequest) {
  Out("0020 4008100000000000");
  In("0030 4008100000000000 414243");
  EXPECT_TRUE(sink_.transfers.empty());
  Out("0020 4000100000000000");
  EXPECT_EQ(Only().outcome, SdoOutcome::kCompleted);
  EXPECT_EQ(Only().kind, SdoTransferKind::kNormal);
  EXPECT_EQ(Text(Only().bytes), "ABC");
  EXPECT_FALSE(Only().size_mismatch);
}

TEST_F(SdoTransferTest, MailboxErrorEndsIt) {
  Out("0020 4000100000000000");
  tracker_.OnMailboxError(7, Frame(9), sink_);
  EXPECT_EQ(Only().outcome, SdoOutcome::kMailboxError);
  EXPECT_EQ(Only().mailbox_error, 7);
  EXPECT_EQ(Only().response.number, 9U);
  tracker_.OnMailboxError(7, Frame(10), sink_);
  EXPECT_EQ(sink_.transfers.size(), 1U);
}

TEST_F(SdoTransferTest, OutboundOnlyDownloadIsReportedAtOnceWithUnknownResult) {
  Send(Direction::kOut, FromHex("0020 2b121c0104170000"), true);
  EXPECT_EQ(Only().outcome, SdoOutcome::kNotCaptured);
  EXPECT_EQ(Only().certainty, Certainty::kInferred);
  EXPECT_EQ(Only().bytes, FromHex("0417"));
  EXPECT_FALSE(Only().incomplete());
  sink_.transfers.clear();
  Send(Direction::kOut, FromHex("0020 21f12f0009000000 4142"), true);
  Send(Direction::kOut, FromHex("0020 0143444546474849"), true);
  EXPECT_EQ(Only().outcome, SdoOutcome::kNotCaptured);
  EXPECT_EQ(Text(Only().bytes), "ABCDEFGHI");
  EXPECT_EQ(Only().toggle_errors, 0U);
  sink_.transfers.clear();
  Send(Direction::kOut, FromHex("0020 40f02f0000000000"), true);
  Send(Direction::kOut, FromHex("0020 6000000000000000"), true);
  Send(Direction::kOut, FromHex("0020 7000000000000000"), true);
  Send(Direction::kOut, FromHex("0020 4000100000000000"), true);
  EXPECT_EQ(Only().outcome, SdoOutcome::kNotCaptured);
  EXPECT_EQ(Only().kind, SdoTransferKind::kSegmented);
  EXPECT_EQ(Only().index, 0x2FF0);
  EXPECT_TRUE(Only().bytes.empty());
}

TEST_F(SdoTransferTest, CaptureThatBeginsBetweenRequestAndAnswer) {
  In("0030 4300100092010200");
  EXPECT_EQ(Only().outcome, SdoOutcome::kCompleted);
  EXPECT_EQ(Only().certainty, Certainty::kInferred);
  EXPECT_EQ(Only().bytes, FromHex("92010200"));
  EXPECT_FALSE(Only().request.seen());
  EXPECT_TRUE(sink_.unexpected.empty());
}

TEST_F(SdoTransferTest, SegmentsWithoutInitiate) {
  In("0030 0041424344454647");
  Out("0020 7000000000000000");
  In("0030 1148494a4b4c4d4e");
  EXPECT_EQ(Only().certainty, Certainty::kUnknown);
  EXPECT_FALSE(Only().has_object);
  EXPECT_TRUE(Only().data_gap);
  EXPECT_EQ(Only().service, SdoService::kUpload);
  EXPECT_EQ(Only().kind, SdoTransferKind::kSegmented);
  EXPECT_EQ(Text(Only().bytes), "ABCDEFGHIJKLMN");
  EXPECT_FALSE(Only().size_mismatch);
  sink_.transfers.clear();
  tracker_.End(TransferEnd::kGap, sink_);
  Out("0020 1141424344454647");
  In("0030 30");
  EXPECT_EQ(Only().service, SdoService::kDownload);
  EXPECT_EQ(Only().certainty, Certainty::kUnknown);
  EXPECT_EQ(Only().toggle_errors, 0U);
}

TEST_F(SdoTransferTest, LostReadInTheCaptureLeavesAGapInTheData) {
  Out("0020 40f02f0000000000");
  In("0030 41f02f000e000000");
  Out("0020 6000000000000000");
  tracker_.OnReadLost(4);
  Out("0020 7000000000000000");  // the master has it and goes on
  In("0030 1141424344454647");
  EXPECT_EQ(Only().outcome, SdoOutcome::kCompleted);
  EXPECT_TRUE(Only().data_gap);
  EXPECT_EQ(Only().toggle_errors, 0U);
  EXPECT_FALSE(Only().size_mismatch);
}

/// The master has the answer that the capture lacks: it goes on to the next entry.
TEST_F(SdoTransferTest, DownloadWhoseAnswerMayBeLostIsTakenForAcceptedWhenTheMasterGoesOn) {
  Out("0020 23001a0320007760");
  tracker_.OnReadLost(2);
  Out("0020 23001a0420006c60");
  EXPECT_EQ(Only().outcome, SdoOutcome::kNotCaptured);
  EXPECT_EQ(Only().bytes, FromHex("20007760"));
  sink_.transfers.clear();
  tracker_.OnReadLost(3);
  Out("0020 23001a0420006c60");  // it repeats itself: it has no answer
  EXPECT_EQ(Only().outcome, SdoOutcome::kSuperseded);
  sink_.transfers.clear();
  Out("0020 23001a0508006160");  // no read was lost: the slave did not answer
  EXPECT_EQ(Only().outcome, SdoOutcome::kSuperseded);
}

TEST_F(SdoTransferTest, SegmentRepeatedWithoutAnswerIsStoredOnce) {
  Out("0020 21f12f0007000000");
  In("0030 60f12f0000000000");
  Out("0020 0141424344454647");
  Out("0020 0141424344454647");
  In("0030 20");
  EXPECT_EQ(Text(Only().bytes), "ABCDEFG");
  EXPECT_FALSE(Only().size_mismatch);
  EXPECT_EQ(Only().toggle_errors, 0U);
}

TEST_F(SdoTransferTest, DataAreBounded) {
  Bytes announce = FromHex("0020 21f12f0000002000");
  Send(Direction::kOut, announce);  // 2 MiB
  In("0030 60f12f0000000000");
  Bytes segment = FromHex("0020 00");
  segment.resize(3 + 65536, 0x55);
  for (int i = 0; i < 32; ++i) {
    segment[2] = static_cast<std::uint8_t>((i % 2 != 0 ? 0x10 : 0) | (i == 31 ? 1 : 0));
    Send(Direction::kOut, segment);
    In(i % 2 != 0 ? "0030 30" : "0030 20");
  }
  EXPECT_EQ(Only().size, 2U << 20U);
  EXPECT_EQ(Only().bytes.size(), SdoTransferTracker::kMaxStoredBytes);
  EXPECT_FALSE(Only().size_mismatch);
  EXPECT_EQ(Only().toggle_errors, 0U);
}

TEST_F(SdoTransferTest, ReservedCommandIsAnsweredByAnAbort) {
  Out("0020 a000100000000000");
  In("0030 8000100001000405");
  EXPECT_EQ(Only().service, SdoService::kUnknown);
  EXPECT_EQ(Only().outcome, SdoOutcome::kAborted);
  EXPECT_EQ(Only().abort_code, 0x05040001U);
}

}  // namespace
}  // namespace ecaudit::mailbox
