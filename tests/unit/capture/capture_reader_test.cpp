#include "decoder/capture/capture_reader.h"

#include <array>
#include <fcntl.h>
#include <sys/stat.h>
#include <thread>
#include <unistd.h>

#include <gtest/gtest.h>

#include "decoder/capture/capture_stream.h"
#include "tests/unit/capture/pcapng_bytes.h"

namespace ecaudit::capture {
namespace {

const Bytes kData{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14};

Bytes SmallCapture(int packets = 3) {
  PcapngBytes file;
  file.Section().Interface();
  for (int i = 0; i < packets; ++i) file.Enhanced(0, static_cast<std::uint64_t>(i), kData);
  return file.bytes();
}

std::string ErrorOf(const std::string& name, std::string_view content) {
  return ReadAll(OpenCaptureFromMemory(Bytes(content.begin(), content.end()), name)).error;
}

TEST(OpenCapture, PlainAndCompressedFilesAlike) {
  const TempFolder folder;
  const Bytes plain = SmallCapture();
  const std::array<std::pair<std::string, Bytes>, 3> files{
      {{"pcapng", plain}, {"pcapng+gzip", Gzip(plain)}, {"pcapng+zstd", Zstd(plain)}}};
  for (const auto& [format, bytes] : files) {
    const std::string path = folder.Write("capture", bytes);  // the name does not matter
    const WholeCapture capture = ReadFile(path);
    EXPECT_EQ(capture.frames.size(), 3U) << capture.error;
    EXPECT_EQ(capture.info.format, format);
    EXPECT_EQ(capture.info.path, path);
  }
}

TEST(OpenCapture, ShowsHowFarItIs) {
  const TempFolder folder;
  const Bytes bytes = SmallCapture(20'000);
  auto source = OpenCapture(folder.Write("x.pcapng", bytes));
  ASSERT_TRUE(source);
  EXPECT_EQ((*source)->bytes_total(), bytes.size());
  CapturedFrame frame;
  while ((*source)->Next(frame) == ReadStatus::kFrame) {
  }
  EXPECT_EQ((*source)->bytes_read(), bytes.size());
}

TEST(OpenCapture, ReportsInOneLineWhyAFileDoesNotOpen) {
  const TempFolder folder;
  const std::string missing = folder.Path("missing.pcap");
  EXPECT_EQ(ReadFile(missing).error, "no such file: " + missing);
  EXPECT_EQ(ReadFile(folder.Path("")).error, folder.Path("") + " is a directory, not a capture");
  const std::string empty = folder.Write("empty.pcap", {});
  EXPECT_EQ(ReadFile(empty).error, empty + " is empty, not a capture");
  EXPECT_EQ(ReadFile("").error, "no such file: ");
}

TEST(OpenCapture, AFileWithoutPermission) {
  const TempFolder folder;
  const std::string path = folder.Write("secret.pcap", SmallCapture());
  ASSERT_EQ(::chmod(path.c_str(), 0), 0);
  if (::access(path.c_str(), R_OK) == 0) GTEST_SKIP() << "running as root, which may read everything";
  EXPECT_EQ(ReadFile(path).error, "cannot read " + path + ": permission denied");
}

TEST(OpenCapture, WhatIsNoCapture) {
  EXPECT_EQ(ErrorOf("x.txt", "hello, this is text\n"), "x.txt is not a capture: neither pcap nor pcapng");
  EXPECT_EQ(ErrorOf("x", "a"), "x is not a capture: neither pcap nor pcapng");
  EXPECT_EQ(ErrorOf("x.cap", "GMBU\x01\x02"),
            "x.cap is not a capture: it is a Microsoft Network Monitor file; 'editcap -F pcapng' converts it");
  EXPECT_EQ(ErrorOf("x.bz2", "BZh91AY&SY"),
            "x.bz2 is not a capture: it is bzip2-compressed; only gzip and zstd are read");
  EXPECT_EQ(ErrorOf("x.zip", std::string_view("PK\x03\x04\x14", 5)),
            "x.zip is not a capture: it is a zip archive; unpack it first");
}

TEST(OpenCapture, CompressedDataThatHoldNoCapture) {
  const auto error = [](const Bytes& bytes) { return ReadAll(OpenCaptureFromMemory(bytes, "x")).error; };
  const Bytes text{'h', 'e', 'l', 'l', 'o', ' ', 't', 'h', 'e', 'r', 'e'};
  EXPECT_EQ(error(Gzip(text)), "x is not a capture: neither pcap nor pcapng");
  EXPECT_EQ(error(Zstd({})), "x is empty, not a capture");
  EXPECT_EQ(error({0x1F, 0x8B}), "x: the gzip data end early");
  EXPECT_EQ(error({0x1F, 0x8B, 0x08, 0x00, 0x00}), "x: the gzip data end early");
}

TEST(OpenCapture, NamesCannotControlTheTerminal) {
  EXPECT_EQ(ErrorOf("x\x1B[31m.pcap", "text that is none"),
            "x\\x1b[31m.pcap is not a capture: neither pcap nor pcapng");
}

TEST(OpenCapture, StandardInput) {
  const Bytes bytes = Gzip(SmallCapture(500));
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe(ends.data()), 0);
  std::thread writer([&] {
    EXPECT_EQ(::write(ends[1], bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
    ::close(ends[1]);
  });
  const int saved = ::dup(STDIN_FILENO);
  ::dup2(ends[0], STDIN_FILENO);
  ::close(ends[0]);
  const WholeCapture capture = ReadFile("-");
  writer.join();
  if (saved >= 0) {
    ::dup2(saved, STDIN_FILENO);
    ::close(saved);
  } else {
    ::close(STDIN_FILENO);
  }
  EXPECT_EQ(capture.frames.size(), 500U) << capture.error;
  EXPECT_EQ(capture.info.path, "-");
  EXPECT_EQ(capture.info.format, "pcapng+gzip");
}

}  // namespace
}  // namespace ecaudit::capture
