#include "decoder/esc/sii.h"

#include <array>
#include <string_view>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ecaudit::esc {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

/// Builds an EEPROM image: Words() and Bytes() append where the last call stopped.
class SiiBuilder {
 public:
  SiiBuilder& At(std::uint32_t word) {
    next_ = word;
    return *this;
  }
  SiiBuilder& Words(const std::vector<std::uint16_t>& words) {
    for (const std::uint16_t word : words) image_.Set(next_++, word);
    return *this;
  }
  SiiBuilder& Bytes(std::vector<std::uint8_t> bytes) {
    if (bytes.size() % 2 != 0) bytes.push_back(0);
    for (std::size_t i = 0; i < bytes.size(); i += 2) {
      image_.Set(next_++, static_cast<std::uint16_t>(bytes[i] | bytes[i + 1] << 8U));
    }
    return *this;
  }
  SiiBuilder& Category(std::uint16_t type, const std::vector<std::uint8_t>& bytes) {
    return Words({type, static_cast<std::uint16_t>((bytes.size() + 1) / 2)}).Bytes(bytes);
  }
  [[nodiscard]] const SiiImage& image() const { return image_; }
  [[nodiscard]] SiiContents Parse() const { return ParseSii(image_); }

 private:
  SiiImage image_;
  std::uint32_t next_ = 0x40;
};

std::vector<std::uint8_t> Strings(const std::vector<std::string_view>& strings) {
  std::vector<std::uint8_t> bytes = {static_cast<std::uint8_t>(strings.size())};
  for (const std::string_view text : strings) {
    bytes.push_back(static_cast<std::uint8_t>(text.size()));
    bytes.insert(bytes.end(), text.begin(), text.end());
  }
  return bytes;
}

// ---- image

TEST(SiiImage, WordsAreUnknownUntilSet) {
  SiiImage image;
  EXPECT_FALSE(image.Word(8));
  EXPECT_EQ(image.Set(8, 0x006A), SiiImage::Change::kLearned);
  EXPECT_EQ(image.Set(8, 0x006A), SiiImage::Change::kNone);
  EXPECT_EQ(image.Set(8, 0x006B), SiiImage::Change::kReplaced);
  EXPECT_EQ(image.Word(8), 0x006B);
  EXPECT_FALSE(image.DoubleWord(8));
  image.Set(9, 0x1234);
  EXPECT_EQ(image.DoubleWord(8), 0x1234006BU);
  image.Forget(8);
  EXPECT_FALSE(image.Word(8));
  EXPECT_EQ(image.KnownWords(), 1U);
}

TEST(SiiImage, EndsAt64KiWords) {
  SiiImage image;
  EXPECT_EQ(image.Set(0xFFFF, 0xABCD), SiiImage::Change::kLearned);
  EXPECT_EQ(image.Set(0x10000, 0xABCD), SiiImage::Change::kNone);
  EXPECT_EQ(image.Set(0xFFFFFFFF, 0xABCD), SiiImage::Change::kNone);
  EXPECT_EQ(image.Word(0xFFFF), 0xABCD);
  EXPECT_FALSE(image.Word(0x10000));
  EXPECT_FALSE(image.DoubleWord(0xFFFF));
  EXPECT_FALSE(image.DoubleWord(0xFFFFFFFF));
  EXPECT_TRUE(image.Bytes(0xFFFF, 1));
  EXPECT_FALSE(image.Bytes(0xFFFF, 2));
  EXPECT_FALSE(image.Bytes(0x10001, 0));
  image.Forget(0xFFFFFFFF);
  EXPECT_EQ(image.KnownWords(), 1U);
}

TEST(SiiImage, BytesOnlyWhenAllAreKnown) {
  SiiImage image = SiiImage::FromBytes(std::array<std::uint8_t, 5>{1, 2, 3, 4, 5});
  EXPECT_EQ(image.KnownWords(), 2U);
  EXPECT_THAT(*image.Bytes(0, 2), ElementsAre(1, 2, 3, 4));
  EXPECT_FALSE(image.Bytes(0, 3));
  EXPECT_THAT(*image.Bytes(7, 0), IsEmpty());
  const SiiImage copy = image;
  image.Set(0, 0xFFFF);
  EXPECT_EQ(copy.Word(0), 0x0201);
}

// ---- header

TEST(SiiHeader, FieldsAreKnownOneByOne) {
  const SiiHeader header = SiiBuilder()
                               .At(0x08)
                               .Words({0x006A, 0, 0x4B44, 0x0041, 2, 0})
                               .At(0x18)
                               .Words({0x1800, 0x0400, 0x1C00, 0x0400, 0x000E})
                               .Parse()
                               .header;
  // The words SOEM reads from a real AKD (soem-sdinfo-akd).
  EXPECT_EQ(header.vendor_id, 0x0000006AU);
  EXPECT_EQ(header.product_code, 0x00414B44U);
  EXPECT_EQ(header.revision, 2U);
  EXPECT_FALSE(header.serial);
  EXPECT_EQ(header.standard_receive, (SiiMailbox{0x1800, 1024}));
  EXPECT_EQ(header.standard_send, (SiiMailbox{0x1C00, 1024}));
  EXPECT_FALSE(header.bootstrap_receive);
  EXPECT_EQ(header.protocols, kSiiEoe | kSiiCoe | kSiiFoe);
  EXPECT_EQ(SiiProtocolNames(*header.protocols), "EoE, CoE, FoE");
  EXPECT_FALSE(header.size_bytes);
  EXPECT_EQ(header.checksum_state, SiiChecksumState::kUnknown);
}

TEST(SiiHeader, SizeIsGivenInKBitMinus1) {
  const SiiHeader header = SiiBuilder().At(0x3E).Words({15, 1}).Parse().header;
  EXPECT_EQ(header.size_bytes, 2048U);
  EXPECT_EQ(header.version, 1);
}

TEST(SiiProtocolNames, NoneAndUnnamedBits) {
  EXPECT_EQ(SiiProtocolNames(0), "none");
  EXPECT_EQ(SiiProtocolNames(0x0044), "CoE, 0x0040");
}

// The check value of CRC-8 with polynomial 0x07 and start 0xFF over "123456789".
TEST(SiiChecksum, CheckValueOfThePolynomial) {
  constexpr std::string_view kText = "123456789";
  EXPECT_EQ(SiiChecksum(std::vector<std::uint8_t>(kText.begin(), kText.end())), 0xFB);
  EXPECT_EQ(SiiChecksum({}), 0xFF);
}

// Words 0-7 of an EEPROM that other software wrote (lab capture soem-eepromtool-read).
TEST(SiiChecksum, StateOfWord7) {
  const std::vector<std::uint16_t> words = {0x0E08, 0xEE02, 0x9C40, 0, 0, 0, 0};
  const auto state = [&words](std::uint16_t checksum) {
    return SiiBuilder().At(0).Words(words).Words({checksum}).Parse().header.checksum_state;
  };
  EXPECT_EQ(state(0x0084), SiiChecksumState::kRight);
  EXPECT_EQ(state(0x0085), SiiChecksumState::kWrong);
  EXPECT_EQ(state(0x88A4), SiiChecksumState::kDisabled);
  EXPECT_EQ(SiiBuilder().At(0).Words(words).Parse().header.checksum_state, SiiChecksumState::kUnknown);
}

// ---- categories

TEST(SiiCategories, AllKinds) {
  const SiiContents contents =
      SiiBuilder()
          .Category(10, Strings({"AKD", "Drive", "Inputs", "Position actual value", "DC"}))
          .Category(30, {2,    0,    1, 1, 0, 0x2D, 1, 1, 0, 0, 0, 0x02, 0x38, 0xFF, 2, 0,
                         0x11, 0x00, 0, 0, 0, 0,    0, 0, 0, 0, 0, 0,    0,    0,    0, 0})
          .Category(40, {1, 2, 3, 0xFF})
          .Category(41,
                    {0x00, 0x18, 0x00, 0x04, 0x26, 0x00, 0x01, 0x01, 0x40, 0x11, 0x06, 0x00, 0x20, 0x00, 0x09, 0x04})
          .Category(50, {0x00, 0x1A, 2, 3, 0, 3, 0x11, 0x00, 0x63, 0x60, 0, 4, 4, 32, 0, 0, 0, 0, 0, 0, 0, 16, 0, 0})
          .Category(51, {0x00, 0x16, 1, 2, 1, 0, 0, 0, 0x40, 0x60, 0, 0, 6, 16, 0, 0})
          .Category(60, {0x40, 0x42, 0x0F, 0, 1, 0, 0, 0, 2, 0, 0, 0, 0xFF, 0xFF, 0x00, 0x07, 2, 0, 5, 0, 0, 0, 0, 0})
          .Category(0x0800, {'A', 'K', 'D', ' ', 0, 0})
          .Words({0xFFFF})
          .Parse();
  EXPECT_EQ(contents.chain_end, SiiChainEnd::kEndMark);
  EXPECT_THAT(contents.categories, SizeIs(8));
  EXPECT_EQ(contents.Name(), "AKD");
  EXPECT_EQ(contents.String(4), "Position actual value");
  EXPECT_EQ(contents.String(0), "");
  EXPECT_EQ(contents.String(6), "");

  ASSERT_TRUE(contents.general);
  EXPECT_EQ(contents.general->group_string, 2);
  EXPECT_TRUE(contents.general->Coe(kSiiSdo));
  EXPECT_FALSE(contents.general->Coe(kSiiSdoInfo));
  EXPECT_TRUE(contents.general->Coe(kSiiCompleteAccess));
  EXPECT_TRUE(contents.general->no_lrw());
  EXPECT_EQ(contents.general->ebus_current_ma, -200);
  EXPECT_EQ(contents.general->physical_ports, 0x0011);

  EXPECT_THAT(contents.fmmus, ElementsAre(SiiFmmuUse::OUTPUTS, SiiFmmuUse::INPUTS, SiiFmmuUse::MAILBOX_STATE,
                                          static_cast<SiiFmmuUse>(0xFF)));
  EXPECT_THAT(contents.sync_managers,
              ElementsAre(SiiSyncManager{0x1800, 1024, 0x26, 0, 1, 1}, SiiSyncManager{0x1140, 6, 0x20, 0, 9, 4}));
  ASSERT_THAT(contents.tx_pdos, SizeIs(1));
  const SiiPdo& tx = contents.tx_pdos[0];
  EXPECT_EQ(tx.index, 0x1A00);
  EXPECT_EQ(tx.sync_manager, 3);
  EXPECT_EQ(tx.flags, 0x0011);
  EXPECT_EQ(contents.String(tx.name_string), "Inputs");
  ASSERT_THAT(tx.entries, SizeIs(2));
  EXPECT_EQ(tx.entries[0].index, 0x6063);
  EXPECT_EQ(tx.entries[0].bits, 32);
  EXPECT_EQ(tx.entries[0].data_type, 4);
  EXPECT_EQ(tx.entries[1].index, 0);
  EXPECT_EQ(tx.Bits(), 48U);
  ASSERT_THAT(contents.rx_pdos, SizeIs(1));
  EXPECT_EQ(contents.rx_pdos[0].index, 0x1600);
  EXPECT_EQ(contents.rx_pdos[0].synchronization, 1);

  ASSERT_THAT(contents.dc_modes, SizeIs(1));
  EXPECT_EQ(contents.dc_modes[0].cycle0_ns, 1000000U);
  EXPECT_EQ(contents.dc_modes[0].shift0_ns, 1U);
  EXPECT_EQ(contents.dc_modes[0].shift1_ns, 2U);
  EXPECT_EQ(contents.dc_modes[0].sync1_cycle_factor, -1);
  EXPECT_EQ(contents.dc_modes[0].assign_activate, 0x0700);
  EXPECT_EQ(contents.dc_modes[0].sync0_cycle_factor, 2);
  EXPECT_EQ(contents.String(contents.dc_modes[0].name_string), "DC");
  EXPECT_EQ(contents.VendorText(0x0800), "AKD");
  EXPECT_EQ(contents.VendorText(0x0801), "");
  for (const SiiCategory& category : contents.categories) {
    EXPECT_EQ(category.coverage, SiiCategory::Coverage::kComplete) << category.type;
    EXPECT_FALSE(category.malformed) << category.type;
  }
}

TEST(SiiCategories, AnUnknownHeaderEndsTheChain) {
  SiiBuilder builder;
  builder.Category(40, {1, 2}).Words({41}).At(0x45).Words({0, 0});
  const SiiContents contents = builder.Parse();
  EXPECT_EQ(contents.chain_end, SiiChainEnd::kUnknownWord);
  EXPECT_EQ(contents.chain_end_word, 0x43U);
  EXPECT_THAT(contents.fmmus, SizeIs(2));
  EXPECT_FALSE(contents.Complete(SiiCategoryType::FMMU));  // another one may follow
}

TEST(SiiCategories, NothingKnown) {
  const SiiContents contents = ParseSii(SiiImage());
  EXPECT_EQ(contents.chain_end, SiiChainEnd::kUnknownWord);
  EXPECT_EQ(contents.chain_end_word, 0x40U);
  EXPECT_EQ(contents.Name(), "");
  EXPECT_FALSE(contents.Complete(SiiCategoryType::TX_PDO));
}

TEST(SiiCategories, PartlyKnownOnesAreNotDecoded) {
  SiiBuilder builder;
  builder.Words({41, 8}).Words({0x1800, 0x0400, 0x0026, 0x0101}).At(0x4A);
  builder.Words({51, 4}).At(0x50).Words({0xFFFF});
  const SiiContents contents = builder.Parse();
  EXPECT_EQ(contents.chain_end, SiiChainEnd::kEndMark);
  EXPECT_THAT(contents.sync_managers, IsEmpty());
  EXPECT_EQ(contents.Find(SiiCategoryType::SYNC_MANAGER)->coverage, SiiCategory::Coverage::kPartial);
  EXPECT_EQ(contents.Find(SiiCategoryType::RX_PDO)->coverage, SiiCategory::Coverage::kUnknown);
  EXPECT_FALSE(contents.Complete(SiiCategoryType::SYNC_MANAGER));
  EXPECT_TRUE(contents.Complete(SiiCategoryType::TX_PDO));  // seen to the end: there is none
  EXPECT_EQ(contents.Find(SiiCategoryType::TX_PDO), nullptr);
}

// SOEM reads a real AKD's strings and general category only in parts (soem-sdinfo-akd, words 0x54 and 0x145).
TEST(SiiCategories, StringsAndGeneralAsFarAsKnown) {
  SiiBuilder builder;
  builder.Words({0x000A, 0x00EF, 0x0321, 0x4B41, 0x0544, 0x7244});
  builder.At(0x42 + 0xEF).Words({0x001E, 0x0010});
  builder.At(0x42 + 0xEF + 2 + 2).Words({0x0D01, 0x0301, 0x0100, 0x0500, 0x0000, 0x0003});
  const SiiContents contents = builder.Parse();
  EXPECT_THAT(contents.strings, ElementsAre("AKD"));
  EXPECT_EQ(contents.Name(), "AKD");
  ASSERT_TRUE(contents.general);
  EXPECT_FALSE(contents.general->name_string);
  EXPECT_EQ(contents.general->coe_details, 0x0D);
  EXPECT_EQ(contents.general->eoe_details, 0x03);
  EXPECT_EQ(contents.general->flags, 0x05);
  EXPECT_FALSE(contents.general->no_lrw());
  EXPECT_EQ(contents.general->ebus_current_ma, 0);
  EXPECT_FALSE(contents.general->physical_ports);
  EXPECT_FALSE(contents.Find(SiiCategoryType::STRINGS)->malformed);
}

TEST(SiiCategories, StringsOverTwoCategories) {
  const SiiContents contents =
      SiiBuilder().Category(10, Strings({"a", "b"})).Category(10, Strings({"c"})).Words({0xFFFF}).Parse();
  EXPECT_EQ(contents.String(3), "c");
  SiiBuilder gap;
  gap.Words({10, 3, 0x0101}).At(0x45).Category(10, Strings({"c"}));
  EXPECT_THAT(gap.Parse().strings, IsEmpty());  // nobody knows how many come before "c"
}

TEST(SiiCategories, VendorBitOfTheType) {
  const SiiContents contents = SiiBuilder().Category(0x8000 | 40, {1, 2}).Words({0xFFFF}).Parse();
  ASSERT_THAT(contents.categories, SizeIs(1));
  EXPECT_TRUE(contents.categories[0].vendor_flag);
  EXPECT_EQ(contents.categories[0].type, 40);
}

TEST(SiiCategories, ErasedEeproms) {
  const SiiContents ones = ParseSii(SiiImage::FromBytes(std::vector<std::uint8_t>(2048, 0xFF)));
  EXPECT_EQ(ones.chain_end, SiiChainEnd::kEndMark);
  EXPECT_THAT(ones.categories, IsEmpty());
  EXPECT_EQ(ones.header.checksum_state, SiiChecksumState::kWrong);
  const SiiContents zeros = ParseSii(SiiImage::FromBytes(std::vector<std::uint8_t>(131072, 0)));
  EXPECT_EQ(zeros.chain_end, SiiChainEnd::kBeyondImage);
  EXPECT_THAT(zeros.categories, IsEmpty());
}

TEST(SiiCategories, LengthAfterTheImage) {
  SiiBuilder builder;
  builder.Words({41, 0xFFFF});
  const SiiContents contents = builder.Parse();
  EXPECT_EQ(contents.chain_end, SiiChainEnd::kBeyondImage);
  EXPECT_EQ(contents.chain_end_word, 0x40U);
  EXPECT_THAT(contents.categories, IsEmpty());
}

TEST(SiiCategories, RecordsAfterTheCategory) {
  // A PDO that promises more entries than there is room for; the one before it stays.
  const SiiContents pdos =
      SiiBuilder().Category(50, {0x00, 0x1A, 0, 3, 0, 0, 0, 0, 0x01, 0x1A, 9, 3, 0, 0, 0, 0}).Words({0xFFFF}).Parse();
  EXPECT_THAT(pdos.tx_pdos, SizeIs(1));
  EXPECT_TRUE(pdos.Find(SiiCategoryType::TX_PDO)->malformed);
  const SiiContents strings = SiiBuilder().Category(10, {2, 1, 'x', 200, 'y', 'z'}).Words({0xFFFF}).Parse();
  EXPECT_THAT(strings.strings, ElementsAre("x"));
  EXPECT_TRUE(strings.Find(SiiCategoryType::STRINGS)->malformed);
  const SiiContents others = SiiBuilder().Category(41, {1, 2, 3, 4}).Category(60, {1, 2}).Words({0xFFFF}).Parse();
  EXPECT_TRUE(others.Find(SiiCategoryType::SYNC_MANAGER)->malformed);
  EXPECT_TRUE(others.Find(SiiCategoryType::DC)->malformed);
  EXPECT_THAT(others.sync_managers, IsEmpty());
}

TEST(SiiCategories, Names) {
  EXPECT_EQ(SiiCategoryName(10), "strings");
  EXPECT_EQ(SiiCategoryName(41), "sync managers");
  EXPECT_EQ(SiiCategoryName(0x0800), "vendor 0x0800");
  EXPECT_EQ(SiiCategoryName(77), "category 77");
  EXPECT_EQ(SiiCategoryName(0xFFFF), "end");
}

}  // namespace
}  // namespace ecaudit::esc
