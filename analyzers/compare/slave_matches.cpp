#include "analyzers/compare/slave_matches.h"

#include <algorithm>
#include <cstdint>

#include "analyzers/compare/longest_common.h"

namespace ecaudit::startup {
namespace {

bool Fits(const std::optional<std::uint32_t>& a, const std::optional<std::uint32_t>& b) {
  return !a || !b || *a == *b;
}

bool SameDevice(const ExpectedSlave& expected, const SlaveSummary& actual) {
  return Fits(expected.vendor_id, actual.identity.vendor_id) &&
         Fits(expected.product_code, actual.identity.product_code);
}

/// Both sides know what it is, and it is the same.
bool KnownDevice(const ExpectedSlave& expected, const SlaveSummary& actual) {
  return expected.product_code && actual.identity.product_code && SameDevice(expected, actual);
}

/// What is left over on both sides and is the same device was put elsewhere.
void MatchMoved(std::span<const ExpectedSlave> expected, std::span<const SlaveSummary> actual,
                std::vector<SlaveMatch>& matches) {
  std::vector<bool> used(actual.size(), false);
  for (const SlaveMatch& match : matches) {
    if (match.place) used[*match.place] = true;
  }
  for (std::size_t e = 0; e < expected.size(); ++e) {
    for (std::size_t a = 0; a < actual.size() && !matches[e].place; ++a) {
      if (used[a] || !KnownDevice(expected[e], actual[a])) continue;
      matches[e] = {a, true};
      used[a] = true;
    }
  }
}

}  // namespace

std::vector<SlaveMatch> MatchSlaves(std::span<const ExpectedSlave> expected, std::span<const SlaveSummary> actual) {
  std::vector<SlaveMatch> matches(expected.size());
  // An unchanged bus: each slave is where it is expected.
  bool in_place = true;
  std::vector<bool> used(actual.size(), false);
  for (std::size_t e = 0; e < expected.size() && in_place; ++e) {
    const auto found = std::ranges::find(actual, expected[e].position, &SlaveSummary::position);
    const auto place = static_cast<std::size_t>(found - actual.begin());
    // A hand-written expectation may name one position twice.
    in_place = found != actual.end() && !used[place] && SameDevice(expected[e], *found);
    if (!in_place) break;
    matches[e].place = place;
    used[place] = true;
  }
  if (in_place) return matches;
  std::ranges::fill(matches, SlaveMatch{});
  for (const auto& [e, a] : LongestCommon(expected.size(), actual.size(), [&](std::size_t e, std::size_t a) {
         const bool known = expected[e].product_code && actual[a].identity.product_code;
         return SameDevice(expected[e], actual[a]) && (known || expected[e].position == actual[a].position);
       })) {
    matches[e].place = a;
  }
  MatchMoved(expected, actual, matches);
  return matches;
}

}  // namespace ecaudit::startup
