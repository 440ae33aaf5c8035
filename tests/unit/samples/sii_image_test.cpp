#include "samples/builder/sii_image.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "decoder/esc/sii.h"
#include "samples/builder/devices.h"

namespace ecaudit::samples {
namespace {

using ::testing::ElementsAre;

std::uint16_t Word(const Bytes& image, std::size_t number) {
  return LoadLe<std::uint16_t>(image, number * 2);
}

// The check value of CRC-8 with polynomial 0x07 and start 0xFF over "123456789".
TEST(BuiltSii, Checksum) {
  const std::string text = "123456789";
  EXPECT_EQ(SiiChecksum(Bytes(text.begin(), text.end())), 0xFB);
}

TEST(BuiltSii, HeaderWords) {
  const Bytes image = BuildSii(AkdDrive().sii);
  ASSERT_EQ(image.size(), 2048U);
  EXPECT_EQ(Word(image, 0x00), 0x0C08);
  EXPECT_EQ(Word(image, 0x07), SiiChecksum(image));
  EXPECT_EQ(Word(image, 0x08), 0x006A);
  EXPECT_EQ(LoadLe<std::uint32_t>(image, 0x0A * 2), 0x00414B44U);
  EXPECT_EQ(Word(image, 0x0C), 2);
  EXPECT_EQ(Word(image, 0x18), 0x1800);
  EXPECT_EQ(Word(image, 0x19), 128);
  EXPECT_EQ(Word(image, 0x1A), 0x1C00);
  EXPECT_EQ(Word(image, 0x1C), 0x0004) << "CoE only";
  EXPECT_EQ(Word(image, 0x3E), 15) << "2 KiB are 16 KBit";
}

TEST(BuiltSii, CategoriesFollowEachOtherToTheEndMark) {
  const Bytes image = BuildSii(AkdDrive().sii);
  std::vector<std::uint16_t> types;
  std::size_t word = 0x40;
  while (word < image.size() / 2 && Word(image, word) != 0xFFFF) {
    types.push_back(Word(image, word));
    word += 2U + Word(image, word + 1);
  }
  EXPECT_THAT(types, ElementsAre(10, 30, 40, 41, 50, 51));
  EXPECT_EQ(Word(image, word), 0xFFFF);
}

// Builder and reader are two implementations of the same layout.
TEST(BuiltSii, TheDecoderReadsWhatWasMeant) {
  const Bytes image = BuildSii(AkdDrive().sii);
  const esc::SiiContents read = esc::ParseSii(esc::SiiImage::FromBytes(image));
  EXPECT_EQ(read.header.checksum_state, esc::SiiChecksumState::kRight);
  EXPECT_EQ(read.chain_end, esc::SiiChainEnd::kEndMark);
  EXPECT_EQ(read.Name(), "AKD");
  ASSERT_EQ(read.sync_managers.size(), 4U);
  EXPECT_EQ(read.sync_managers[2].start, 0x1100);
  EXPECT_EQ(read.sync_managers[2].type, 3);
  ASSERT_EQ(read.rx_pdos.size(), 1U);
  EXPECT_EQ(read.rx_pdos[0].index, 0x1701);
  EXPECT_EQ(read.rx_pdos[0].Bits(), 48U);
  ASSERT_EQ(read.rx_pdos[0].entries.size(), 2U);
  EXPECT_EQ(read.String(read.rx_pdos[0].entries[1].name_string), "Control word");
  ASSERT_EQ(read.fmmus.size(), 4U) << "three, and one unused to fill the word";
  EXPECT_EQ(read.fmmus[0], esc::SiiFmmuUse::OUTPUTS);
  EXPECT_EQ(read.fmmus[1], esc::SiiFmmuUse::INPUTS);
  EXPECT_EQ(read.fmmus[2], esc::SiiFmmuUse::MAILBOX_STATE);
}

}  // namespace
}  // namespace ecaudit::samples
