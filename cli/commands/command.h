/// A subcommand: one file in this folder, and one line in commands.cpp.
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include "cli/console.h"
#include "cli/exit_status.h"
#include "cli/options.h"

namespace ecaudit::cli {

class Command {
 public:
  Command() = default;
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;
  virtual ~Command() = default;

  [[nodiscard]] virtual std::string_view name() const = 0;
  /// Name and arguments for the overview: "check CAPTURE...".
  [[nodiscard]] virtual std::string_view usage() const = 0;
  /// One line for the overview and the help.
  [[nodiscard]] virtual std::string_view summary() const = 0;
  /// Declares what the command takes; the targets are members of the command.
  virtual void Declare(OptionSet& options) = 0;
  /// Does the work after parsing. What goes wrong is reported on `console`, once.
  [[nodiscard]] virtual ExitStatus Run(Console& console) = 0;
};

[[nodiscard]] std::unique_ptr<Command> MakeCheckCommand();
[[nodiscard]] std::unique_ptr<Command> MakeStartupCommand();
[[nodiscard]] std::unique_ptr<Command> MakeDiffCommand();
[[nodiscard]] std::unique_ptr<Command> MakeBatchCommand();
[[nodiscard]] std::unique_ptr<Command> MakeMergeCommand();
[[nodiscard]] std::unique_ptr<Command> MakeDecodeCommand();
[[nodiscard]] std::unique_ptr<Command> MakeEventsCommand();
[[nodiscard]] std::unique_ptr<Command> MakeSignalsCommand();
[[nodiscard]] std::unique_ptr<Command> MakeSliceCommand();
[[nodiscard]] std::unique_ptr<Command> MakeAnnotateCommand();
[[nodiscard]] std::unique_ptr<Command> MakeAnonymizeCommand();
[[nodiscard]] std::unique_ptr<Command> MakeWiresharkCommand();
[[nodiscard]] std::unique_ptr<Command> MakeRulesCommand();
[[nodiscard]] std::unique_ptr<Command> MakeExplainCommand();
[[nodiscard]] std::unique_ptr<Command> MakeProfilesCommand();
[[nodiscard]] std::unique_ptr<Command> MakeCompletionCommand();

/// All of them, in the order of the overview.
[[nodiscard]] std::vector<std::unique_ptr<Command>> AllCommands();

}  // namespace ecaudit::cli
