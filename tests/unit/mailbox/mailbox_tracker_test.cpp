#include "decoder/track/mailbox_tracker.h"

#include <gtest/gtest.h>

#include "tests/unit/mailbox/mailbox_test_support.h"

namespace ecaudit::mailbox {
namespace {

using track::Acceptance;
using track::MailboxTracker;
using track::MailboxUse;
using track::MailboxWindow;
using track::SlaveAccess;

constexpr EscAddress kOut = 0x1800;
constexpr EscAddress kIn = 0x1C00;
constexpr std::uint16_t kLength = 64;
constexpr MailboxWindow kAkdLike{kOut, kLength, kIn, kLength, MailboxUse::kOn, MailboxUse::kOn};

/// Header with `counter`, then a CoE payload.
Bytes Coe(int counter, const char* payload) {
  Bytes message = FromHex(payload);
  const auto length = static_cast<std::uint8_t>(message.size());
  const Bytes header{length, 0, 0, 0, 0, static_cast<std::uint8_t>(3 | counter << 4)};
  message.insert(message.begin(), header.begin(), header.end());
  return message;
}
Bytes Typed(int type, int counter, const char* payload) {
  Bytes message = Coe(counter, payload);
  message[5] = static_cast<std::uint8_t>(type | counter << 4);
  return message;
}
Bytes Padded(Bytes message, std::size_t length = kLength) {
  message.resize(length);
  return message;
}

class MailboxTrackerTest : public ::testing::Test {
 protected:
  MailboxTrackerTest() { tracker_.SetWindow(kAkdLike, Frame(1)); }

  SlaveAccess Access(EscAddress address, Acceptance acceptance) {
    SlaveAccess access;
    access.slave = 0;
    access.command = wire::Command::FPWR;
    access.address = address;
    access.acceptance = acceptance;
    if (!same_frame_) frame_ += 2;
    access.sent = Frame(frame_);
    if (acceptance == Acceptance::kAccepted || acceptance == Acceptance::kRefused) access.returned = Frame(frame_ + 1);
    return access;
  }
  void Write(const Bytes& data, EscAddress address = kOut, Acceptance acceptance = Acceptance::kAccepted) {
    SlaveAccess access = Access(address, acceptance);
    access.written = data;
    tracker_.OnAccess(access);
  }
  void Read(const Bytes& data, EscAddress address = kIn) {
    SlaveAccess access = Access(address, Acceptance::kAccepted);
    access.command = wire::Command::FPRD;
    access.read = data;
    tracker_.OnAccess(access);
  }
  void ReadNothing(Acceptance acceptance, EscAddress address = kIn) {
    SlaveAccess access = Access(address, acceptance);
    access.command = wire::Command::FPRD;
    tracker_.OnAccess(access);
  }
  /// Data and last byte in one frame, as TwinCAT does.
  void WriteApart(const Bytes& message, Acceptance acceptance = Acceptance::kAccepted) {
    Write(message, kOut, acceptance);
    same_frame_ = true;
    Write({0}, kOut + kLength - 1, acceptance);
    same_frame_ = false;
  }
  void ReadApart(const Bytes& message) {
    Read(message);
    same_frame_ = true;
    Read({0}, kIn + kLength - 1);
    same_frame_ = false;
  }

  Recorder sink_;
  MailboxTracker tracker_{0, sink_};
  FrameNo frame_ = 10;
  bool same_frame_ = false;
};

const char* const kUpload = "0020 4000100000000000";
const char* const kAnswer = "0030 4300100092010200";

TEST_F(MailboxTrackerTest, WholeMailboxInOneDatagram) {
  Write(Padded(Coe(1, kUpload)));
  Read(Padded(Coe(1, kAnswer)));
  ASSERT_EQ(sink_.messages.size(), 2U);
  EXPECT_EQ(sink_.messages[0].bytes.size(), 10U);
  EXPECT_EQ(sink_.messages[0].frame().number, 12U);  // outbound copy of the request
  EXPECT_EQ(sink_.messages[1].frame().number, 15U);  // returned copy of the answer
  ASSERT_EQ(sink_.transfers.size(), 1U);
  EXPECT_EQ(sink_.transfers[0].bytes, FromHex("92010200"));
  EXPECT_EQ(sink_.transfers[0].duration, 3000);
  EXPECT_EQ(tracker_.counters().requests, 1U);
  EXPECT_EQ(tracker_.counters().responses, 1U);
}

TEST_F(MailboxTrackerTest, DataAndLastByteApart) {
  WriteApart(Coe(1, kUpload));
  ASSERT_EQ(sink_.messages.size(), 1U);
  EXPECT_EQ(sink_.messages[0].problem, Problem::kNone);
  ReadNothing(Acceptance::kRefused);  // polls by reading two bytes: empty
  Read(FromHex("0a00"));              // two bytes: full
  EXPECT_EQ(sink_.messages.size(), 1U);
  ReadApart(Coe(1, kAnswer));
  ASSERT_EQ(sink_.messages.size(), 2U);
  ASSERT_EQ(sink_.transfers.size(), 1U);
  EXPECT_EQ(sink_.transfers[0].outcome, SdoOutcome::kCompleted);
  EXPECT_EQ(tracker_.counters().empty_reads, 1U);
}

TEST_F(MailboxTrackerTest, SeveralFrames) {
  const Bytes message = Padded(Coe(1, "0020 21f22f0010000000 4142434445464748494a4b4c4d4e4f50"));
  Write(Bytes(message.begin(), message.begin() + 20));
  Write(Bytes(message.begin() + 20, message.begin() + 40), kOut + 20);
  EXPECT_TRUE(sink_.messages.empty());
  Write(Bytes(message.begin() + 40, message.end()), kOut + 40);
  ASSERT_EQ(sink_.messages.size(), 1U);
  EXPECT_EQ(sink_.messages[0].bytes.size(), 26U);
  EXPECT_EQ(sink_.messages[0].first.number, 12U);
  EXPECT_EQ(sink_.messages[0].frame().number, 16U);
  Read(Bytes(Padded(Coe(1, "0030 60f22f0000000000"))));
  ASSERT_EQ(sink_.transfers.size(), 1U);
  EXPECT_EQ(Text(sink_.transfers[0].bytes), "ABCDEFGHIJKLMNOP");
}

TEST_F(MailboxTrackerTest, AccessWiderThanTheMailbox) {
  Bytes wide(16);
  const Bytes message = Padded(Coe(1, kUpload));
  wide.insert(wide.end(), message.begin(), message.end());
  wide.resize(wide.size() + 16);
  Write(wide, kOut - 16);
  ASSERT_EQ(sink_.messages.size(), 1U);
  EXPECT_EQ(sink_.messages[0].problem, Problem::kNone);
  EXPECT_EQ(sink_.messages[0].bytes, FromHex(kUpload));
}

TEST_F(MailboxTrackerTest, WithoutTheLastByteNothingIsSent) {
  Write(Coe(1, kUpload));  // 16 bytes, as the manuals describe it: the sync manager does not pass it on
  EXPECT_TRUE(sink_.messages.empty());
  Write(Padded(Coe(2, kUpload)));
  ASSERT_EQ(sink_.messages.size(), 2U);
  EXPECT_EQ(sink_.messages[0].problem, Problem::kNotCompleted);
  EXPECT_EQ(sink_.messages[1].problem, Problem::kNone);
  EXPECT_EQ(tracker_.counters().requests, 1U);
}

TEST_F(MailboxTrackerTest, BytesThatWereNotWrittenAreMissed) {
  Bytes message = Coe(1, kUpload);
  message[0] = 20;
  WriteApart(message);
  ASSERT_EQ(sink_.messages.size(), 1U);
  EXPECT_EQ(sink_.messages[0].problem, Problem::kLengthBeyondData);
  Write(Padded(Typed(3, 2, "00")));
  EXPECT_EQ(sink_.messages[1].problem, Problem::kServiceTooShort);
  Bytes huge = Padded(Coe(3, kUpload));
  huge[1] = 4;
  Write(huge);
  EXPECT_EQ(sink_.messages[2].problem, Problem::kLengthBeyondMailbox);
  EXPECT_EQ(tracker_.counters().malformed, 3U);
}

TEST_F(MailboxTrackerTest, WriteIntoAFullMailboxIsRefused) {
  Write(Padded(Coe(1, kUpload)));
  WriteApart(Coe(2, kUpload), Acceptance::kRefused);
  ASSERT_EQ(sink_.refused.size(), 1U);
  EXPECT_EQ(sink_.refused[0].header.counter, 2);
  EXPECT_EQ(sink_.refused[0].outstanding.frame.number, 12U);
  EXPECT_EQ(sink_.refused[0].outstanding.index, 0x1000);
  EXPECT_FALSE(sink_.refused[0].same_as_last);
  Write(Padded(Coe(1, kUpload)), kOut, Acceptance::kRefused);
  EXPECT_TRUE(sink_.refused[1].same_as_last);
  EXPECT_EQ(sink_.messages.size(), 1U);
  EXPECT_EQ(tracker_.counters().refused_writes, 2U);
}

TEST_F(MailboxTrackerTest, RepeatedRequestIsNoSecondTransfer) {
  Write(Padded(Coe(3, kUpload)));
  Write(Padded(Coe(3, kUpload)));
  ASSERT_EQ(sink_.messages.size(), 2U);
  EXPECT_FALSE(sink_.messages[0].repeated);
  EXPECT_TRUE(sink_.messages[1].repeated);
  Write(Padded(Coe(3, kUpload)));
  EXPECT_TRUE(sink_.messages[2].repeated);
  Read(Padded(Coe(1, kAnswer)));
  EXPECT_EQ(sink_.transfers.size(), 1U);
  EXPECT_TRUE(sink_.unanswered.empty());
  EXPECT_EQ(tracker_.counters().repeated, 2U);
  // The same bytes once more after the answer: a master that never advances its counter asks again.
  Write(Padded(Coe(3, kUpload)));
  EXPECT_FALSE(sink_.messages.back().repeated);
  Read(Padded(Coe(2, kAnswer)));
  EXPECT_EQ(sink_.transfers.size(), 2U);
}

TEST_F(MailboxTrackerTest, MastersThatDoNotCount) {
  for (int i = 0; i < 3; ++i) {
    Write(Padded(Coe(0, kUpload)));
    Read(Padded(Coe(i + 1, kAnswer)));
  }
  EXPECT_EQ(sink_.transfers.size(), 3U);
  EXPECT_EQ(tracker_.counters().repeated, 0U);
  EXPECT_EQ(sink_.messages[2].counter_step, CounterStep::kUnused);
}

TEST_F(MailboxTrackerTest, RequestWhoseFrameNeverReturned) {
  Write(Padded(Coe(1, kUpload)), kOut, Acceptance::kUnknown);
  ASSERT_EQ(sink_.messages.size(), 1U);
  EXPECT_EQ(sink_.messages[0].certainty, Certainty::kUnknown);
  Write(Padded(Coe(1, kUpload)), kOut, Acceptance::kRefused);  // it has arrived: the mailbox is full of it
  Read(Padded(Coe(1, kAnswer)));
  ASSERT_EQ(sink_.transfers.size(), 1U);
  EXPECT_EQ(sink_.transfers[0].certainty, Certainty::kObserved);
  EXPECT_EQ(sink_.transfers[0].request.number, 12U);
}

TEST_F(MailboxTrackerTest, MailboxFullOfARequestThatIsKnownTooLate) {
  Write(Padded(Coe(1, kUpload)));
  Read(Padded(Coe(1, kAnswer)));
  // Frame 16 with the next request never returned, which shows only later; its repetition finds the mailbox full.
  frame_ = 16;
  Write(Padded(Coe(2, "0020 4018100100000000")), kOut, Acceptance::kRefused);
  Read(Padded(Coe(2, "0030 43181001 6a000000")));
  EXPECT_TRUE(sink_.unexpected.empty());
  ASSERT_EQ(sink_.transfers.size(), 2U);
  EXPECT_EQ(sink_.transfers[1].certainty, Certainty::kInferred);
  EXPECT_FALSE(sink_.transfers[1].request.seen());
}

TEST_F(MailboxTrackerTest, LostRequestRepeatedWithoutCounting) {
  Write(Padded(Coe(0, kUpload)), kOut, Acceptance::kUnknown);
  Write(Padded(Coe(0, kUpload)));
  EXPECT_TRUE(sink_.messages[1].repeated);
  Read(Padded(Coe(1, kAnswer)));
  EXPECT_EQ(sink_.transfers.size(), 1U);
}

/// The frame of a request was overtaken by that of its answer.
class OvertakenRequest : public MailboxTrackerTest {
 protected:
  void Overtake(const Bytes& data, EscAddress address = kOut) {
    SlaveAccess access = Access(address, Acceptance::kUnknown);
    access.written = data;
    tracker_.OnDoubtful(access);
    written_ = frame_;
  }
  /// What became of the frame.
  void Ends(const Bytes& data, Acceptance acceptance) {
    const FrameNo now = frame_;
    frame_ = written_ - 2;
    Write(data, kOut, acceptance);
    frame_ = now;
  }

  FrameNo written_ = 0;
  const Bytes request_ = Padded(Coe(1, kUpload));
};

TEST_F(OvertakenRequest, IsTakenForWrittenOnceItIsAnswered) {
  Overtake(request_);
  EXPECT_TRUE(sink_.messages.empty());
  Read(Padded(Coe(1, kAnswer)));
  ASSERT_EQ(sink_.messages.size(), 2U);
  EXPECT_EQ(sink_.messages[0].frame().number, 12U);
  EXPECT_EQ(sink_.messages[0].certainty, Certainty::kUnknown);
  ASSERT_EQ(sink_.transfers.size(), 1U);
  EXPECT_EQ(sink_.transfers[0].request.number, 12U);
  EXPECT_EQ(sink_.transfers[0].certainty, Certainty::kObserved);
  EXPECT_TRUE(sink_.unexpected.empty());
}

TEST_F(OvertakenRequest, IsReportedOnce) {
  for (const Acceptance end : {Acceptance::kUnknown, Acceptance::kAccepted}) {
    Overtake(request_);
    Read(Padded(Coe(1, kAnswer)));
    const std::size_t told = sink_.messages.size();
    Ends(request_, end);
    EXPECT_EQ(sink_.messages.size(), told);
  }
  EXPECT_EQ(sink_.transfers.size(), 2U);
  EXPECT_EQ(tracker_.counters().requests, 2U);
  EXPECT_EQ(tracker_.counters().repeated, 0U);
}

TEST_F(OvertakenRequest, MayBeWrittenInParts) {
  Overtake(Coe(1, kUpload));
  same_frame_ = true;
  Overtake({0}, kOut + kLength - 1);
  same_frame_ = false;
  Read(Padded(Coe(1, kAnswer)));
  ASSERT_EQ(sink_.messages.size(), 2U);
  EXPECT_EQ(sink_.messages[0].bytes.size(), 10U);
}

TEST_F(OvertakenRequest, IsNotProvenByWhatAnswersAnother) {
  Write(request_);
  Read(Padded(Coe(1, kAnswer)));
  Overtake(request_);
  Read(Padded(Coe(2, "0030 4308100041424344")));  // another object
  Read(Padded(Coe(3, "0010 0000000000000000")));  // an emergency
  EXPECT_EQ(sink_.transfers.size(), 1U);
  EXPECT_EQ(tracker_.counters().requests, 1U);
}

TEST_F(OvertakenRequest, IsNotProvenOnceItsEndIsKnown) {
  Overtake(request_);
  Ends(request_, Acceptance::kRefused);
  Read(Padded(Coe(1, kAnswer)));
  EXPECT_EQ(tracker_.counters().requests, 0U);
}

TEST_F(OvertakenRequest, IsOldAfterALaterOne) {
  Overtake(request_);
  Write(Padded(Coe(2, "0020 4018100100000000")));
  Read(Padded(Coe(1, "0030 431810016a000000")));
  Read(Padded(Coe(2, kAnswer)));
  ASSERT_EQ(sink_.transfers.size(), 1U);
  EXPECT_EQ(sink_.transfers[0].index, 0x1018);
  EXPECT_EQ(tracker_.counters().requests, 1U);
}

TEST_F(MailboxTrackerTest, OvertakenReadMayHaveTakenTheAnswer) {
  for (const bool returns : {false, true}) {
    Write(Padded(Coe(1, kUpload)));
    SlaveAccess read = Access(kIn, Acceptance::kUnknown);
    read.command = wire::Command::FPRD;
    tracker_.OnDoubtful(read);
    if (returns) {
      read.acceptance = Acceptance::kRefused;
      tracker_.OnAccess(read);
    }
    Write(Padded(Coe(2, "0020 4018100100000000")));
    ASSERT_FALSE(sink_.transfers.empty());
    EXPECT_EQ(sink_.transfers.back().outcome, SdoOutcome::kSuperseded);
    EXPECT_EQ(sink_.transfers.back().answer_lost, !returns);
    Read(Padded(Coe(2, "0030 431810016a000000")));
  }
}

TEST_F(MailboxTrackerTest, LostWriteThatBecomesKnownLate) {
  Write(Padded(Coe(1, kUpload)));
  Read(Padded(Coe(1, kAnswer)));
  const FrameNo now = frame_;
  frame_ = 5;
  Write(Padded(Coe(7, "0020 4018100100000000")), kOut, Acceptance::kUnknown);
  frame_ = now;
  ASSERT_EQ(sink_.messages.size(), 3U);
  EXPECT_TRUE(sink_.messages[2].late);
  EXPECT_FALSE(sink_.messages[2].repeated);
  Write(Padded(Coe(2, kUpload)));
  EXPECT_EQ(sink_.messages[3].counter_step, CounterStep::kNext);
  Read(Padded(Coe(2, kAnswer)));
  EXPECT_EQ(sink_.transfers.size(), 2U);
  EXPECT_TRUE(sink_.unanswered.empty());
}

TEST_F(MailboxTrackerTest, LostReadAndRepeatRequest) {
  Write(Padded(Coe(1, kUpload)));
  ReadNothing(Acceptance::kUnknown);
  ASSERT_EQ(sink_.lost.size(), 1U);
  EXPECT_EQ(sink_.lost[0].outstanding.frame.number, 12U);
  Write(FromHex("0003"), 0x080D);  // as SOEM: status and activate byte
  Read(FromHex("02"), 0x080F);
  ASSERT_EQ(sink_.repeats.size(), 2U);
  EXPECT_EQ(sink_.repeats[0].kind, MailboxRepeatRequest::Kind::kRequested);
  EXPECT_EQ(sink_.repeats[1].kind, MailboxRepeatRequest::Kind::kAcknowledged);
  Read(Padded(Coe(1, kAnswer)));  // the stored answer
  EXPECT_FALSE(sink_.messages[1].repeated);
  EXPECT_EQ(sink_.messages[1].counter_step, CounterStep::kUnknown);
  ASSERT_EQ(sink_.transfers.size(), 1U);
  EXPECT_EQ(sink_.transfers[0].outcome, SdoOutcome::kCompleted);
  EXPECT_FALSE(sink_.transfers[0].answer_lost);
}

TEST_F(MailboxTrackerTest, AnswerThatComesTwiceAfterARepeatRequest) {
  Write(Padded(Coe(1, kUpload)));
  Read(Padded(Coe(1, kAnswer)));  // in the capture, although the master lost it
  Write(FromHex("03"), 0x080E);
  Read(Padded(Coe(1, kAnswer)));
  EXPECT_TRUE(sink_.messages[2].repeated);
  EXPECT_EQ(sink_.transfers.size(), 1U);
  EXPECT_TRUE(sink_.unexpected.empty());
  // Toggled back later: requested again.
  Write(FromHex("01"), 0x080E);
  EXPECT_EQ(sink_.repeats.size(), 2U);
  // A configuration of the whole sync manager is no repeat request.
  Write(FromHex("001c 4000 22 00 03 00"), 0x0808);
  EXPECT_EQ(sink_.repeats.size(), 2U);
  Write(FromHex("01"), 0x080E);
  EXPECT_EQ(sink_.repeats.size(), 3U);
}

TEST_F(MailboxTrackerTest, SameAnswerTwiceWithoutRepeatRequestIsTwoAnswers) {
  for (int i = 0; i < 2; ++i) {
    Write(Padded(Coe(1 + i, kUpload)));
    Read(Padded(Coe(1, kAnswer)));  // a slave that always says 1
  }
  EXPECT_EQ(sink_.transfers.size(), 2U);
  EXPECT_EQ(sink_.messages[3].counter_step, CounterStep::kSame);
  EXPECT_FALSE(sink_.messages[3].repeated);
}

TEST_F(MailboxTrackerTest, CounterSteps) {
  for (const int counter : {6, 7, 1, 3, 3, 0, 4}) {
    Write(Padded(Coe(counter, counter == 3 ? "0020 4000100000000000" : "0020 4018100000000000")));
    Read(Padded(Coe(counter, counter == 3 ? kAnswer : "0030 4f18100004000000")));
  }
  const CounterStep expected[] = {CounterStep::kUnknown, CounterStep::kNext, CounterStep::kNext,
                                  CounterStep::kSkipped, CounterStep::kSame, CounterStep::kUnused,
                                  CounterStep::kUnused};
  for (std::size_t i = 0; i < 7; ++i) {
    EXPECT_EQ(sink_.messages[2 * i].counter_step, expected[i]) << i;
    EXPECT_EQ(sink_.messages[2 * i + 1].counter_echoes_request, i != 5) << i;
  }
}

TEST_F(MailboxTrackerTest, EmergencyBetweenRequestAndAnswer) {
  Write(Padded(Coe(1, kUpload)));
  Read(Padded(Coe(1, "0010 0573 01 1122334455")));
  Read(Padded(Coe(2, kAnswer)));
  ASSERT_EQ(sink_.emergencies.size(), 1U);
  EXPECT_EQ(sink_.emergencies[0].data.error_code, 0x7305);
  ASSERT_EQ(sink_.transfers.size(), 1U);
  EXPECT_EQ(sink_.transfers[0].unexpected_responses, 0U);
  EXPECT_TRUE(sink_.unanswered.empty());
}

TEST_F(MailboxTrackerTest, RequestWithoutAnswer) {
  Write(Padded(Coe(1, kUpload)));
  Read(FromHex("00"), 0x080D);
  Read(FromHex("00"), 0x080D);
  ReadNothing(Acceptance::kRefused);
  Read(FromHex("08"), 0x0805);  // the slave has not even taken it
  Write(Padded(Coe(2, kUpload)));
  ASSERT_EQ(sink_.unanswered.size(), 1U);
  const MailboxUnanswered& u = sink_.unanswered[0];
  EXPECT_EQ(u.request.frame.number, 12U);
  EXPECT_EQ(u.request.protocol, Protocol::kCoE);
  EXPECT_EQ(u.request.index, 0x1000);
  EXPECT_EQ(u.end, MailboxUnanswered::End::kNextRequest);
  EXPECT_EQ(u.polls, 3U);
  EXPECT_EQ(u.first_poll.number, 15U);
  EXPECT_EQ(u.last_poll.number, 19U);
  EXPECT_TRUE(u.not_accepted);
  tracker_.Finish();
  ASSERT_EQ(sink_.unanswered.size(), 2U);
  EXPECT_EQ(sink_.unanswered[1].end, MailboxUnanswered::End::kCaptureEnd);
  EXPECT_EQ(sink_.unanswered[1].polls, 0U);
  EXPECT_FALSE(sink_.unanswered[1].not_accepted);
  EXPECT_EQ(tracker_.counters().unanswered, 2U);
}

TEST_F(MailboxTrackerTest, ErrorReplyNamesWhatItAnswers) {
  Write(Padded(Typed(4, 5, "0100 00000000 4543")));
  Read(Padded(Typed(0, 5, "0100 0200")));
  ASSERT_EQ(sink_.errors.size(), 1U);
  EXPECT_EQ(sink_.errors[0].detail, 2);
  EXPECT_EQ(sink_.errors[0].request.protocol, Protocol::kFoE);
  EXPECT_EQ(sink_.errors[0].request.operation, 1);
  ASSERT_EQ(sink_.files.size(), 1U);
  EXPECT_EQ(sink_.files[0].outcome, FoeTransfer::Outcome::kMailboxError);
  // An Ethernet fragment needs no answer but can be answered by an error.
  Write(Padded(Typed(2, 6, "0001 0100 ffffffffffff 000000000000 0800")));
  Read(Padded(Typed(0, 1, "0100 0200")));
  ASSERT_EQ(sink_.errors.size(), 2U);
  EXPECT_EQ(sink_.errors[1].request.protocol, Protocol::kEoE);
  EXPECT_EQ(sink_.errors[1].request.frame.number, 16U);
  // A second error to nothing.
  Read(Padded(Typed(0, 2, "0100 0200")));
  ASSERT_EQ(sink_.errors.size(), 3U);
  EXPECT_FALSE(sink_.errors[2].request.frame.seen());
}

TEST_F(MailboxTrackerTest, ErrorReplyGoesToTheRequestWithItsCounter) {
  Write(Padded(Coe(1, kUpload)));
  Write(Padded(Typed(2, 2, "0200 0000 00000000")));  // set IP, outstanding as well
  Read(Padded(Typed(0, 1, "0100 0700")));
  ASSERT_EQ(sink_.errors.size(), 1U);
  EXPECT_EQ(sink_.errors[0].request.protocol, Protocol::kCoE);
  ASSERT_EQ(sink_.transfers.size(), 1U);
  EXPECT_EQ(sink_.transfers[0].outcome, SdoOutcome::kMailboxError);
  Read(Padded(Typed(0, 7, "0100 0200")));
  EXPECT_EQ(sink_.errors[1].request.protocol, Protocol::kEoE);
}

TEST_F(MailboxTrackerTest, EveryProtocolReachesItsEvent) {
  Write(Padded(Typed(2, 1, "0200 0000 02000000 000000000000 8b00a8c0")));
  Read(Padded(Typed(2, 1, "0300 0000")));
  Write(Padded(Typed(5, 2, "01 40 1100")));
  Read(Padded(Typed(5, 2, "02 40 1100 0100")));
  Write(Padded(Typed(1, 3,
                     "c0a80001 0101 5303 c0a80002 0101 0080 0200 0400 0c000000 00000000 07000000"
                     "20f00000 00000000 04000000")));
  Read(Padded(Typed(1, 3,
                    "c0a80002 0101 0080 c0a80001 0101 5303 0200 0500 0c000000 00000000 07000000"
                    "00000000 04000000 01020304")));
  Write(Padded(Typed(15, 4, "6a000000 0100 aa")));
  Write(Padded(Coe(5, "0170 ")));
  Read(Padded(Coe(4, "0540 1122")));
  Write(Padded(Coe(6, "0080 03000000 1810")));
  Read(Padded(Coe(5, "0080 04000000 1810 0500 04 09 4964")));
  ASSERT_EQ(sink_.eoe_controls.size(), 2U);
  EXPECT_EQ(sink_.eoe_controls[1].request.number, sink_.eoe_controls[0].frame.number);
  ASSERT_EQ(sink_.soe.size(), 2U);
  EXPECT_EQ(sink_.soe[1].request.number, sink_.soe[0].frame.number);
  EXPECT_FALSE(sink_.soe[0].request.seen());
  ASSERT_EQ(sink_.aoe.size(), 2U);
  EXPECT_EQ(sink_.aoe[1].request.number, sink_.aoe[0].frame.number);
  EXPECT_EQ(sink_.aoe[1].bytes, FromHex("01020304"));
  ASSERT_EQ(sink_.voe.size(), 1U);
  EXPECT_EQ(sink_.voe[0].vendor_id, 0x6AU);
  ASSERT_EQ(sink_.pdos.size(), 2U);
  EXPECT_EQ(sink_.pdos[0].service, CoeService::kRxPdoRequest);
  EXPECT_EQ(sink_.pdos[0].number, 1);
  EXPECT_EQ(sink_.pdos[1].service, CoeService::kTxPdo);
  EXPECT_EQ(sink_.pdos[1].number, 5);
  EXPECT_EQ(sink_.pdos[1].bytes, FromHex("1122"));
  ASSERT_EQ(sink_.infos.size(), 1U);
  EXPECT_EQ(sink_.infos[0].text, "Id");
  tracker_.Finish();
  EXPECT_TRUE(sink_.unanswered.empty());
}

TEST_F(MailboxTrackerTest, ReconfigurationEndsWhatIsOpen) {
  Write(Padded(Coe(1, kUpload)));
  tracker_.SetWindow(kAkdLike, Frame(20));  // the same again: harmless
  EXPECT_TRUE(sink_.transfers.empty());
  MailboxWindow other = kAkdLike;
  other.out_length = 32;
  tracker_.SetWindow(other, Frame(21));
  ASSERT_EQ(sink_.transfers.size(), 1U);
  EXPECT_EQ(sink_.transfers[0].outcome, SdoOutcome::kReset);
  ASSERT_EQ(sink_.unanswered.size(), 1U);
  EXPECT_EQ(sink_.unanswered[0].end, MailboxUnanswered::End::kReset);
  EXPECT_EQ(sink_.unanswered[0].ended.number, 21U);
  Write(Padded(Coe(1, kUpload), 32));
  ASSERT_EQ(sink_.messages.size(), 2U);
  EXPECT_EQ(sink_.messages[1].counter_step, CounterStep::kUnknown);
  EXPECT_FALSE(sink_.messages[1].repeated);
  tracker_.Reset(Frame(30));
  EXPECT_EQ(sink_.transfers[1].outcome, SdoOutcome::kReset);
}

TEST_F(MailboxTrackerTest, MailboxThatIsSwitchedOff) {
  MailboxWindow off;
  off.out_use = off.in_use = MailboxUse::kOff;
  tracker_.SetWindow(off, Frame(20));
  Write(Padded(Coe(1, kUpload)));
  ASSERT_EQ(sink_.messages.size(), 1U);
  EXPECT_TRUE(sink_.messages[0].mailbox_off);
  EXPECT_FALSE(sink_.messages[0].window_inferred);
  Write(Padded(Coe(2, kUpload)), kOut, Acceptance::kRefused);
  ASSERT_EQ(sink_.refused.size(), 1U);
  EXPECT_TRUE(sink_.refused[0].off);
  Write(Padded(Coe(3, kUpload)), 0x1100);  // not where the mailbox was
  EXPECT_EQ(sink_.messages.size(), 1U);
  tracker_.Finish();
  EXPECT_TRUE(sink_.transfers.empty());  // nobody listened
  EXPECT_TRUE(sink_.unanswered.empty());
}

TEST_F(MailboxTrackerTest, ProcessDataAreNoMailbox) {
  MailboxWindow none;
  none.out_use = none.in_use = MailboxUse::kNone;
  tracker_.SetWindow(none, Frame(20));
  Write(Padded(Coe(1, kUpload)));
  Read(Padded(Coe(1, kAnswer)));
  EXPECT_TRUE(sink_.messages.empty());
  MailboxTracker fresh(0, sink_);
  SlaveAccess access = Access(0x1100, Acceptance::kAccepted);
  const Bytes outputs = FromHex("0f00 a4 20 01 00 00 ff 00 00 00 00 00 12 34 56 78");
  access.written = outputs;
  fresh.OnAccess(access);
  access.written = {};
  access.read = outputs;
  fresh.OnAccess(access);
  EXPECT_TRUE(sink_.messages.empty());
}

TEST(MailboxTrackerInference, MessagesAreRecognisedWithoutConfiguration) {
  Recorder sink;
  MailboxTracker tracker(0, sink);
  SlaveAccess access;
  access.command = wire::Command::FPWR;
  access.acceptance = Acceptance::kAccepted;
  access.sent = Frame(2);
  access.returned = Frame(3);
  access.address = kOut;
  const Bytes request = Coe(1, kUpload);
  access.written = request;
  tracker.OnAccess(access);
  access.address = kOut + kLength - 1;  // last byte apart
  const Bytes zero{0};
  access.written = zero;
  tracker.OnAccess(access);
  access.written = {};
  access.command = wire::Command::FPRD;
  access.address = kIn;
  const Bytes answer = Padded(Coe(1, kAnswer));
  access.read = answer;
  access.sent = Frame(4);
  access.returned = Frame(5);
  tracker.OnAccess(access);
  ASSERT_EQ(sink.messages.size(), 2U);
  for (const KeptMessage& m : sink.messages) {
    EXPECT_TRUE(m.window_inferred);
    EXPECT_EQ(m.certainty, Certainty::kInferred);
    EXPECT_EQ(m.problem, Problem::kNone);
  }
  ASSERT_EQ(sink.transfers.size(), 1U);
  EXPECT_EQ(sink.transfers[0].bytes, FromHex("92010200"));
  // Another place that looks like one does not count any more.
  access.address = 0x1100;
  tracker.OnAccess(access);
  EXPECT_EQ(sink.messages.size(), 2U);
}

TEST(MailboxTrackerInference, WhatAMessageMayLookLike) {
  EXPECT_TRUE(LooksLikeMessage(Coe(1, kUpload), Direction::kOut));
  EXPECT_TRUE(LooksLikeMessage(Coe(1, kAnswer), Direction::kIn));
  EXPECT_FALSE(LooksLikeMessage(Coe(1, kAnswer), Direction::kOut));                  // an answer is not written
  EXPECT_FALSE(LooksLikeMessage(Coe(1, "0220 4000100000000000"), Direction::kOut));  // SDO with a PDO number
  EXPECT_FALSE(LooksLikeMessage(Coe(1, "0022 4000100000000000"), Direction::kOut));  // reserved bits
  EXPECT_FALSE(LooksLikeMessage(Bytes(64), Direction::kOut));
  EXPECT_FALSE(LooksLikeMessage({}, Direction::kIn));
  EXPECT_FALSE(LooksLikeMessage(Typed(15, 1, "6a000000 0100"), Direction::kOut));
  EXPECT_TRUE(LooksLikeMessage(Typed(0, 1, "0100 0200"), Direction::kIn));
  EXPECT_FALSE(LooksLikeMessage(Typed(0, 1, "0100 0200"), Direction::kOut));
  EXPECT_TRUE(LooksLikeMessage(Typed(4, 1, "0100 00000000 61"), Direction::kOut));
  EXPECT_TRUE(LooksLikeMessage(Typed(5, 1, "01 40 1100"), Direction::kOut));
  EXPECT_FALSE(LooksLikeMessage(Typed(5, 1, "01 40 1100"), Direction::kIn));
  EXPECT_TRUE(LooksLikeMessage(Typed(2, 1, "0200 0000"), Direction::kOut));
}

TEST_F(MailboxTrackerTest, OutboundOnly) {
  Write(Padded(Coe(1, "0020 2b121c0104170000")), kOut, Acceptance::kAssumed);
  ReadNothing(Acceptance::kAssumed);
  Write(Padded(Coe(2, kUpload)), kOut, Acceptance::kAssumed);
  tracker_.Finish();
  ASSERT_EQ(sink_.transfers.size(), 2U);
  for (const KeptTransfer& t : sink_.transfers) {
    EXPECT_EQ(t.outcome, SdoOutcome::kNotCaptured);
    EXPECT_EQ(t.certainty, Certainty::kInferred);
  }
  EXPECT_TRUE(sink_.unanswered.empty());
  EXPECT_TRUE(sink_.lost.empty());
}

TEST_F(MailboxTrackerTest, ReturnedCopiesAlone) {
  SlaveAccess access = Access(kOut, Acceptance::kAccepted);
  access.sent = {};
  const Bytes request = Padded(Coe(1, kUpload));
  access.written = request;
  tracker_.OnAccess(access);
  access = Access(kIn, Acceptance::kAccepted);
  access.sent = {};
  const Bytes answer = Padded(Coe(1, kAnswer));
  access.read = answer;
  tracker_.OnAccess(access);
  ASSERT_EQ(sink_.transfers.size(), 1U);
  EXPECT_EQ(sink_.transfers[0].request.number, 13U);
  EXPECT_EQ(sink_.transfers[0].response.number, 15U);
  EXPECT_EQ(sink_.transfers[0].certainty, Certainty::kObserved);
}

TEST_F(MailboxTrackerTest, BroadcastsAreNoMessages) {
  SlaveAccess access = Access(kOut, Acceptance::kAccepted);
  const Bytes request = Padded(Coe(1, kUpload));
  access.written = request;
  access.broadcast = true;
  tracker_.OnAccess(access);
  EXPECT_TRUE(sink_.messages.empty());
}

TEST_F(MailboxTrackerTest, CaptureGapLeavesTransfersUnknown) {
  Write(Padded(Coe(1, "0020 40f02f0000000000")));
  Read(Padded(Coe(1, "0030 41f02f00ff000000")));
  tracker_.Forget(Frame(20));
  ASSERT_EQ(sink_.transfers.size(), 1U);
  EXPECT_EQ(sink_.transfers[0].outcome, SdoOutcome::kGap);
  Read(Padded(Coe(4, kAnswer)));  // to a request inside the gap
  ASSERT_EQ(sink_.transfers.size(), 2U);
  EXPECT_EQ(sink_.transfers[1].certainty, Certainty::kInferred);
  EXPECT_TRUE(sink_.unexpected.empty());
}

TEST(MailboxWindow, FromTheRegisters) {
  track::SlaveState state;
  MailboxWindow window = track::MailboxWindowOf(state);
  EXPECT_EQ(window.out_use, MailboxUse::kUnknown);
  EXPECT_EQ(window.in_use, MailboxUse::kUnknown);
  state.registers.Write(0x0800, FromHex("0018 0004 26 00 01 00  001c 0004 22 00 01 00"), Certainty::kObserved);
  window = track::MailboxWindowOf(state);
  EXPECT_EQ(window, (MailboxWindow{0x1800, 0x400, 0x1C00, 0x400, MailboxUse::kOn, MailboxUse::kOn}));
  state.registers.Write(0x0800, Bytes(16), Certainty::kObserved);
  window = track::MailboxWindowOf(state);
  EXPECT_EQ(window.out_use, MailboxUse::kOff);
  EXPECT_EQ(window.in_use, MailboxUse::kOff);
  // A terminal without mailbox: outputs in sync manager 0
  state.registers.Write(0x0800, FromHex("000f 0100 44 00 01 00"), Certainty::kObserved);
  EXPECT_EQ(track::MailboxWindowOf(state).out_use, MailboxUse::kNone);
}

}  // namespace
}  // namespace ecaudit::mailbox
