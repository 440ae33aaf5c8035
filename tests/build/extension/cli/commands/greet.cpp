/// `ecaudit greet`: here only to show how commands are added.
#include <memory>

#include "cli/commands/command.h"

namespace ecaudit::cli {
namespace {

class GreetCommand : public Command {
 public:
  GreetCommand() : Command("greet", "greet", "Say hello") {}
  void Declare(OptionSet& /*options*/) override {}
  [[nodiscard]] ExitStatus Run(Console& console) override {
    return console.Write("hello\n") ? ExitStatus::kUsage : ExitStatus::kClean;
  }
};

}  // namespace

std::unique_ptr<Command> MakeGreetCommand() {
  return std::make_unique<GreetCommand>();
}

}  // namespace ecaudit::cli
