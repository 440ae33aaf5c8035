#include "decoder/capture/joined_source.h"

#include <algorithm>
#include <cstdlib>

#include <gtest/gtest.h>

#include "decoder/capture/capture_reader.h"
#include "tests/unit/capture/pcapng_bytes.h"

namespace ecaudit::capture {
namespace {

constexpr std::uint64_t kNone = ~0ULL;

/// A pcapng with one packet for each stamp in microseconds (kNone: none); `tag` is the first byte of each, its ordinal
/// the second.
PcapngBytes File(std::uint8_t tag, const std::vector<std::uint64_t>& stamps) {
  PcapngBytes file;
  file.Section().Interface();
  std::uint8_t ordinal = 0;
  for (const std::uint64_t stamp : stamps) {
    const Bytes data{tag, ++ordinal, 0, 0};
    if (stamp == kNone) {
      file.Simple(data, 4);
    } else {
      file.Enhanced(0, stamp, data);
    }
  }
  return file;
}

/// "a1 a2 b1": which packets came, in order.
std::string Order(const WholeCapture& capture) {
  std::string order;
  for (const OwnedFrame& frame : capture.frames) {
    if (!order.empty()) order += ' ';
    order += static_cast<char>(frame.bytes[0]) + std::to_string(frame.bytes[1]);
  }
  return order;
}

class Joined : public testing::Test {
 protected:
  std::string Write(const std::string& name, const PcapngBytes& file) const {
    return folder_.Write(name, file.bytes());
  }
  static WholeCapture Join(const std::vector<std::string>& paths) { return ReadAll(OpenJoined(paths)); }

  TempFolder folder_;
};

TEST_F(Joined, FilesInTimeOrderWhateverTheOrderOfTheirNames) {
  const std::string a = Write("a", File('a', {10, 20, 30}));
  const std::string b = Write("b", File('b', {40, 50}));
  const std::string c = Write("c", File('c', {60}));
  std::vector<std::string> paths{a, b, c};
  do {
    const WholeCapture capture = Join(paths);
    EXPECT_EQ(Order(capture), "a1 a2 a3 b1 b2 c1");
    EXPECT_EQ(capture.end, ReadStatus::kEnd);
    for (std::size_t i = 0; i < capture.frames.size(); ++i) EXPECT_EQ(capture.frames[i].number, i + 1);
    EXPECT_EQ(capture.info.path, paths[0] + ", " + paths[1] + ", " + paths[2]);
  } while (std::next_permutation(paths.begin(), paths.end()));
}

TEST_F(Joined, OverlappingFilesAreMerged) {
  const WholeCapture capture =
      Join({Write("a", File('a', {10, 30, 50})), Write("b", File('b', {20, 21, 60})), Write("c", File('c', {40}))});
  EXPECT_EQ(Order(capture), "a1 b1 b2 a2 c1 a3 b3");
  EXPECT_EQ(capture.frames[1].time, 20'000);
}

TEST_F(Joined, EqualStampsFollowTheFileThatBeganFirst) {
  const std::string a = Write("a", File('a', {10, 20}));
  const std::string b = Write("b", File('b', {20, 30}));
  EXPECT_EQ(Order(Join({b, a})), "a1 a2 b1 b2");
  const std::string x = Write("x", File('x', {10, 20}));
  EXPECT_EQ(Order(Join({x, a})), "x1 a1 x2 a2");
  EXPECT_EQ(Order(Join({a, x})), "a1 x1 a2 x2");
}

TEST_F(Joined, StampsThatGoBackKeepTheirPlaceInTheFile) {
  EXPECT_EQ(Order(Join({Write("a", File('a', {10, 30, 20, 40})), Write("b", File('b', {15, 25, 35}))})),
            "a1 b1 b2 a2 a3 b3 a4");
}

TEST_F(Joined, PacketsWithoutStampFollowTheOneBeforeThem) {
  EXPECT_EQ(Order(Join({Write("a", File('a', {10, kNone, 30})), Write("b", File('b', {20, kNone, kNone, 40}))})),
            "a1 a2 b1 b2 b3 a3 b4");
  EXPECT_EQ(Order(Join({Write("c", File('c', {10})), Write("d", File('d', {kNone, kNone, 20, kNone}))})),
            "d1 d2 c1 d3 d4");
  EXPECT_EQ(Order(Join({Write("e", File('e', {kNone, kNone})), Write("f", File('f', {kNone}))})), "e1 e2 f1");
}

TEST_F(Joined, OneInterfaceOfARingBufferStaysOne) {
  const auto file = [](std::uint64_t start, std::uint64_t dropped) {
    PcapngBytes bytes;
    const auto named = [&](std::string_view name) { return bytes.Option(2, name); };
    bytes.Section().Interface(named("eth0")).Interface(named("eth1"));
    bytes.Enhanced(0, start, {1, 2, 3, 4}).Enhanced(1, start + 1, {1, 2, 3, 4});
    bytes.Statistics(1, bytes.Option(5, bytes.U64(dropped)));
    return bytes;
  };
  const WholeCapture capture = Join({Write("a", file(10, 7)), Write("b", file(20, 5))});
  ASSERT_EQ(capture.info.interfaces.size(), 2U);
  EXPECT_EQ(capture.info.interfaces[0].name, "eth0");
  EXPECT_FALSE(capture.info.interfaces[0].dropped.has_value());
  EXPECT_EQ(capture.info.interfaces[1].dropped, 7U);
  ASSERT_EQ(capture.frames.size(), 4U);
  EXPECT_EQ(capture.frames[2].interface_index, 0);
  EXPECT_EQ(capture.frames[3].interface_index, 1);
}

TEST_F(Joined, DifferentInterfacesStayDifferentAndEqualOnesOfOneFileToo) {
  PcapngBytes a;
  a.Section().Interface(a.Option(2, "eth0")).Enhanced(0, 10, {1, 2, 3, 4});
  PcapngBytes b;
  b.Section().Interface(b.Option(2, "eth1"), 113).Interface(b.Option(2, "eth0")).Interface(b.Option(2, "eth0"));
  b.Enhanced(0, 20, {1, 2, 3, 4}).Enhanced(1, 21, {1, 2, 3, 4}).Enhanced(2, 22, {1, 2, 3, 4});
  const WholeCapture capture = Join({Write("a", a), Write("b", b)});
  ASSERT_EQ(capture.info.interfaces.size(), 3U);
  std::vector<int> indices;
  for (const OwnedFrame& frame : capture.frames) indices.push_back(frame.interface_index);
  EXPECT_EQ(indices, (std::vector<int>{0, 1, 0, 2}));
  EXPECT_EQ(capture.frames[1].link_type, 113);
}

TEST_F(Joined, ADamagedFileEndsAloneAndIsNamed) {
  PcapngBytes damaged = File('b', {20, 30});
  damaged.Raw({6, 0, 0, 0, 0});
  const std::string b = Write("b", damaged);
  const WholeCapture capture = Join({Write("a", File('a', {10, 25, 50})), b, Write("c", File('c', {40, 60}))});
  EXPECT_EQ(Order(capture), "a1 b1 a2 b2 c1 a3 c2");
  EXPECT_EQ(capture.end, ReadStatus::kDamaged);
  EXPECT_EQ(capture.damage(), b + ": file ends inside a block header before packet 3");
  EXPECT_EQ(capture.info.damage->after_frame, 4U);
  EXPECT_EQ(capture.info.damage->offset, damaged.bytes().size() - 5);
}

TEST_F(Joined, SeveralDamagedFilesAreAllNamed) {
  const auto damaged = [&](std::uint8_t tag, std::uint64_t stamp) {
    return Write(std::string(1, static_cast<char>(tag)), File(tag, {stamp}).Raw(Bytes(9)));
  };
  const std::string a = damaged('a', 10);
  const std::string b = damaged('b', 20);
  const WholeCapture capture = Join({b, a});
  EXPECT_EQ(capture.damage(), a + ": file ends inside a block header before packet 2; " + b +
                                  ": file ends inside a block header before packet 2");
  EXPECT_EQ(capture.info.damage->after_frame, 1U);

  std::vector<std::string> many;
  for (char name = 'A'; name <= 'L'; ++name) many.push_back(Write(std::string(1, name), File('m', {1}).Raw(Bytes(9))));
  const std::string message = Join(many).damage();
  EXPECT_EQ(std::count(message.begin(), message.end(), ';'), 10);
  EXPECT_TRUE(message.ends_with("; and more files")) << message;
}

TEST_F(Joined, CommentsKeepTheirPacketAndThoseOfFilesComeOnce) {
  const auto file = [](std::uint64_t start, std::string_view comment) {
    PcapngBytes bytes;
    bytes.Section(bytes.Option(1, "ring buffer of bench 4")).Interface();
    bytes.Enhanced(0, start, {1, 2, 3, 4}).Enhanced(0, start + 1, {1, 2, 3, 4}, bytes.Option(1, comment));
    return bytes;
  };
  const WholeCapture capture = Join({Write("b", file(20, "second")), Write("a", file(10, "first"))});
  ASSERT_EQ(capture.info.comments.size(), 3U);
  EXPECT_EQ(capture.info.comments[0].frame, 0U);
  EXPECT_EQ(capture.info.comments[1].frame, 2U);
  EXPECT_EQ(capture.info.comments[1].text, "first");
  EXPECT_EQ(capture.info.comments[2].frame, 4U);
  EXPECT_EQ(capture.info.comments[2].text, "second");
}

TEST_F(Joined, FilesOfSeveralFormatsAndEmptyOnes) {
  const std::string a = folder_.Write("a", Gzip(File('a', {10}).bytes()));
  const std::string b = Write("b", File('b', {5, 20}));
  const std::string c = Write("c", File('c', {}));
  const WholeCapture capture = Join({a, b, c});
  EXPECT_EQ(Order(capture), "b1 a1 b2");
  EXPECT_EQ(capture.info.format, "pcapng, pcapng+gzip");
}

TEST_F(Joined, NothingOpensWhenOneFileDoesNot) {
  const std::string a = Write("a", File('a', {10}));
  EXPECT_EQ(Join({a, folder_.Path("missing")}).error, "no such file: " + folder_.Path("missing"));
  EXPECT_EQ(Join({}).error, "no captures to join");
}

TEST_F(Joined, CountsTheBytesOfAllFiles) {
  const std::vector<std::string> paths{Write("a", File('a', {10, 11})), Write("b", File('b', {20}))};
  const std::size_t total = File('a', {10, 11}).bytes().size() + File('b', {20}).bytes().size();
  auto source = OpenJoined(paths);
  ASSERT_TRUE(source);
  EXPECT_EQ((*source)->bytes_total(), total);
  CapturedFrame frame;
  while ((*source)->Next(frame) == ReadStatus::kFrame) EXPECT_LE((*source)->bytes_read(), total);
  EXPECT_EQ((*source)->bytes_read(), total);
}

TEST_F(Joined, MoreFilesThanAProcessMayHoldOpen) {
  std::vector<std::string> paths;
  for (std::uint64_t i = 0; i < 1500; ++i) paths.push_back(Write(std::to_string(i), File('a', {i})));
  std::reverse(paths.begin(), paths.end());
  const WholeCapture capture = Join(paths);
  EXPECT_EQ(capture.error, "");
  ASSERT_EQ(capture.frames.size(), 1500U);
  EXPECT_EQ(capture.frames[1499].time, 1'499'000);
  EXPECT_EQ(capture.info.interfaces.size(), 1U);
}

TEST_F(Joined, NamesOfInterfacesHaveRoomTogether) {
  const std::size_t half = CaptureInfo::kNameBytes / 200 / 2;
  std::vector<std::string> paths;
  for (char tag : {'a', 'b', 'c'}) {
    PcapngBytes file;
    file.Section();
    for (std::size_t i = 0; i < half; ++i) {
      std::string name = tag + std::to_string(i);
      name.resize(200, '.');
      file.Interface(file.Option(2, name));
    }
    file.Enhanced(static_cast<std::uint32_t>(half - 1), static_cast<std::uint64_t>(tag), Bytes{1, 2, 3, 4});
    paths.push_back(Write(std::string(1, tag), file));
  }
  const WholeCapture capture = Join(paths);
  EXPECT_EQ(capture.error, "");
  ASSERT_EQ(capture.info.interfaces.size(), 3 * half);
  EXPECT_EQ(capture.info.interfaces[capture.frames[1].interface_index].name.front(), 'b');
  EXPECT_EQ(capture.info.interfaces[capture.frames[2].interface_index].name, "");
  EXPECT_EQ(capture.info.name_bytes_left_out, (3 * half - CaptureInfo::kNameBytes / 200) * 200);
}

TEST_F(Joined, SplitCaptureIsTheWholeOneAgain) {
  const std::string path = SharedCapture("lab/startup-ok-1slave.pcapng");
  if (path.empty()) GTEST_SKIP() << "no captures beside the project";
  if (std::system("editcap --version >/dev/null 2>&1") != 0) GTEST_SKIP() << "no editcap";
  const std::string command = "editcap -c 3000 '" + path + "' '" + folder_.Path("part.pcapng") + "' >/dev/null 2>&1";
  ASSERT_EQ(std::system(command.c_str()), 0);
  std::vector<std::string> parts;
  for (const auto& entry : std::filesystem::directory_iterator(folder_.Path("")))
    parts.push_back(entry.path().string());
  ASSERT_EQ(parts.size(), 4U);
  const WholeCapture joined = Join(parts);
  const WholeCapture whole = ReadFile(path);
  ASSERT_EQ(joined.frames.size(), whole.frames.size());
  EXPECT_EQ(joined.info.interfaces.size(), 1U);
  for (std::size_t i = 0; i < whole.frames.size(); ++i) {
    ASSERT_EQ(joined.frames[i].number, whole.frames[i].number);
    ASSERT_EQ(joined.frames[i].time, whole.frames[i].time);
    ASSERT_EQ(joined.frames[i].bytes, whole.frames[i].bytes);
  }
}

TEST_F(Joined, NumbersAreThoseOfMergecap) {
  const std::string outbound = SharedCapture("lab/startup-ok-1slave-outbound-only.pcapng");
  const std::string returned = SharedCapture("lab/startup-ok-1slave-return-only.pcapng");
  if (outbound.empty()) GTEST_SKIP() << "no captures beside the project";
  if (std::system("mergecap --version >/dev/null 2>&1") != 0) GTEST_SKIP() << "no mergecap";
  const std::string merged = folder_.Path("merged.pcapng");
  const std::string command = "mergecap -w '" + merged + "' '" + outbound + "' '" + returned + "' 2>/dev/null";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const WholeCapture expected = ReadFile(merged);
  const WholeCapture joined = Join({outbound, returned});
  ASSERT_EQ(joined.frames.size(), expected.frames.size());
  for (std::size_t i = 0; i < expected.frames.size(); ++i) {
    ASSERT_EQ(joined.frames[i].number, expected.frames[i].number);
    ASSERT_EQ(joined.frames[i].time, expected.frames[i].time);
    ASSERT_EQ(joined.frames[i].bytes, expected.frames[i].bytes);
  }
}

}  // namespace
}  // namespace ecaudit::capture
