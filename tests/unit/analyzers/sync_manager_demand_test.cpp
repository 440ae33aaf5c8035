// What sync managers must be set to: EEPROM before ESI before manual (esc-reference 6.1, 11.1; rule catalogue).
#include "analyzers/model/sync_manager_demand.h"

#include <vector>

#include <gmock/gmock.h>

#include "decoder/device/profile_registry.h"

namespace ecaudit::model {
namespace {

using device::DeviceDescription;
using device::SyncManagerUse;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using Field = SyncManagerFault::Field;

DeviceDescription Family(const char* name) {
  return *device::BuiltinProfile(name);
}

esc::SiiContents Mailboxes(esc::SiiMailbox out, esc::SiiMailbox in) {
  esc::SiiContents sii;
  sii.header.standard_receive = out;
  sii.header.standard_send = in;
  return sii;
}

/// EEPROM that was read to its end and holds these sync managers.
esc::SiiContents WithSyncManagers(std::vector<esc::SiiSyncManager> managers) {
  esc::SiiContents sii;
  sii.chain_end = esc::SiiChainEnd::kEndMark;
  esc::SiiCategory category;
  category.type = static_cast<std::uint16_t>(esc::SiiCategoryType::SYNC_MANAGER);
  category.coverage = esc::SiiCategory::Coverage::kComplete;
  sii.categories.push_back(category);
  sii.sync_managers = std::move(managers);
  return sii;
}

std::vector<Field> FieldsOf(const std::vector<SyncManagerFault>& faults) {
  std::vector<Field> fields;
  for (const SyncManagerFault& fault : faults) fields.push_back(fault.field);
  return fields;
}

TEST(MailboxDemands, TheEepromComesBeforeTheManual) {
  const auto demands = MailboxDemands(Family("kollmorgen-akd-2011"), Mailboxes({0x1000, 128}, {0x1080, 96}));
  ASSERT_TRUE(demands.known);
  ASSERT_THAT(demands.list, SizeIs(2));
  EXPECT_EQ(demands.list[0].number, 0);
  EXPECT_TRUE(demands.list[0].master_writes());
  EXPECT_THAT(demands.list[0].starts, ElementsAre(0x1000U));
  EXPECT_THAT(demands.list[0].lengths, ElementsAre(128U));
  EXPECT_EQ(demands.list[1].number, 1);
  EXPECT_FALSE(demands.list[1].master_writes());
  EXPECT_THAT(demands.list[1].starts, ElementsAre(0x1080U));
  EXPECT_THAT(demands.list[1].lengths, ElementsAre(96U));
}

TEST(MailboxDemands, MailboxWordsAndCategoryAreBothAllowed) {
  esc::SiiContents sii = WithSyncManagers({{0x1000, 256, 0x26, 0, 1, 1}, {0x1100, 256, 0x22, 0, 1, 2}});
  sii.header.standard_receive = esc::SiiMailbox{0x1000, 128};
  sii.header.standard_send = esc::SiiMailbox{0x1080, 128};
  const auto demands = MailboxDemands(Family("generic"), sii);
  ASSERT_THAT(demands.list, SizeIs(2));
  EXPECT_THAT(demands.list[0].lengths, ElementsAre(128U, 256U));
  EXPECT_THAT(demands.list[1].starts, ElementsAre(0x1080U, 0x1100U));
}

TEST(MailboxDemands, WithoutEepromTheManualTellsTheStartButNoLength) {
  const auto demands = MailboxDemands(Family("kollmorgen-akd-2011"), {});
  ASSERT_THAT(demands.list, SizeIs(2));
  EXPECT_THAT(demands.list[0].starts, ElementsAre(0x1800U));
  EXPECT_THAT(demands.list[0].lengths, IsEmpty());
  EXPECT_THAT(demands.list[1].starts, ElementsAre(0x1C00U));
}

TEST(MailboxDemands, AnEsiFileTellsTheLength) {
  DeviceDescription family = Family("kollmorgen-akd-2011");
  family.esi.emplace();
  const auto demands = MailboxDemands(family, {});
  ASSERT_THAT(demands.list, SizeIs(2));
  EXPECT_THAT(demands.list[0].lengths, ElementsAre(512U));
}

TEST(MailboxDemands, ASlaveWithoutMailboxHasNone) {
  const auto none = MailboxDemands(Family("generic"), Mailboxes({0, 0}, {0, 0}));
  EXPECT_TRUE(none.known);
  EXPECT_THAT(none.list, IsEmpty());
  EXPECT_FALSE(MailboxDemands(Family("generic"), {}).known);
}

TEST(ProcessDemands, TheEepromComesBeforeTheManual) {
  const auto demands = ProcessDemands(Family("kollmorgen-akd-2011"), WithSyncManagers({{0x1800, 128, 0x26, 0, 1, 1},
                                                                                       {0x1C00, 128, 0x22, 0, 1, 2},
                                                                                       {0x1200, 0, 0x64, 0, 1, 3},
                                                                                       {0x1300, 0, 0x22, 0, 8, 4},
                                                                                       {0x1400, 0, 0x20, 0, 4, 4}}));
  ASSERT_TRUE(demands.known);
  ASSERT_THAT(demands.list, SizeIs(2)) << "the last one is virtual: it needs no sync manager";
  EXPECT_EQ(demands.list[0].number, 2);
  EXPECT_EQ(demands.list[0].use, SyncManagerUse::kProcessOut);
  EXPECT_THAT(demands.list[0].starts, ElementsAre(0x1200U));
  EXPECT_TRUE(demands.list[0].enabled);
  EXPECT_FALSE(demands.list[0].one_buffer);
  EXPECT_EQ(demands.list[0].max_length, 64U);
  EXPECT_FALSE(demands.list[1].enabled) << "in OP only";
  EXPECT_TRUE(demands.list[1].one_buffer) << "control 0x22";
}

TEST(ProcessDemands, WithoutEepromTheManualTellsTheStart) {
  const auto demands = ProcessDemands(Family("pilz-pmcprotego-d"), {});
  ASSERT_THAT(demands.list, SizeIs(2));
  EXPECT_THAT(demands.list[0].starts, ElementsAre(0x1100U));
  EXPECT_THAT(demands.list[1].starts, ElementsAre(0x1140U));
  EXPECT_EQ(demands.list[1].max_length, 72U);
  EXPECT_FALSE(ProcessDemands(Family("generic"), {}).known);
}

TEST(FaultsOf, NamesEachSettingThatIsWrong) {
  SyncManagerDemand demand;
  demand.use = SyncManagerUse::kMailboxOut;
  demand.starts = {0x1800};
  demand.lengths = {128, 256};
  EXPECT_THAT(FaultsOf({0x1800, 256, 0x26, 0, 1, 0}, demand), IsEmpty());
  EXPECT_THAT(FieldsOf(FaultsOf({0x1802, 64, 0x20, 0, 1, 0}, demand)),
              ElementsAre(Field::kMode, Field::kDirection, Field::kStart, Field::kLength));
  EXPECT_THAT(FieldsOf(FaultsOf({0x1800, 128, 0x26, 0, 0, 0}, demand)), ElementsAre(Field::kEnable));
  EXPECT_THAT(FieldsOf(FaultsOf({0x1800, 128, 0x25, 0, 1, 0}, demand)), ElementsAre(Field::kMode)) << "reserved mode";
  EXPECT_THAT(FieldsOf(FaultsOf({0x1800, 128, 0x2A, 0, 1, 0}, demand)), ElementsAre(Field::kDirection)) << "reserved";
}

TEST(FaultsOf, WithoutLengthTheLargestCounts) {
  SyncManagerDemand demand;
  demand.use = SyncManagerUse::kProcessIn;
  demand.max_length = 64;
  EXPECT_THAT(FaultsOf({0x1140, 64, 0x20, 0, 1, 0}, demand), IsEmpty());
  EXPECT_THAT(FieldsOf(FaultsOf({0x1140, 65, 0x20, 0, 1, 0}, demand)), ElementsAre(Field::kLength));
  EXPECT_THAT(FieldsOf(FaultsOf({0x1140, 0, 0x20, 0, 1, 0}, demand)), ElementsAre(Field::kLength));
}

}  // namespace
}  // namespace ecaudit::model
