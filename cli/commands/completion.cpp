/// `ecaudit completion bash|zsh|fish`: what the shell offers at the tabulator key. `ecaudit completion man` writes man
/// pages, which the build installs.
#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "cli/commands/command.h"
#include "cli/pages/command_table.h"

namespace ecaudit::cli {
namespace {

class CompletionCommand : public Command {
 public:
  CompletionCommand() : Command("completion", "completion SHELL", "Write the completion for bash, zsh or fish") {}

  void Declare(OptionSet& options) override {
    options.Argument("SHELL", shell_, "bash, zsh or fish; man: the manual page instead", true);
    options.Words({"bash", "zsh", "fish", "man"});
    options.Value("--command", "COMMAND", command_, "with man: the page of this command (default: of the program)");
    options.Footer(
        "\n  source <(ecaudit completion bash)                    # for this shell; in ~/.bashrc for all\n"
        "  ecaudit completion zsh > ~/.zfunc/_ecaudit           # a folder of $fpath\n"
        "  ecaudit completion fish > ~/.config/fish/completions/ecaudit.fish\n"
        "Packages install these and the man pages.");
  }

  [[nodiscard]] ExitStatus Run(Console& console) override {
    if (command_ && *shell_ != "man") return Fail(console, Error{"--command belongs to man"});
    std::string text;
    if (*shell_ == "man") {
      const std::vector<CommandRow> table = CommandTable();
      const CommandRow* wanted = nullptr;
      if (command_) {
        const auto found = std::ranges::find(table, *command_, &CommandRow::name);
        if (found == table.end()) return Fail(console, Error{"unknown command '" + *command_ + "'"});
        wanted = &*found;
      }
      text = ManPage(wanted, table);
    } else {
      text = CompletionScript(*shell_);
      if (text.empty()) return Fail(console, Error{"unknown shell '" + *shell_ + "' (bash, zsh, fish)"});
    }
    if (const auto error = console.Write(text)) return Fail(console, *error);
    return ExitStatus::kClean;
  }

 private:
  std::optional<std::string> shell_;
  std::optional<std::string> command_;
};

}  // namespace

std::unique_ptr<Command> MakeCompletionCommand() {
  return std::make_unique<CompletionCommand>();
}

}  // namespace ecaudit::cli
