/// All commands with their options, as their help has them: what man pages and completion are made of.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "cli/options.h"

namespace ecaudit::cli {

struct CommandRow {
  std::string name;
  std::string usage;
  std::string summary;
  std::vector<OptionSet::Row> options;
  std::string footer;
};

/// In the order of the overview.
[[nodiscard]] std::vector<CommandRow> CommandTable();

/// "-o,--output" in its parts.
[[nodiscard]] std::vector<std::string> NamesOf(const OptionSet::Row& row);

/// The script for one shell: "bash", "zsh" or "fish"; empty for another.
[[nodiscard]] std::string CompletionScript(std::string_view shell);
/// A man page in the language of man(7).
/// @param command  null: the page of the program
[[nodiscard]] std::string ManPage(const CommandRow* command, const std::vector<CommandRow>& all);

}  // namespace ecaudit::cli
