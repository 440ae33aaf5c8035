#include "cli/pages/command_table.h"

#include <algorithm>

#include "cli/commands/command.h"

namespace ecaudit::cli {

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

}  // namespace ecaudit::cli
