#include "decoder/device/profile_check.h"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "decoder/base/json.h"
#include "decoder/base/json_places.h"
#include "decoder/device/profile_consistency.h"

namespace ecaudit::device {
namespace {

/// A mistake more than this and the file is something else.
constexpr std::size_t kMostProblems = 500;

/// The text of a profile from which what is wrong is cut out, so that reading can continue after it. Cut parts become
/// spaces and inserted ones are remembered, so every byte still knows its place in the original.
class Draft {
 public:
  explicit Draft(std::string_view text) : text_(text) {
    for (std::size_t i = 0; i <= text.size(); ++i) origin_.push_back(i);
  }

  [[nodiscard]] const std::string& text() const { return text_; }
  [[nodiscard]] std::size_t Origin(std::size_t offset) const { return origin_[std::min(offset, origin_.size() - 1)]; }

  /// Cuts a value, with its key and one comma.
  void Cut(const JsonPlace& place) {
    std::size_t begin = place.outer;
    std::size_t end = place.end;
    const std::size_t behind = text_.find_first_not_of(" \t\r\n", end);
    if (behind != std::string::npos && text_[behind] == ',') {
      end = behind + 1;
    } else if (const std::size_t before = text_.find_last_not_of(" \t\r\n", begin - 1);
               begin > 0 && before != std::string::npos && text_[before] == ',') {
      begin = before;
    }
    for (std::size_t i = begin; i < end; ++i) {
      if (text_[i] != '\n') text_[i] = ' ';
    }
  }

  /// Puts a member at the beginning of an object.
  void InsertMember(const JsonPlace& object, const std::string& member) {
    const std::size_t at = object.begin + 1;
    const std::size_t next = text_.find_first_not_of(" \t\r\n", at);
    const std::string inserted = member + (next != std::string::npos && text_[next] == '}' ? "" : ",");
    text_.insert(at, inserted);
    origin_.insert(origin_.begin() + static_cast<std::ptrdiff_t>(at), inserted.size(), Origin(at));
  }

 private:
  std::string text_;
  std::vector<std::size_t> origin_;
};

/// "al.transitions[3].from: ..." in its two parts; "document" is the whole.
std::pair<std::string, std::string> Split(const std::string& message) {
  const std::size_t colon = message.find(": ");
  if (colon == std::string::npos) return {"", message};
  std::string path = message.substr(0, colon);
  if (path == "document") path.clear();
  return {std::move(path), message.substr(colon + 2)};
}

/// The key in `"KEY" is missing` or `unknown key "KEY"`; empty for other texts.
std::string KeyIn(const std::string& what, std::string_view before, std::string_view behind) {
  if (what.size() < before.size() + behind.size() || !what.starts_with(before) || !what.ends_with(behind)) return {};
  return what.substr(before.size(), what.size() - before.size() - behind.size());
}

std::string Joined(const std::string& path, const std::string& key) {
  return path.empty() ? key : path + "." + key;
}

/// The innermost element of a list that holds `path`; `path` itself where there is none. What fails in a row is cut out
/// with its row: what is left of it may not be complete.
std::string RowOf(const std::string& path) {
  const std::size_t bracket = path.rfind(']');
  return bracket == std::string::npos ? path : path.substr(0, bracket + 1);
}

class Check {
 public:
  Check(std::string_view text, const ProfileLookup& lookup)
      : original_(text), original_places_(text), draft_(text), lookup_(lookup) {}

  std::vector<ProfileProblem> Run() {
    const JsonReading reading = ReadJson(original_);
    if (!reading.document) {
      problems_.push_back({LineOf(original_, reading.position == 0 ? 0 : reading.position - 1), {}, reading.problem});
      return std::move(problems_);
    }
    if (!reading.document->root().is_object()) {
      problems_.push_back({1, {}, "expected an object"});
      return std::move(problems_);
    }
    for (const auto& [path, place] : original_places_.repeated()) {
      AddAt(place.outer, path, "the object has this key already");
    }
    CutRepeated();
    CutRowsThatStandTwice(reading.document->root());
    const std::optional<DeviceDescription> description = ReadToTheEnd();
    CheckConsistency(reading.document->root(), description ? &*description : nullptr,
                     [this](const std::string& path, std::string what) { AddOnce(path, std::move(what)); });
    std::ranges::stable_sort(problems_, {}, &ProfileProblem::line);
    return std::move(problems_);
  }

 private:
  void AddAt(std::size_t offset, const std::string& path, std::string what) {
    problems_.push_back({LineOf(original_, offset), path, std::move(what)});
  }
  void Add(const std::string& path, std::string what) {
    const JsonPlace* place = original_places_.Find(path);
    AddAt(place == nullptr ? 0 : place->outer, path, std::move(what));
  }
  /// A row that could not be read is not compared with others, too.
  void AddOnce(const std::string& path, std::string what) {
    const JsonPlace* place = original_places_.Find(path);
    const std::size_t line = LineOf(original_, place == nullptr ? 0 : place->outer);
    const std::string row = RowOf(path);
    const bool known = std::ranges::any_of(problems_, [&](const ProfileProblem& problem) {
      return problem.line == line && (problem.place == path || unread_.contains(row));
    });
    if (!known) problems_.push_back({line, path, std::move(what)});
  }

  void CutRepeated() {
    for (std::size_t rounds = 0; rounds < kMostProblems; ++rounds) {
      const JsonPlaces places(draft_.text());
      if (places.repeated().empty()) return;
      draft_.Cut(places.repeated().front().second);
    }
  }

  /// The reader reports of a list only that some row appears twice.
  void CutRowsThatStandTwice(JsonValue root) {
    std::vector<std::string> rows =
        RowsThatStandTwice(root, [this](const std::string& path, std::string what) { Add(path, std::move(what)); });
    const JsonPlaces places(draft_.text());
    // From the end, so that a cut does not change the paths of those before it.
    for (auto row = rows.rbegin(); row != rows.rend(); ++row) {
      if (!unread_.insert(*row).second) continue;
      if (const JsonPlace* place = places.Find(*row)) draft_.Cut(*place);
    }
  }

  /// Reads, cuts out what fails, and reads again.
  std::optional<DeviceDescription> ReadToTheEnd() {
    while (problems_.size() < kMostProblems) {
      Result<DeviceDescription> read = ReadProfile(draft_.text(), lookup_);
      if (read) return std::move(*read);
      const auto [path, what] = Split(read.error().message);
      const JsonPlaces places(draft_.text());
      if (!ContinueAfter(path, what, places)) return std::nullopt;
    }
    return std::nullopt;
  }

  /// The path in the original of a value that the draft has at `place`.
  [[nodiscard]] std::string OriginalPath(const std::string& path, const JsonPlace& place) const {
    const std::size_t at = draft_.Origin(place.begin);
    if (const JsonPlace* same = original_places_.Find(path); same != nullptr && same->begin == at) return path;
    // An element before it was cut out: its number has grown since.
    const std::string row = RowOf(path);
    const std::size_t bracket = row.rfind('[');
    if (bracket == std::string::npos) return path;
    const std::string list = row.substr(0, bracket);
    for (std::size_t index = 0; index < 100'000; ++index) {
      const std::string candidate = list + "[" + std::to_string(index) + "]" + path.substr(row.size());
      const JsonPlace* found = original_places_.Find(candidate);
      if (found != nullptr && found->begin == at) return candidate;
      if (original_places_.Find(list + "[" + std::to_string(index) + "]") == nullptr) break;
    }
    return path;
  }

  bool ContinueAfter(const std::string& path, const std::string& what, const JsonPlaces& places) {
    const JsonPlace* place = places.Find(path);
    if (place == nullptr) {
      Add(path, what);
      return false;
    }
    if (std::string key = KeyIn(what, "unknown key \"", "\""); !key.empty()) {
      const std::string member = Joined(path, key);
      const JsonPlace* at = places.Find(member);
      if (at == nullptr) return Add(path, what), false;
      AddAt(draft_.Origin(at->outer), OriginalPath(path, *place), what);
      draft_.Cut(*at);
      return true;
    }
    std::string missing = KeyIn(what, "\"", "\" is missing");
    const bool empty = missing.empty() && (what == "\"source\" is empty" || what == "\"id\" is empty");
    if (empty) missing = what.substr(1, what.find('"', 1) - 1);
    const std::string original = OriginalPath(path, *place);
    AddAt(draft_.Origin(empty ? places.Find(Joined(path, missing))->outer : place->outer), original, what);
    if (!missing.empty() && (path.empty() || missing == "source")) {
      if (empty) draft_.Cut(*places.Find(Joined(path, missing)));
      const JsonPlaces now(draft_.text());
      draft_.InsertMember(*now.Find(path),
                          "\"" + missing + "\":\"" + (missing == "schema" ? "ecaudit.profile/1" : "?") + "\"");
      return true;
    }
    if (path.empty()) {
      // "schema" is another one: the rest may be anything.
      return false;
    }
    const std::string row = RowOf(path);
    unread_.insert(RowOf(original));
    draft_.Cut(*places.Find(row));
    return true;
  }

  std::string_view original_;
  JsonPlaces original_places_;
  Draft draft_;
  const ProfileLookup& lookup_;
  std::vector<ProfileProblem> problems_;
  std::set<std::string> unread_;  ///< rows of the original that the description lacks
};

}  // namespace

std::vector<ProfileProblem> CheckProfile(std::string_view text, const ProfileLookup& lookup) {
  return Check(text, lookup).Run();
}

}  // namespace ecaudit::device
