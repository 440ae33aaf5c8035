/// The program as the system starts it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace ecaudit::system {

/// What was typed after the name of the program.
[[nodiscard]] std::vector<std::string> Arguments(int argc, char** argv);
/// To be called first: bytes go through the standard streams as they are, and a reader that closes a pipe early makes
/// a write fail instead of ending the program.
void PrepareProgram();
/// Where the program lies; empty when unknown.
[[nodiscard]] std::string ProgramPath();
/// A variable of the environment; empty when it is not set.
[[nodiscard]] std::string Environment(const char* name);
/// What local time is ahead of UTC by, at a moment in seconds since 1970.
[[nodiscard]] std::int64_t ZoneSeconds(std::int64_t moment);

}  // namespace ecaudit::system
