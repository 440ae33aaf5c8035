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
  /// @param usage    name and arguments for the overview: "check CAPTURE..."
  /// @param summary  one line for the overview and the help
  Command(std::string_view name, std::string_view usage, std::string_view summary)
      : name_(name), usage_(usage), summary_(summary) {}
  Command(const Command&) = delete;
  Command& operator=(const Command&) = delete;
  virtual ~Command() = default;

  [[nodiscard]] std::string_view name() const { return name_; }
  [[nodiscard]] std::string_view usage() const { return usage_; }
  [[nodiscard]] std::string_view summary() const { return summary_; }
  /// Declares what the command takes; the targets are members of the command.
  virtual void Declare(OptionSet& options) = 0;
  /// Does the work after parsing. What goes wrong is reported on `console`, once.
  [[nodiscard]] virtual ExitStatus Run(Console& console) = 0;

 private:
  std::string_view name_, usage_, summary_;
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
