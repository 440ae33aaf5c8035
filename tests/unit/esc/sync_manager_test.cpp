#include "decoder/esc/sync_manager.h"

#include <array>

#include <gtest/gtest.h>

namespace ecaudit::esc {
namespace {

using SyncManagerBytes = std::array<std::uint8_t, kSyncManagerBytes>;

// soem-sdinfo-akd, frames 263, 735 and 737.
constexpr SyncManagerBytes kMailboxOut = {0x00, 0x18, 0x00, 0x04, 0x26, 0x00, 0x01, 0x00};
constexpr SyncManagerBytes kMailboxIn = {0x00, 0x1C, 0x00, 0x04, 0x22, 0x00, 0x01, 0x00};
constexpr SyncManagerBytes kOutputs = {0x00, 0x11, 0x11, 0x00, 0x24, 0x00, 0x01, 0x00};
constexpr SyncManagerBytes kInputs = {0x40, 0x11, 0x11, 0x00, 0x20, 0x00, 0x01, 0x00};

TEST(SyncManager, MailboxOutOfARealAkd) {
  const auto sm = SyncManager::Decode(kMailboxOut);
  ASSERT_TRUE(sm);
  EXPECT_EQ(sm->start, 0x1800);
  EXPECT_EQ(sm->length, 1024);
  EXPECT_TRUE(sm->mailbox());
  EXPECT_EQ(sm->direction(), SmDirection::ECAT_WRITES);
  EXPECT_TRUE(sm->pdi_irq());
  EXPECT_FALSE(sm->ecat_irq());
  EXPECT_FALSE(sm->watchdog_trigger());
  EXPECT_TRUE(sm->enabled());
  EXPECT_EQ(sm->end(), 0x1C00U);
  EXPECT_EQ(sm->occupied_bytes(), 1024U);
}

TEST(SyncManager, MailboxInAndProcessDataOfARealAkd) {
  EXPECT_EQ(SyncManager::Decode(kMailboxIn)->direction(), SmDirection::ECAT_READS);
  const auto outputs = SyncManager::Decode(kOutputs);
  EXPECT_EQ(outputs->mode(), SmMode::BUFFERED);
  EXPECT_TRUE(outputs->ecat_writes());
  EXPECT_EQ(outputs->occupied_bytes(), 51U);  // three buffers of 17 bytes
  const auto inputs = SyncManager::Decode(kInputs);
  EXPECT_EQ(inputs->start, 0x1140);
  EXPECT_TRUE(inputs->ecat_reads());
  EXPECT_FALSE(outputs->Overlaps(*inputs));
}

// SOEM's defaults are 32-bit words laid over control, status, activate and PDI control (esc-reference 6.1).
TEST(SyncManager, DefaultWordsOfSoem) {
  const auto mailbox = SyncManager::Decode(SyncManagerBytes{0x00, 0x10, 0x80, 0x00, 0x26, 0x00, 0x01, 0x00});
  EXPECT_EQ(mailbox->control, 0x26);
  EXPECT_TRUE(mailbox->enabled());
  const auto digital_out = SyncManager::Decode(SyncManagerBytes{0x00, 0x0F, 0x01, 0x00, 0x44, 0x00, 0x01, 0x00});
  EXPECT_TRUE(digital_out->buffered());
  EXPECT_TRUE(digital_out->ecat_writes());
  EXPECT_TRUE(digital_out->watchdog_trigger());
  EXPECT_EQ(digital_out->occupied_bytes(), 1U);  // a length of 1 has no buffers
}

TEST(SyncManager, StatusBits) {
  SyncManager sm;
  sm.status = 0x30;  // never written, as ESCs read after a re-init
  EXPECT_EQ(sm.last_buffer(), 3);
  EXPECT_FALSE(sm.mailbox_full());
  sm.status = 0x09;  // soem-sdinfo-akd 288: mailbox in full
  EXPECT_TRUE(sm.irq_write());
  EXPECT_FALSE(sm.irq_read());
  EXPECT_TRUE(sm.mailbox_full());
  sm.status = 0x02;
  EXPECT_TRUE(sm.irq_read());
  sm.status = 0x40;
  EXPECT_TRUE(sm.read_buffer_open());
  EXPECT_FALSE(sm.write_buffer_open());
  sm.status = 0x80;
  EXPECT_TRUE(sm.write_buffer_open());
}

TEST(SyncManager, ActivateAndPdiControl) {
  SyncManager sm;
  sm.activate = 0x03;
  EXPECT_TRUE(sm.enabled());
  EXPECT_TRUE(sm.repeat_request());
  EXPECT_TRUE(sm.active());
  sm.pdi_control = 0x03;
  EXPECT_TRUE(sm.deactivated_by_pdi());
  EXPECT_TRUE(sm.repeat_acknowledge());
  EXPECT_FALSE(sm.active());
  sm.activate = 0xC0;
  EXPECT_TRUE(sm.latch_ecat());
  EXPECT_TRUE(sm.latch_pdi());
  EXPECT_FALSE(sm.enabled());
}

TEST(SyncManager, TooFewBytes) {
  EXPECT_FALSE(SyncManager::Decode(ByteSpan(kInputs).first(7)));
}

TEST(SyncManager, Touches) {
  const SyncManager sm = *SyncManager::Decode(kMailboxOut);
  EXPECT_TRUE(sm.Touches(0x1800, 1));
  EXPECT_TRUE(sm.Touches(0x1BFF, 1));
  EXPECT_TRUE(sm.Touches(0x17FF, 2));
  EXPECT_FALSE(sm.Touches(0x17FF, 1));
  EXPECT_FALSE(sm.Touches(0x1C00, 4));
  EXPECT_FALSE(sm.Touches(0x1900, 0));
  SyncManager empty = sm;
  empty.length = 0;
  EXPECT_FALSE(empty.Touches(0x17FF, 4)) << "an access across it";
}

TEST(SyncManager, OverlapCountsThreeBuffers) {
  const SyncManager outputs{0x1100, 30, 0x24, 0, 1, 0};  // occupies 0x1100-0x1159
  EXPECT_TRUE(outputs.Overlaps({0x1140, 4, 0x20, 0, 1, 0}));
  EXPECT_TRUE((SyncManager{0x1140, 4, 0x20, 0, 1, 0}).Overlaps(outputs));
  EXPECT_FALSE(outputs.Overlaps({0x115A, 4, 0x20, 0, 1, 0}));
  EXPECT_FALSE(outputs.Overlaps({0x1140, 0, 0x20, 0, 1, 0}));
}

TEST(SyncManager, EndAfterTheAddressSpace) {
  const SyncManager sm{0xFFFF, 0xFFFF, 0x00, 0, 1, 0};
  EXPECT_EQ(sm.end(), 0x1FFFEU);
  EXPECT_EQ(sm.occupied_bytes(), 0x2FFFDU);
}

TEST(SyncManager, SameSettingsIgnoresWhatTheMasterCannotWrite) {
  SyncManager a = *SyncManager::Decode(kOutputs);
  SyncManager b = a;
  b.status = 0x30;
  b.pdi_control = 1;
  EXPECT_TRUE(a.SameSettings(b));
  b.activate = 0;
  EXPECT_FALSE(a.SameSettings(b));
}

TEST(SyncManager, Addresses) {
  EXPECT_EQ(SyncManagerAddress(0), 0x0800);
  EXPECT_EQ(SyncManagerAddress(3), 0x0818);
  EXPECT_EQ(SyncManagerAddress(15), 0x0878);
}

}  // namespace
}  // namespace ecaudit::esc
