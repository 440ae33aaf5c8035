#include "decoder/device/esi_reader.h"

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "decoder/device/profile_registry.h"

namespace ecaudit::device {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

/// Written by hand after ETG.2000: a drive with two revisions.
constexpr std::string_view kEsi = R"(<?xml version="1.0" encoding="UTF-8"?>
<EtherCATInfo xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" Version="1.2">
  <Vendor>
    <Id>#x6A</Id>
    <Name LcId="1031">Beispiel</Name>
    <Name LcId="1033">Example &amp; Sons</Name>
  </Vendor>
  <Descriptions>
    <Groups><Group><Type>Drive</Type></Group></Groups>
    <Devices>
      <Device Physics="YY">
        <Type ProductCode="#x00414B44" RevisionNo="#x00000002">AKD</Type>
        <Name LcId="1033"><![CDATA[AKD EtherCAT Drive (CoE)]]></Name>
        <Info>
          <StateMachine>
            <Timeout>
              <PreopTimeout>2000</PreopTimeout>
              <SafeopOpTimeout>9000</SafeopOpTimeout>
              <BackToInitTimeout>5000</BackToInitTimeout>
              <BackToSafeopTimeout>200</BackToSafeopTimeout>
            </Timeout>
          </StateMachine>
        </Info>
        <GroupType>Drive</GroupType>
        <Profile>
          <ProfileNo>402</ProfileNo>
          <Dictionary>
            <DataTypes>
              <DataType><Name>UDINT</Name><BitSize>32</BitSize></DataType>
              <DataType>
                <Name>DT1018</Name><BitSize>80</BitSize>
                <SubItem>
                  <SubIdx>0</SubIdx><Name>Number of entries</Name><Type>USINT</Type><BitSize>8</BitSize><BitOffs>0</BitOffs>
                  <Flags><Access>ro</Access></Flags>
                </SubItem>
                <SubItem>
                  <SubIdx>1</SubIdx><Name>Vendor</Name><Type>UDINT</Type><BitSize>32</BitSize><BitOffs>16</BitOffs>
                  <Flags><Access>ro</Access></Flags>
                </SubItem>
              </DataType>
              <DataType>
                <Name>DT1C12ARR</Name><BaseType>UINT</BaseType><BitSize>64</BitSize>
                <ArrayInfo><LBound>1</LBound><Elements>4</Elements></ArrayInfo>
              </DataType>
              <DataType>
                <Name>DT1C12</Name><BitSize>80</BitSize>
                <SubItem>
                  <SubIdx>0</SubIdx><Name>SubIndex 000</Name><Type>USINT</Type><BitSize>8</BitSize><BitOffs>0</BitOffs>
                  <Flags><Access>rw</Access></Flags>
                </SubItem>
                <SubItem>
                  <Name>Elements</Name><Type>DT1C12ARR</Type><BitSize>64</BitSize><BitOffs>16</BitOffs>
                  <Flags><Access>rw</Access></Flags>
                </SubItem>
              </DataType>
            </DataTypes>
            <Objects>
              <Object>
                <Index>#x1008</Index><Name>Device name</Name><Type>STRING(8)</Type><BitSize>64</BitSize>
                <Flags><Access>ro</Access><Category>m</Category></Flags>
              </Object>
              <Object><Index>#x1018</Index><Name>Identity</Name><Type>DT1018</Type><BitSize>80</BitSize>
                <Info><SubItem><Name>Number of entries</Name><Info><DefaultData>01</DefaultData></Info></SubItem></Info>
                <Flags><Access>ro</Access></Flags></Object>
              <Object><Index>#x1C12</Index><Name>RxPDO assign</Name><Type>DT1C12</Type><BitSize>80</BitSize></Object>
              <Object>
                <Index>#x6040</Index><Name>Controlword</Name><Type>UINT</Type><BitSize>16</BitSize>
                <Flags><Access>rw</Access><PdoMapping>R</PdoMapping></Flags>
              </Object>
              <Object>
                <Index>24641</Index><Name>Statusword</Name><Type>UINT</Type><BitSize>16</BitSize>
                <Flags><Access>ro</Access><PdoMapping>T</PdoMapping></Flags>
              </Object>
            </Objects>
          </Dictionary>
        </Profile>
        <Fmmu>Outputs</Fmmu>
        <Fmmu>Inputs</Fmmu>
        <Fmmu>MBoxState</Fmmu>
        <Sm MinSize="36" MaxSize="1024" DefaultSize="1024" StartAddress="#x1800" ControlByte="#x26" Enable="1">MBoxOut</Sm>
        <Sm MaxSize="1024" DefaultSize="1024" StartAddress="#x1C00" ControlByte="#x22" Enable="1">MBoxIn</Sm>
        <Sm DefaultSize="6" StartAddress="#x1100" ControlByte="#x24" Enable="1">Outputs</Sm>
        <Sm DefaultSize="6" StartAddress="#x1140" ControlByte="#x20" Enable="1">Inputs</Sm>
        <RxPdo Fixed="1" Sm="2">
          <Index>#x1701</Index><Name>Position</Name>
          <Exclude>#x1702</Exclude><Exclude>#x1720</Exclude>
          <Entry><Index>#x60C1</Index><SubIndex>1</SubIndex><BitLen>32</BitLen><Name>Position command</Name><DataType>DINT</DataType></Entry>
          <Entry><Index>#x6040</Index><SubIndex>0</SubIndex><BitLen>16</BitLen><Name>Control word</Name><DataType>UINT</DataType></Entry>
        </RxPdo>
        <RxPdo><Index>#x1600</Index><Name>Free</Name></RxPdo>
        <TxPdo Fixed="true" Mandatory="1" Sm="3">
          <Index>#x1B01</Index><Name>Position</Name>
          <Entry><Index>#x6064</Index><SubIndex>0</SubIndex><BitLen>32</BitLen><Name>Position actual</Name><DataType>DINT</DataType></Entry>
          <Entry><Index>0</Index><BitLen>8</BitLen></Entry>
          <Entry><Index>#x6061</Index><SubIndex>0</SubIndex><BitLen>8</BitLen><Name>Mode</Name><DataType>SINT</DataType></Entry>
        </TxPdo>
        <Mailbox DataLinkLayer="1"><EoE/><CoE SdoInfo="1" PdoAssign="1" CompleteAccess="true"/><FoE/></Mailbox>
        <Dc>
          <OpMode>
            <Name>DcSync</Name><Desc>DC for synchronization</Desc>
            <AssignActivate>#x700</AssignActivate>
            <CycleTimeSync0 Factor="1">0</CycleTimeSync0>
            <ShiftTimeSync0>-5000</ShiftTimeSync0>
            <CycleTimeSync1 Factor="-2">250000</CycleTimeSync1>
          </OpMode>
        </Dc>
        <Eeprom><ByteSize>2048</ByteSize></Eeprom>
      </Device>
      <Device><Type ProductCode="4279108" RevisionNo="3">AKD</Type></Device>
    </Devices>
  </Descriptions>
</EtherCATInfo>
)";

EsiFile Read() {
  Result<EsiFile> file = ReadEsi(kEsi);
  EXPECT_TRUE(file) << file.error().message;
  return file ? std::move(*file) : EsiFile{};
}

std::string EsiErrorOf(std::string_view xml) {
  const Result<EsiFile> file = ReadEsi(xml);
  return file ? "no error" : file.error().message;
}

TEST(EsiReader, ReadsIdentities) {
  const EsiFile file = Read();
  EXPECT_EQ(file.vendor_id, 0x6AU);
  EXPECT_EQ(file.vendor_name, "Example & Sons");
  ASSERT_EQ(file.devices.size(), 2U);
  EXPECT_EQ(file.devices[0].title, "AKD EtherCAT Drive (CoE)");
  EXPECT_TRUE(file.devices[0].match.MatchesIdentity(0x6A, 0x00414B44, 2));
  EXPECT_FALSE(file.devices[0].match.MatchesIdentity(0x6A, 0x00414B44, 3));
  EXPECT_EQ(file.devices[1].title, "AKD");
  EXPECT_EQ(file.devices[0].esi->profile_number, 402U);
  EXPECT_EQ(file.devices[0].esi->group, "Drive");
}

TEST(EsiReader, FindPrefersTheRevisionThenTheNewest) {
  const EsiFile file = Read();
  EXPECT_EQ(file.Find(0x00414B44, 2), &file.devices[0]);
  EXPECT_EQ(file.Find(0x00414B44, 3), &file.devices[1]);
  EXPECT_EQ(file.Find(0x00414B44, 9), &file.devices[1]);
  EXPECT_EQ(file.Find(1, 1), nullptr);
}

TEST(EsiReader, ReadsPdos) {
  const PdoDescription pdo = Read().devices[0].pdo;
  ASSERT_EQ(pdo.fixed.size(), 3U);
  const PdoContent* rx = pdo.FindFixed(0x1701);
  ASSERT_NE(rx, nullptr);
  EXPECT_TRUE(rx->fixed);
  EXPECT_EQ(rx->sync_manager, 2);
  EXPECT_THAT(rx->excludes, ElementsAre(0x1702, 0x1720));
  EXPECT_EQ(rx->bits(), 48U);
  EXPECT_EQ(rx->entries[0].index, 0x60C1);
  EXPECT_EQ(rx->entries[0].subindex, 1);
  EXPECT_EQ(rx->entries[0].type, DataType::kInteger32);
  EXPECT_EQ(rx->entries[1].name, "Control word");
  EXPECT_FALSE(pdo.FindFixed(0x1600)->fixed);
  EXPECT_FALSE(pdo.FindFixed(0x1600)->sync_manager);
  const PdoContent* tx = pdo.FindFixed(0x1B01);
  ASSERT_NE(tx, nullptr);
  EXPECT_TRUE(tx->mandatory);
  EXPECT_EQ(tx->entries[1].index, 0);  // padding
  EXPECT_EQ(tx->entries[1].bits, 8);
  EXPECT_TRUE(pdo.IsAssignable(PdoDirection::kRx, 0x1600));
  EXPECT_FALSE(pdo.IsAssignable(PdoDirection::kRx, 0x1B01));
}

TEST(EsiReader, ReadsSyncManagersAndMailbox) {
  const DeviceDescription device = Read().devices[0];
  ASSERT_EQ(device.mailbox.sync_managers.size(), 4U);
  const SyncManagerRule& out = device.mailbox.sync_managers[0];
  EXPECT_EQ(out.start, 0x1800);
  EXPECT_THAT(out.lengths, ElementsAre(1024));
  EXPECT_EQ(out.max_length, 1024U);
  EXPECT_EQ(out.control, 0x26);
  EXPECT_TRUE(out.mailbox_mode && out.master_writes);
  EXPECT_EQ(device.mailbox.sync_managers[3].use, SyncManagerUse::kProcessIn);
  EXPECT_NE(device.mailbox.FindProtocol(2), nullptr);
  EXPECT_NE(device.mailbox.FindProtocol(3), nullptr);
  EXPECT_NE(device.mailbox.FindProtocol(4), nullptr);
  EXPECT_EQ(device.mailbox.FindProtocol(5), nullptr);
  EXPECT_TRUE(device.mailbox.complete_access);
  EXPECT_TRUE(device.mailbox.sdo_information);
  EXPECT_THAT(device.esi->fmmus, ElementsAre(FmmuUse::kOutputs, FmmuUse::kInputs, FmmuUse::kMailboxState));
}

TEST(EsiReader, ReadsDcModesAndTimeouts) {
  const EsiDetails esi = *Read().devices[0].esi;
  ASSERT_EQ(esi.dc_modes.size(), 1U);
  EXPECT_EQ(esi.dc_modes[0].name, "DcSync");
  EXPECT_EQ(esi.dc_modes[0].assign_activate, 0x700U);
  EXPECT_EQ(esi.dc_modes[0].cycle_sync0, 0);
  EXPECT_EQ(esi.dc_modes[0].factor_sync0, 1);
  EXPECT_EQ(esi.dc_modes[0].shift_sync0, -5000);
  EXPECT_EQ(esi.dc_modes[0].cycle_sync1, 250'000);
  EXPECT_EQ(esi.dc_modes[0].factor_sync1, -2);
  EXPECT_FALSE(esi.dc_modes[0].shift_sync1);
  EXPECT_EQ(esi.timeouts.preop, 2'000'000'000);
  EXPECT_EQ(esi.timeouts.safeop_op, 9'000'000'000);
  EXPECT_EQ(esi.timeouts.back_to_safeop, 200'000'000);
}

TEST(EsiReader, ReadsInitCommandsAndWhatCoeOffers) {
  const auto file = ReadEsi(R"(<EtherCATInfo><Descriptions><Devices><Device><Type ProductCode="1">x</Type><Mailbox>
      <CoE PdoAssign="1" CompleteAccess="1">
        <InitCmd CompleteAccess="1"><Transition>PS</Transition><Transition>SO</Transition><Index>#x1C12</Index>
          <SubIndex>0</SubIndex><Data>01000016</Data><Comment>assign</Comment></InitCmd>
        <Vendor>skipped</Vendor>
        <InitCmd><Transition>IP</Transition><Index>24672</Index><SubIndex>0</SubIndex><Data>08</Data></InitCmd>
      </CoE><FoE/></Mailbox></Device></Devices></Descriptions></EtherCATInfo>)");
  ASSERT_TRUE(file) << file.error().message;
  const DeviceDescription& device = file->devices.at(0);
  ASSERT_EQ(device.esi->init_commands.size(), 2U);
  const EsiInitCommand& first = device.esi->init_commands[0];
  EXPECT_EQ(first.transitions, (std::vector<std::string>{"PS", "SO"}));
  EXPECT_EQ(first.index, 0x1C12);
  EXPECT_TRUE(first.complete_access);
  EXPECT_EQ(first.data, (std::vector<std::uint8_t>{1, 0, 0, 0x16}));
  EXPECT_EQ(first.comment, "assign");
  EXPECT_EQ(device.esi->init_commands[1].index, 0x6060);
  EXPECT_EQ(device.esi->pdo_assign, true);
  EXPECT_EQ(device.esi->pdo_config, std::nullopt) << "not stated";
  EXPECT_TRUE(device.mailbox.complete_access);
  ASSERT_EQ(device.mailbox.protocols.size(), 2U);
}

TEST(EsiReader, ReadsInitCommandsOfOtherProtocols) {
  // AoE: a write of 2 bytes to index group 0x4020, offset 8.
  const auto file = ReadEsi(R"(<EtherCATInfo><Descriptions><Devices><Device><Type ProductCode="1">x</Type><Mailbox>
      <AoE AdsRouter="1"><InitCmd><Transition>PS</Transition><Data>000000000000011000000000000000200300040010000000
        </Data></InitCmd><InitCmd><Transition>PS</Transition>
        <Data>00000000000001100000000000000020030004000e0000000000000007000000204000000800000002000000abcd</Data>
        </InitCmd></AoE>
      <EoE IP="1"><InitCmd><Transition>IP</Transition><Type>2</Type><Data>01</Data></InitCmd></EoE>
      <SoE ChannelCount="2"><InitCmd Chn="1"><Transition>PS</Transition><Transition>SO</Transition><IDN>32</IDN>
        <Data>0B00</Data><Comment>mode</Comment></InitCmd>
        <InitCmd><Transition>PS</Transition><IDN>#x80C8</IDN></InitCmd><Vendor>skipped</Vendor></SoE>
      </Mailbox></Device></Devices></Descriptions></EtherCATInfo>)");
  ASSERT_TRUE(file) << file.error().message;
  const EsiDetails& esi = *file->devices.at(0).esi;
  EXPECT_TRUE(esi.init_commands.empty());
  ASSERT_EQ(esi.mailbox_commands.size(), 5U);
  const EsiMailboxCommand& cut = esi.mailbox_commands[0];
  EXPECT_EQ(cut.protocol, mailbox::Protocol::kAoE);
  EXPECT_EQ(cut.number, 0) << "no whole message";
  EXPECT_TRUE(cut.data.empty());
  const EsiMailboxCommand& aoe = esi.mailbox_commands[1];
  EXPECT_EQ(aoe.number, 3) << "ADS write";
  EXPECT_EQ(aoe.data, (std::vector<std::uint8_t>{0x20, 0x40, 0, 0, 8, 0, 0, 0, 0xAB, 0xCD}));
  const EsiMailboxCommand& eoe = esi.mailbox_commands[2];
  EXPECT_EQ(eoe.protocol, mailbox::Protocol::kEoE);
  EXPECT_EQ(eoe.number, 2);
  EXPECT_THAT(eoe.transitions, ElementsAre("IP"));
  const EsiMailboxCommand& soe = esi.mailbox_commands[3];
  EXPECT_EQ(soe.protocol, mailbox::Protocol::kSoE);
  EXPECT_EQ(soe.drive, 1);
  EXPECT_EQ(soe.number, 32);
  EXPECT_EQ(soe.data, (std::vector<std::uint8_t>{0x0B, 0}));
  EXPECT_EQ(soe.comment, "mode");
  EXPECT_THAT(soe.transitions, ElementsAre("PS", "SO"));
  EXPECT_EQ(esi.mailbox_commands[4].drive, std::nullopt) << "not stated";
  EXPECT_EQ(esi.mailbox_commands[4].number, 0x80C8);
}

TEST(EsiReader, BoundsInitCommandsOfAllProtocolsTogether) {
  std::string coe, soe;
  for (int i = 0; i < 5'001; ++i) (coe += "<InitCmd/>", soe += "<InitCmd/>");
  const auto file =
      ReadEsi("<EtherCATInfo><Descriptions><Devices><Device><Type ProductCode=\"1\">x</Type><Mailbox><CoE>" + coe +
              "</CoE><SoE>" + soe + "</SoE></Mailbox></Device></Devices></Descriptions></EtherCATInfo>");
  EXPECT_THAT(file.error().message, HasSubstr("more than 10,000 init commands"));
}

TEST(EsiReader, BoundsWhatEachRefusalLooksThrough) {
  const auto with = [](const std::string& commands, const std::string& name) {
    return ReadEsi("<EtherCATInfo><Descriptions><Devices><Device><Type ProductCode=\"1\">x</Type><Name>" + name +
                   "</Name><Mailbox><CoE>" + commands +
                   "</CoE></Mailbox></Device></Devices></Descriptions></EtherCATInfo>");
  };
  std::string many, transitions;
  for (int i = 0; i < 10'001; ++i) many += "<InitCmd/>";
  for (int i = 0; i < 65; ++i) transitions += "<Transition>PS</Transition>";
  EXPECT_THAT(with(many, "").error().message, HasSubstr("more than 10,000 init commands"));
  EXPECT_THAT(with("<InitCmd>" + transitions + "</InitCmd>", "").error().message, HasSubstr("too many transitions"));
  const auto named = with("", std::string(100'000, 'n'));
  ASSERT_TRUE(named);
  EXPECT_LT(named->devices.at(0).title.size(), 300U) << "each finding of its slave repeats it";
}

TEST(EsiReader, ReadsTheDictionary) {
  const ObjectDictionary dictionary = *Read().devices[0].dictionary;
  ASSERT_NE(dictionary.Find(0x1008, 0), nullptr);
  EXPECT_EQ(dictionary.Find(0x1008, 0)->types[0], DataType::kVisibleString);
  EXPECT_TRUE(dictionary.FindIndex(0x1018)->head);
  EXPECT_THAT(dictionary.FindIndex(0x1018)->types, ElementsAre(DataType::kRecord));
  ASSERT_NE(dictionary.Find(0x1018, 1), nullptr);
  EXPECT_EQ(dictionary.Find(0x1018, 1)->name, "Vendor");
  EXPECT_EQ(dictionary.Find(0x1018, 1)->types[0], DataType::kUnsigned32);
  EXPECT_EQ(dictionary.Find(0x1018, 1)->access, Access::kRead);
  EXPECT_EQ(dictionary.Find(0x1018, 2), nullptr);
  EXPECT_THAT(dictionary.FindIndex(0x1C12)->types, ElementsAre(DataType::kArray));
  ASSERT_NE(dictionary.Find(0x1C12, 4), nullptr);
  EXPECT_EQ(dictionary.Find(0x1C12, 4)->TypeOf(4), DataType::kUnsigned16);
  EXPECT_EQ(dictionary.Find(0x1C12, 4)->access, Access::kReadWrite);
  EXPECT_EQ(dictionary.Find(0x1C12, 5), nullptr);
  EXPECT_EQ(dictionary.Find(0x6040, 0)->mappable, Mappable::kYes);
  EXPECT_EQ(dictionary.Find(0x6040, 0)->only, PdoDirection::kRx);
  EXPECT_EQ(dictionary.Find(0x6041, 0)->only, PdoDirection::kTx);
  EXPECT_EQ(dictionary.Find(0x1008, 0)->mappable, Mappable::kNo);
}

TEST(EsiReader, AFamilyKeepsItsLawAndTakesTheDeviceFromTheEsi) {
  const DeviceDescription merged = WithEsi(*BuiltinProfile("kollmorgen-mkd-n"), Read().devices[0]);
  EXPECT_EQ(merged.id, "kollmorgen-mkd-n");
  EXPECT_EQ(merged.al.status_codes.size(), 3U);
  EXPECT_EQ(merged.sync.cycle_min.value, 250'000);
  EXPECT_TRUE(merged.match.MatchesIdentity(0x6A, 0x00414B44, 2));
  EXPECT_EQ(merged.pdo.FindFixed(0x1B01)->entries[0].index, 0x6064);  // the manual is read as 6063h
  EXPECT_EQ(merged.pdo.FindFixed(0x1B20)->entries.size(), 10U);       // only the manual knows it
  EXPECT_THAT(merged.mailbox.FindSyncManager(0)->lengths, ElementsAre(1024));
  ASSERT_NE(merged.object(0x6040, 0), nullptr);
  EXPECT_EQ(merged.object(0x6040, 0)->name, "Controlword");
  EXPECT_EQ(merged.object(0x6040, 0)->access, Access::kReadWrite);  // printed WO
  ASSERT_NE(merged.object(0x607A, 0), nullptr);
  EXPECT_EQ(merged.object(0x607A, 0)->keyword, "MT.P");
}

TEST(EsiReader, ErrorsNameLineAndColumn) {
  EXPECT_THAT(EsiErrorOf("<EtherCATInfo>\n <Vendor><Id>#xZZ</Id></Vendor></EtherCATInfo>"),
              ::testing::AllOf(StartsWith("line 2, column "), HasSubstr("\"#xZZ\" is not a number")));
  EXPECT_THAT(EsiErrorOf("<EtherCATInfo>\n<Vendor>\n</EtherCATInfo>"), StartsWith("line 3, column "));
  EXPECT_THAT(EsiErrorOf("<EtherCATInfo>"), StartsWith("line 1, column "));
  EXPECT_THAT(EsiErrorOf(""), StartsWith("line 1, column "));
  EXPECT_THAT(EsiErrorOf("<EtherCATConfig/>"), HasSubstr("expected the element EtherCATInfo, got EtherCATConfig"));
}

TEST(EsiReader, NumbersAreCheckedAgainstTheirRange) {
  const auto with_index = [](std::string_view index) {
    return "<EtherCATInfo><Descriptions><Devices><Device><RxPdo><Index>" + std::string(index) +
           "</Index></RxPdo></Device></Devices></Descriptions></EtherCATInfo>";
  };
  EXPECT_EQ(EsiErrorOf(with_index("#xFFFF")), "no error");
  EXPECT_EQ(EsiErrorOf(with_index(" 5632\n")), "no error");
  EXPECT_THAT(EsiErrorOf(with_index("#x10000")), HasSubstr("65536 is outside 0 to 65535"));
  EXPECT_THAT(EsiErrorOf(with_index("-1")), HasSubstr("-1 is outside 0 to 65535"));
  EXPECT_THAT(EsiErrorOf(with_index("")), HasSubstr("\"\" is not a number"));
  EXPECT_THAT(EsiErrorOf(with_index("#x")), HasSubstr("is not a number"));
  EXPECT_THAT(EsiErrorOf(with_index("99999999999999999999")), HasSubstr("is not a number"));
}

// A "billion laughs" document: entities that expand to each other.
TEST(EsiReader, EntitiesAndDocumentTypesAreRefused) {
  EXPECT_THAT(EsiErrorOf("<?xml version=\"1.0\"?>\n<!DOCTYPE x [<!ENTITY a \"aaaa\"><!ENTITY b \"&a;&a;\">]>\n"
                         "<EtherCATInfo><Vendor><Name>&b;</Name></Vendor></EtherCATInfo>"),
              HasSubstr("document type declarations are not accepted"));
  EXPECT_THAT(EsiErrorOf("<!DOCTYPE x SYSTEM \"file:///etc/passwd\"><EtherCATInfo/>"),
              HasSubstr("document type declarations are not accepted"));
  EXPECT_THAT(EsiErrorOf("<EtherCATInfo><Vendor><Name>&b;</Name></Vendor></EtherCATInfo>"), HasSubstr("Entity 'b'"));
}

TEST(EsiReader, TruncationAnywhereIsAnError) {
  const std::size_t end = kEsi.rfind("</EtherCATInfo>") + 14;
  for (std::size_t length = 0; length <= end; length += 13) {
    EXPECT_FALSE(ReadEsi(kEsi.substr(0, length))) << length;
  }
}

TEST(EsiReader, DeepNestingIsNoRecursion) {
  std::string deep = "<EtherCATInfo>";
  for (int i = 0; i < 100'000; ++i) deep += "<a>";
  EXPECT_FALSE(ReadEsi(deep));
}

TEST(EsiReader, OtherEncodingsAreRead) {
  const auto latin = ReadEsi(
      "<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?><EtherCATInfo><Vendor><Name>M\xFCller"
      "</Name></Vendor></EtherCATInfo>");
  ASSERT_TRUE(latin) << latin.error().message;
  EXPECT_EQ(latin->vendor_name, "M\xC3\xBCller");
  const auto windows = ReadEsi(
      "<?xml version='1.0' encoding='Windows-1252'?><EtherCATInfo><Vendor><Name>M\xFCller"
      "</Name></Vendor></EtherCATInfo>");
  ASSERT_TRUE(windows) << windows.error().message;
  EXPECT_EQ(windows->vendor_name, "M\xC3\xBCller");
}

TEST(EsiReader, FilesAreReadAndErrorsNameThem) {
  const std::string path = (std::filesystem::path(::testing::TempDir()) / "ecaudit_esi_test.xml").string();
  std::ofstream(path, std::ios::binary) << kEsi;
  const auto file = LoadEsiFile(path);
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(file->devices.size(), 2U);
  std::ofstream(path, std::ios::binary) << "<EtherCATInfo>";
  EXPECT_THAT(LoadEsiFile(path).error().message, StartsWith(path + ": line 1, column "));
  std::filesystem::remove(path);
  EXPECT_EQ(LoadEsiFile(path).error().message, path + ": no such file");
}

TEST(EsiReader, ReadsTheTextsOfDiagnosisMessages) {
  const auto file = ReadEsi(R"(<EtherCATInfo><Vendor><Id>1</Id></Vendor><Descriptions><Devices><Device>
    <Type ProductCode="#x2" RevisionNo="#x3">T</Type>
    <Profile><ProfileNo>5001</ProfileNo><DiagMessages>
      <DiagMessage><TextId>#x3702</TextId><MessageText LcId="1031">Kurzschluss</MessageText>
        <MessageText LcId="1033">Short circuit in module %d</MessageText></DiagMessage>
      <DiagMessage><TextId>17</TextId><MessageText LcId="1031">Nur deutsch</MessageText></DiagMessage>
      <DiagMessage><TextId>#x0012</TextId></DiagMessage>
      <Other/>
    </DiagMessages></Profile>
  </Device><Device><Type ProductCode="#x3">U</Type></Device></Devices></Descriptions></EtherCATInfo>)");
  ASSERT_TRUE(file) << file.error().message;
  ASSERT_NE(file->devices[0].diagnosis_texts(), nullptr);
  EXPECT_EQ(*file->devices[0].diagnosis_texts(),
            (mailbox::DiagnosisTexts{{0x0011, "Nur deutsch"}, {0x3702, "Short circuit in module %d"}}));
  EXPECT_EQ(file->devices[1].diagnosis_texts(), nullptr);
}

}  // namespace
}  // namespace ecaudit::device
