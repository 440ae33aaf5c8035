/// What is wrong with the file of a drive family: all of it, each with its line.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "decoder/device/profile_reader.h"

namespace ecaudit::device {

struct ProfileProblem {
  std::size_t line = 0;  ///< from 1
  std::string place;     ///< "al.transitions[3].from"; empty for the document
  std::string what;

  friend bool operator==(const ProfileProblem&, const ProfileProblem&) = default;
};

/// Reads the profile as the program does, continues after each mistake, and compares what it states with itself:
/// states that cannot be reached, codes that no list has, PDOs whose entries do not fit their types or the sync
/// manager, citations of documents that are not named, rows that appear twice.
/// @param lookup  finds the profile it extends
/// @return sorted by line; empty: nothing was found
[[nodiscard]] std::vector<ProfileProblem> CheckProfile(std::string_view text, const ProfileLookup& lookup);

}  // namespace ecaudit::device
