// Which accesses to a mailbox the model can foretell (esc-reference 6.2).
#include "analyzers/model/mailbox_unit.h"

#include <vector>

#include <gtest/gtest.h>

#include "analyzers/wiring/event_bus.h"

namespace ecaudit::model {
namespace {

using track::Acceptance;

constexpr EscAddress kOut = 0x1000;
constexpr EscAddress kIn = 0x1080;
constexpr std::size_t kLength = 128;

class MailboxUnitTest : public testing::Test, protected EventBus {
 protected:
  MailboxUnitTest() {
    Listen(Stage::kModel, *this, &MailboxUnitTest::On);
    Configure(0, kOut, 0x26);
    Configure(1, kIn, 0x22);
  }
  void On(const Predicted& e) { predicted.push_back(e); }

  void Configure(std::size_t n, EscAddress start, std::uint8_t control) {
    const std::vector<std::uint8_t> bytes{
        static_cast<std::uint8_t>(start), static_cast<std::uint8_t>(start >> 8U), kLength, 0, control, 0, 1, 0};
    state.registers.Write(esc::SyncManagerAddress(n), bytes, Certainty::kObserved);
    ++state.mapping_version;
  }
  void Read(EscAddress address, std::vector<std::uint8_t> bytes, Acceptance acceptance = Acceptance::kAccepted) {
    track::SlaveAccess access = Access(address, acceptance);
    if (acceptance == Acceptance::kAccepted) access.read = bytes;
    unit.OnAccess(access);
  }
  void Write(EscAddress address, std::vector<std::uint8_t> bytes, Acceptance acceptance = Acceptance::kAccepted) {
    track::SlaveAccess access = Access(address, acceptance);
    access.written = bytes;
    unit.OnAccess(access);
  }
  void Status(std::size_t n, bool full) {
    Read(static_cast<EscAddress>(esc::SyncManagerAddress(n) + 5), {static_cast<std::uint8_t>(full ? 0x08 : 0x00)});
  }

  track::SlaveState state;
  std::vector<Predicted> predicted;
  MailboxUnit unit{0, state, *this};

 private:
  track::SlaveAccess Access(EscAddress address, Acceptance acceptance) {
    track::SlaveAccess access;
    access.address = address;
    access.acceptance = acceptance;
    access.sent.number = frame_++;
    access.returned.number = frame_++;
    return access;
  }
  FrameNo frame_ = 1;
};

TEST_F(MailboxUnitTest, NothingIsForetoldBeforeTheStatusWasRead) {
  Write(kOut, std::vector<std::uint8_t>(kLength));
  Read(kIn, std::vector<std::uint8_t>(kLength));
  EXPECT_TRUE(predicted.empty());
}

TEST_F(MailboxUnitTest, AnEmptyMailboxTakesTheNextMessage) {
  Status(0, false);
  Write(kOut, std::vector<std::uint8_t>(kLength));
  ASSERT_EQ(predicted.size(), 1U);
  EXPECT_TRUE(predicted[0].held);
  EXPECT_EQ(predicted[0].frame.number, 4U) << "the returned copy";
  Write(kOut, std::vector<std::uint8_t>(kLength), Acceptance::kRefused);
  EXPECT_EQ(predicted.size(), 1U) << "the slave may not have taken the first one yet";
}

TEST_F(MailboxUnitTest, AnEmptyMailboxThatRefusesIsADeviation) {
  Status(0, false);
  Write(kOut, std::vector<std::uint8_t>(kLength), Acceptance::kRefused);
  ASSERT_EQ(predicted.size(), 1U);
  EXPECT_FALSE(predicted[0].held);
}

TEST_F(MailboxUnitTest, AFullMailboxMayBeTakenAtAnyTime) {
  Status(0, true);
  Write(kOut, std::vector<std::uint8_t>(kLength));
  EXPECT_TRUE(predicted.empty());
}

TEST_F(MailboxUnitTest, AFullInMailboxGivesItsMessageOnce) {
  Status(1, true);
  Read(kIn, std::vector<std::uint8_t>(kLength));
  Read(kIn, {}, Acceptance::kRefused);
  ASSERT_EQ(predicted.size(), 1U);
  EXPECT_TRUE(predicted[0].held);
}

TEST_F(MailboxUnitTest, AFullInMailboxThatGivesNothingIsADeviation) {
  Status(1, true);
  Read(kIn, {}, Acceptance::kRefused);
  ASSERT_EQ(predicted.size(), 1U);
  EXPECT_FALSE(predicted[0].held);
}

TEST_F(MailboxUnitTest, AnEmptyInMailboxMayFillAtAnyTime) {
  Status(1, false);
  Read(kIn, std::vector<std::uint8_t>(kLength));
  EXPECT_TRUE(predicted.empty());
}

TEST_F(MailboxUnitTest, AStateRequestOrAnotherConfigurationEndsWhatIsKnown) {
  Status(1, true);
  unit.Forget();
  Read(kIn, {}, Acceptance::kRefused);
  Status(0, false);
  Configure(0, 0x1200, 0x26);
  Write(0x1200, std::vector<std::uint8_t>(kLength), Acceptance::kRefused);
  EXPECT_TRUE(predicted.empty());
}

TEST_F(MailboxUnitTest, ALostFrameTellsNothing) {
  Status(1, true);
  Read(kIn, {}, Acceptance::kUnknown);
  Read(kIn, {}, Acceptance::kRefused);
  EXPECT_TRUE(predicted.empty());
}

TEST_F(MailboxUnitTest, AStatusThatWasOvertakenTellsNothing) {
  track::SlaveAccess late;
  late.address = static_cast<EscAddress>(esc::SyncManagerAddress(1) + 5);
  late.acceptance = Acceptance::kAccepted;
  const std::vector<std::uint8_t> full{0x08};
  late.read = full;
  late.sent.number = 1;
  late.returned.number = 9;
  Read(0x0130, {8, 0});  // frames 1 and 2 go to something else
  Read(kIn, std::vector<std::uint8_t>(kLength));
  unit.OnAccess(late);
  Read(kIn, {}, Acceptance::kRefused);
  EXPECT_TRUE(predicted.empty());
}

}  // namespace
}  // namespace ecaudit::model
