#include "cli/lookup/phrase_mentions.h"

#include <algorithm>
#include <cctype>

#include "decoder/base/text.h"
#include "decoder/device/json_cursor.h"
#include "decoder/device/profile_registry.h"

namespace ecaudit::cli::lookup {
namespace {

using Parts = std::vector<std::pair<std::string, std::string>>;

/// Rows of a long dictionary that mention the same word.
constexpr std::size_t kMostStatements = 30;
/// A row that is longer is shown by what mentions the word alone.
constexpr std::size_t kShortRow = 200;

bool IsRow(JsonValue value) {
  return value.is_object() && value.member("source").is_text();
}

std::string Scalar(JsonValue value) {
  if (const std::string_view* text = value.text()) return std::string(*text);
  if (const auto number = value.integer()) return std::to_string(*number);
  if (const auto number = value.number()) return std::to_string(*number);
  if (const auto flag = value.boolean()) return *flag ? "yes" : "no";
  return {};
}

/// A value without rows of its own: "F125, n125", "3496h:1".
std::string Flat(JsonValue value) {
  if (value.is_array()) {
    std::string all;
    for (const JsonValue& element : value.Elements()) {
      const std::string text = Flat(element);
      if (!text.empty()) all += (all.empty() ? "" : ", ") + text;
    }
    return all;
  }
  if (!value.is_object()) return Scalar(value);
  if (IsRow(value)) return {};
  std::string all;
  for (const JsonMember& member : value.Members()) {
    const std::string text = Flat(member.value);
    if (!text.empty()) all += (all.empty() ? "" : " ") + std::string(member.key) + " " + text;
  }
  return all;
}

void Collect(JsonValue value, const std::string& path, std::vector<ProfileFact>& out) {
  if (value.is_array()) {
    for (const JsonValue& element : value.Elements()) Collect(element, path, out);
    return;
  }
  if (!value.is_object()) return;
  if (IsRow(value)) {
    ProfileFact fact{path, {}, Scalar(value.member("note")), Scalar(value.member("source"))};
    for (const JsonMember& member : value.Members()) {
      const bool apart = member.key == "note" || member.key == "source";
      // What rules need of a row and no reader does.
      const bool inner = member.key == "rules" || member.key == "basis";
      if (apart || inner || IsRow(member.value)) continue;
      std::string text = Flat(member.value);
      if (!text.empty()) fact.parts.emplace_back(std::string(member.key), std::move(text));
    }
    out.push_back(std::move(fact));
  }
  for (const JsonMember& member : value.Members()) {
    Collect(member.value, path.empty() ? std::string(member.key) : path + "." + std::string(member.key), out);
  }
}

bool InWord(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

char Lower(char c) {
  return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
}

std::string TextOf(const Parts& parts, std::string_view word) {
  const auto join = [&](bool all) {
    std::string text;
    for (const auto& [key, value] : parts) {
      if (!all && !HasWords(value, word)) continue;
      text += (text.empty() ? "" : "; ") + key + " " + value;
    }
    return text;
  };
  std::string text = join(true);
  if (text.size() <= kShortRow) return text;
  std::string part = join(false);
  return part.empty() ? Shortened(text, kShortRow) : part;
}

bool Cited(const std::vector<Meaning>& meanings, const std::string& family, const ProfileFact& fact) {
  return std::ranges::any_of(meanings, [&](const Meaning& meaning) {
    return std::ranges::any_of(meaning.statements, [&](const Statement& statement) {
      if (statement.family != family || statement.source != fact.source) return false;
      return std::ranges::any_of(fact.parts, [&](const auto& part) {
        const bool words = part.first == "text" || part.first == "name" || part.first == "meaning";
        return words && statement.text.find(part.second) != std::string::npos;
      });
    });
  });
}

}  // namespace

std::vector<ProfileFact> FactsOf(std::string_view profile_text) {
  std::vector<ProfileFact> facts;
  const Result<JsonDocument> document = device::ParseJson(profile_text);
  if (document) Collect(document->root(), {}, facts);
  return facts;
}

bool HasWords(std::string_view text, std::string_view words) {
  if (words.empty() || words.size() > text.size()) return false;
  for (std::size_t at = 0; at + words.size() <= text.size(); ++at) {
    const bool same = std::equal(words.begin(), words.end(), text.begin() + static_cast<std::ptrdiff_t>(at),
                                 [](char a, char b) { return Lower(a) == Lower(b); });
    if (!same || (at > 0 && InWord(text[at - 1]))) continue;
    const std::size_t end = at + words.size();
    if (end == text.size() || !InWord(text[end])) return true;
  }
  return false;
}

void AddMentions(std::string_view what, const Families& families, const device::ProfileRegistry& registry,
                 std::vector<Meaning>& out) {
  // A single word is in too many sentences: names are found by LookUp().
  if (what.find_first_of(" .") == std::string_view::npos) return;
  Meaning meaning{.kind = "in the manuals", .name = std::string(what), .details = {}, .statements = {}};
  std::size_t more = 0;
  for (const device::DeviceDescription* family : families) {
    for (const ProfileFact& fact : FactsOf(registry.Text(family->id))) {
      const bool mentioned =
          std::ranges::any_of(fact.parts, [&](const auto& part) { return HasWords(part.second, what); });
      if (!mentioned && !HasWords(fact.note, what)) continue;
      const std::string id = family->id == "generic" ? "standard" : family->id;
      if (Cited(out, id, fact)) continue;
      if (meaning.statements.size() == kMostStatements) {
        ++more;
        continue;
      }
      meaning.statements.push_back({id, fact.path + ": " + TextOf(fact.parts, what), fact.note, fact.source});
    }
  }
  if (meaning.statements.empty()) return;
  if (more > 0) meaning.details.emplace_back("left out", Count(more, "more row"));
  out.push_back(std::move(meaning));
}

}  // namespace ecaudit::cli::lookup
