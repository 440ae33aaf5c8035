// The catalogue itself: every rule is complete, documented and tested.
//
// docs/rules.md is written from the rules. To write it anew: ECAUDIT_WRITE_DOCS=1 ecaudit_unit_tests
// --gtest_filter='Catalogue.*'
#include "analyzers/judge/catalogue.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <sstream>

#include <gtest/gtest.h>

#include "analyzers/judge/common_causes.h"
#include "analyzers/judge/shared_notes.h"
#include "analyzers/options/options.h"
#include "analyzers/result/rule_info.h"
#include "cli/commands/catalogue_output.h"
#include "cli/report/sentences.h"
#include "decoder/device/source_documents.h"
#include "tests/support/folders.h"

namespace ecaudit {
namespace {

namespace fs = std::filesystem;

const fs::path kRoot = test::SourceDir();

std::string FileText(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

constexpr std::string_view kHeadings[] = {"What it checks", "Why it matters", "How it is decided", "Example",
                                          "What to do"};

/// Heading and text of each "## " part, in order.
std::vector<std::pair<std::string, std::string>> Parts(std::string_view doc) {
  std::vector<std::pair<std::string, std::string>> parts;
  std::istringstream lines{std::string(doc)};
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("## ")) {
      parts.emplace_back(line.substr(3), "");
    } else if (!parts.empty() && !line.empty()) {
      parts.back().second += line + "\n";
    }
  }
  return parts;
}

TEST(Catalogue, LawsOfCommonCausesNameRulesThatExist) {
  const auto exists = [](std::string_view id) {
    return std::any_of(RuleCatalogue().begin(), RuleCatalogue().end(),
                       [id](const RuleInfo* rule) { return rule->id == id; });
  };
  const auto laws = CommonCauses();
  EXPECT_FALSE(laws.empty());
  for (const auto& [effect, cause] : laws) {
    EXPECT_TRUE(exists(effect)) << effect;
    EXPECT_TRUE(exists(cause)) << cause;
    EXPECT_EQ(std::count(laws.begin(), laws.end(), std::pair(effect, cause)), 1) << effect << " from " << cause;
  }
}

TEST(Catalogue, EveryRuleFileIsRegisteredUnderItsName) {
  std::set<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / "analyzers" / "rules")) {
    if (entry.path().extension() == ".cpp") files.insert(entry.path().stem().string());
  }
  std::set<std::string> rules;
  for (const RuleInfo* rule : RuleCatalogue()) {
    std::string name(rule->id);
    std::replace(name.begin(), name.end(), '-', '_');
    EXPECT_TRUE(rules.insert(name).second) << rule->id << " is registered twice";
  }
  EXPECT_EQ(rules, files);
  EXPECT_FALSE(rules.empty());
}

TEST(Catalogue, IsSortedAndFound) {
  EXPECT_TRUE(std::is_sorted(RuleCatalogue().begin(), RuleCatalogue().end(),
                             [](const RuleInfo* a, const RuleInfo* b) { return a->id < b->id; }));
  for (const RuleInfo* rule : RuleCatalogue()) EXPECT_EQ(FindRule(rule->id), rule);
  EXPECT_EQ(FindRule("no-such-rule"), nullptr);
}

TEST(Catalogue, EveryRuleIsDescribed) {
  for (const RuleInfo* rule : RuleCatalogue()) {
    SCOPED_TRACE(rule->id);
    EXPECT_TRUE(std::regex_match(std::string(rule->id), std::regex("[a-z0-9]+(-[a-z0-9]+)+")));
    EXPECT_FALSE(rule->group.empty());
    EXPECT_FALSE(rule->needs.empty());
    ASSERT_FALSE(rule->title.empty());
    EXPECT_TRUE(rule->title.front() >= 'A' && rule->title.front() <= 'Z') << rule->title;
    EXPECT_NE(rule->title.back(), '.') << rule->title;
    EXPECT_LE(rule->title.size(), 100U) << rule->title;

    const auto parts = Parts(rule->doc);
    ASSERT_EQ(parts.size(), std::size(kHeadings));
    for (std::size_t i = 0; i < parts.size(); ++i) {
      EXPECT_EQ(parts[i].first, kHeadings[i]);
      EXPECT_FALSE(parts[i].second.empty()) << parts[i].first << " is empty";
    }
    std::istringstream lines{std::string(rule->doc)};
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 120U) << line;
  }
}

/// Names in "{name}", "{name:number}", "{?name}" of a template; nothing when a bracket is not closed.
std::optional<std::set<std::string>> NamesIn(std::string_view text) {
  std::set<std::string> names;
  int open = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\\') {
      ++i;
    } else if (text[i] == '[') {
      ++open;
    } else if (text[i] == ']') {
      if (--open < 0) return std::nullopt;
    } else if (text[i] == '{') {
      const std::size_t end = text.find('}', i);
      if (end == std::string_view::npos) return std::nullopt;
      std::string_view inside = text.substr(i + 1, end - i - 1);
      if (inside.starts_with('?') || inside.starts_with('!')) inside.remove_prefix(1);
      names.emplace(inside.substr(0, inside.find_first_of(":?")));
      i = end;
    }
  }
  if (open != 0) return std::nullopt;
  return names;
}

void ExpectATemplate(std::string_view text) {
  SCOPED_TRACE(text);
  const auto names = NamesIn(text);
  ASSERT_TRUE(names.has_value()) << "a bracket is not closed";
  static const std::regex snake("[a-z][a-z0-9]*(_[a-z0-9]+)*");
  for (const std::string& name : *names) EXPECT_TRUE(std::regex_match(name, snake)) << name;
}

TEST(Catalogue, EveryRuleHasItsSentences) {
  static const std::regex kebab("[a-z0-9]+(-[a-z0-9]+)*");
  for (const RuleInfo* rule : RuleCatalogue()) {
    SCOPED_TRACE(rule->id);
    EXPECT_FALSE(rule->kinds.empty());
    std::set<std::string_view> names;
    for (const FindingKind* kind : rule->kinds) {
      SCOPED_TRACE(kind->name);
      EXPECT_TRUE(std::regex_match(std::string(kind->name), kebab));
      EXPECT_TRUE(names.insert(kind->name).second) << "two kinds have this name";
      EXPECT_FALSE(kind->title.empty());
      EXPECT_FALSE(kind->message.empty());
      EXPECT_FALSE(kind->title.ends_with('.'));
      for (const std::string_view text : {kind->title, kind->message, kind->next}) ExpectATemplate(text);
    }
    std::set<std::string_view> notes;
    for (const NoteKind* note : kSharedNotes) notes.insert(note->name);
    for (const NoteKind* note : rule->notes) {
      EXPECT_TRUE(std::regex_match(std::string(note->name), kebab)) << note->name;
      EXPECT_TRUE(notes.insert(note->name).second) << note->name << ": two notes have this name";
      ExpectATemplate(note->text);
    }
  }
}

TEST(Catalogue, SourcesAreKnownDocuments) {
  const std::string sources = FileText(kRoot / "docs" / "sources.md");
  for (const RuleInfo* rule : RuleCatalogue()) {
    SCOPED_TRACE(rule->id);
    ASSERT_FALSE(rule->source.empty());
    std::istringstream citations{std::string(rule->source)};
    for (std::string citation; std::getline(citations, citation, ';');) {
      citation.erase(0, citation.find_first_not_of(' '));
      const device::Citation cited = device::FirstCitation(citation);
      EXPECT_NE(device::FindSourceDocument(cited.key), nullptr) << cited.key;
      EXPECT_FALSE(cited.section.empty()) << citation;
      EXPECT_NE(sources.find("`" + std::string(cited.key) + "`"), std::string::npos)
          << cited.key << " is not in docs/sources.md";
    }
  }
}

TEST(Catalogue, ExamplesExist) {
  const std::regex sample("samples/captures/[a-z0-9-]+\\.pcap(ng)?");
  for (const RuleInfo* rule : RuleCatalogue()) {
    const std::string doc(rule->doc);
    for (auto at = std::sregex_iterator(doc.begin(), doc.end(), sample); at != std::sregex_iterator(); ++at) {
      EXPECT_TRUE(fs::exists(kRoot / at->str())) << rule->id << ": " << at->str();
    }
  }
}

TEST(Catalogue, EveryRuleHasItsTraces) {
  for (const RuleInfo* rule : RuleCatalogue()) {
    for (const std::string_view kind : {"violates", "complies", "unknown"}) {
      const fs::path trace = kRoot / "tests" / "rules" / rule->id / (std::string(kind) + ".trace");
      EXPECT_TRUE(fs::exists(trace)) << trace;
      EXPECT_TRUE(fs::exists(fs::path(trace).replace_extension(".expected"))) << trace;
    }
  }
  for (const auto& entry : fs::directory_iterator(kRoot / "tests" / "rules")) {
    // common/ holds what traces include.
    if (entry.is_directory() && entry.path().filename() != "common") {
      EXPECT_NE(FindRule(entry.path().filename().string()), nullptr) << entry.path() << " is the folder of no rule";
    }
  }
}

/// "RULE kind=NAME" and "RULE note=NAME" of all findings that the traces expect.
std::set<std::string> ExpectedKindsAndNotes() {
  std::set<std::string> expected;
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / "tests" / "rules")) {
    if (entry.path().extension() != ".expected") continue;
    std::istringstream lines(FileText(entry.path()));
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line.substr(0, line.find('#')));
      std::string severity;
      std::string rule;
      words >> severity >> rule;
      for (std::string word; words >> word;) {
        if (word.starts_with("kind=") || word.starts_with("note=")) expected.insert(rule + " " + word);
      }
    }
  }
  return expected;
}

// A sentence that no trace brings about is read by no test: it may be wrong, and its condition may never be true.
// Rules that share a table share its code: a trace of one of them is enough.
TEST(Catalogue, EveryKindAndNoteIsExpectedByATrace) {
  const std::set<std::string> expected = ExpectedKindsAndNotes();
  std::map<const FindingKind*, bool> kinds;
  std::map<const NoteKind*, bool> notes;
  for (const NoteKind* note : kSharedNotes) notes[note] = false;
  for (const RuleInfo* rule : RuleCatalogue()) {
    const std::string id(rule->id);
    for (const FindingKind* kind : rule->kinds) {
      kinds[kind] = kinds[kind] || expected.contains(id + " kind=" + std::string(kind->name));
    }
    for (const NoteKind* note : rule->notes) {
      notes[note] = notes[note] || expected.contains(id + " note=" + std::string(note->name));
    }
    for (const NoteKind* note : kSharedNotes) {
      notes[note] = notes[note] || expected.contains(id + " note=" + std::string(note->name));
    }
  }
  for (const auto& [kind, found] : kinds) EXPECT_TRUE(found) << "kind " << kind->name << ": " << kind->title;
  for (const auto& [note, found] : notes) EXPECT_TRUE(found) << "note " << note->name << ": " << note->text;
}

/// Angle brackets would be tags.
std::string InMarkdown(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '<' ? std::string("\\<") : c == '>' ? std::string("\\>") : std::string(1, c);
  return out;
}

/// The catalogue as Markdown.
std::string RulesPage() {
  std::string page =
      "# Rules\n\n"
      "What `ecaudit check` evaluates, chapter by chapter. `ecaudit explain RULE` prints the same text. This page is "
      "written\n"
      "from the rules themselves (`analyzers/rules/`); `docs/sources.md` lists the documents.\n\n"
      "A rule fires only on what the capture shows. If it lacks a fact, it is silent, and the report gives the reason. "
      "Severities\n"
      "are defaults: `--rule ID=off|info|warning|error` or \"rules\" in `.ecaudit.json` change them.\n";
  for (const std::string_view group : cli::RuleGroups()) {
    page += "\n## " + std::string(group) + "\n\n| rule | severity | fires when |\n|---|---|---|\n";
    for (const RuleInfo* rule : RuleCatalogue()) {
      if (rule->group != group) continue;
      page += "| [`" + std::string(rule->id) + "`](#" + std::string(rule->id) + ") | " +
              std::string(Name(rule->severity)) + " | " + std::string(rule->title) + " |\n";
    }
  }
  for (const std::string_view group : cli::RuleGroups()) {
    for (const RuleInfo* rule : RuleCatalogue()) {
      if (rule->group != group) continue;
      page += "\n## " + std::string(rule->id) + "\n\n" + std::string(rule->title) +
              ". Default: " + std::string(Name(rule->severity)) + ".\n";
      for (const auto& [heading, text] : Parts(rule->doc)) page += "\n### " + heading + "\n" + text;
      page += "\n### Findings\n\n";
      for (const FindingKind* kind : rule->kinds) {
        page += "- `" + std::string(kind->name) + "`: " + InMarkdown(report::OutlineOf(kind->title)) + "\n";
      }
      for (const NoteKind* note : rule->notes) {
        page += "- note `" + std::string(note->name) + "`: " + InMarkdown(report::OutlineOf(note->text)) + "\n";
      }
      page += "\nNeeds: " + std::string(rule->needs) + ". Source: " + std::string(rule->source) + ".\n";
    }
  }
  return page;
}

TEST(Catalogue, PageOfTheRulesIsUpToDate) {
  const fs::path path = kRoot / "docs" / "rules.md";
  if (std::getenv("ECAUDIT_WRITE_DOCS") != nullptr) std::ofstream(path, std::ios::binary) << RulesPage();
  EXPECT_TRUE(FileText(path) == RulesPage())
      << path << " is not what the rules say today: run this test with ECAUDIT_WRITE_DOCS=1 and look at the difference";
}

}  // namespace
}  // namespace ecaudit
