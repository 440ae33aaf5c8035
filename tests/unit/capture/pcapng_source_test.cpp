#include "decoder/capture/pcapng_source.h"

#include <gtest/gtest.h>

#include "decoder/capture/capture_stream.h"
#include "tests/unit/capture/pcapng_bytes.h"

namespace ecaudit::capture {
namespace {

const Bytes kPcapngSourceData{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14};

WholeCapture ReadPcapng(const PcapngBytes& file) {
  return ReadAll(OpenCaptureFromMemory(file.bytes(), "x"));
}

/// Section header and one interface.
PcapngBytes Plain() {
  return PcapngBytes().Section().Interface();
}

TEST(Pcapng, OneEnhancedPacket) {
  const WholeCapture capture = ReadPcapng(Plain().Enhanced(0, 5'000'000, kPcapngSourceData, {}, 60));
  ASSERT_EQ(capture.frames.size(), 1U);
  const OwnedFrame& frame = capture.frames[0];
  EXPECT_EQ(frame.number, 1U);
  EXPECT_TRUE(frame.has_time);
  EXPECT_EQ(frame.time, 5'000'000'000);
  EXPECT_EQ(frame.link_type, 1);
  EXPECT_EQ(frame.interface_index, 0);
  EXPECT_EQ(frame.flag, PacketFlag::kNone);
  EXPECT_EQ(frame.original_length, 60U);
  EXPECT_EQ(frame.bytes, kPcapngSourceData);
  EXPECT_EQ(capture.end, ReadStatus::kEnd);
  EXPECT_EQ(capture.info.path, "x");
  EXPECT_EQ(capture.info.format, "pcapng");
}

TEST(Pcapng, NamesOfInterfacesHaveRoomTogether) {
  PcapngBytes file;
  file.Section();
  const std::size_t most = CaptureInfo::kNameBytes / 250;
  for (std::size_t i = 0; i < most + 3; ++i) file.Interface(file.Option(2, std::string(250, 'n')));
  file.Interface(file.Option(2, "eth0"));  // for which there is room
  file.Enhanced(0, 7, kPcapngSourceData);
  const WholeCapture capture = ReadPcapng(file);
  EXPECT_EQ(capture.frames.size(), 1U);
  ASSERT_EQ(capture.info.interfaces.size(), most + 4);
  EXPECT_EQ(capture.info.interfaces[most - 1].name.size(), 250U);
  EXPECT_EQ(capture.info.interfaces[most].name, "");
  EXPECT_EQ(capture.info.interfaces.back().name, "eth0");
  EXPECT_EQ(capture.info.name_bytes_left_out, 3U * 250);
}

TEST(Pcapng, InterfacesWithTheirOwnClockNameAndLinkType) {
  PcapngBytes file;
  file.Section();
  file.Interface(PcapngBytes::Join({file.Option(2, "eth0"), file.Option(9, Bytes{9}), file.Option(14, file.U64(100)),
                                    file.EndOfOptions()}),
                 1, 128);
  file.Interface(PcapngBytes::Join({file.Option(2, "tap"), file.Option(9, Bytes{0x80 | 10})}), 113);
  file.Enhanced(0, 7, kPcapngSourceData).Enhanced(1, 3 * 1024 + 512, kPcapngSourceData);
  const WholeCapture capture = ReadPcapng(file);
  ASSERT_EQ(capture.frames.size(), 2U);
  EXPECT_EQ(capture.frames[0].time, 100'000'000'007);
  EXPECT_EQ(capture.frames[1].time, 3'500'000'000);
  EXPECT_EQ(capture.frames[1].interface_index, 1);
  EXPECT_EQ(capture.frames[1].link_type, 113);
  ASSERT_EQ(capture.info.interfaces.size(), 2U);
  EXPECT_EQ(capture.info.interfaces[0].name, "eth0");
  EXPECT_EQ(capture.info.interfaces[0].snap_length, 128U);
  EXPECT_EQ(capture.info.interfaces[0].resolution_ns, 1);
  EXPECT_EQ(capture.info.interfaces[1].name, "tap");
  EXPECT_EQ(capture.info.interfaces[1].link_type, 113);
  EXPECT_EQ(capture.info.interfaces[1].resolution_ns, 976'563);
  EXPECT_FALSE(capture.info.interfaces[0].dropped.has_value());
}

TEST(Pcapng, BigEndianReadsTheSame) {
  PcapngBytes file(true);
  file.Section();
  file.Interface(PcapngBytes::Join({file.Option(9, Bytes{9}), file.Option(14, file.U64(100))}), 276, 64);
  file.Enhanced(0, (1ULL << 32U) + 5, kPcapngSourceData, file.Option(2, file.U32(1)));
  const WholeCapture capture = ReadPcapng(file);
  ASSERT_EQ(capture.frames.size(), 1U);
  EXPECT_EQ(capture.frames[0].time, 100'000'000'000 + (1LL << 32U) + 5);
  EXPECT_EQ(capture.frames[0].flag, PacketFlag::kInbound);
  EXPECT_EQ(capture.frames[0].link_type, 276);
  EXPECT_EQ(capture.frames[0].bytes, kPcapngSourceData);
  EXPECT_EQ(capture.info.interfaces[0].snap_length, 64U);
}

TEST(Pcapng, InterfaceNumbersGoOnOverSections) {
  PcapngBytes first;
  first.Section().Interface().Interface().Enhanced(1, 1, kPcapngSourceData);
  PcapngBytes second(true);  // each section has its own byte order
  second.Section().Interface({}, 113).Enhanced(0, 2, kPcapngSourceData);
  const WholeCapture capture = ReadPcapng(first.Raw(second.bytes()));
  ASSERT_EQ(capture.frames.size(), 2U) << capture.damage();
  EXPECT_EQ(capture.frames[0].interface_index, 1);
  EXPECT_EQ(capture.frames[1].interface_index, 2);
  EXPECT_EQ(capture.frames[1].number, 2U);
  EXPECT_EQ(capture.frames[1].link_type, 113);
  EXPECT_EQ(capture.info.interfaces.size(), 3U);
}

TEST(Pcapng, DirectionFlags) {
  PcapngBytes file = Plain();
  for (const std::uint32_t flags : {0U, 1U, 2U, 3U, 0xFFFFFFFDU}) {
    file.Enhanced(0, 1, kPcapngSourceData, PcapngBytes::Join({file.Option(2, file.U32(flags)), file.EndOfOptions()}));
  }
  file.Enhanced(0, 1, kPcapngSourceData, file.Option(2, file.U16(1)));  // wrong length: no direction
  file.Enhanced(0, 1, kPcapngSourceData, PcapngBytes::Join({file.EndOfOptions(), file.Option(2, file.U32(1))}));
  const WholeCapture capture = ReadPcapng(file);
  std::vector<PacketFlag> flags;
  for (const OwnedFrame& frame : capture.frames) flags.push_back(frame.flag);
  EXPECT_EQ(flags, (std::vector{PacketFlag::kNone, PacketFlag::kInbound, PacketFlag::kOutbound, PacketFlag::kNone,
                                PacketFlag::kInbound, PacketFlag::kNone, PacketFlag::kNone}));
}

TEST(Pcapng, SimplePacketsHaveNoStampAndEndAtTheSnapLength) {
  PcapngBytes file;
  file.Section().Interface({}, 1, 8).Interface({}, 113);
  file.Simple({1, 2, 3, 4, 5, 6, 7, 8}, 60).Simple({1, 2, 3, 4, 5}, 5);
  const WholeCapture capture = ReadPcapng(file);
  ASSERT_EQ(capture.frames.size(), 2U) << capture.damage();
  EXPECT_FALSE(capture.frames[0].has_time);
  EXPECT_EQ(capture.frames[0].time, 0);
  EXPECT_EQ(capture.frames[0].bytes, (Bytes{1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(capture.frames[0].original_length, 60U);
  EXPECT_EQ(capture.frames[0].interface_index, 0);
  EXPECT_EQ(capture.frames[1].bytes, (Bytes{1, 2, 3, 4, 5}));
  EXPECT_EQ(capture.frames[1].original_length, 5U);
}

TEST(Pcapng, SimplePacketsAfterStampedOnesLoseTheStamp) {
  const WholeCapture capture = ReadPcapng(Plain().Enhanced(0, 5, kPcapngSourceData, {}).Simple(kPcapngSourceData, 14));
  ASSERT_EQ(capture.frames.size(), 2U);
  EXPECT_FALSE(capture.frames[1].has_time);
}

TEST(Pcapng, ObsoletePacketsAndTheirDropCounts) {
  PcapngBytes file;
  file.Section().Interface().Interface();
  file.Obsolete(1, 3, 1'000'000, kPcapngSourceData, file.Option(2, file.U32(2)));
  file.Obsolete(1, 0xFFFF, 2'000'000, kPcapngSourceData);  // 0xFFFF: the writer does not know
  file.Obsolete(1, 4, 3'000'000, kPcapngSourceData);
  const WholeCapture capture = ReadPcapng(file);
  ASSERT_EQ(capture.frames.size(), 3U) << capture.damage();
  EXPECT_EQ(capture.frames[0].time, 1'000'000'000);
  EXPECT_EQ(capture.frames[0].interface_index, 1);
  EXPECT_EQ(capture.frames[0].flag, PacketFlag::kOutbound);
  EXPECT_EQ(capture.frames[0].bytes, kPcapngSourceData);
  EXPECT_FALSE(capture.info.interfaces[0].dropped.has_value());
  EXPECT_EQ(capture.info.interfaces[1].dropped, 7U);
}

TEST(Pcapng, ImpossibleDropCountsDoNotWrap) {
  constexpr std::uint64_t kAll = ~std::uint64_t{0};
  PcapngBytes file;
  file.Section().Interface().Interface();
  file.Statistics(0, PcapngBytes::Join({file.Option(5, file.U64(kAll)), file.Option(7, file.U64(2))}));
  file.Enhanced(1, 1, kPcapngSourceData, file.Option(4, file.U64(kAll)))
      .Enhanced(1, 1, kPcapngSourceData, file.Option(4, file.U64(9)));
  const WholeCapture capture = ReadPcapng(file);
  ASSERT_EQ(capture.info.interfaces.size(), 2U);
  EXPECT_EQ(capture.info.interfaces[0].dropped, CaptureInfo::kMostDropped);
  EXPECT_EQ(capture.info.interfaces[1].dropped, CaptureInfo::kMostDropped);
  EXPECT_EQ(capture.info.dropped(), 2 * CaptureInfo::kMostDropped);
}

TEST(Pcapng, DropsOfTheStatistics) {
  PcapngBytes file;
  file.Section().Interface().Interface().Interface();
  file.Statistics(0, PcapngBytes::Join({file.Option(4, file.U64(900)), file.Option(5, file.U64(10))}));
  file.Statistics(0, PcapngBytes::Join({file.Option(5, file.U64(12)), file.Option(7, file.U64(30))}));
  file.Statistics(1, PcapngBytes::Join({file.Option(4, file.U64(900))}));
  file.Enhanced(2, 1, kPcapngSourceData, file.Option(4, file.U64(5)))
      .Enhanced(2, 1, kPcapngSourceData, file.Option(4, file.U64(6)));
  file.Statistics(7, file.Option(5, file.U64(1)));  // of no interface at all
  const WholeCapture capture = ReadPcapng(file);
  ASSERT_EQ(capture.info.interfaces.size(), 3U);
  EXPECT_EQ(capture.info.interfaces[0].dropped, 42U);
  EXPECT_FALSE(capture.info.interfaces[1].dropped.has_value());
  EXPECT_EQ(capture.info.interfaces[2].dropped, 11U);
  EXPECT_EQ(capture.end, ReadStatus::kEnd);
}

TEST(Pcapng, CommentsOfFileAndPackets) {
  PcapngBytes file;
  file.Section(PcapngBytes::Join({file.Option(3, "Linux"), file.Option(1, "bench 4"), file.EndOfOptions()}))
      .Interface();
  file.Enhanced(0, 1, kPcapngSourceData);
  file.Enhanced(0, 1, kPcapngSourceData, PcapngBytes::Join({file.Option(1, "here"), file.Option(1, "and here")}));
  const WholeCapture capture = ReadPcapng(file);
  ASSERT_EQ(capture.info.comments.size(), 3U);
  EXPECT_EQ(capture.info.comments[0].frame, 0U);
  EXPECT_EQ(capture.info.comments[0].text, "bench 4");
  EXPECT_EQ(capture.info.comments[1].frame, 2U);
  EXPECT_EQ(capture.info.comments[1].text, "here");
  EXPECT_EQ(capture.info.comments[2].text, "and here");
}

TEST(Pcapng, CommentsAreBoundedInNumberAndLength) {
  PcapngBytes file = Plain();
  // Longer than what is kept, and the cut would go through a two-byte character.
  std::string text = "x";
  while (text.size() < 10'000) text += "\xC3\xA4";
  for (int i = 0; i < 1001; ++i) file.Enhanced(0, 1, kPcapngSourceData, file.Option(1, text));
  const WholeCapture capture = ReadPcapng(file);
  EXPECT_EQ(capture.frames.size(), 1001U);
  ASSERT_EQ(capture.info.comments.size(), 1000U);
  EXPECT_EQ(capture.info.comments[0].text, text.substr(0, 4095));
}

TEST(Pcapng, OtherBlocksArePassedOver) {
  PcapngBytes file = Plain();
  for (const std::uint32_t type : {4U, 7U, 8U, 10U, 0x80000001U, 0xFFFFFFFFU}) {
    file.Block(type, Bytes(40)).Enhanced(0, 1, kPcapngSourceData).Block(type, {});
  }
  const WholeCapture capture = ReadPcapng(file);
  EXPECT_EQ(capture.frames.size(), 6U);
  EXPECT_EQ(capture.frames.back().number, 6U);
  EXPECT_EQ(capture.end, ReadStatus::kEnd);
}

TEST(Pcapng, RecordsThatWiresharkNumbersTakeTheirNumber) {
  PcapngBytes file = Plain();
  const std::string journal = "__REALTIME_TIMESTAMP=1404101101501873\nMESSAGE=x\n\n";
  file.Enhanced(0, 1, kPcapngSourceData)
      .Block(0xBAD, PcapngBytes::Join({file.U32(32473), {1, 2, 3, 4}}))
      .Enhanced(0, 2, kPcapngSourceData)
      .Block(0x40000BAD, file.U32(32473))
      .Block(9, Bytes(journal.begin(), journal.end()))
      .Enhanced(0, 3, kPcapngSourceData);
  const WholeCapture capture = ReadPcapng(file);
  ASSERT_EQ(capture.frames.size(), 3U);
  EXPECT_EQ(capture.frames[0].number, 1U);
  EXPECT_EQ(capture.frames[1].number, 3U);
  EXPECT_EQ(capture.frames[2].number, 6U);
  EXPECT_EQ(capture.info.packets, 3U);

  if (!HaveTshark()) GTEST_SKIP() << "no tshark";
  const TempFolder folder;
  std::vector<std::uint64_t> packets;  // of all that tshark lists, those with our length
  for (const TsharkFrame& frame : TsharkFrames(folder.Write("x.pcapng", file.bytes()))) {
    if (frame.length == kPcapngSourceData.size()) packets.push_back(frame.number);
  }
  EXPECT_EQ(packets, (std::vector<std::uint64_t>{1, 3, 6}));
}

TEST(Pcapng, BadOptionsOfAPacketCostOnlyTheOptions) {
  PcapngBytes file = Plain();
  file.Enhanced(0, 1, kPcapngSourceData, PcapngBytes::Join({file.Option(1, "kept"), file.U16(1), file.U16(100)}));
  file.Enhanced(0, 2, kPcapngSourceData);
  const WholeCapture capture = ReadPcapng(file);
  EXPECT_EQ(capture.frames.size(), 2U);
  ASSERT_EQ(capture.info.comments.size(), 1U);
  EXPECT_EQ(capture.info.comments[0].text, "kept");
}

TEST(Pcapng, StampsThatNoTimeCanHoldAreNoStamps) {
  PcapngBytes file;
  file.Section().Interface(file.Option(9, Bytes{9}));
  const WholeCapture capture = ReadPcapng(file.Enhanced(0, ~0ULL, kPcapngSourceData));
  ASSERT_EQ(capture.frames.size(), 1U);
  EXPECT_FALSE(capture.frames[0].has_time);
  EXPECT_EQ(capture.frames[0].time, 0);
}

TEST(Pcapng, NothingButASectionHeaderIsAnEmptyCapture) {
  const WholeCapture capture = ReadPcapng(PcapngBytes().Section());
  EXPECT_EQ(capture.error, "");
  EXPECT_TRUE(capture.frames.empty());
  EXPECT_EQ(capture.end, ReadStatus::kEnd);
}

TEST(Pcapng, FramesLargerThanTheWindowAreWhole) {
  Bytes large(3'000'000);
  for (std::size_t i = 0; i < large.size(); ++i) large[i] = static_cast<std::uint8_t>(i * 7);
  const WholeCapture capture =
      ReadPcapng(Plain().Enhanced(0, 1, kPcapngSourceData).Enhanced(0, 2, large).Enhanced(0, 3, kPcapngSourceData));
  ASSERT_EQ(capture.frames.size(), 3U) << capture.damage();
  EXPECT_EQ(capture.frames[1].bytes, large);
  EXPECT_EQ(capture.frames[2].bytes, kPcapngSourceData);
}

/// A file whose packet 1 is good and that is damaged behind it.
struct Broken {
  std::string name;
  Bytes rest;
  std::string message;
};

std::vector<Broken> BrokenFiles() {
  const PcapngBytes f;
  const auto j = [](std::initializer_list<Bytes> parts) { return PcapngBytes::Join(parts); };
  const Bytes whole = PcapngBytes().Enhanced(0, 2, kPcapngSourceData).bytes();
  const auto patched = [&](std::size_t offset, const Bytes& bytes) {
    Bytes copy = whole;
    std::copy(bytes.begin(), bytes.end(), copy.begin() + static_cast<std::ptrdiff_t>(offset));
    return copy;
  };
  const auto first = [&](std::size_t count) {
    return Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(count));
  };
  const std::string lengths = "packet 2 has an impossible block length, ";
  return {
      {"LengthZero", patched(4, f.U32(0)), lengths + "0 bytes"},
      {"LengthBelowTheFixedFields", patched(4, f.U32(28)), lengths + "28 bytes"},
      {"LengthNotOfFours", patched(4, f.U32(49)), lengths + "49 bytes"},
      {"LengthHuge", patched(4, f.U32(0xFFFFFFF0)), lengths + "4,294,967,280 bytes"},
      {"LengthAboveTheLimit", patched(4, f.U32(16 * 1024 * 1024 + 4)), lengths + "16,777,220 bytes"},
      {"LengthAtTheLimit", patched(4, f.U32(16 * 1024 * 1024)), "file ends inside packet 2"},
      {"TwoLengths", patched(44, f.U32(52)), "packet 2 has two different block lengths"},
      {"EndsInHeader", first(5), "file ends inside a block header before packet 2"},
      {"EndsInPacket", first(30), "file ends inside packet 2"},
      {"EndsInTrailer", first(47), "file ends inside packet 2"},
      {"NoSuchInterface", patched(8, f.U32(1)), "packet 2 belongs to interface 1, which the file does not describe"},
      {"CapturedBeyondBlock", patched(20, f.U32(17)), "packet 2 has a captured length larger than its block, 17 bytes"},
      {"CapturedHuge", patched(20, f.U32(0xFFFFFFFF)),
       "packet 2 has a captured length larger than its block, 4,294,967,295 bytes"},
      {"NoInterfaceInThisSection", PcapngBytes().Section().Enhanced(0, 1, kPcapngSourceData).bytes(),
       "packet 2 belongs to interface 0, which the file does not describe"},
      {"SimpleWithoutInterface", PcapngBytes().Section().Simple(kPcapngSourceData, 14).bytes(),
       "packet 2 belongs to interface 0, which the file does not describe"},
      {"SimpleBeyondBlock", PcapngBytes().Simple(kPcapngSourceData, 17).bytes(),
       "packet 2 has a captured length larger than its block, 17 bytes"},
      {"ObsoleteNoSuchInterface", PcapngBytes().Obsolete(9, 1, 0, kPcapngSourceData).bytes(),
       "packet 2 belongs to interface 9, which the file does not describe"},
      {"Version2", PcapngBytes().Section({}, 2).bytes(), "pcapng version 2 is not known"},
      {"NoByteOrder", j({f.U32(0x0A0D0D0A), f.U32(28), f.U32(0x12345678), Bytes(16)}),
       "a section header has no byte-order magic"},
      {"SectionHeaderCut", j({f.U32(0x0A0D0D0A), f.U32(28), f.U32(0x1A2B3C4D), Bytes(4)}),
       "file ends inside a section header before packet 2"},
      {"InterfaceCut", j({f.U32(1), f.U32(20), Bytes(8)}), "file ends inside an interface description before packet 2"},
      {"InterfaceTooShort", j({f.U32(1), f.U32(16), Bytes(4), f.U32(16)}),
       "an interface description before packet 2 has an impossible block length, 16 bytes"},
      {"OtherBlockCut", j({f.U32(4), f.U32(400), Bytes(100)}),
       "file ends inside a block of type 0x00000004 before packet 2"},
      {"OtherBlockCutInTrailer", j({f.U32(4), f.U32(20), Bytes(8), Bytes(3)}),
       "file ends inside a block of type 0x00000004 before packet 2"},
      {"OtherBlockTwoLengths", j({f.U32(4), f.U32(20), Bytes(8), f.U32(24)}),
       "a block of type 0x00000004 before packet 2 has two different block lengths"},
      {"OtherBlockLengthZero", j({f.U32(4), f.U32(0), f.U32(0)}),
       "a block of type 0x00000004 before packet 2 has an impossible block length, 0 bytes"},
      {"InterfaceOptionsCut", PcapngBytes().Interface(j({f.U16(9), f.U16(9), Bytes{9}})).bytes(),
       "the options of interface 1 are not valid"},
      {"ResolutionOfTwoBytes", PcapngBytes().Interface(f.Option(9, f.U16(9))).bytes(),
       "the options of interface 1 are not valid"},
      {"OffsetOfFourBytes", PcapngBytes().Interface(f.Option(14, f.U32(9))).bytes(),
       "the options of interface 1 are not valid"},
  };
}

TEST(Pcapng, DamageEndsReadingAfterTheGoodPackets) {
  for (const Broken& broken : BrokenFiles()) {
    PcapngBytes file = Plain().Enhanced(0, 1, kPcapngSourceData);
    const std::size_t good = file.bytes().size();
    const WholeCapture capture = ReadPcapng(file.Raw(broken.rest));
    EXPECT_EQ(capture.damage(), broken.message) << broken.name;
    EXPECT_EQ(capture.frames.size(), 1U) << broken.name;
    ASSERT_TRUE(capture.info.damage.has_value()) << broken.name;
    EXPECT_EQ(capture.info.damage->after_frame, 1U) << broken.name;
    EXPECT_GE(capture.info.damage->offset, good) << broken.name;
    EXPECT_LE(capture.info.damage->offset, good + 28) << broken.name;
  }
}

TEST(Pcapng, DamageInTheFirstSectionHeaderDoesNotOpen) {
  const PcapngBytes f;
  const auto error = [](const Bytes& bytes) { return ReadAll(OpenCaptureFromMemory(bytes, "x")).error; };
  EXPECT_EQ(error(PcapngBytes().Section({}, 2).bytes()), "x is not a readable capture: pcapng version 2 is not known");
  EXPECT_EQ(error(f.U32(0x0A0D0D0A)), "x is not a readable capture: file ends inside a block header before packet 1");
  EXPECT_EQ(error(PcapngBytes::Join({f.U32(0x0A0D0D0A), f.U32(28), Bytes(20)})),
            "x is not a readable capture: a section header has no byte-order magic");
}

TEST(Pcapng, MoreInterfacesThanNumbersIsDamage) {
  PcapngBytes file;
  file.Section();
  for (int i = 0; i < 65'536; ++i) file.Interface();
  const WholeCapture capture = ReadPcapng(file);
  EXPECT_EQ(capture.info.interfaces.size(), 65'535U);
  EXPECT_EQ(capture.damage(), "there are more than 65,535 interfaces");
}

TEST(Pcapng, CutAtAnyByteNeverGivesAFrameMore) {
  PcapngBytes file;
  file.Section(file.Option(1, "c")).Interface(file.Option(9, Bytes{9}));
  file.Enhanced(0, 1, kPcapngSourceData, file.Option(2, file.U32(1)))
      .Simple(kPcapngSourceData, 14)
      .Obsolete(0, 0, 1, kPcapngSourceData);
  const Bytes& all = file.bytes();
  const std::vector<OwnedFrame> frames = ReadPcapng(file).frames;
  ASSERT_EQ(frames.size(), 3U);
  std::size_t last = 0;
  for (std::size_t length = 0; length < all.size(); ++length) {
    const Bytes cut(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(length));
    const WholeCapture capture = ReadAll(OpenCaptureFromMemory(cut, "x"));
    ASSERT_LT(capture.frames.size(), 3U) << length;
    ASSERT_GE(capture.frames.size(), last) << length;
    last = capture.frames.size();
    for (std::size_t i = 0; i < last; ++i) ASSERT_EQ(capture.frames[i].bytes, frames[i].bytes) << length;
  }
  EXPECT_EQ(last, 2U);
}

}  // namespace
}  // namespace ecaudit::capture
