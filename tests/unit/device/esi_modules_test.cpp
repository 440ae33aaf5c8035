#include "decoder/device/esi_modules.h"

#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "decoder/device/esi_reader.h"

namespace ecaudit::device {
namespace {

using ::testing::ElementsAre;

/// Written by hand after ETG.2000: modules stand behind the device that takes them, and not in the order of idents.
constexpr std::string_view kModular = R"(<EtherCATInfo><Vendor><Id>1</Id></Vendor><Descriptions>
  <Devices><Device>
    <Type ProductCode="#x10" RevisionNo="1">Coupler</Type>
    <TxPdo Sm="3"><Index>#x1AFF</Index><Name>State</Name>
      <Entry><Index>#xF100</Index><SubIndex>1</SubIndex><BitLen>8</BitLen><Name>State</Name></Entry></TxPdo>
    <Slots SlotPdoIncrement="2" SlotIndexIncrement="#x10"><Slot><ModuleIdent Default="1">#x20</ModuleIdent></Slot></Slots>
  </Device></Devices>
  <Modules>
    <Module><Type ModuleIdent="#x20">Out</Type>
      <RxPdo Sm="2"><Index DependOnSlot="1">#x1600</Index><Name>Outputs</Name>
        <Entry><Index DependOnSlot="1">#x7000</Index><SubIndex>1</SubIndex><BitLen>4</BitLen><Name>Value</Name></Entry>
        <Entry><Index>0</Index><BitLen>4</BitLen></Entry>
        <Entry><Index>#x2000</Index><SubIndex>0</SubIndex><BitLen>8</BitLen><Name>Common</Name></Entry></RxPdo>
      <Profile><Dictionary><Objects>
        <Object><Index DependOnSlot="1">#x8000</Index><Name>Filter</Name><Type>USINT</Type></Object>
        <Object><Index>#x2000</Index><Name>Common</Name><Type>USINT</Type></Object>
      </Objects></Dictionary></Profile></Module>
    <Module><Type ModuleIdent="#x10">Far</Type>
      <TxPdo Sm="3"><Index DependOnSlot="1">#xFFFF</Index><Name>Beyond</Name></TxPdo></Module>
  </Modules></Descriptions></EtherCATInfo>)";

class EsiModules : public ::testing::Test {
 protected:
  void SetUp() override {
    auto read = ReadEsi(kModular);
    ASSERT_TRUE(read) << read.error().message;
    device_ = read->devices.at(0);
  }
  [[nodiscard]] DeviceDescription With(std::vector<std::uint32_t> idents) const { return WithModules(device_, idents); }
  static std::vector<std::uint16_t> Pdos(const DeviceDescription& device) {
    std::vector<std::uint16_t> indices;
    for (const PdoContent& pdo : device.pdo.fixed) indices.push_back(pdo.index);
    return indices;
  }

  DeviceDescription device_;
};

TEST_F(EsiModules, AreReadWithTheirSlots) {
  ASSERT_TRUE(device_.esi->slot_rules);
  EXPECT_TRUE(device_.esi->misses_modules());
  EXPECT_EQ(device_.esi->slot_rules->pdo_increment, 2);
  EXPECT_EQ(device_.esi->slot_rules->index_increment, 0x10);
  ASSERT_NE(device_.esi->slot_rules->Find(0x20), nullptr);
  EXPECT_EQ(device_.esi->slot_rules->Find(0x20)->name, "Out");
  EXPECT_EQ(device_.esi->slot_rules->Find(0x21), nullptr);
}

TEST_F(EsiModules, MoveWithTheirSlot) {
  const DeviceDescription device = With({0x20, 0, 0x20});
  EXPECT_FALSE(device.esi->misses_modules());
  EXPECT_THAT(Pdos(device), ElementsAre(0x1600, 0x1604, 0x1AFF));
  const PdoContent& third = device.pdo.fixed[1];
  EXPECT_EQ(third.name, "Outputs (slot 3)");
  ASSERT_EQ(third.entries.size(), 3U);
  EXPECT_EQ(third.entries[0].index, 0x7020);
  EXPECT_EQ(third.entries[0].name, "Value (slot 3)");
  EXPECT_EQ(third.entries[1].index, 0) << "padding stays padding";
  EXPECT_EQ(third.entries[2].index, 0x2000) << "does not depend on the slot";
  EXPECT_EQ(third.entries[2].name, "Common");
  EXPECT_TRUE(device.pdo.IsAssignable(PdoDirection::kRx, 0x1604));
  ASSERT_TRUE(device.dictionary);
  ASSERT_NE(device.dictionary->Find(0x8020, 0), nullptr);
  EXPECT_EQ(device.dictionary->Find(0x8020, 0)->name, "Filter (slot 3)");
  EXPECT_EQ(device.dictionary->Find(0x8010, 0), nullptr) << "slot 2 is empty";
  EXPECT_NE(device.dictionary->Find(0x2000, 0), nullptr);
}

TEST(EsiModuleTexts, OfTheModulesInTheSlots) {
  const auto texts = [](std::string_view id, std::string_view text) {
    return "<Profile><DiagMessages><DiagMessage><TextId>" + std::string(id) + "</TextId><MessageText LcId=\"1033\">" +
           std::string(text) + "</MessageText></DiagMessage></DiagMessages></Profile>";
  };
  const auto file = ReadEsi(
      "<EtherCATInfo><Vendor><Id>1</Id></Vendor><Descriptions><Devices><Device><Type ProductCode=\"2\">C</Type>" +
      texts("1", "of the coupler") + "<Slots/></Device></Devices><Modules><Module><Type ModuleIdent=\"16\">A</Type>" +
      texts("7", "short circuit") + "</Module><Module><Type ModuleIdent=\"17\">B</Type>" + texts("7", "open load") +
      "</Module><Module><Type ModuleIdent=\"18\">C</Type>" + texts("1", "of the module") +
      "</Module></Modules></Descriptions></EtherCATInfo>");
  ASSERT_TRUE(file) << file.error().message;
  const auto of = [&](std::vector<std::uint32_t> idents) {
    return WithModules(file->devices.at(0), idents).esi->diagnosis_texts;
  };
  EXPECT_EQ(of({}), (mailbox::DiagnosisTexts{{1, "of the coupler"}}));
  EXPECT_EQ(of({16, 16}), (mailbox::DiagnosisTexts{{1, "of the coupler"}, {7, "short circuit"}}));
  EXPECT_EQ(of({16, 17}), (mailbox::DiagnosisTexts{{1, "of the coupler"}})) << "which of the two is not known";
  EXPECT_EQ(of({18}), (mailbox::DiagnosisTexts{{1, "of the coupler"}}));
}

TEST_F(EsiModules, EmptySlotsAreKnown) {
  const DeviceDescription device = With({});
  EXPECT_FALSE(device.esi->misses_modules());
  EXPECT_THAT(Pdos(device), ElementsAre(0x1AFF));
}

TEST_F(EsiModules, AreNotGuessedWhereOneIsNotInTheFile) {
  const DeviceDescription device = With({0x20, 0x99});
  EXPECT_TRUE(device.esi->misses_modules());
  EXPECT_THAT(Pdos(device), ElementsAre(0x1AFF));
}

TEST_F(EsiModules, StayInsideSixteenBits) {
  EXPECT_THAT(Pdos(With({0x10})), ElementsAre(0x1AFF, 0xFFFF));
  EXPECT_THAT(Pdos(With({0, 0x10})), ElementsAre(0x1AFF));
}

TEST(EsiModulesOfPlainDevices, AreNone) {
  const auto read = ReadEsi(
      "<EtherCATInfo><Vendor><Id>1</Id></Vendor><Descriptions><Devices><Device><Type ProductCode=\"1\"/></Device>"
      "</Devices></Descriptions></EtherCATInfo>");
  ASSERT_TRUE(read);
  EXPECT_FALSE(read->devices.at(0).esi->slot_rules);
  EXPECT_FALSE(read->devices.at(0).esi->misses_modules());
}

}  // namespace
}  // namespace ecaudit::device
