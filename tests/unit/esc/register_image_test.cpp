#include "decoder/esc/register_image.h"

#include <array>
#include <vector>

#include <gtest/gtest.h>

namespace ecaudit::esc {
namespace {

constexpr std::array<std::uint8_t, 4> kBytes = {0x12, 0x34, 0x56, 0x78};

TEST(RegisterImage, EverythingIsUnknownAtFirst) {
  const RegisterImage image;
  EXPECT_FALSE(image.Value<std::uint16_t>(0x0130));
  EXPECT_EQ(image.CertaintyOf(0x0000, RegisterImage::kSize), Certainty::kUnknown);
  EXPECT_EQ(image.CertaintyOf(0x0130, 0), Certainty::kUnknown);
}

TEST(RegisterImage, ReadsWhatWasWrittenAcrossPages) {
  RegisterImage image;
  image.Write(0x01FE, kBytes, Certainty::kObserved);
  EXPECT_EQ(image.Value<std::uint32_t>(0x01FE), 0x78563412U);
  EXPECT_EQ(image.Value<std::uint16_t>(0x0200), 0x7856U);
  EXPECT_FALSE(image.Value<std::uint16_t>(0x01FD));
  EXPECT_FALSE(image.Value<std::uint16_t>(0x0201));
  EXPECT_EQ(image.Read<4>(0x01FE), kBytes);
}

TEST(RegisterImage, TheLeastCertainByteCounts) {
  RegisterImage image;
  image.Write(0x0100, kBytes, Certainty::kObserved);
  image.Write(0x0102, ByteSpan(kBytes).first(1), Certainty::kInferred);
  EXPECT_EQ(image.CertaintyOf(0x0100, 2), Certainty::kObserved);
  EXPECT_EQ(image.CertaintyOf(0x0100, 4), Certainty::kInferred);
  EXPECT_EQ(image.Value<std::uint32_t>(0x0100), 0x78123412U);
  EXPECT_FALSE(image.Value<std::uint32_t>(0x0100, Certainty::kObserved));
  EXPECT_EQ(image.Value<std::uint16_t>(0x0100, Certainty::kObserved), 0x3412U);
}

TEST(RegisterImage, PartlyUnknownReadGivesZerosAndReportsIt) {
  RegisterImage image;
  image.Write(0x0901, ByteSpan(kBytes).first(2), Certainty::kObserved);
  std::array<std::uint8_t, 4> out = {0xEE, 0xEE, 0xEE, 0xEE};
  EXPECT_EQ(image.Read(0x0900, out), Certainty::kUnknown);
  EXPECT_EQ(out, (std::array<std::uint8_t, 4>{0, 0x12, 0x34, 0}));
}

TEST(RegisterImage, ForgetMakesExactlyTheRangeUnknown) {
  RegisterImage image;
  const std::vector<std::uint8_t> all(RegisterImage::kSize, 0x5A);
  image.Write(0, all, Certainty::kObserved);
  EXPECT_EQ(image.CertaintyOf(0, RegisterImage::kSize), Certainty::kObserved);
  image.Forget(0x08FF, 2);
  EXPECT_FALSE(image.Value<std::uint8_t>(0x08FF));
  EXPECT_FALSE(image.Value<std::uint8_t>(0x0900));
  EXPECT_TRUE(image.Value<std::uint8_t>(0x08FE));
  EXPECT_TRUE(image.Value<std::uint8_t>(0x0901));
  image.Write(0x0901, ByteSpan(kBytes).first(1), Certainty::kUnknown);
  EXPECT_FALSE(image.Value<std::uint8_t>(0x0901));
  image.Clear();
  EXPECT_FALSE(image.Value<std::uint8_t>(0x0000));
}

TEST(RegisterImage, ProcessRamIsNotKept) {
  RegisterImage image;
  image.Write(0x0FFE, kBytes, Certainty::kObserved);
  EXPECT_EQ(image.Value<std::uint16_t>(0x0FFE), 0x3412U);
  EXPECT_FALSE(image.Value<std::uint32_t>(0x0FFE));
  image.Write(0xFFFE, kBytes, Certainty::kObserved);
  EXPECT_FALSE(image.Value<std::uint8_t>(0xFFFE));
  EXPECT_FALSE(image.Value<std::uint8_t>(0x0000));
  image.Forget(0xFFFF, 0xFFFF);
  EXPECT_TRUE(image.Value<std::uint16_t>(0x0FFE));
  std::array<std::uint8_t, 4> out = {1, 1, 1, 1};
  EXPECT_EQ(image.Read(0x1000, out), Certainty::kUnknown);
  EXPECT_EQ(out, (std::array<std::uint8_t, 4>{}));
}

TEST(RegisterImage, CopiesAreIndependent) {
  RegisterImage image;
  image.Write(0x0100, kBytes, Certainty::kObserved);
  RegisterImage copy = image;
  copy.Write(0x0100, ByteSpan(kBytes).last(1), Certainty::kObserved);
  EXPECT_EQ(image.Value<std::uint8_t>(0x0100), 0x12);
  EXPECT_EQ(copy.Value<std::uint8_t>(0x0100), 0x78);
  image = copy;
  EXPECT_EQ(image.Value<std::uint8_t>(0x0100), 0x78);
}

TEST(RegisterImage, PagesThatAreSharedAreIndependent) {
  RegisterImage image;
  RegisterImage other;
  for (RegisterImage* i : {&image, &other}) i->Write(0x0100, kBytes, Certainty::kObserved);
  image.ShareWith(other, 0x0100, 4);
  EXPECT_EQ(image.Value<std::uint32_t>(0x0100), other.Value<std::uint32_t>(0x0100));
  image.Write(0x0102, ByteSpan(kBytes).first(1), Certainty::kInferred);
  EXPECT_EQ(image.CertaintyOf(0x0100, 4), Certainty::kInferred);
  EXPECT_EQ(other.CertaintyOf(0x0100, 4), Certainty::kObserved);
  image.ShareWith(other, 0x0100, 4);  // they differ now
  EXPECT_EQ(image.CertaintyOf(0x0100, 4), Certainty::kInferred);
  image.Write(0x0102, ByteSpan(kBytes).subspan(2, 1), Certainty::kObserved);
  image.ShareWith(other, 0x0100, 4);
  other.Forget(0x0101, 1);
  EXPECT_TRUE(image.Value<std::uint8_t>(0x0101));
  image.Write(0x0100, kBytes, Certainty::kInferred);  // the same bytes, less certain
  EXPECT_EQ(image.CertaintyOf(0x0100, 4), Certainty::kInferred);
  EXPECT_EQ(other.CertaintyOf(0x0100, 1), Certainty::kObserved);
}

}  // namespace
}  // namespace ecaudit::esc
