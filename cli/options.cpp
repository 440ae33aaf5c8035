#include "cli/options.h"

#include <algorithm>
#include <utility>

#include <CLI/CLI.hpp>

#include "cli/commands/command.h"
#include "cli/suggest.h"
#include "decoder/base/system/files.h"
#include "decoder/base/system/names.h"

namespace ecaudit::cli {
namespace {

/// CLI11's help without the marks for repetition and duty, which our help texts put in words.
class PlainFormatter : public CLI::Formatter {
 public:
  [[nodiscard]] std::string make_option_opts(const CLI::Option* option) const override {
    return option->get_type_name().empty() ? "" : " " + option->get_type_name();
  }
};

/// Runs of empty lines, which CLI11 puts between groups, become one.
std::string WithoutDoubleBlanks(std::string text) {
  for (std::size_t at = text.find("\n\n\n"); at != std::string::npos; at = text.find("\n\n\n", at)) text.erase(at, 1);
  return text;
}

}  // namespace

struct OptionSet::Impl {
  explicit Impl(std::string_view command, std::string_view summary)
      : app(std::string(summary), "ecaudit " + std::string(command)), name(command) {
    app.set_help_flag("-h,--help", "This page");
    // On Windows "/x" would be an option: there, too, it names a file.
    app.allow_windows_style_options(false);
    const auto formatter = std::make_shared<PlainFormatter>();
    formatter->column_width(30);
    formatter->label("Positionals", "Arguments");
    app.formatter(formatter);
  }

  void InGroup(CLI::Option* option) const {
    if (!group.empty()) option->group(group);
  }

  [[nodiscard]] std::string Hint() const { return "ecaudit " + name + " --help"; }

  /// One line for an argument that nothing takes.
  [[nodiscard]] std::string Unexpected(const std::string& argument) const {
    if (argument.size() < 2 || argument.front() != '-') {
      return "unexpected argument '" + argument + "' (see '" + Hint() + "')";
    }
    std::vector<std::string> names{"--help"};
    for (const CLI::Option* option : app.get_options()) {
      for (const std::string& long_name : option->get_lnames()) names.push_back("--" + long_name);
    }
    const std::vector<std::string_view> views(names.begin(), names.end());
    const std::string typed = argument.substr(0, argument.find('='));
    return "unknown option '" + typed + "'" + Suggestion(typed, views, Hint());
  }

  CLI::App app;
  std::string name;
  std::string group;
  std::string footer;
  std::vector<Row> rows;
  std::vector<std::string>* paths = nullptr;  ///< where Arguments() puts them
};

OptionSet::OptionSet(std::string_view command, std::string_view summary)
    : impl_(std::make_unique<Impl>(command, summary)) {}

OptionSet::~OptionSet() = default;

void OptionSet::Group(std::string heading) {
  impl_->group = std::move(heading);
}

const std::vector<OptionSet::Row>& OptionSet::rows() const {
  return impl_->rows;
}

const std::string& OptionSet::footer() const {
  return impl_->footer;
}

void OptionSet::Flag(const std::string& names, bool& target, const std::string& help) {
  impl_->rows.push_back({.names = names, .value = {}, .help = help, .group = impl_->group});
  impl_->InGroup(impl_->app.add_flag(names, target, help));
}

void OptionSet::Value(const std::string& names, const std::string& value_name, std::optional<std::string>& target,
                      const std::string& help) {
  impl_->rows.push_back({.names = names, .value = value_name, .help = help, .group = impl_->group});
  impl_->InGroup(impl_->app
                     .add_option_function<std::string>(
                         names, [&target](const std::string& value) { target = value; }, help)
                     ->type_name(value_name)
                     ->multi_option_policy(CLI::MultiOptionPolicy::TakeLast));
}

void OptionSet::Values(const std::string& names, const std::string& value_name, std::vector<std::string>& target,
                       const std::string& help) {
  impl_->rows.push_back({.names = names, .value = value_name, .help = help, .group = impl_->group, .repeatable = true});
  // Without allow_extra_args(false) the option would swallow the captures that follow its value.
  impl_->InGroup(impl_->app.add_option(names, target, help)->type_name(value_name)->allow_extra_args(false));
}

void OptionSet::Argument(const std::string& name, std::optional<std::string>& target, const std::string& help,
                         bool required) {
  impl_->rows.push_back(
      {.names = name, .value = {}, .help = help, .group = {}, .argument = true, .required = required});
  impl_->app
      .add_option_function<std::string>(
          name, [&target](const std::string& value) { target = value; }, help)
      ->type_name("")
      ->required(required);
}

void OptionSet::Arguments(const std::string& name, std::vector<std::string>& target, const std::string& help) {
  impl_->rows.push_back(
      {.names = name, .value = {}, .help = help, .group = {}, .argument = true, .required = true, .repeatable = true});
  impl_->app.add_option(name, target, help)->type_name("")->required();
  impl_->paths = &target;
}

void OptionSet::Words(std::vector<std::string> words) {
  Words([words = std::move(words)] { return words; });
}

void OptionSet::Words(std::function<std::vector<std::string>()> words) {
  if (!impl_->rows.empty()) impl_->rows.back().words = std::move(words);
}

void OptionSet::Footer(const std::string& text) {
  impl_->footer = text;
  impl_->app.footer(text);
}

OptionSet::Parsed OptionSet::Parse(const std::vector<std::string>& arguments) {
  for (const std::string& argument : arguments) {
    if (argument == "--") break;
    // CLI11 would take the next argument for the value.
    if (argument.starts_with("--") && argument.find('=') == argument.size() - 1) {
      return {Outcome::kError,
              "option " + argument.substr(0, argument.size() - 1) + " needs a value (see '" + impl_->Hint() + "')"};
    }
  }
  // "-a.pcapng" would be taken for options, one for each letter.
  for (const std::string& argument : arguments) {
    if (argument == "--") break;
    if (argument.size() > 2 && argument[0] == '-' && argument[1] != '-' && system::IsFile(argument)) {
      return {Outcome::kError, "'" + argument + "' begins like an option; to name the file: ./" + argument};
    }
  }
  // CLI11 reports through exceptions; they end here. It takes the arguments last first.
  std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
  try {
    impl_->app.parse(reversed);
    // Not before: values of options may have wildcards of their own, as those of --signal.
    if (impl_->paths != nullptr) *impl_->paths = system::TypedPaths(std::move(*impl_->paths));
    return {};
  } catch (const CLI::CallForHelp&) {
    return {Outcome::kHelp, WithoutDoubleBlanks(impl_->app.help())};
  } catch (const CLI::ExtrasError&) {
    const std::vector<std::string> extras = impl_->app.remaining();
    return {Outcome::kError,
            extras.empty() ? "unexpected argument (see '" + impl_->Hint() + "')" : impl_->Unexpected(extras.front())};
  } catch (const CLI::RequiredError& e) {
    std::string what = e.what();  // "CAPTURE is required"
    what = what.substr(0, what.find(' '));
    return {Outcome::kError, "no " + what + " given (see '" + impl_->Hint() + "')"};
  } catch (const CLI::ArgumentMismatch& e) {
    std::string what = e.what();  // "--fail-on: 1 required SEVERITY missing"
    what = what.substr(0, what.find(':'));
    return {Outcome::kError, "option " + what + " needs a value (see '" + impl_->Hint() + "')"};
  } catch (const CLI::ParseError& e) {
    return {Outcome::kError, std::string(e.what()) + " (see '" + impl_->Hint() + "')"};
  }
}

std::string ProgramHelp(const std::vector<std::unique_ptr<Command>>& commands) {
  std::string text =
      "ecaudit: reads captures of EtherCAT traffic, follows what each slave does, and reports what is wrong.\n"
      "\n"
      "Usage: ecaudit COMMAND [OPTIONS] ...\n"
      "\n"
      "Commands:\n";
  std::size_t width = 0;
  for (const auto& command : commands) width = std::max(width, command->usage().size());
  for (const auto& command : commands) {
    text += "  " + std::string(command->usage());
    text.append(width - command->usage().size() + 3, ' ');
    text += std::string(command->summary()) + "\n";
  }
  text +=
      "\n"
      "  ecaudit COMMAND --help     the options of a command (also: ecaudit help COMMAND)\n"
      "  ecaudit --version          version, commit, compiler and libraries\n"
      "\n" +
      std::string(kExitStatusHelp) + "3 internal error.\n";
  return text;
}

}  // namespace ecaudit::cli
