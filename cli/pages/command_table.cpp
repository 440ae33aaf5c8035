#include "cli/pages/command_table.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "analyzers/judge/catalogue.h"
#include "analyzers/result/rule_info.h"
#include "cli/commands/command.h"
#include "decoder/device/profile_registry.h"

namespace ecaudit::cli {
namespace {

std::vector<std::string> RuleIds(std::string_view suffix) {
  std::vector<std::string> ids;
  for (const RuleInfo* rule : RuleCatalogue()) ids.push_back(std::string(rule->id) + std::string(suffix));
  return ids;
}

/// The words of `known` that the help of an option names: each command has formats of its own.
std::vector<std::string> WordsIn(std::string_view help, std::initializer_list<std::string_view> known) {
  std::vector<std::string> words;
  for (const std::string_view word : known) {
    for (std::size_t at = help.find(word); at != std::string_view::npos; at = help.find(word, at + 1)) {
      const bool begins = at == 0 || std::isalnum(static_cast<unsigned char>(help[at - 1])) == 0;
      const std::size_t end = at + word.size();
      const bool ends = end == help.size() || std::isalnum(static_cast<unsigned char>(help[end])) == 0;
      if (!begins || !ends) continue;
      words.emplace_back(word);
      break;
    }
  }
  return words;
}

}  // namespace

std::vector<CommandRow> CommandTable() {
  std::vector<CommandRow> table;
  for (const std::unique_ptr<Command>& command : AllCommands()) {
    OptionSet options(command->name(), command->summary());
    command->Declare(options);
    table.push_back({std::string(command->name()), std::string(command->usage()), std::string(command->summary()),
                     options.rows(), options.footer()});
  }
  return table;
}

std::vector<std::string> NamesOf(const OptionSet::Row& row) {
  std::vector<std::string> names;
  for (std::size_t at = 0; at <= row.names.size();) {
    const std::size_t comma = std::min(row.names.find(',', at), row.names.size());
    names.push_back(row.names.substr(at, comma - at));
    at = comma + 1;
  }
  return names;
}

std::vector<std::string> ValuesOf(std::string_view command, const OptionSet::Row& row) {
  const std::string long_name = NamesOf(row).back();
  if (row.argument) {
    if (command == "explain") return RuleIds("");
    if (command == "profiles") return device::BuiltinProfileNames();
    if (row.names == "SHELL") return {"bash", "zsh", "fish"};
    return {};
  }
  if (long_name == "--profile" || long_name == "--from-family") return device::BuiltinProfileNames();
  if (long_name == "--from" && command == "profiles") return device::BuiltinProfileNames();
  if (long_name == "--rule") return RuleIds("=");
  if (long_name == "--fail-on") return {"error", "warning", "info", "never"};
  if (long_name == "--time") return WordsIn(row.help, {"relative", "utc", "local"});
  if (long_name == "--format") {
    return WordsIn(row.help, {"text", "json", "jsonl", "csv", "html", "junit", "sarif", "summary"});
  }
  return {};
}

}  // namespace ecaudit::cli
