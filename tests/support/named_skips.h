/// A test may skip only if tests/needs.txt states what it needs; else it fails. So no test is lost in silence.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "decoder/base/result.h"

namespace ecaudit::test {

/// One line of tests/needs.txt: what a test needs that a machine may lack, and its name.
struct Need {
  std::string what;  ///< "shared", "tshark", ...
  std::string test;  ///< PROGRAM.SUITE.NAME; `*` stands for any characters
};

/// Reads the text of tests/needs.txt. The error names the line.
[[nodiscard]] Result<std::vector<Need>> ParseNeeds(std::string_view text);

/// True when `name` is `pattern`, in which each `*` stands for any characters.
[[nodiscard]] bool MatchesPattern(std::string_view pattern, std::string_view name);

/// Why the skipped test should not have skipped; empty when it may.
/// @param shared true when the folder of SharedDir() is there
[[nodiscard]] std::string ProblemOfSkip(std::string_view test, const std::vector<Need>& needs, bool shared);

/// From now on each test of this program that skips without a line in tests/needs.txt fails.
/// @param program the first part of its names there
/// @return true, for a constant that is initialised before main()
bool ExpectNamedSkips(std::string program);

}  // namespace ecaudit::test
