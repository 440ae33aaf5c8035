#include "tests/unit/analyzers/sentence_check.h"

#include <algorithm>
#include <regex>
#include <sstream>

#include "cli/report/sentences.h"

namespace ecaudit::test {
namespace {

constexpr std::size_t kTitleLength = 70;
constexpr std::string_view kAxis = "Axis 2: ";
constexpr std::size_t kWordsOfASentence = 25;
constexpr std::size_t kEntriesOfAList = 2;

Value Shortened(const Value& value) {
  Value out = value;
  const bool bytes = value.type == Value::Type::kBytes;
  if (value.type == Value::Type::kCode) {
    out.SetText({});
  } else if (!bytes && value.text().find(' ') != std::string::npos) {
    out.SetText("name");
  }
  if (value.type == Value::Type::kList) {
    std::vector<Value> items;
    for (std::size_t i = 0; i < std::min(kEntriesOfAList, value.items().size()); ++i) {
      items.push_back(Shortened(value.items()[i]));
    }
    out.SetItems(std::move(items));
  }
  return out;
}

Arguments Shortened(const Arguments& arguments) {
  Arguments out;
  for (const Argument& argument : arguments) out.Set(argument.name, Shortened(argument.value));
  return out;
}

std::size_t NumberOfWords(const std::string& sentence) {
  std::istringstream words(sentence);
  std::size_t number = 0;
  for (std::string word; words >> word;) ++number;
  return number;
}

}  // namespace

std::vector<std::string> ProblemsOfSentences(const Finding& finding) {
  Finding skeleton = finding;
  skeleton.arguments = Shortened(finding.arguments);
  for (Note& note : skeleton.notes) note.arguments = Shortened(note.arguments);
  const report::Sentences sentences = report::SentencesOf(skeleton, {});
  const std::string where = std::string(finding.rule) + " " + std::string(finding.kind->name) + ": ";
  std::vector<std::string> problems;
  if (sentences.title.size() > kTitleLength + (finding.axis == 0 ? 0 : kAxis.size())) {
    problems.push_back(where + "title of " + std::to_string(sentences.title.size()) +
                       " characters: " + sentences.title);
  }
  static const std::regex missing(R"(\?[a-z_0-9]+\?)");
  static const std::regex marks(R"(\.\.(?!\.)|\.,|,\.|  | [,.;)]|\( )");
  static const std::regex end(R"([.!?:]( |$))");
  for (const std::string& text : {sentences.title, sentences.message, sentences.next}) {
    if (std::regex_search(text, missing)) problems.push_back(where + "an argument is missing: " + text);
    if (std::regex_search(text, marks)) problems.push_back(where + "blanks or full stops: " + text);
    std::sregex_token_iterator sentence(text.begin(), text.end(), end, -1);
    for (; sentence != std::sregex_token_iterator(); ++sentence) {
      if (NumberOfWords(sentence->str()) <= kWordsOfASentence) continue;
      problems.push_back(where + std::to_string(NumberOfWords(sentence->str())) + " words: " + sentence->str());
    }
  }
  return problems;
}

}  // namespace ecaudit::test
