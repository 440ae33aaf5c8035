// What a slave is, where only object 1018h tells (contract: "EEPROM words 8-15, object 1018h, or ESI/ENI").
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "tests/support/trace_builder.h"

namespace ecaudit {
namespace {

using test::Bytes;
using test::Trace;
using ::testing::HasSubstr;

constexpr std::uint32_t kVendor = 0x0000006A;
constexpr std::uint32_t kAkd = 0x00414B44;
constexpr std::uint32_t kMkdC = 0x00000002;  // object_dictionary_mkd_c.csv, 1018h

class IdentityTest : public ::testing::Test {
 protected:
  IdentityTest() {
    trace.After(1000).Brd(0x0130, {2, 0});
    trace.After(1000).Apwr(0, 0x0010, {1, 0x10});
    trace.After(1000).Fprd(0x1001, 0x0130, {2, 0, 0, 0, 0, 0});
    trace.After(1000).Fpwr(0x1001, 0x0800, {0x00, 0x18, 0x80, 0, 0x26, 0, 1, 0, 0x00, 0x1C, 0x80, 0, 0x22, 0, 1, 0});
  }
  static void Append(Bytes& to, std::uint32_t value) {
    for (unsigned i = 0; i < 4; ++i) to.push_back(static_cast<std::uint8_t>(value >> 8U * i));
  }
  /// A CoE message of SDO bytes in a mailbox of 128 bytes.
  static Bytes Message(std::uint8_t service, const Bytes& sdo) {
    Bytes message{static_cast<std::uint8_t>(sdo.size() + 2), 0, 0, 0, 0, 0x03, 0, service};
    message.insert(message.end(), sdo.begin(), sdo.end());
    message.resize(128);
    return message;
  }
  void Exchange(const Bytes& request, const Bytes& answer) {
    trace.After(1000).Fpwr(0x1001, 0x1800, Message(0x20, request));
    trace.After(1000).Fprd(0x1001, 0x1C00, Message(0x30, answer)).Mark("answer " + std::to_string(++answers));
  }
  void Upload(std::uint8_t subindex, std::uint32_t value) {
    Bytes answer{0x43, 0x18, 0x10, subindex};
    Append(answer, value);
    Exchange({0x40, 0x18, 0x10, subindex, 0, 0, 0, 0}, answer);
  }
  /// The EEPROM's vendor and product, eight bytes a read.
  void ReadEeprom(std::uint32_t vendor, std::uint32_t product) {
    trace.After(1000).Fpwr(0x1001, 0x0502, {0x00, 0x01, 0x08, 0, 0, 0});
    Bytes answer{0x40, 0x00, 0x08, 0, 0, 0};
    Append(answer, vendor);
    Append(answer, product);
    trace.After(1000).Fprd(0x1001, 0x0502, answer);
  }
  SlaveSummary Slave() { return Analyse(*trace.Source(), {}).slaves.at(0); }

  Trace trace;
  int answers = 0;
};

TEST_F(IdentityTest, UploadsOf1018ChooseTheProfile) {
  Upload(1, kVendor);
  Upload(2, kAkd);
  Upload(3, 2);
  Upload(4, 77);
  const SlaveSummary slave = Slave();
  EXPECT_EQ(slave.identity.vendor_id, kVendor);
  EXPECT_EQ(slave.identity.product_code, kAkd);
  EXPECT_EQ(slave.identity.revision, 2U);
  EXPECT_EQ(slave.identity.serial, 77U);
  EXPECT_EQ(slave.profile, "kollmorgen-akd-2011");
  EXPECT_THAT(slave.profile_source, HasSubstr("identity in object 1018h"));
  EXPECT_THAT(slave.profile_source, HasSubstr("frame " + std::to_string(trace.Returned("answer 4"))));
}

TEST_F(IdentityTest, CompleteAccessTo1018ChoosesTheProfile) {
  Bytes answer{0x51, 0x18, 0x10, 0, 18, 0, 0, 0, 4, 0};
  for (const std::uint32_t value : {kVendor, kMkdC, std::uint32_t{0x00020000}, std::uint32_t{5}}) Append(answer, value);
  Exchange({0x50, 0x18, 0x10, 0, 0, 0, 0, 0}, answer);
  const SlaveSummary slave = Slave();
  EXPECT_EQ(slave.identity.vendor_id, kVendor);
  EXPECT_EQ(slave.identity.product_code, kMkdC);
  EXPECT_EQ(slave.identity.revision, 0x00020000U);
  EXPECT_EQ(slave.identity.serial, 5U);
  EXPECT_EQ(slave.profile, "kollmorgen-mkd-c");
}

TEST_F(IdentityTest, VendorAloneChoosesNothing) {
  Upload(1, kVendor);
  const SlaveSummary slave = Slave();
  EXPECT_EQ(slave.identity.vendor_id, kVendor);
  EXPECT_EQ(slave.profile, "generic");
}

TEST_F(IdentityTest, AbortedUploadTellsNothing) {
  Exchange({0x40, 0x18, 0x10, 1, 0, 0, 0, 0}, {0x80, 0x18, 0x10, 1, 0x11, 0, 0x09, 0x06});
  EXPECT_FALSE(Slave().identity.vendor_id);
}

TEST_F(IdentityTest, EepromComesFirstAndTheObjectFillsGaps) {
  ReadEeprom(kVendor, kAkd);
  Upload(2, kMkdC);
  Upload(4, 77);
  const SlaveSummary slave = Slave();
  EXPECT_EQ(slave.identity.product_code, kAkd);
  EXPECT_EQ(slave.identity.serial, 77U);
  EXPECT_THAT(slave.profile_source, HasSubstr("identity in the EEPROM"));
}

TEST_F(IdentityTest, ProductThatOnlyTheObjectTells) {
  trace.After(1000).Fpwr(0x1001, 0x0502, {0x00, 0x01, 0x08, 0, 0, 0});
  Bytes vendor{0x00, 0x00, 0x08, 0, 0, 0};  // four bytes a read
  Append(vendor, kVendor);
  trace.After(1000).Fprd(0x1001, 0x0502, vendor);
  Upload(2, kMkdC);
  const SlaveSummary slave = Slave();
  EXPECT_EQ(slave.profile, "kollmorgen-mkd-c");
  EXPECT_THAT(slave.profile_source, HasSubstr("identity in object 1018h"));
}

TEST_F(IdentityTest, EepromReadLaterWins) {
  Upload(1, kVendor);
  Upload(2, kMkdC);
  ReadEeprom(kVendor, kAkd);
  const SlaveSummary slave = Slave();
  EXPECT_EQ(slave.identity.product_code, kAkd);
  EXPECT_THAT(slave.profile_source, HasSubstr("identity in the EEPROM"));
}

}  // namespace
}  // namespace ecaudit
