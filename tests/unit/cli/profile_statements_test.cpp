// Each row of a manual is found by what it is about: an address, a code, an object, or its own words. So nothing that a
// profile states is held in vain; tests/build/facts_read.py shows the same of its fields.
#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "cli/lookup/meanings.h"
#include "cli/lookup/phrase_mentions.h"
#include "decoder/device/profile_registry.h"

namespace ecaudit::cli {
namespace {

using lookup::ProfileFact;

/// Rows that state something of a whole section: `ecaudit profiles` prints them as its heading.
constexpr std::string_view kHeadings[] = {"al",    "drive",       "pdo",  "dictionary", "emergency",
                                          "latch", "touch_probe", "sync", "mailbox",    "match"};

std::string_view Part(const ProfileFact& fact, std::string_view key) {
  for (const auto& [name, value] : fact.parts) {
    if (name == key) return value;
  }
  return {};
}

/// Rows without a number of their own, and the words that lead to them.
struct Topic {
  std::string_view path;
  std::vector<std::string> names;
};

const std::vector<Topic>& Topics() {
  static const std::vector<Topic> kTopics{
      {"drive.", {"6040h", "6041h", "6060h"}},
      {"latch.", {"20A4h", "20A5h"}},
      {"mailbox.sync_managers", {"sync manager 0", "sync manager 1", "sync manager 2", "sync manager 3"}},
      {"mailbox.protocols", {"mailbox type"}},
      {"mailbox.sdo_commands", {"SDO command"}},
      {"mailbox.files", {"FoE parameter file"}},
      {"mailbox.layout", {"mailbox byte"}},
      {"mailbox.example", {"mailbox example"}},
      {"mailbox.coe_services", {"CoE service"}},
      {"mailbox.sizes", {"mailbox size"}},
      {"pdo.selectable", {"PDO assignment"}},
      {"pdo.flexible", {"free mapping"}},
      {"sync.cycle_base_ns", {"cycle time"}},
      {"sync.cycle_min_ns", {"cycle time"}},
      {"sync.cycle_by_60c2", {"cycle time"}},
      {"sync.pll", {"PLL"}},
      {"sync.lost", {"loss of synchronisation"}},
      {"sync.jitter", {"permitted jitter"}},
  };
  return kTopics;
}

/// What an engineer has in hand who needs the row: best first.
std::vector<std::string> NamesOf(const ProfileFact& fact) {
  std::vector<std::string> names;
  const std::string_view index = Part(fact, "index");
  if (index.starts_with("0x")) names.push_back(std::string(index.substr(2)) + "h");
  for (const std::string_view key : {"address", "code"}) {
    if (!Part(fact, key).empty()) names.emplace_back(Part(fact, key));
  }
  if (!Part(fact, "from").empty())
    names.push_back(std::string(Part(fact, "from")) + " -> " + std::string(Part(fact, "to")));
  for (const Topic& topic : Topics()) {
    if (fact.path.starts_with(topic.path)) names.insert(names.end(), topic.names.begin(), topic.names.end());
  }
  if (fact.path == "drive.transitions") names.push_back("transition " + std::string(Part(fact, "number")));
  // The code for "no error" is 0, which is no number to look up.
  if (fact.path == "emergency.codes") names.emplace_back(Part(fact, "text"));
  if (fact.path == "facts")
    names.push_back(std::string(Part(fact, "category")) + ", " + std::string(Part(fact, "name")));
  // What has no number and is part of no topic is found by its words, as a search in the manual would find it.
  if (!names.empty()) return names;
  for (const auto& [key, value] : fact.parts) names.push_back(value);
  return names;
}

bool Shows(const std::vector<Meaning>& meanings, const std::string& family, const ProfileFact& fact) {
  return std::any_of(meanings.begin(), meanings.end(), [&](const Meaning& meaning) {
    return std::any_of(meaning.statements.begin(), meaning.statements.end(), [&](const Statement& row) {
      if (row.family != family || row.source != fact.source || row.note != fact.note) return false;
      // The row's own words, where it has any besides numbers.
      bool has_words = false;
      for (const std::string_view key : {"name", "meaning", "text", "action", "fact", "rule", "parameter", "keyword"}) {
        const std::string_view words = Part(fact, key);
        if (words.empty()) continue;
        if (row.text.find(words) != std::string::npos) return true;
        has_words = true;
      }
      return !has_words;
    });
  });
}

TEST(ProfileStatements, ExplainFindsEachRow) {
  const device::DeviceDescription* generic = device::BuiltinProfile("generic");
  ASSERT_NE(generic, nullptr);
  const device::ProfileRegistry registry;
  for (const std::string& id : device::BuiltinProfileNames()) {
    if (id == "generic") continue;
    const device::DeviceDescription* family = device::BuiltinProfile(id);
    ASSERT_NE(family, nullptr) << id;
    const Families families{generic, family};
    // One look-up of each name for all rows.
    std::map<std::string, std::vector<Meaning>> known;
    const auto look_up = [&](const std::string& name) -> const std::vector<Meaning>& {
      const auto [at, fresh] = known.emplace(name, std::vector<Meaning>{});
      if (fresh) {
        // As the command does.
        at->second = LookUp(name, families);
        if (at->second.empty()) lookup::AddMentions(name, families, registry, at->second);
      }
      return at->second;
    };
    std::size_t rows = 0;
    for (const ProfileFact& fact : lookup::FactsOf(device::BuiltinProfileText(id))) {
      if (std::find(std::begin(kHeadings), std::end(kHeadings), fact.path) != std::end(kHeadings)) continue;
      // What the profile takes from another document is found under that one's families.
      if (!fact.source.starts_with(family->document)) continue;
      ++rows;
      const std::vector<std::string> names = NamesOf(fact);
      const bool found = std::any_of(names.begin(), names.end(),
                                     [&](const std::string& name) { return Shows(look_up(name), id, fact); });
      EXPECT_TRUE(found) << id << " " << fact.path << ": " << (names.empty() ? "" : names.front()) << ", "
                         << (fact.parts.empty() ? "" : fact.parts.back().second) << " [" << fact.source << "]";
    }
    EXPECT_GT(rows, 200U) << id;
  }
}

}  // namespace
}  // namespace ecaudit::cli
