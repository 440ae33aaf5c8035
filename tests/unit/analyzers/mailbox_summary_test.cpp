// What the report says of the mailboxes: counted from the events, repetitions left out.
#include "analyzers/collect/mailbox_summary.h"

#include <gtest/gtest.h>

namespace ecaudit {
namespace {

using mailbox::Direction;
using mailbox::MailboxMessage;
using mailbox::Protocol;

MailboxMessage Message(SlaveId slave, Direction direction, Protocol protocol) {
  MailboxMessage message;
  message.slave = slave;
  message.direction = direction;
  message.header.protocol = protocol;
  return message;
}

mailbox::SdoTransfer Transfer(mailbox::SdoService service, mailbox::SdoOutcome outcome) {
  mailbox::SdoTransfer transfer;
  transfer.slave = 1;
  transfer.service = service;
  transfer.outcome = outcome;
  return transfer;
}

TEST(MailboxStatistics, CountsMessagesByProtocol) {
  EventBus bus;
  MailboxStatistics statistics(bus);
  statistics.On(Message(1, Direction::kOut, Protocol::kCoE));
  statistics.On(Message(1, Direction::kOut, Protocol::kCoE));
  statistics.On(Message(1, Direction::kIn, Protocol::kCoE));
  statistics.On(Message(1, Direction::kOut, Protocol::kFoE));
  statistics.On(Message(1, Direction::kIn, Protocol::kError));
  const MailboxSummary summary = statistics.Of(1);
  EXPECT_EQ(summary.requests, 3U);
  EXPECT_EQ(summary.responses, 2U);
  ASSERT_EQ(summary.by_protocol.size(), 3U);
  EXPECT_EQ(summary.by_protocol[0].protocol, "error");
  EXPECT_EQ(summary.by_protocol[0].responses, 1U);
  EXPECT_EQ(summary.by_protocol[1].protocol, "CoE");
  EXPECT_EQ(summary.by_protocol[1].requests, 2U);
  EXPECT_EQ(summary.by_protocol[1].responses, 1U);
  EXPECT_EQ(summary.by_protocol[2].protocol, "FoE");
}

TEST(MailboxStatistics, RepetitionsAndLateMessagesDoNotCount) {
  EventBus bus;
  MailboxStatistics statistics(bus);
  MailboxMessage message = Message(0, Direction::kOut, Protocol::kCoE);
  statistics.On(message);
  message.repeated = true;
  statistics.On(message);
  message.repeated = false;
  message.late = true;
  statistics.On(message);
  EXPECT_EQ(statistics.Of(0).requests, 1U);
}

TEST(MailboxStatistics, CountsTransfersByServiceAndOutcome) {
  using mailbox::SdoOutcome;
  using mailbox::SdoService;
  EventBus bus;
  MailboxStatistics statistics(bus);
  statistics.On(Transfer(SdoService::kUpload, SdoOutcome::kCompleted));
  statistics.On(Transfer(SdoService::kUpload, SdoOutcome::kAborted));
  statistics.On(Transfer(SdoService::kUpload, SdoOutcome::kCaptureEnd));
  statistics.On(Transfer(SdoService::kDownload, SdoOutcome::kAborted));
  statistics.On(Transfer(SdoService::kUnknown, SdoOutcome::kCompleted));
  EXPECT_EQ(statistics.Of(1).sdo_uploads, 3U);
  EXPECT_EQ(statistics.Of(1).sdo_downloads, 1U);
  EXPECT_EQ(statistics.Of(1).aborts, 2U);
  EXPECT_EQ(statistics.Of(0).sdo_uploads, 0U) << "another slave";
}

TEST(MailboxStatistics, GapsOfTheCaptureLeaveNothingUnanswered) {
  EventBus bus;
  MailboxStatistics statistics(bus);
  mailbox::MailboxUnanswered unanswered;
  unanswered.slave = 0;
  unanswered.end = mailbox::MailboxUnanswered::End::kGap;
  statistics.On(unanswered);
  EXPECT_EQ(statistics.Of(0).unanswered, 0U);
  unanswered.end = mailbox::MailboxUnanswered::End::kReset;
  statistics.On(unanswered);
  EXPECT_EQ(statistics.Of(0).unanswered, 1U);
}

TEST(MailboxStatistics, CountsEmergenciesAndErrorReplies) {
  EventBus bus;
  MailboxStatistics statistics(bus);
  mailbox::Emergency emergency;
  emergency.slave = 2;
  statistics.On(emergency);
  mailbox::MailboxErrorReply reply;
  reply.slave = 2;
  statistics.On(reply);
  statistics.On(reply);
  EXPECT_EQ(statistics.Of(2).emergencies, 1U);
  EXPECT_EQ(statistics.Of(2).error_replies, 2U);
  EXPECT_EQ(statistics.Of(7).emergencies, 0U) << "a slave that was never met";
}

}  // namespace
}  // namespace ecaudit
