#include <algorithm>
#include <fstream>
#include <functional>
#include <iterator>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "decoder/device/profile_registry.h"
#include "decoder/device/source_documents.h"
#include "tests/support/folders.h"

namespace ecaudit::device {
namespace {

TEST(Sources, CitationsAreSplitAtTheFirstComma) {
  EXPECT_EQ(FirstCitation("AKD-2010, 4.3.4").key, "AKD-2010");
  EXPECT_EQ(FirstCitation("AKD-2010, 4.3.4").section, "4.3.4");
  EXPECT_EQ(FirstCitation("MKD, 4.4.1, 4.4.3; PILZ, 4").section, "4.4.1, 4.4.3");
  EXPECT_EQ(FirstCitation("SSC").key, "SSC");
  EXPECT_EQ(FirstCitation("SSC").section, "");
  EXPECT_EQ(FirstCitation("").key, "");
}

TEST(Sources, DocumentsAreFoundByKey) {
  ASSERT_NE(FindSourceDocument("PILZ"), nullptr);
  EXPECT_NE(FindSourceDocument("PILZ")->title.find("PMCprotego"), std::string_view::npos);
  EXPECT_EQ(FindSourceDocument("pilz"), nullptr);
  EXPECT_EQ(FindSourceDocument(""), nullptr);
  const auto documents = SourceDocuments();
  EXPECT_TRUE(std::is_sorted(documents.begin(), documents.end(),
                             [](const SourceDocument& a, const SourceDocument& b) { return a.key < b.key; }));
}

TEST(Sources, EveryDocumentIsDescribedInTheDocs) {
  std::ifstream stream(test::SourceDir() + "/docs/sources.md");
  const std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  ASSERT_FALSE(text.empty());
  for (const SourceDocument& document : SourceDocuments()) {
    EXPECT_NE(text.find("| `" + std::string(document.key) + "` |"), std::string::npos) << document.key;
  }
}

/// Calls `visit` with every object of the document.
void ForEachObject(const nlohmann::json& value, const std::function<void(const nlohmann::json&)>& visit) {
  if (value.is_object()) visit(value);
  if (!value.is_structured()) return;
  for (const auto& child : value) ForEachObject(child, visit);
}

TEST(Sources, EveryValueOfAProfileCitesAKnownDocument) {
  for (const std::string& name : BuiltinProfileNames()) {
    const auto document = nlohmann::json::parse(BuiltinProfileText(name), nullptr, false);
    ASSERT_TRUE(document.is_object()) << name;
    std::size_t citations = 0;
    ForEachObject(document, [&](const nlohmann::json& object) {
      const auto source = object.find("source");
      if (source == object.end()) return;
      ++citations;
      std::string rest = source->get<std::string>();
      while (!rest.empty()) {
        const Citation citation = FirstCitation(rest);
        EXPECT_NE(FindSourceDocument(citation.key), nullptr) << name << ": " << rest;
        EXPECT_NE(citation.section, "") << name << ": " << rest;
        const std::size_t end = rest.find("; ");
        rest = end == std::string::npos ? "" : rest.substr(end + 2);
      }
    });
    EXPECT_GT(citations, 100U) << name;
    EXPECT_NE(FindSourceDocument(BuiltinProfile(name)->document), nullptr) << name;
  }
}

// Profiles are read by people: no references to lists that are not part of the project.
TEST(Sources, NotesOfProfilesStandAlone) {
  for (const std::string& name : BuiltinProfileNames()) {
    const std::string text = BuiltinProfileText(name);
    for (const char* word : {".csv", "README", "seed"}) {
      EXPECT_EQ(text.find(word), std::string::npos) << name << ": " << word;
    }
  }
}

}  // namespace
}  // namespace ecaudit::device
