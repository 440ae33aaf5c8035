/// Where tests find files: functions and not macros on every test file, so that two checkouts share what ccache has
/// compiled.
#pragma once

#include <string>

namespace ecaudit::test {

/// The root of the project's sources.
std::string SourceDir();

/// Captures and reference tables beside the project, or the folder that the variable ECAUDIT_SHARED_DIR names. Tests
/// that need them skip with a message where they are absent; tests/needs.txt lists these tests.
std::string SharedDir();

}  // namespace ecaudit::test
