/// `ecaudit greet`: here only to show how commands are added.
#include <memory>

#include "cli/commands/command.h"

namespace ecaudit::cli {
namespace {

class GreetCommand : public Command {
 public:
  [[nodiscard]] std::string_view name() const override { return "greet"; }
  [[nodiscard]] std::string_view usage() const override { return "greet"; }
  [[nodiscard]] std::string_view summary() const override { return "Say hello"; }
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
