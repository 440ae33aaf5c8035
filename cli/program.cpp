#include "cli/program.h"

#include <cstddef>
#include <cstdlib>
#include <exception>
#include <memory>
#include <string_view>

#include "cli/commands/command.h"
#include "cli/console.h"
#include "cli/crash.h"
#include "cli/exit_status.h"
#include "cli/options.h"
#include "cli/suggest.h"
#include "cli/version.h"
#include "decoder/base/system/files.h"
#include "decoder/base/system/names.h"
#include "decoder/base/system/program.h"

namespace ecaudit::cli {
namespace {

/// What a person reads who calls the program by its name alone.
constexpr std::string_view kFirstPage =
    R"(ecaudit reads EtherCAT captures: what happened, where, why, and what to do.

  ecaudit check CAPTURE    findings of a capture, each with cause and remedy; -o html=report.html adds a page with plots
  ecaudit batch FOLDER     all captures of a folder, in parallel, with one summary
  ecaudit explain NAME     a rule, code, fault, object or register: al-refused, 0x001b, F503, 6041h, 0x0130

All commands: ecaudit --help
)";

/// Prints a page on standard output.
ExitStatus Print(Console& console, const std::string& page) {
  if (const auto error = console.Write(page)) {
    console.Error(error->message);
    return ExitStatus::kUsage;
  }
  return ExitStatus::kClean;
}

ExitStatus WrongUsage(Console& console, const std::string& message) {
  console.Error(message);
  return ExitStatus::kUsage;
}

ExitStatus Dispatch(const std::vector<std::string>& arguments, Console& console) {
  const std::vector<std::unique_ptr<Command>> commands = AllCommands();
  if (arguments.empty()) {
    if (!console.output_is_terminal()) return WrongUsage(console, "no command given (see 'ecaudit --help')");
    static_cast<void>(Print(console, std::string(kFirstPage)));
    return ExitStatus::kUsage;
  }
  const std::string& first = arguments.front();
  if (first == "--help" || first == "-h" || (first == "help" && arguments.size() == 1)) {
    return Print(console, ProgramHelp(commands));
  }
  if (first == "--version" || first == "version") return Print(console, VersionPage());
  // 'help check' is 'check --help'.
  if (first == "help") return Dispatch({arguments[1], "--help"}, console);
  if (first.starts_with("-")) {
    return WrongUsage(console, "a command comes first, found '" + first + "' (see 'ecaudit --help')");
  }
  std::vector<std::string_view> names;
  for (const auto& command : commands) {
    names.push_back(command->name());
    if (command->name() != first) continue;
    OptionSet options(command->name(), command->summary());
    command->Declare(options);
    const OptionSet::Parsed parsed = options.Parse({arguments.begin() + 1, arguments.end()});
    switch (parsed.outcome) {
      case OptionSet::Outcome::kHelp:
        return Print(console, parsed.text);
      case OptionSet::Outcome::kError:
        return WrongUsage(console, parsed.text);
      case OptionSet::Outcome::kParsed:
        return command->Run(console);
    }
  }
  if (const std::string path = system::TypedPaths({first}).front(); system::Exists(path)) {
    const bool folder = system::IsFolder(path);
    return WrongUsage(console, folder ? "no command given; to check the captures of the folder: ecaudit batch " + first
                                      : "no command given; to check the capture: ecaudit check " + first);
  }
  return WrongUsage(console, "unknown command '" + first + "'" + Suggestion(first, names, "ecaudit --help"));
}

/// Until a large piece of memory was given back once, glibc returns each freed page at the end of the heap to the
/// system, one call each: some hundred of a small capture, a tenth of the time. After this one it keeps up to 2 MB, as
/// it does in larger captures.
void LetHeapKeepPages() {
  constexpr std::size_t kLarge = std::size_t{1} << 20U;
  void* volatile piece = std::malloc(kLarge);  // never touched; volatile: requested, although it is not used
  std::free(piece);
}

}  // namespace

int RunProgram(const std::vector<std::string>& arguments, std::FILE* out, std::FILE* err) {
  // A reader that closes the pipe early (head, less) must not kill us before the files of -o are written.
  system::PrepareProgram();
  LetHeapKeepPages();
  ListenForCrashes();
  Console console(out, err);
  try {
    return static_cast<int>(Dispatch(arguments, console));
  } catch (const std::exception& e) {
    // We throw nothing ourselves: this is memory exhausted, or a bug.
    console.Error(std::string("internal error: ") + e.what() + "; " + kPleaseReport);
  }
  return static_cast<int>(ExitStatus::kInternal);
}

}  // namespace ecaudit::cli
