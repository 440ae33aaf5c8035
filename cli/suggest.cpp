#include "cli/suggest.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <numeric>
#include <vector>

namespace ecaudit::cli {
namespace {

/// Letters to insert, delete or replace (Levenshtein).
std::size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0U : 1U)});
      diagonal = above;
    }
  }
  return row[b.size()];
}

/// Upper and lower case count as the same.
bool Contains(std::string_view text, std::string_view part) {
  const auto same = [](unsigned char a, unsigned char b) { return std::tolower(a) == std::tolower(b); };
  return std::search(text.begin(), text.end(), part.begin(), part.end(), same) != text.end();
}

}  // namespace

std::string_view Nearest(std::string_view typed, std::span<const std::string_view> candidates) {
  constexpr std::size_t kLongestTyped = 100;
  if (typed.empty() || typed.size() > kLongestTyped) return {};
  std::string_view best;
  std::size_t best_distance = std::max<std::size_t>(1, typed.size() / 3) + 1;
  for (const std::string_view candidate : candidates) {
    // A beginning that is typed out far enough counts as one mistake: 'kollmorgen-akd' for 'kollmorgen-akd-2011'.
    const bool beginning = typed.size() >= 3 && candidate.starts_with(typed);
    const std::size_t distance = beginning ? 1 : EditDistance(typed, candidate);
    if (distance < best_distance) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

std::string Suggestion(std::string_view typed, std::span<const std::string_view> candidates, std::string_view hint) {
  // A part of several names: 'akd' of kollmorgen-akd-2010 and kollmorgen-akd-2011. All are named where they are few.
  constexpr std::size_t kFewNames = 6;
  std::vector<std::string_view> holding;
  for (const std::string_view candidate : candidates) {
    if (typed.size() >= 3 && Contains(candidate, typed)) holding.push_back(candidate);
  }
  if (!holding.empty() && holding.size() <= kFewNames) {
    std::string text = " (did you mean";
    for (const std::string_view& candidate : holding) {
      if (&candidate != &holding.front()) text += &candidate == &holding.back() ? " or" : ",";
      text += " '" + std::string(candidate) + "'";
    }
    return text + "?)";
  }
  if (const std::string_view near = Nearest(typed, candidates); !near.empty()) {
    return " (did you mean '" + std::string(near) + "'?)";
  }
  return hint.empty() ? std::string() : " (see '" + std::string(hint) + "')";
}

}  // namespace ecaudit::cli
