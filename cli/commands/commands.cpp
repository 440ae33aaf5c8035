#include "cli/commands/command.h"

namespace ecaudit::cli {

std::vector<std::unique_ptr<Command>> AllCommands() {
  std::vector<std::unique_ptr<Command>> commands;
  commands.push_back(MakeCheckCommand());
  commands.push_back(MakeStartupCommand());
  commands.push_back(MakeDiffCommand());
  commands.push_back(MakeBatchCommand());
  commands.push_back(MakeMergeCommand());
  commands.push_back(MakeDecodeCommand());
  commands.push_back(MakeEventsCommand());
  commands.push_back(MakeSignalsCommand());
  commands.push_back(MakeSliceCommand());
  commands.push_back(MakeAnnotateCommand());
  commands.push_back(MakeWiresharkCommand());
  commands.push_back(MakeAnonymizeCommand());
  commands.push_back(MakeRulesCommand());
  commands.push_back(MakeExplainCommand());
  commands.push_back(MakeProfilesCommand());
  commands.push_back(MakeCompletionCommand());
  return commands;
}

}  // namespace ecaudit::cli
