// The committed captures against the builder, and against Wireshark as a second opinion.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <unistd.h>

#include <gtest/gtest.h>

#include "samples/builder/catalogue.h"
#include "tests/support/folders.h"

namespace ecaudit::samples {
namespace {

const std::filesystem::path kSamples = std::filesystem::path(test::SourceDir()) / "samples";

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

// All files behind each other in one run, since each start of tshark takes long.
TEST(Samples, WiresharkReadsThemWithoutComplaint) {
  if (!HaveTshark()) GTEST_SKIP() << "tshark is not installed";
  std::string files;
  std::vector<const MadeSample*> of_packet{nullptr};  // by frame number
  std::string broken;                                 // these are broken on purpose; Wireshark marks some of the faults
  for (const MadeSample& one : Made()) {
    const std::string name = one.scenario->name;
    if (name == "truncated") continue;
    if (name == "malformed" || name == "snaplen" || name == "swapped-header") broken += one.file_name() + " ";
    files += " '" + (kSamples / "captures" / one.file_name()).string() + "'";
    of_packet.insert(of_packet.end(), one.sample.packets, &one);
  }
  const std::filesystem::path all =
      std::filesystem::temp_directory_path() / ("ecaudit_samples_" + std::to_string(getpid()) + ".pcapng");
  ASSERT_EQ(std::system(("mergecap -a -w '" + all.string() + "'" + files).c_str()), 0);
  std::istringstream lines(Output("tshark -r '" + all.string() +
                                  "' -T fields -E separator=';' -e frame.number -e _ws.malformed 2>/dev/null"));
  std::filesystem::remove(all);
  std::size_t count = 0;
  std::set<std::string> malformed;
  for (std::string line; std::getline(lines, line);) {
    ++count;
    ASSERT_LT(count, of_packet.size());
    if (line.back() != ';') malformed.insert(of_packet[count]->file_name());
  }
  EXPECT_EQ(count + 1, of_packet.size());
  for (const std::string& name : malformed) EXPECT_NE(broken.find(name), std::string::npos) << name;
  EXPECT_TRUE(malformed.contains("malformed.pcapng")) << "the check itself works";
}

TEST(Samples, WiresharkReadsTheTruncatedFileUpToTheCut) {
  if (!HaveTshark()) GTEST_SKIP() << "tshark is not installed";
  const auto truncated = std::find_if(Made().begin(), Made().end(), [](const MadeSample& one) {
    return std::string(one.scenario->name) == "truncated";
  });
  ASSERT_NE(truncated, Made().end());
  const std::string path = (kSamples / "captures" / truncated->file_name()).string();
  const std::string numbers = Output("tshark -r '" + path + "' -T fields -e frame.number 2>/dev/null");
  EXPECT_EQ(static_cast<std::size_t>(std::count(numbers.begin(), numbers.end(), '\n')), truncated->sample.packets);
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
