// The committed captures against the builder, and against Wireshark as a second opinion.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include <gtest/gtest.h>

#include "samples/builder/catalogue.h"

namespace ecaudit::samples {
namespace {

const std::filesystem::path kSamples = std::filesystem::path(ECAUDIT_SOURCE_DIR) / "samples";

std::string FileText(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

const std::vector<MadeSample>& Made() {
  static const std::vector<MadeSample> made = MakeAll();
  return made;
}

std::string Output(const std::string& command) {
  std::string out;
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return out;
  char buffer[4096];
  while (const std::size_t got = fread(buffer, 1, sizeof buffer, pipe)) out.append(buffer, got);
  pclose(pipe);
  return out;
}

bool HaveTshark() {
  return std::system("tshark --version > /dev/null 2>&1") == 0;
}

TEST(Samples, CommittedFilesAreWhatTheBuilderWrites) {
  for (const MadeSample& one : Made()) {
    const std::string committed = FileText(kSamples / "captures" / one.file_name());
    const std::string made(one.sample.file.begin(), one.sample.file.end());
    EXPECT_TRUE(committed == made) << one.file_name() << " differs: run ecaudit_make_samples samples";
  }
  EXPECT_EQ(FileText(kSamples / "README.md"), ReadmeText(Made()));
  EXPECT_EQ(FileText(kSamples / "captures" / "expected.json"), ExpectedJson(Made()));
}

TEST(Samples, EveryCommittedFileComesFromTheBuilder) {
  std::set<std::string> names{"expected.json"};
  for (const MadeSample& one : Made()) EXPECT_TRUE(names.insert(one.file_name()).second) << one.file_name();
  for (const auto& entry : std::filesystem::directory_iterator(kSamples / "captures")) {
    EXPECT_TRUE(names.contains(entry.path().filename().string())) << entry.path();
  }
}

TEST(Samples, BuilderIsDeterministic) {
  const std::vector<MadeSample> again = MakeAll();
  ASSERT_EQ(again.size(), Made().size());
  for (std::size_t i = 0; i < again.size(); ++i) {
    EXPECT_TRUE(again[i].sample.file == Made()[i].sample.file) << again[i].file_name();
  }
}

TEST(Samples, FilesAreSmallAndWellNamed) {
  for (const MadeSample& one : Made()) {
    EXPECT_LT(one.sample.file.size(), 150U * 1024U) << one.file_name();
    EXPECT_TRUE(std::regex_match(one.scenario->name, std::regex("[a-z0-9]+(-[a-z0-9]+)*"))) << one.scenario->name;
    EXPECT_EQ(std::string(one.scenario->about).back(), '.') << one.scenario->name;
    EXPECT_EQ(std::string(one.scenario->report).back(), '.') << one.scenario->name;
  }
}

TEST(Samples, ExpectedFramesAreInTheFile) {
  for (const MadeSample& one : Made()) {
    for (const Expectation& finding : one.sample.expected) {
      EXPECT_LE(finding.sent, one.sample.packets) << one.file_name() << " " << finding.rule;
      EXPECT_LE(finding.returned, one.sample.packets) << one.file_name() << " " << finding.rule;
    }
  }
}

TEST(Samples, WiresharkReadsThemWithoutComplaint) {
  if (!HaveTshark()) GTEST_SKIP() << "tshark is not installed";
  for (const MadeSample& one : Made()) {
    const std::string path = (kSamples / "captures" / one.file_name()).string();
    const std::string name = one.scenario->name;
    const std::string malformed = Output("tshark -r '" + path + "' -Y _ws.malformed 2>/dev/null");
    const std::string count = Output("tshark -r '" + path + "' -T fields -e frame.number 2>/dev/null | wc -l");
    // These are broken on purpose; Wireshark marks only some of the faults.
    const bool broken = name == "malformed" || name == "snaplen";
    if (!broken) {
      EXPECT_EQ(malformed, "") << one.file_name();
    }
    EXPECT_EQ(std::stoul(count), one.sample.packets) << one.file_name();
  }
}

// Frames that the encoder wrote and the fields that Wireshark's dissector reads out of them.
TEST(Samples, WiresharkReadsTheSameDatagrams) {
  if (!HaveTshark()) GTEST_SKIP() << "tshark is not installed";
  const std::string path = (kSamples / "captures" / "clean-startup.pcapng").string();
  const std::string text =
      Output("tshark -r '" + path +
             "' -T fields -E separator=';' -e frame.number -e frame.time_epoch -e ecat.cmd -e ecat.idx "
             "-e ecat.adp -e ecat.ado -e ecat.cnt 2>/dev/null");
  std::istringstream lines(text);
  std::map<std::string, int> commands;
  std::string first_time;
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    std::vector<std::string> fields;
    std::istringstream stream(line);
    for (std::string field; std::getline(stream, field, ';');) fields.push_back(field);
    ASSERT_GE(fields.size(), 4U) << line;
    if (first_time.empty()) first_time = fields[1];
    ++commands[fields[2]];
    EXPECT_EQ(std::stoi(fields[3], nullptr, 0), static_cast<int>(count / 2 % 16)) << line;
  }
  EXPECT_EQ(count, Made().front().sample.packets);
  EXPECT_EQ(first_time, "1772442000.500000000");
  EXPECT_GT(commands["0x0c"], 200) << "LRW, both copies";
  EXPECT_EQ(commands["0x07"], 2) << "one BRD, both copies";
}

}  // namespace
}  // namespace ecaudit::samples
