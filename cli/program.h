/// The program after main(): finds the command, parses its options, runs it.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

namespace ecaudit::cli {

/// @param arguments  without the program's name
/// @return the exit status, see exit_status.h
int RunProgram(const std::vector<std::string>& arguments, std::FILE* out, std::FILE* err);

}  // namespace ecaudit::cli
