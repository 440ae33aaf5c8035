// Every pair of AL states for every drive family, through the whole analysis: what the master asks, what the drive
// answers, and what must be found. What is allowed comes from the tables made from the manuals, for slaves without a
// family from the standard (esc-reference 5.2); never from the profiles that are under test.
#include <array>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "analyzers/judge/catalogue.h"
#include "analyzers/result/rule_info.h"
#include "cli/report/sentences.h"
#include "decoder/esc/al.h"
#include "tests/support/csv.h"
#include "tests/support/folders.h"
#include "tests/support/trace_builder.h"

namespace ecaudit::test {
namespace {

using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

constexpr std::array<std::uint8_t, 5> kStates{1, 2, 3, 4, 8};

struct Row {
  bool allowed = false;
  std::uint16_t refusal_code = 0;  ///< that the manual gives for a refusal; 0: none
};
using Table = std::map<std::pair<std::uint8_t, std::uint8_t>, Row>;

std::uint8_t StateOf(char letter) {
  switch (letter) {
    case 'I':
      return 1;
    case 'P':
      return 2;
    case 'B':
      return 3;
    case 'S':
      return 4;
    default:
      return 8;
  }
}

/// The standard: one step up at a time, down to any state, BOOT between INIT and INIT only, any state to itself.
Table StandardTable() {
  const std::set<std::pair<int, int>> allowed = {{1, 1}, {2, 2}, {3, 3}, {4, 4}, {8, 8}, {1, 2}, {2, 4}, {4, 8},
                                                 {2, 1}, {4, 1}, {8, 1}, {4, 2}, {8, 2}, {8, 4}, {1, 3}, {3, 1}};
  Table table;
  for (const std::uint8_t from : kStates) {
    for (const std::uint8_t to : kStates) table[{from, to}] = {allowed.contains({from, to}), 0x0011};
  }
  return table;
}

/// Rows of al_transitions.csv of one family; empty when the table is absent.
Table FamilyTable(const std::string& family) {
  Table table;
  for (const CsvRow& row : ReadCsvFile(test::SharedDir() + "/reference/al_transitions.csv")) {
    if (row.at("family") != family) continue;
    const std::string& code = row.at("al_status_code_if_refused");
    const bool request = !row.at("al_control_value").empty() || row.at("from") == "B";
    if (!request) continue;  // a fall by itself, listed beside the requests
    table[{StateOf(row.at("from")[0]), StateOf(row.at("to")[0])}] = {
        row.at("allowed") == "yes",
        code.empty() ? std::uint16_t{0} : static_cast<std::uint16_t>(std::stoul(code.substr(0, 6), nullptr, 16))};
  }
  return table;
}

Bytes Status(std::uint8_t state, bool error, std::uint16_t code) {
  return {static_cast<std::uint8_t>(state | (error ? 0x10U : 0U)),
          0,
          0,
          0,
          static_cast<std::uint8_t>(code & 0xFFU),
          static_cast<std::uint8_t>(code >> 8U)};
}

/// The slave is in `from`, `to` is requested, AL Status then shows `answer`.
AnalysisResult Ask(const std::string& profile, std::uint8_t from, std::uint8_t to, const Bytes& answer) {
  Trace trace;
  trace.At(0).Fprd(0x1001, 0x0130, Status(from, false, 0));
  trace.After(1000).Fpwr(0x1001, 0x0120, {to, 0}).Mark("ask");
  trace.After(1000).Fprd(0x1001, 0x0130, Status(from, false, 0));
  trace.After(20'000).Fprd(0x1001, 0x0130, answer).Mark("answer");
  AnalysisOptions options;
  options.default_profile = profile;
  for (const RuleInfo* rule : RuleCatalogue()) {
    if (rule->group != "AL state machine") options.rules[std::string(rule->id)].off = true;
  }
  return Analyse(*trace.Source(), options);
}

/// "al-refused<-al-illegal-transition": rule and the rule of its cause.
std::vector<std::string> Found(const AnalysisResult& result) {
  std::vector<std::string> found;
  for (const Finding& finding : result.findings) {
    std::string text(finding.rule);
    if (finding.caused_by != kNoFinding) text += "<-" + std::string(result.findings[finding.caused_by].rule);
    found.push_back(text);
  }
  return found;
}

struct Case {
  std::string profile;
  std::string family;  ///< in the table; empty: the standard
  std::uint8_t from;
  std::uint8_t to;
};

class AlTable : public ::testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    const Case& c = GetParam();
    table_ = c.family.empty() ? StandardTable() : FamilyTable(c.family);
    if (table_.empty()) GTEST_SKIP() << "reference tables are absent: al_transitions.csv";
    ASSERT_TRUE(table_.contains({c.from, c.to})) << "the table of the manual lacks this pair";
  }
  [[nodiscard]] const Row& row() const { return table_.at({GetParam().from, GetParam().to}); }

 private:
  Table table_;
};

TEST_P(AlTable, ReachedSilentlyOrAcceptedAgainstTheManual) {
  const Case& c = GetParam();
  const AnalysisResult result = Ask(c.profile, c.from, c.to, Status(c.to, false, 0));
  if (row().allowed) {
    EXPECT_THAT(Found(result), IsEmpty());
  } else {
    EXPECT_THAT(Found(result),
                UnorderedElementsAre("al-illegal-transition", "al-accepted-illegal<-al-illegal-transition"));
  }
}

TEST_P(AlTable, RefusedAsTheManualSays) {
  const Case& c = GetParam();
  if (c.from == c.to) return;  // a request of the current state is not refused
  const std::uint16_t code = row().refusal_code;
  const AnalysisResult result = Ask(c.profile, c.from, c.to, Status(c.from, true, code));
  if (row().allowed) {
    EXPECT_THAT(Found(result), ::testing::Contains("al-refused"));
  } else {
    EXPECT_THAT(Found(result), UnorderedElementsAre("al-illegal-transition", "al-refused<-al-illegal-transition"));
  }
  for (const Finding& finding : result.findings) {
    EXPECT_EQ(finding.confidence, Confidence::kObserved);
    EXPECT_EQ(finding.slave, 0);
    if (code != 0) {
      EXPECT_NE(finding.rule, "al-undocumented-status-code") << report::MessageOf(finding, result);
      EXPECT_NE(finding.rule, "al-wrong-status-code") << report::MessageOf(finding, result);
    }
  }
}

std::vector<Case> AllCases() {
  const std::vector<std::pair<std::string, std::string>> profiles = {{"generic", ""},
                                                                     {"kollmorgen-akd-2010", "akd_b"},
                                                                     {"kollmorgen-akd-2011", "akd_d"},
                                                                     {"kollmorgen-mkd-c", "mkd"},
                                                                     {"kollmorgen-mkd-n", "mkd"},
                                                                     {"pilz-pmcprotego-d", "pilz"}};
  std::vector<Case> cases;
  for (const auto& [profile, family] : profiles) {
    for (const std::uint8_t from : kStates) {
      for (const std::uint8_t to : kStates) cases.push_back({profile, family, from, to});
    }
  }
  return cases;
}

std::string NameOf(const ::testing::TestParamInfo<Case>& info) {
  std::string name =
      info.param.profile + "_" + esc::StateName(info.param.from) + "_to_" + esc::StateName(info.param.to);
  for (char& c : name) c = c == '-' ? '_' : c;
  return name;
}

INSTANTIATE_TEST_SUITE_P(AllPairs, AlTable, ::testing::ValuesIn(AllCases()), NameOf);

// --- codes
// ------------------------------------------------------------------------------------------------------------

struct CodeCase {
  const char* name;
  const char* profile;
  std::uint8_t from;
  std::uint8_t to;  ///< 0: an error by itself
  std::uint16_t code;
  const char* complaint;  ///< rule that must complain about the code; empty: none
};

class AlCode : public ::testing::TestWithParam<CodeCase> {};

TEST_P(AlCode, FitsOrDoesNot) {
  const CodeCase& c = GetParam();
  AnalysisResult result;
  if (c.to == 0) {
    Trace trace;
    trace.At(0).Fprd(0x1001, 0x0130, Status(c.from, false, 0));
    trace.After(1000).Fprd(0x1001, 0x0130, Status(c.from == 8 ? 4 : c.from, true, c.code));
    AnalysisOptions options;
    options.default_profile = c.profile;
    result = Analyse(*trace.Source(), options);
  } else {
    result = Ask(c.profile, c.from, c.to, Status(c.from, true, c.code));
  }
  std::string complaint;
  for (const Finding& finding : result.findings) {
    if (finding.rule != "al-undocumented-status-code" && finding.rule != "al-wrong-status-code") continue;
    EXPECT_EQ(complaint, "") << "two complaints about one code";
    complaint = finding.rule;
    EXPECT_EQ(finding.severity, Severity::kWarning);
    ASSERT_NE(finding.caused_by, kNoFinding);
    EXPECT_EQ(result.findings[finding.caused_by].rule, c.to == 0 ? "al-unexpected-change" : "al-refused");
  }
  EXPECT_EQ(complaint, c.complaint);
}

constexpr const char* kUndocumented = "al-undocumented-status-code";
constexpr const char* kWrong = "al-wrong-status-code";

// al_status_codes.csv: AKD and MKD 0x0011 (I-S, I-O, P-O, O-B, S-B, P-B) and 0x0017 (I-P, P-S); Pilz 0x0017 (P-S, S-O)
// and 0x001A (O, S-O). "No other codes supported". Tolerated: 0x0016 for I-P and 0x0013 for I-B (real stacks).
INSTANTIATE_TEST_SUITE_P(
    Families, AlCode,
    ::testing::Values(CodeCase{"Akd17InitToPreop", "kollmorgen-akd-2011", 1, 2, 0x0017, ""},
                      CodeCase{"Akd17PreopToSafeop", "kollmorgen-akd-2011", 2, 4, 0x0017, ""},
                      CodeCase{"Akd17SafeopToOp", "kollmorgen-akd-2011", 4, 8, 0x0017, kWrong},
                      CodeCase{"Akd17InitToOp", "kollmorgen-akd-2010", 1, 8, 0x0017, kWrong},
                      CodeCase{"Akd17ByItself", "kollmorgen-akd-2011", 8, 0, 0x0017, kWrong},
                      CodeCase{"Akd11InitToPreop", "kollmorgen-akd-2011", 1, 2, 0x0011, kWrong},
                      CodeCase{"Akd11PreopToOp", "kollmorgen-akd-2011", 2, 8, 0x0011, ""},
                      CodeCase{"Akd11BootToOp", "kollmorgen-akd-2011", 3, 8, 0x0011, ""},
                      CodeCase{"Akd16InitToPreop", "kollmorgen-akd-2011", 1, 2, 0x0016, ""},
                      CodeCase{"Akd13InitToBoot", "kollmorgen-akd-2011", 1, 3, 0x0013, ""},
                      CodeCase{"Akd13InitToPreop", "kollmorgen-akd-2011", 1, 2, 0x0013, kUndocumented},
                      CodeCase{"Akd1DPreopToSafeop", "kollmorgen-akd-2011", 2, 4, 0x001D, kUndocumented},
                      CodeCase{"Akd1AInOp", "kollmorgen-akd-2011", 8, 0, 0x001A, kUndocumented},
                      CodeCase{"AkdVendorCode", "kollmorgen-akd-2011", 2, 4, 0x8001, kUndocumented},
                      CodeCase{"MkdN17PreopToSafeop", "kollmorgen-mkd-n", 2, 4, 0x0017, ""},
                      CodeCase{"MkdC1BInOp", "kollmorgen-mkd-c", 8, 0, 0x001B, kUndocumented},
                      CodeCase{"Pilz1ASafeopToOp", "pilz-pmcprotego-d", 4, 8, 0x001A, ""},
                      CodeCase{"Pilz1AInOp", "pilz-pmcprotego-d", 8, 0, 0x001A, ""},
                      CodeCase{"Pilz1APreopToSafeop", "pilz-pmcprotego-d", 2, 4, 0x001A, kWrong},
                      CodeCase{"Pilz1AInPreop", "pilz-pmcprotego-d", 2, 0, 0x001A, kWrong},
                      CodeCase{"Pilz17SafeopToOp", "pilz-pmcprotego-d", 4, 8, 0x0017, ""},
                      CodeCase{"Pilz17PreopToSafeop", "pilz-pmcprotego-d", 2, 4, 0x0017, ""},
                      CodeCase{"Pilz17InitToPreop", "pilz-pmcprotego-d", 1, 2, 0x0017, kWrong},
                      CodeCase{"Generic17InitToOp", "generic", 1, 8, 0x0017, ""},
                      CodeCase{"Generic99", "generic", 2, 4, 0x0099, kUndocumented},
                      CodeCase{"GenericVendorCode", "generic", 2, 4, 0x9000, ""},
                      CodeCase{"NoCode", "kollmorgen-akd-2011", 2, 4, 0x0000, ""}),
    [](const ::testing::TestParamInfo<CodeCase>& of) { return of.param.name; });

}  // namespace
}  // namespace ecaudit::test
