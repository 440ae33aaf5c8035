#include "analyzers/model/profile_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "analyzers/model/slave_model.h"
#include "tests/support/trace_builder.h"

namespace ecaudit::model {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using track::IdentityLearned;

constexpr std::uint32_t kVendor = 0x6A;
constexpr std::uint32_t kAkd = 0x00414B44;

/// Written by hand after ETG.2000: one product of the AKD's vendor in two revisions.
constexpr std::string_view kEsi =
    R"(<EtherCATInfo><Vendor><Id>#x6A</Id><Name>Example</Name></Vendor><Descriptions><Devices>
  <Device><Type ProductCode="#x00414B44" RevisionNo="#x2">AKD</Type><Name LcId="1033">Drive two</Name>
    <RxPdo Sm="2" Fixed="1"><Index>#x1777</Index><Name>Outputs</Name>
      <Entry><Index>#x6040</Index><SubIndex>0</SubIndex><BitLen>16</BitLen><Name>Control</Name><DataType>UINT</DataType></Entry>
    </RxPdo></Device>
  <Device><Type ProductCode="#x00414B44" RevisionNo="#x5">AKD</Type><Name LcId="1033">Drive five</Name></Device>
</Devices></Descriptions></EtherCATInfo>)";

constexpr std::string_view kTwoProducts =
    R"(<EtherCATInfo><Vendor><Id>#x6A</Id></Vendor><Descriptions><Devices>
  <Device><Type ProductCode="1" RevisionNo="1">A</Type></Device>
  <Device><Type ProductCode="30583" RevisionNo="1">B</Type></Device>
</Devices></Descriptions></EtherCATInfo>)";

/// After ETG.2100: an AKD at 0x1001, position 1, and another product at 0x1002, position 2.
constexpr std::string_view kEni = R"(<EtherCATConfig><Config>
  <Slave><Info><Name>Axis X</Name><PhysAddr>4097</PhysAddr><AutoIncAddr>65535</AutoIncAddr>
    <VendorId>106</VendorId><ProductCode>4279108</ProductCode><RevisionNo>2</RevisionNo><SerialNo>0</SerialNo></Info></Slave>
  <Slave><Info><Name>Lamp</Name><PhysAddr>4098</PhysAddr><AutoIncAddr>65534</AutoIncAddr>
    <VendorId>2</VendorId><ProductCode>7</ProductCode></Info></Slave>
</Config></EtherCATConfig>)";

class ProfileChoiceTest : public ::testing::Test {
 protected:
  ProfileChoiceTest() : slave(0, state, limits, sink) { options.files = files; }

  void AddEsi(std::string name, std::string_view xml) {
    Result<device::EsiFile> file = device::ReadEsi(xml);
    ASSERT_TRUE(file) << file.error().message;
    files->esi.push_back({std::move(name), std::move(*file), {}});
  }
  void AddEni(std::string_view xml) {
    Result<device::EniConfig> config = device::ReadEni(xml);
    ASSERT_TRUE(config) << config.error().message;
    files->eni = {"network.xml", std::move(*config)};
  }
  void At(SlavePos position, StationAddress station) {
    address.position = Known<SlavePos>::Observed(position, 1);
    address.station = Known<StationAddress>::Observed(station, 1);
  }
  void Saw(std::uint32_t vendor, std::uint32_t product, std::uint32_t revision) {
    seen.vendor_id = vendor;
    seen.product_code = product;
    seen.revision = revision;
    seen.frame.number = 78;
  }
  void Choose() { choice.Choose(address, seen, slave); }

  std::shared_ptr<DeviceFiles> files = std::make_shared<DeviceFiles>();
  AnalysisOptions options;
  EventSink sink;
  track::SlaveState state;
  SharedLimits limits;
  SlaveModel slave;
  bus::SlaveAddress address;
  IdentityLearned seen;
  ProfileChoice choice{options};
};

TEST_F(ProfileChoiceTest, TheModelTypeChoosesAFamilyWithoutProductCode) {
  // MKD, 4.14: category 0x0800 of the EEPROM holds the model type; 5.3.2: 1018h:2 of MKD-N has no value.
  Saw(kVendor, 1, 2);
  Choose();
  EXPECT_EQ(slave.profile->id, "generic");
  seen.model = "MKD-N-00606";
  Choose();
  EXPECT_EQ(slave.profile->id, "kollmorgen-mkd-n");
  EXPECT_THAT(slave.profile_source, HasSubstr("model type MKD-N-00606"));
  seen.vendor_id = kVendor + 1;
  Choose();
  EXPECT_EQ(slave.profile->id, "generic") << "others may call their devices so, too";
}

TEST_F(ProfileChoiceTest, TheEditionIsOneThatDescribesTheAssignedPdos) {
  // AKD-2010, 4.5 lists 1B20h; AKD-2011, 4.5 does not. Both have 1B01h.
  const auto assign = [this](std::uint8_t low) {
    for (const auto& [subindex, data] :
         {std::pair<std::uint8_t, std::vector<std::uint8_t>>{1, {low, 0x1B}}, {0, {1}}}) {
      mailbox::SdoTransfer transfer;
      transfer.service = mailbox::SdoService::kDownload;
      transfer.outcome = mailbox::SdoOutcome::kCompleted;
      transfer.has_object = true;
      transfer.index = process::kTxAssignment;
      transfer.subindex = subindex;
      transfer.data = data;
      transfer.size = data.size();
      slave.process.Apply(transfer);
    }
  };
  Saw(kVendor, kAkd, 2);
  assign(0x01);
  Choose();
  EXPECT_EQ(slave.profile->id, "kollmorgen-akd-2011");
  assign(0x20);
  Choose();
  EXPECT_EQ(slave.profile->id, "kollmorgen-akd-2010");
  EXPECT_THAT(slave.profile_source, HasSubstr("that describes the assigned PDOs"));
}

TEST_F(ProfileChoiceTest, WithoutFilesTheIdentitySeenChoosesTheFamily) {
  options.files = nullptr;
  Saw(kVendor, kAkd, 2);
  Choose();
  EXPECT_THAT(slave.profile->id, HasSubstr("kollmorgen-akd"));
  EXPECT_EQ(slave.profile_source, "identity in the EEPROM (frame 78), newest of 2 editions");
  EXPECT_EQ(slave.eni, nullptr);
}

TEST_F(ProfileChoiceTest, EsiLiesOverTheFamily) {
  AddEsi("drive.xml", kEsi);
  Saw(kVendor, kAkd, 2);
  Choose();
  EXPECT_THAT(slave.profile->id, HasSubstr("kollmorgen-akd"));
  ASSERT_NE(slave.profile->pdo.FindFixed(0x1777), nullptr);    // of the file
  EXPECT_NE(slave.profile->pdo.FindFixed(0x1701), nullptr);    // of the family
  EXPECT_NE(slave.profile->al_status_code(0x0017), nullptr);   // of the family
  EXPECT_THAT(slave.profile->title, HasSubstr("Kollmorgen"));  // whose manual is cited
  EXPECT_EQ(slave.name, "Drive two");
  EXPECT_EQ(slave.profile_source, "identity in the EEPROM (frame 78), newest of 2 editions, with drive.xml");
}

TEST_F(ProfileChoiceTest, SameOverlayIsMadeOnce) {
  AddEsi("drive.xml", kEsi);
  Saw(kVendor, kAkd, 2);
  Choose();
  const device::DeviceDescription* first = slave.profile;
  Choose();
  EXPECT_EQ(slave.profile, first);
}

TEST_F(ProfileChoiceTest, OtherRevisionOfTheFileIsSaid) {
  AddEsi("drive.xml", kEsi);
  Saw(kVendor, kAkd, 3);
  Choose();
  EXPECT_EQ(slave.name, "Drive five");  // the highest
  EXPECT_THAT(slave.profile_source, HasSubstr("with drive.xml (for revision 0x00000005, the slave has 0x00000003)"));
}

TEST_F(ProfileChoiceTest, ExactRevisionOfALaterFileWins) {
  AddEsi("first.xml", R"(<EtherCATInfo><Vendor><Id>#x6A</Id></Vendor><Descriptions><Devices>
    <Device><Type ProductCode="#x00414B44" RevisionNo="#x9">AKD</Type><Name LcId="1033">Nine</Name></Device>
    </Devices></Descriptions></EtherCATInfo>)");
  AddEsi("drive.xml", kEsi);
  Saw(kVendor, kAkd, 2);
  Choose();
  EXPECT_EQ(slave.name, "Drive two");
}

TEST_F(ProfileChoiceTest, EsiOfAnotherVendorDoesNotCount) {
  AddEsi("drive.xml", kEsi);
  Saw(0x6B, kAkd, 2);
  Choose();
  EXPECT_EQ(slave.profile->id, "generic");
  EXPECT_EQ(slave.profile->pdo.FindFixed(0x1777), nullptr);
  EXPECT_EQ(slave.profile_source,
            "no profile for vendor 0x0000006b, product 0x00414b44: evaluated by the EtherCAT standard");
}

TEST_F(ProfileChoiceTest, DeviceOfNoFamilyIsTheStandardWithItsEsi) {
  AddEsi("both.xml", kTwoProducts);
  Saw(kVendor, 0x7777, 1);
  Choose();
  EXPECT_EQ(slave.profile->id, "generic");
  EXPECT_EQ(slave.profile_source,
            "no profile for vendor 0x0000006a, product 0x00007777: the EtherCAT standard, with both.xml");
}

TEST_F(ProfileChoiceTest, UnknownSlaveIsTakenForTheOnlyProductOfTheFiles) {
  AddEsi("drive.xml", kEsi);
  Choose();
  EXPECT_EQ(slave.profile->id, "generic");  // no family is assumed: its rules are not the file's
  EXPECT_THAT(slave.profile_source, HasSubstr("taken for the only product in drive.xml"));
  EXPECT_EQ(slave.name, "");
  EXPECT_FALSE(slave.identity.vendor_id);
}

TEST_F(ProfileChoiceTest, UnknownSlaveIsNothingWhenThereAreSeveralProducts) {
  AddEsi("both.xml", kTwoProducts);
  Choose();
  EXPECT_EQ(slave.profile_source, "identity not in the capture: evaluated by the EtherCAT standard");
}

TEST_F(ProfileChoiceTest, ProfileOfTheUserStaysUnderTheEsi) {
  AddEsi("drive.xml", kEsi);
  options.default_profile = "kollmorgen-mkd-n";
  Saw(kVendor, kAkd, 2);
  Choose();
  EXPECT_EQ(slave.profile->id, "kollmorgen-mkd-n");
  EXPECT_NE(slave.profile->pdo.FindFixed(0x1777), nullptr);
  EXPECT_EQ(slave.profile_source, "option --profile, with drive.xml");
}

TEST_F(ProfileChoiceTest, EniGivesNameAndIdentityWhereTheCaptureIsSilent) {
  AddEni(kEni);
  At(0, 0x1001);  // the address counts more than the position
  Choose();
  ASSERT_NE(slave.eni, nullptr);
  EXPECT_EQ(slave.name, "Axis X");
  EXPECT_EQ(slave.identity.source, IdentityLearned::Source::kEni);
  EXPECT_EQ(slave.identity.product_code, kAkd);
  EXPECT_EQ(slave.identity.serial, std::nullopt);  // 0 stands for any
  EXPECT_THAT(slave.profile->id, HasSubstr("kollmorgen-akd"));
  EXPECT_EQ(slave.profile_source, "identity in the ENI, newest of 2 editions");
}

TEST_F(ProfileChoiceTest, EniIsFoundByPosition) {
  AddEni(kEni);
  At(1, 0x5555);
  Choose();
  ASSERT_NE(slave.eni, nullptr);
  EXPECT_EQ(slave.name, "Axis X");
}

TEST_F(ProfileChoiceTest, CaptureBeatsTheEni) {
  AddEni(kEni);
  At(2, 0x1002);
  Saw(kVendor, kAkd, 2);
  Choose();
  EXPECT_EQ(slave.eni, nullptr);
  EXPECT_EQ(slave.name, "");
  EXPECT_EQ(slave.identity.vendor_id, kVendor);
  EXPECT_THAT(slave.profile_source,
              HasSubstr("; network.xml expects another device here (vendor 0x00000002, product 0x00000007)"));
}

TEST_F(ProfileChoiceTest, PartOfTheIdentitySeenIsFilledUpByTheEni) {
  AddEni(kEni);
  At(1, 0x1001);
  seen.vendor_id = kVendor;
  seen.frame.number = 40;
  Choose();
  EXPECT_EQ(slave.identity.product_code, kAkd);
  EXPECT_EQ(slave.identity.source, IdentityLearned::Source::kEni);
  Saw(kVendor, kAkd, 7);  // another revision is no contradiction
  Choose();
  EXPECT_EQ(slave.identity.source, IdentityLearned::Source::kEeprom);
  EXPECT_EQ(slave.identity.revision, 7U);
  EXPECT_NE(slave.eni, nullptr);
}

TEST_F(ProfileChoiceTest, EniAndEsiTogetherNeedNoIdentityInTheCapture) {
  AddEni(kEni);
  AddEsi("drive.xml", kEsi);
  At(1, 0x1001);
  Choose();
  EXPECT_EQ(slave.name, "Axis X");  // the name of the axis, not that of the product
  EXPECT_NE(slave.profile->pdo.FindFixed(0x1777), nullptr);
  EXPECT_EQ(slave.profile_source, "identity in the ENI, newest of 2 editions, with drive.xml");
}

TEST_F(ProfileChoiceTest, SlaveThatTheEniDoesNotKnow) {
  AddEni(kEni);
  At(9, 0x1009);
  Choose();
  EXPECT_EQ(slave.eni, nullptr);
  EXPECT_THAT(slave.profile_source, Not(HasSubstr("network.xml")));
}

TEST(ModelType, IsReadFromTheDeviceName) {
  const auto trace = test::Trace::Parse(R"(
+0us    FPRD 0x1001:0x0130  02 00
+1ms    FPWR 0x1001:0x0800  00 10 20 00 26 00 01 00
+1ms    FPWR 0x1001:0x0808  00 14 20 00 22 00 01 00
+1ms    FPWR 0x1001:0x1000  0A 00 00 00 00 13 00 20 40 18 10 01 00 00 00 00  len=32
+1ms    FPRD 0x1001:0x1400  0A 00 00 00 00 13 00 30 43 18 10 01 6A 00 00 00  len=32
+1ms    FPWR 0x1001:0x1000  0A 00 00 00 00 23 00 20 40 18 10 02 00 00 00 00  len=32
+1ms    FPRD 0x1001:0x1400  0A 00 00 00 00 23 00 30 43 18 10 02 01 00 00 00  len=32
+1ms    FPWR 0x1001:0x1000  0A 00 00 00 00 33 00 20 40 08 10 00 00 00 00 00  len=32
+1ms    FPRD 0x1001:0x1400  15 00 00 00 00 33 00 30 41 08 10 00 0B 00 00 00 4D 4B 44 2D 4E 2D 30 30 36 30 36  len=32
)");
  ASSERT_TRUE(trace) << trace.error().message;
  const AnalysisResult result = Analyse(*trace->Source(), {});
  ASSERT_EQ(result.slaves.size(), 1U);
  EXPECT_EQ(result.slaves[0].profile, "kollmorgen-mkd-n");
}

}  // namespace
}  // namespace ecaudit::model
