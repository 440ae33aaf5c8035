#include "tests/support/trace_builder.h"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "decoder/capture/capture_reader.h"
#include "tests/support/folders.h"
#include "tests/support/trace_file.h"

namespace ecaudit::test {
namespace {

namespace fs = std::filesystem;

using ::testing::ElementsAreArray;
using ::testing::HasSubstr;
using ::testing::SizeIs;

// Offsets in an untagged Ethernet frame whose first datagram begins at 16.
constexpr std::size_t kSource = 6;
constexpr std::size_t kFirst = 16;

std::uint16_t Word(const Packet& packet, std::size_t offset) {
  return samples::LoadLe<std::uint16_t>(packet.bytes, offset);
}
std::uint16_t Adp(const Packet& packet) {
  return Word(packet, kFirst + 2);
}
std::uint16_t Wkc(const Packet& packet, std::size_t data) {
  return Word(packet, kFirst + 10 + data);
}

Trace Parsed(std::string_view text) {
  Result<Trace> trace = Trace::Parse(text);
  EXPECT_TRUE(trace.has_value()) << (trace ? "" : trace.error().message);
  return trace ? *trace : Trace();
}
std::string ErrorOf(std::string_view text) {
  Result<Trace> trace = Trace::Parse(text);
  return trace ? "" : trace.error().message;
}

TEST(TraceBuilder, TheExampleOfTheStyleGuide) {
  const Trace trace = Parsed(R"(
@slaves 1 profile=kollmorgen-akd
+0us    FPRD 0x1001:0x0130  02 00        wkc=1   # AL status: PRE-OP, now observed
+500us  FPWR 0x1001:0x0120  08 00        wkc=1   # OP requested
)");
  EXPECT_EQ(trace.attributes().at("profile"), "kollmorgen-akd");
  const std::vector<Packet> packets = trace.Packets();
  ASSERT_THAT(packets, SizeIs(4));
  EXPECT_THAT(packets[0].bytes, ElementsAreArray({0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x01, 0x01, 0x01, 0x01,
                                                  0x01, 0x01, 0x88, 0xA4, 0x0E, 0x10, 0x04, 0x00, 0x01, 0x10,
                                                  0x30, 0x01, 0x02, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00}));
  EXPECT_THAT(packets[1].bytes, SizeIs(60));
  EXPECT_EQ(packets[1].bytes[kSource], 0x03);
  EXPECT_EQ(Word(packets[1], kFirst + 10), 0x0002);
  EXPECT_EQ(Wkc(packets[1], 2), 1);
  EXPECT_EQ(packets[2].bytes[kFirst], 5);
  EXPECT_EQ(packets[2].bytes[kFirst + 1], 1) << "indices count up";
  EXPECT_EQ(Word(packets[2], kFirst + 10), 0x0008) << "the outbound copy of a write carries the data";
  EXPECT_EQ(packets[0].time, kTraceStart);
  EXPECT_EQ(packets[1].time, kTraceStart + 30'000);
  EXPECT_EQ(packets[2].time, kTraceStart + 500'000);
}

TEST(TraceBuilder, BroadcastsCountTheSlaves) {
  const std::vector<Packet> packets = Parsed("@slaves 3\n+0us BRD 0x0130 02 00\n+1ms BRW 0x0130 00 00\n").Packets();
  ASSERT_THAT(packets, SizeIs(4));
  EXPECT_EQ(Adp(packets[0]), 0);
  EXPECT_EQ(Adp(packets[1]), 3);
  EXPECT_EQ(Wkc(packets[1], 2), 3);
  EXPECT_EQ(Wkc(packets[3], 2), 9) << "read +1 and write +2 for each slave";
}

TEST(TraceBuilder, PositionsBecomeAutoIncrementAddresses) {
  const std::vector<Packet> packets =
      Parsed("@slaves 3\n+0us APWR 2:0x0010 03 10\n+1ms ARMW 0:0x0910 00 00 00 00\n").Packets();
  EXPECT_EQ(Adp(packets[0]), 0xFFFE);
  EXPECT_EQ(Adp(packets[1]), 0x0001);
  EXPECT_EQ(Wkc(packets[1], 2), 1);
  EXPECT_EQ(Adp(packets[3]), 3);
  EXPECT_EQ(Wkc(packets[3], 4), 3);
}

TEST(TraceBuilder, SeveralDatagramsAndDifferentReturnedData) {
  const Trace trace = Parsed(R"(
+0us LRW 0x12345678 01 02 -> 03 04 wkc=3 & FRMW 0x1001:0x0910 11 22 33 44 wkc=1
   & FPRD 0x1001:0x0130 len=2 wkc=0 idx=0x55
)");
  const std::vector<Packet> packets = trace.Packets();
  ASSERT_THAT(packets, SizeIs(2));
  EXPECT_EQ(Word(packets[0], 14), 0x1000 + 14 + 16 + 14);
  EXPECT_EQ(samples::LoadLe<std::uint32_t>(packets[0].bytes, kFirst + 2), 0x12345678U);
  EXPECT_EQ(Word(packets[0], kFirst + 6), 0x8002);
  EXPECT_EQ(Word(packets[0], kFirst + 10), 0x0201);
  EXPECT_EQ(Word(packets[1], kFirst + 10), 0x0403);
  EXPECT_EQ(samples::LoadLe<std::uint32_t>(packets[0].bytes, kFirst + 14 + 10), 0U);
  EXPECT_EQ(samples::LoadLe<std::uint32_t>(packets[1].bytes, kFirst + 14 + 10), 0x44332211U);
  EXPECT_EQ(packets[0].bytes[kFirst + 30 + 1], 0x55);
  EXPECT_EQ(Word(packets[1], kFirst + 30 + 12), 0) << "working counter of the refused read";
}

TEST(TraceBuilder, LostFramesMarksAndLateReturns) {
  const Trace trace = Parsed(R"(
+0us FPRD 0x1001:0x0130 02 00 @lost mark=gone
+1ms FPRD 0x1001:0x0130 02 00 mark=fine
+1ms RETURN gone
+1ms FPRD 0x1001:0x0130 02 00 @twice mark=double
+1ms OTHER
)");
  EXPECT_THAT(trace.Packets(), SizeIs(1 + 2 + 1 + 3 + 1));
  EXPECT_EQ(trace.Sent("gone"), 1U);
  EXPECT_EQ(trace.Returned("gone"), 4U);
  EXPECT_EQ(trace.Sent("fine"), 2U);
  EXPECT_EQ(trace.Returned("fine"), 3U);
  EXPECT_EQ(trace.Returned("double"), 6U);
  EXPECT_EQ(trace.Sent("never"), 0U);
  const std::vector<Packet> packets = trace.Packets();
  EXPECT_EQ(packets[3].bytes[kFirst + 1], packets[0].bytes[kFirst + 1]) << "a late return keeps its index";
}

TEST(TraceBuilder, DirectivesForDirectionStampsAndAnswers) {
  const Trace trace = Parsed(R"(
@out-only
+0us FPRD 0x1001:0x0130 02 00
@returned-only
+0us FPRD 0x1001:0x0130 02 00
@both
@no-time
@ack wkc=0
@mac 10:10:10:10:10:10
+0us FPRD 0x1001:0x0130 02 00
)");
  const std::vector<Packet> packets = trace.Packets();
  ASSERT_THAT(packets, SizeIs(4));
  const auto count_bit = [&](std::uint8_t first) {
    return std::count_if(packets.begin(), packets.end(), [&](const Packet& p) { return p.bytes[kSource] == first; });
  };
  EXPECT_EQ(count_bit(0x01), 1);
  EXPECT_EQ(count_bit(0x03), 1);
  EXPECT_EQ(count_bit(0x10), 1);
  EXPECT_EQ(count_bit(0x12), 1);
  EXPECT_EQ(std::count_if(packets.begin(), packets.end(), [](const Packet& p) { return !p.has_time; }), 2);
  EXPECT_EQ(Wkc(packets.back(), 2), 0);
}

TEST(TraceBuilder, CutPacketsKeepTheirOriginalLength) {
  const std::vector<Packet> packets = Parsed("+0us FPRD 0x1001:0x1800 len=64 @cut=40").Packets();
  ASSERT_THAT(packets, SizeIs(2));
  EXPECT_THAT(packets[0].bytes, SizeIs(40));
  EXPECT_EQ(packets[0].original_length, 14U + 2 + 12 + 64);
}

TEST(TraceBuilder, ErrorsNameTheLine) {
  EXPECT_EQ(ErrorOf("\n+0us FPRD 0x1001:0x0130 2\n"), "line 2: \"2\" is no byte of two hexadecimal digits");
  EXPECT_EQ(ErrorOf("+0us FXRD 0x1001:0x0130"), "line 1: \"FXRD\" is no command");
  EXPECT_EQ(ErrorOf("+5 BRD 0x0130"), "line 1: \"5\" is no time such as 500us");
  EXPECT_EQ(ErrorOf("# text\n\n@speed 3"), "line 3: @speed takes 0 words");
  EXPECT_EQ(ErrorOf("@speed"), "line 1: \"@speed\" is no directive");
  EXPECT_EQ(ErrorOf("+0us FPRD 0x11001:0x0130"), "line 1: \"0x11001\" is no number up to 65535");
  EXPECT_EQ(ErrorOf("+0us FPRD 0x1001:0x0130 color=3"), "line 1: \"color=3\" is not known");
  EXPECT_EQ(ErrorOf("+0us BRD 0x0130 00 00 &\n+1us BRD 0x0130"), "line 1: \"+1us\" is no command");
  EXPECT_EQ(ErrorOf("+0us RETURN x"), "line 1: no frame above is marked \"x\"");
}

/// Traces in a folder of their own, gone at the end.
class TraceInclude : public ::testing::Test {
 protected:
  TraceInclude() { fs::create_directories(folder_ / "sub"); }
  ~TraceInclude() override { fs::remove_all(folder_); }
  TraceInclude(const TraceInclude&) = delete;
  TraceInclude& operator=(const TraceInclude&) = delete;

  std::string Write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return (folder_ / name).string();
  }
  static std::vector<Packet> PacketsOf(const std::string& path) {
    const Result<Trace> trace = Trace::Load(path);
    EXPECT_TRUE(trace.has_value()) << (trace ? "" : trace.error().message);
    return trace ? trace->Packets() : std::vector<Packet>();
  }
  static std::string ErrorOfFile(const std::string& path) {
    const Result<Trace> trace = Trace::Load(path);
    return trace ? "" : trace.error().message;
  }

  fs::path folder_ = fs::temp_directory_path() / ("ecaudit_trace_include_" + std::to_string(getpid()));
};

TEST_F(TraceInclude, StandsForTheLinesOfTheFile) {
  Write("sub/start.trace", "@slaves 2\n+0us BRD 0x0130 01 00\n@include poll.trace\n");
  Write("sub/poll.trace", "# relative to the file that includes it\n+1ms FPRD 0x1001:0x0130 02 00 mark=poll\n");
  const std::string with =
      Write("with.trace", "+5ms BRD 0x0000 11\n@include sub/start.trace  # both\n+1ms BRD 0x0130 02 00");
  const std::string without = Write("without.trace",
                                    "+5ms BRD 0x0000 11\n@slaves 2\n+0us BRD 0x0130 01 00\n"
                                    "+1ms FPRD 0x1001:0x0130 02 00 mark=poll\n+1ms BRD 0x0130 02 00\n");
  const std::vector<Packet> expected = PacketsOf(without);
  const std::vector<Packet> packets = PacketsOf(with);
  ASSERT_THAT(expected, SizeIs(8));
  ASSERT_THAT(packets, SizeIs(8));
  for (std::size_t i = 0; i < packets.size(); ++i) {
    EXPECT_EQ(packets[i].bytes, expected[i].bytes) << i;
    EXPECT_EQ(packets[i].time, expected[i].time) << i;
  }
  EXPECT_EQ(Trace::Load(with)->Sent("poll"), 5U);
}

TEST_F(TraceInclude, MayComeTwice) {
  Write("poll.trace", "+1ms BRD 0x0130 01 00\n");
  EXPECT_THAT(PacketsOf(Write("twice.trace", "@include poll.trace\n@include poll.trace\n")), SizeIs(4));
}

TEST_F(TraceInclude, LooksInTheCommonFolder) {
  const std::string text = "@include process-data-2-bytes.trace\n";
  EXPECT_THAT(PacketsOf(Write("common.trace", text)), SizeIs(8));
  EXPECT_THAT(Parsed(text).Packets(), SizeIs(8)) << "a text is in no folder, and finds common files all the same";
}

TEST_F(TraceInclude, FindsACycle) {
  Write("b.trace", "+0us BRD 0x0130 01 00\n\n@include sub/../a.trace\n");
  const std::string a = Write("a.trace", "@include b.trace\n");
  const std::string b = (folder_ / "b.trace").string();
  EXPECT_EQ(ErrorOfFile(a), a + ": line 1: " + b + ": line 3: the file includes itself: a.trace -> b.trace -> a.trace");
  const std::string own = Write("own.trace", "@include own.trace\n");
  EXPECT_EQ(ErrorOfFile(own), own + ": line 1: the file includes itself: own.trace -> own.trace");
}

TEST_F(TraceInclude, ErrorsNameFileAndLine) {
  const std::string bad = Write("bad.trace", "\n+0us BRD 0x0130 01 00\n+0us FPRD 0x1001:0x0130 2\n");
  const std::string path = Write("outer.trace", "# text\n@include bad.trace\n");
  EXPECT_EQ(ErrorOfFile(path), path + ": line 2: " + bad + ": line 3: \"2\" is no byte of two hexadecimal digits");
  const std::string absent = Write("absent.trace", "@include none.trace\n");
  EXPECT_EQ(ErrorOfFile(absent),
            absent + ": line 1: no file \"none.trace\" to include neither beside this file nor in tests/rules/common");
  EXPECT_EQ(ErrorOf("@include none.trace"), "line 1: no file \"none.trace\" to include in tests/rules/common");
  EXPECT_EQ(ErrorOf("@include"), "line 1: @include takes 1 word");
  EXPECT_THAT(ErrorOfFile(Write("folder.trace", "@include sub\n")), HasSubstr("no such file: "));
  // A statement ends with its file, on both sides.
  Write("open.trace", "+0us BRD 0x0130 00 00 &\n");
  EXPECT_THAT(ErrorOfFile(Write("open-end.trace", "@include open.trace\nBRD 0x0130 00 00\n")),
              HasSubstr("open.trace: line 1: a datagram is missing beside \"&\""));
  Write("poll.trace", "+1ms BRD 0x0130 01 00\n");
  EXPECT_THAT(ErrorOfFile(Write("goes-on.trace", "@include poll.trace\n& BRD 0x0130 00 00\n")),
              HasSubstr("goes-on.trace: line 1: @include takes 1 word"));
}

TEST_F(TraceInclude, EveryCommonFileIsIncluded) {
  const fs::path rules = fs::path(SourceDir()) / "tests" / "rules";
  std::string all;
  for (const auto& entry : fs::recursive_directory_iterator(rules)) {
    if (entry.path().extension() != ".trace") continue;
    std::ostringstream text;
    text << std::ifstream(entry.path()).rdbuf();
    all += text.str() + "\n";
  }
  for (const auto& entry : fs::directory_iterator(rules / "common")) {
    EXPECT_FALSE(PacketsOf(entry.path().string()).empty()) << entry.path();
    EXPECT_THAT(all, HasSubstr("@include " + entry.path().filename().string() + "\n"));
  }
}

TEST_F(TraceInclude, AFileHoldsWhatTheTraceHolds) {
  const Trace trace = Parsed("@two-interfaces\n+0us BRD 0x0130 01 00\n+1ms FPRD 0x1001:0x1800 len=64 @cut=40\n");
  const Trace stampless = Parsed("+0us BRD 0x0130 01 00 @no-time\n");
  for (const Trace& one : {trace, stampless}) {
    const samples::Bytes bytes = PcapNgOf(one);
    const std::string path = Write("trace.pcapng", std::string(bytes.begin(), bytes.end()));
    const auto source = capture::OpenCapture(path);
    ASSERT_TRUE(source) << source.error().message;
    capture::CapturedFrame frame;
    for (const Packet& packet : one.Packets()) {
      ASSERT_EQ((*source)->Next(frame), capture::ReadStatus::kFrame);
      const capture::CapturedFrame expected = AsCaptured(packet, frame.number);
      EXPECT_THAT(frame.bytes, ElementsAreArray(expected.bytes));
      EXPECT_EQ(frame.time, expected.time);
      EXPECT_EQ(frame.has_time, expected.has_time);
      EXPECT_EQ(frame.interface_index, expected.interface_index);
      EXPECT_EQ(frame.original_length, expected.original_length);
    }
    EXPECT_EQ((*source)->Next(frame), capture::ReadStatus::kEnd);
  }
}

TEST(TraceBuilder, CppInterface) {
  Trace trace;
  trace.Slaves(2);
  trace.At(0).Fpwr(0x1001, 0x0120, {8, 0}).Wkc(1).Brd(0x0130, {2, 0}).Mark("request");
  trace.After(1000).Lrw(0x10000, {1}, {2}).Lost();
  const std::vector<Packet> packets = trace.Packets();
  ASSERT_THAT(packets, SizeIs(3));
  EXPECT_EQ(Wkc(packets[1], 2), 1);
  EXPECT_EQ(Word(packets[1], kFirst + 14 + 2), 2) << "broadcast passed two slaves";
  EXPECT_EQ(Word(packets[1], kFirst + 14 + 12), 2);
  EXPECT_EQ(packets[2].time, kTraceStart + 1'000'000);

  const std::unique_ptr<MemorySource> source = trace.Source();
  capture::CapturedFrame frame;
  FrameNo count = 0;
  while (source->Next(frame) == capture::ReadStatus::kFrame) EXPECT_EQ(frame.number, ++count);
  EXPECT_EQ(count, 3U);
  EXPECT_EQ(source->info().packets, 3U);
}

}  // namespace
}  // namespace ecaudit::test
