// Every tests/rules/RULE/*.trace against the .expected beside it: the whole analysis runs, and what the rules of the
// catalogue's first chapters (and of the rule's own chapter) find must be exactly what is written there.
//
// Attributes of @slaves that this test reads: profile=NAME for all slaves; expect=FILE in the same folder is what the
// start-up is compared with; file=pcapng|pcap writes the trace to a file
// first and reads that, and cut=N takes N bytes from its end.
#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <sstream>
#include <unistd.h>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "analyzers/judge/catalogue.h"
#include "analyzers/options/device_files.h"
#include "analyzers/result/rule_info.h"
#include "cli/expectation_file.h"
#include "decoder/bus/aligned_source.h"
#include "decoder/capture/capture_reader.h"
#include "decoder/device/eni_reader.h"
#include "tests/support/folders.h"
#include "tests/support/trace_file.h"
#include "tests/unit/analyzers/expected_findings.h"
#include "tests/unit/analyzers/sentence_check.h"

namespace ecaudit::test {
namespace {

namespace fs = std::filesystem;

const fs::path kRules = fs::path(test::SourceDir()) / "tests" / "rules";

std::string FileText(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::vector<fs::path> AllTraces() {
  std::vector<fs::path> traces;
  if (!fs::exists(kRules)) return traces;
  for (const auto& entry : fs::recursive_directory_iterator(kRules)) {
    // What stands in common/ is included by traces, and is none itself.
    const bool common = entry.path().parent_path() == kRules / "common";
    if (!common && entry.path().extension() == ".trace") traces.push_back(entry.path());
  }
  std::sort(traces.begin(), traces.end());
  return traces;
}

/// Chapters whose rules may speak up in a trace of a rule of `group`. Rules of later chapters would judge
/// configurations that the traces leave out.
bool Concerns(std::string_view rule_group, std::string_view group) {
  static const std::set<std::string_view> kFirst{"Capture", "Frame and bus", "AL state machine"};
  // A wrong mapping makes a wrong length, and that a refusal.
  if (group == "PDO mapping" && rule_group == "Sync managers and FMMUs") return true;
  return rule_group == group || kFirst.contains(rule_group);
}

/// A file in the temporary folder, gone at the end.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& extension)
      : path_(fs::temp_directory_path() / ("ecaudit_rule_trace_" + std::to_string(getpid()) + "." + extension)) {}
  ~TemporaryFile() { fs::remove(path_); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

AnalysisResult AnalyseTrace(const Trace& trace, const AnalysisOptions& options) {
  const auto file = trace.attributes().find("file");
  if (file == trace.attributes().end()) return Analyse(*trace.Source(), options);
  samples::Bytes bytes = file->second == "pcapng" ? PcapNgOf(trace) : PcapOf(trace);
  if (const auto cut = trace.attributes().find("cut"); cut != trace.attributes().end()) {
    bytes.resize(bytes.size() - std::min<std::size_t>(bytes.size(), std::stoul(cut->second)));
  }
  const TemporaryFile temporary(file->second);
  std::ofstream(temporary.path(), std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  // As the program opens a capture: the clocks of two interfaces are aligned.
  auto source = bus::OpenAligned([&] { return capture::OpenCapture(temporary.path().string()); });
  if (!source) {
    ADD_FAILURE() << source.error().message;
    return {};
  }
  return Analyse(**source, options);
}

class RuleTrace : public ::testing::TestWithParam<fs::path> {};

TEST_P(RuleTrace, FindsWhatIsExpected) {
  const fs::path& path = GetParam();
  const std::string rule = path.parent_path().filename().string();
  const RuleInfo* info = FindRule(rule);
  ASSERT_NE(info, nullptr) << rule << " is not in the catalogue";
  const auto trace = Trace::Load(path.string());
  ASSERT_TRUE(trace) << trace.error().message;
  const fs::path expected_path = fs::path(path).replace_extension(".expected");
  ASSERT_TRUE(fs::exists(expected_path)) << expected_path;
  const auto expected = ParseExpectations(FileText(expected_path), *trace);
  ASSERT_TRUE(expected) << expected_path << ": " << expected.error().message;

  AnalysisOptions options;
  if (const auto profile = trace->attributes().find("profile"); profile != trace->attributes().end()) {
    options.default_profile = profile->second;
  }
  if (const auto expect = trace->attributes().find("expect"); expect != trace->attributes().end()) {
    const auto expectation = cli::ReadExpectation((path.parent_path() / expect->second).string());
    ASSERT_TRUE(expectation) << expectation.error().message;
    options.expectation = *expectation;
  }
  const auto esi = trace->attributes().find("esi");
  const auto eni = trace->attributes().find("eni");
  auto files = std::make_shared<DeviceFiles>();
  if (esi != trace->attributes().end()) {
    auto file = device::LoadEsiFile((path.parent_path() / esi->second).string());
    ASSERT_TRUE(file) << file.error().message;
    files->esi.push_back({esi->second, std::move(*file), esi->second});
  }
  if (eni != trace->attributes().end()) {
    auto file = device::LoadEniFile((path.parent_path() / eni->second).string());
    ASSERT_TRUE(file) << file.error().message;
    files->eni.emplace(DeviceFiles::Eni{eni->second, std::move(*file)});
  }
  if (!files->esi.empty() || files->eni) options.files = std::move(files);
  // Parameters of drives have names in capitals, other attributes do not.
  for (const auto& [key, value] : trace->attributes()) {
    if (std::isupper(static_cast<unsigned char>(key[0])) != 0) {
      options.parameters.push_back({std::nullopt, key, std::stoll(value)});
    }
  }
  // Rules of other chapters whose findings follow from this one's, or the other way round: "a,b".
  const auto also = trace->attributes().find("also");
  const std::string named = also == trace->attributes().end() ? "" : "," + also->second + ",";
  for (const RuleInfo* other : RuleCatalogue()) {
    if (named.find("," + std::string(other->id) + ",") != std::string::npos) continue;
    if (!Concerns(other->group, info->group)) options.rules[std::string(other->id)].off = true;
  }
  const AnalysisResult result = AnalyseTrace(*trace, options);

  std::vector<bool> used(result.findings.size(), false);
  for (const ExpectedFinding& wanted : expected->findings) {
    bool found = false;
    for (std::size_t i = 0; i < result.findings.size() && !found; ++i) {
      if (used[i] || !Matches(wanted, result.findings[i], result)) continue;
      found = used[i] = true;
    }
    EXPECT_TRUE(found) << "not found: " << wanted.line << " (frame " << wanted.frame << ")";
  }
  for (std::size_t i = 0; i < result.findings.size(); ++i) {
    EXPECT_TRUE(used[i]) << "not expected: " << TextOf(result.findings[i], result);
  }
  for (const Finding& finding : result.findings) {
    if (finding.rule != rule) continue;
    for (const std::string& problem : ProblemsOfSentences(finding)) ADD_FAILURE() << problem;
  }

  // What the rule itself could not judge; of other rules only what the file names.
  std::vector<bool> said(result.not_evaluable.size(), false);
  for (const ExpectedNotEvaluable& wanted : expected->not_evaluable) {
    bool found = false;
    for (std::size_t i = 0; i < result.not_evaluable.size() && !found; ++i) {
      if (said[i] || !Matches(wanted, result.not_evaluable[i], result)) continue;
      found = said[i] = true;
    }
    EXPECT_TRUE(found) << "not reported: not-evaluable " << wanted.rule << " " << wanted.code << " " << wanted.what;
  }
  for (std::size_t i = 0; i < result.not_evaluable.size(); ++i) {
    const NotEvaluable& entry = result.not_evaluable[i];
    if (entry.rule != rule || said[i]) continue;
    ADD_FAILURE() << "not expected: " << LineOf(entry, result);
  }

  // A trace that is named for it must show the rule at work, and one that complies must not.
  const bool fires = std::any_of(result.findings.begin(), result.findings.end(),
                                 [&](const Finding& finding) { return finding.rule == rule; });
  const std::string stem = path.stem().string();
  if (stem.starts_with("violates")) {
    EXPECT_TRUE(fires);
  } else if (stem.starts_with("complies")) {
    EXPECT_FALSE(fires);
  } else {
    EXPECT_TRUE(stem.starts_with("unknown")) << "a trace is called violates, complies or unknown, with a number";
  }
}

std::string TraceName(const ::testing::TestParamInfo<fs::path>& info) {
  std::string name = info.param.parent_path().filename().string() + "_" + info.param.stem().string();
  for (char& c : name) c = c == '-' ? '_' : c;
  return name;
}

INSTANTIATE_TEST_SUITE_P(Traces, RuleTrace, ::testing::ValuesIn(AllTraces()), TraceName);

}  // namespace
}  // namespace ecaudit::test
